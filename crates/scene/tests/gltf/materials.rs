use glam::{Affine2, Vec4, vec2, vec4};
use pellucid_core::texture::{Filter, Sampler, Wrap};
use pellucid_core::{AlphaMode, Material};
use pellucid_scene::gltf::{self, TRANSMISSION_CLARITY};
use pellucid_scene::{Folder, LoadError, load_file};
use serde_json::{Value, json};

use crate::build::{Doc, png_uri};

/// The one material of a triangle without texture.
fn material(source: Value) -> Material {
    let mut doc = Doc::triangle();
    doc.push("materials", source);
    doc.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let loaded = doc.load();
    assert_eq!(loaded.warnings, [""; 0]);
    loaded.scene.materials()[0].clone()
}

fn textured(mut source: Value) -> Doc {
    source["pbrMetallicRoughness"]["baseColorTexture"]["index"] = json!(0);
    let mut doc = Doc::textured_triangle(source);
    doc.push("images", json!({"uri": png_uri([[10, 20, 30, 100], [40, 50, 60, 200]])}));
    doc
}

#[test]
fn base_colour_and_flags() {
    let found = material(json!({
        "name": "glass", "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4]},
        "alphaMode": "BLEND", "doubleSided": true, "extensions": {"KHR_materials_unlit": {}},
    }));
    let expected = Material {
        name: "glass".into(),
        base_color: vec4(0.1, 0.2, 0.3, 0.4),
        texture: None,
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        unlit: true,
    };
    assert_eq!(found, expected);
    let plain = Material { double_sided: false, ..Material::default() };
    assert_eq!(material(json!({})), plain);
    assert_eq!(Doc::triangle().load().scene.materials(), [plain], "a primitive without material");
}

#[test]
fn alpha_modes() {
    for (source, expected) in [
        (json!({"alphaMode": "OPAQUE"}), AlphaMode::Opaque),
        (json!({"alphaMode": "BLEND"}), AlphaMode::Blend),
        (json!({"alphaMode": "MASK"}), AlphaMode::Mask { cutoff: 0.5 }),
        (json!({"alphaMode": "MASK", "alphaCutoff": 0.25}), AlphaMode::Mask { cutoff: 0.25 }),
    ] {
        assert_eq!(material(source).alpha_mode, expected);
    }
    let mut doc = textured(json!({"alphaMode": "mask"}));
    assert!(doc.error().contains("material 0: unknown alpha mode 'mask'"), "{}", doc.error());
    doc.json["materials"][0] = json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1e99]}});
    // The parser itself may find that an f32 cannot be so large.
    assert!(["material 0", "number out of range"].iter().any(|says| doc.error().contains(says)), "{}", doc.error());
}

#[test]
fn samplers() {
    use Filter::{Linear, Nearest};
    let texture = |sampler: Option<Value>| {
        let mut doc = textured(json!({}));
        if let Some(sampler) = sampler {
            doc.push("samplers", sampler);
            doc.json["textures"][0]["sampler"] = json!(0);
        }
        doc.load().scene.textures()[0].clone()
    };
    assert_eq!(texture(None).sampler(), Sampler::default());
    assert_eq!(texture(Some(json!({}))).sampler(), Sampler::default());
    for (code, minify, mip) in [
        (9728, Nearest, None),
        (9729, Linear, None),
        (9984, Nearest, Some(Nearest)),
        (9985, Linear, Some(Nearest)),
        (9986, Nearest, Some(Linear)),
        (9987, Linear, Some(Linear)),
    ] {
        let found = texture(Some(json!({"minFilter": code})));
        assert_eq!((found.sampler().minify, found.sampler().mip), (minify, mip), "{code}");
        assert_eq!(found.levels().len(), if mip.is_some() { 2 } else { 1 });
    }
    let found = texture(Some(json!({"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}))).sampler();
    assert_eq!((found.magnify, found.wrap_u, found.wrap_v), (Nearest, Wrap::ClampToEdge, Wrap::MirroredRepeat));
    let found = texture(Some(json!({"magFilter": 9729, "wrapS": 10497}))).sampler();
    assert_eq!((found.magnify, found.wrap_u), (Linear, Wrap::Repeat));

    let mut doc = textured(json!({}));
    doc.push("samplers", json!({"wrapS": 1}));
    doc.json["textures"][0]["sampler"] = json!(0);
    assert!(doc.error().contains("sampler 0: unknown wrap mode 1"), "{}", doc.error());
}

#[test]
fn a_picture_is_decoded_once_for_each_sampler() {
    let mut doc = textured(json!({}));
    doc.push("samplers", json!({"magFilter": 9728}));
    doc.push("textures", json!({"source": 0, "sampler": 0}));
    doc.push("textures", json!({"source": 0}));
    for texture in 1..3 {
        let material = doc.push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": texture}}}));
        let mut primitive = doc.json["meshes"][0]["primitives"][0].clone();
        primitive["material"] = json!(material);
        doc.draw(primitive);
    }
    let scene = doc.load().scene;
    let uses: Vec<usize> = scene.materials().iter().map(|m| m.texture.unwrap().texture.index()).collect();
    assert_eq!(uses, [0, 1, 0]);
    assert_eq!(scene.meshes().len(), 1);
}

#[test]
fn texture_transform_and_its_own_coordinate_set() {
    let mut doc = textured(json!({}));
    let second = doc.floats("VEC2", &[0.5; 6]);
    doc.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_3"] = json!(second);
    let plain = doc.load().scene;
    assert_eq!(plain.materials()[0].texture.unwrap().transform, Affine2::IDENTITY);

    let info = &mut doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["texCoord"] = json!(3);
    let scene = doc.load().scene;
    assert_eq!(scene.meshes()[0].tex_coords().unwrap(), [vec2(0.5, 0.5); 3]);

    let info = &mut doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["extensions"]["KHR_texture_transform"] =
        json!({"offset": [0.1, 0.2], "rotation": std::f32::consts::FRAC_PI_2, "scale": [2, 3], "texCoord": 0});
    let scene = doc.load().scene;
    assert_eq!(scene.meshes()[0].tex_coords().unwrap()[1], vec2(1.0, 0.0), "the transform's own set");
    let transform = scene.materials()[0].texture.unwrap().transform;
    assert!(transform.transform_point2(vec2(1.0, 0.0)).abs_diff_eq(vec2(0.1, -1.8), 1e-6));
    assert!(transform.transform_point2(vec2(0.0, 1.0)).abs_diff_eq(vec2(3.1, 0.2), 1e-6));

    let info = &mut doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["extensions"]["KHR_texture_transform"]["texCoord"] = json!(1);
    let loaded = doc.load();
    assert_eq!(loaded.scene.meshes()[0].tex_coords(), None);
    assert!(loaded.warnings[0].contains("texture coordinates"), "{:?}", loaded.warnings);
}

#[test]
fn transmission_becomes_translucency() {
    let transmissive = |alpha_mode: &str, factor: f32| {
        json!({"alphaMode": alpha_mode, "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]},
               "extensions": {"KHR_materials_transmission": {"transmissionFactor": factor}}})
    };
    assert_eq!(material(transmissive("OPAQUE", 0.0)).alpha_mode, AlphaMode::Opaque);
    for (mode, expected) in [("OPAQUE", 1.0), ("MASK", 1.0), ("BLEND", 0.5)] {
        let found = material(transmissive(mode, 0.75));
        assert_eq!(found.alpha_mode, AlphaMode::Blend);
        let alpha = expected * (1.0 - TRANSMISSION_CLARITY * 0.75);
        assert!((found.base_color.w - alpha).abs() < 1e-6, "{mode}: {}", found.base_color);
    }
    // What a texture's alpha meant before is kept: nothing, a hole, transparency.
    for (mode, expected) in [("OPAQUE", [255, 255]), ("MASK", [0, 255]), ("BLEND", [100, 200])] {
        let mut source = transmissive(mode, 1.0);
        source["pbrMetallicRoughness"]["baseColorFactor"] = json!([1, 1, 1, 1]);
        let scene = textured(source).load().scene;
        let found: Vec<u8> = scene.textures()[0].texels()[..2].iter().map(|texel| texel[3]).collect();
        assert_eq!(found, expected, "{mode}");
    }
}

#[test]
fn pictures_from_buffers_and_files() {
    let folder = tempfile::tempdir().unwrap();
    let picture = image::RgbaImage::from_pixel(3, 2, image::Rgba([1, 2, 3, 4]));
    let file = folder.path().join("a wood.png");
    picture.save(&file).unwrap();

    let mut doc = textured(json!({}));
    let view = doc.view(&std::fs::read(&file).unwrap());
    doc.json["images"][0] = json!({"bufferView": view, "mimeType": "image/png"});
    let level = |scene: &pellucid_core::Scene| {
        let texture = &scene.textures()[0];
        (texture.levels()[0].width, texture.levels()[0].height, texture.texels()[0])
    };
    assert_eq!(level(&doc.load().scene), (3, 2, [1, 2, 3, 4]));

    doc.json["images"][0] = json!({"uri": "a%20wood.png"});
    let path = folder.path().join("scene.glb");
    std::fs::write(&path, doc.glb()).unwrap();
    assert_eq!(level(&load_file(&path).unwrap().scene), (3, 2, [1, 2, 3, 4]));
}

#[test]
fn a_picture_that_cannot_be_read_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("text.png"), "no picture").unwrap();
    std::fs::write(folder.path().join("a.webp"), b"RIFF\x1a\0\0\0WEBPVP8L\x0d\0\0\0").unwrap();
    std::fs::write(folder.path().join("cut.png"), b"\x89PNG\r\n\x1a\n\0\0").unwrap();
    for uri in ["missing.png", "text.png", "a.webp", "cut.png", "data:image/png;base64,!", "data:image/png,abc", ""] {
        let mut doc = textured(json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}));
        doc.json["images"][0] = json!({"uri": uri});
        // A second material with the same picture adds no second warning.
        doc.push("materials", doc.json["materials"][0].clone());
        let mut primitive = doc.json["meshes"][0]["primitives"][0].clone();
        primitive["material"] = json!(1);
        doc.draw(primitive);
        let loaded = gltf::parse(&doc.glb(), &Folder::new(folder.path())).unwrap();
        assert_eq!(loaded.warnings.len(), 1, "{uri}: {:?}", loaded.warnings);
        assert!(loaded.warnings[0].starts_with("image 0: "), "{}", loaded.warnings[0]);
        let material = &loaded.scene.materials()[0];
        assert_eq!((material.base_color, material.texture), (vec4(1.0, 0.0, 0.0, 1.0), None), "{uri}");
    }
}

#[test]
fn a_texture_in_another_format_only_is_a_warning() {
    for (name, source) in [("KHR_texture_basisu", 0), ("EXT_texture_webp", 0)] {
        let mut doc = textured(json!({}));
        doc.json["extensionsUsed"] = json!([name]);
        doc.json["textures"][0] = json!({"extensions": {name: {"source": source}}});
        let loaded = doc.load();
        assert_eq!(loaded.scene.materials()[0].texture, None);
        assert_eq!(loaded.warnings.len(), 2, "{:?}", loaded.warnings);
        assert!(loaded.warnings[1].contains("PNG or JPEG"));
    }
}

#[test]
fn files_outside_the_folder_are_refused() {
    let outer = tempfile::tempdir().unwrap();
    let inner = outer.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    std::fs::write(outer.path().join("secret.bin"), [0; 100]).unwrap();
    let folder = Folder::new(&inner);
    let outside = [
        "../secret.bin",
        "%2e%2e/secret.bin",
        "..%5csecret.bin",
        "/etc/passwd",
        "file:///etc/passwd",
        "https://a.example/b.png",
    ];
    for uri in outside {
        let mut doc = textured(json!({}));
        doc.json["images"][0] = json!({"uri": uri});
        for bytes in [doc.glb(), Doc::triangle().external(uri)] {
            match gltf::parse(&bytes, &folder) {
                Err(error @ LoadError::OutsideFolder { .. }) => {
                    assert!(error.to_string().contains("folder"), "{error}");
                }
                other => panic!("{uri}: {other:?}"),
            }
        }
    }
    match gltf::parse(&Doc::triangle().external("missing.bin"), &folder) {
        Err(LoadError::Asset { uri, .. }) => assert_eq!(uri, "missing.bin"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn specular_glossiness_is_a_warning() {
    let mut doc = textured(json!({}));
    doc.json["materials"][0] =
        json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [1, 0, 0, 1]}}});
    let loaded = doc.load();
    assert_eq!(loaded.scene.materials()[0].base_color, Vec4::ONE);
    assert!(loaded.warnings[0].contains("pbrSpecularGlossiness"), "{:?}", loaded.warnings);
}
