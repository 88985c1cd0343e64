//! Content that breaks the rules: one clear error, no panic, no memory for what is not there.

use pellucid_scene::{LoadError, NoAssets, gltf};
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::build::{Doc, U8, U16, png_uri};

/// A document that uses most of what the loader reads.
fn rich() -> Doc {
    let mut doc = Doc::textured_triangle(json!({
        "name": "m", "alphaMode": "MASK", "alphaCutoff": 0.3,
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "baseColorTexture": {
            "index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.1, 0.2], "rotation": 1.5}}}},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5}},
    }));
    doc.json["extensionsUsed"] = json!(["KHR_texture_transform", "KHR_materials_transmission"]);
    doc.push("images", json!({"uri": png_uri([[1, 2, 3, 4]; 2])}));
    doc.push("samplers", json!({"magFilter": 9728, "minFilter": 9984, "wrapS": 33071}));
    doc.json["textures"][0]["sampler"] = json!(0);
    let colors = doc.accessor("VEC4", U8, 3, &[9; 12]);
    let indices = doc.indices(U16, &[0, 1, 2]);
    let sparse_indices = doc.view(&[2]);
    let sparse_values = doc.view(&[0; 12]);
    doc.json["accessors"][0]["sparse"] = json!({
        "count": 1, "indices": {"bufferView": sparse_indices, "componentType": U8},
        "values": {"bufferView": sparse_values},
    });
    let primitive = &mut doc.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["COLOR_0"] = json!(colors);
    primitive["indices"] = json!(indices);
    doc.push("cameras", json!({"perspective": {"yfov": 1, "znear": 0.1}}));
    let child = doc.push("nodes", json!({"camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]}));
    doc.json["nodes"][0] = json!({"mesh": 0, "translation": [1, 2, 3], "scale": [1, 2, 3], "children": [child]});
    doc
}

#[test]
fn the_rich_document_is_valid() {
    assert_eq!(rich().load().warnings, [""; 0]);
}

/// Sets the value at a JSON pointer, made if need be.
fn set(doc: &mut Doc, pointer: &str, value: Value) {
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    let parent = doc.json.pointer_mut(parent).unwrap_or_else(|| panic!("{parent}"));
    match key.parse::<usize>() {
        Ok(index) => parent[index] = value,
        Err(_) => parent[key] = value,
    }
}

#[test]
fn each_broken_rule_is_named_with_its_place() {
    let huge = u64::MAX / 2;
    let cases = [
        ("/accessors/0/bufferView", json!(99), "accessor 0: buffer view 99 does not exist"),
        ("/accessors/0/byteOffset", json!(4), "accessor 0: 3 elements of 12 bytes"),
        ("/accessors/0/byteOffset", json!(huge), "accessor 0: 3 elements"),
        ("/accessors/0/count", json!(4), "accessor 0: 4 elements"),
        ("/accessors/0/count", json!(huge), "accessor 0"),
        ("/accessors/0/count", json!(2), "accessor 0: sparse index 2"),
        ("/accessors/0/componentType", json!(5124), "accessor 0: unknown component type 5124"),
        ("/accessors/0/type", json!("VEC2"), "accessor 0: POSITION"),
        ("/accessors/0/type", json!("VEC5"), "accessor 0: unknown type 'VEC5'"),
        ("/accessors/0/type", json!("MAT3"), "accessor 0: a matrix"),
        ("/accessors/0/sparse/count", json!(2), "accessor 0: 2 elements of 1 bytes"),
        ("/accessors/0/sparse/count", json!(1_u64 << 60), "accessor 0"),
        ("/accessors/0/sparse/indices/componentType", json!(5126), "accessor 0: sparse indices"),
        ("/accessors/0/sparse/indices/bufferView", json!(50), "accessor 0: buffer view 50"),
        ("/accessors/0/sparse/values/byteOffset", json!(1), "accessor 0: 1 elements of 12 bytes"),
        ("/accessors/1/count", json!(2), "accessor 1: 2 elements, but mesh 0, primitive 0 has 3 vertices"),
        ("/accessors/3/componentType", json!(5126), "accessor 3"),
        ("/accessors/3/componentType", json!(5122), "accessor 3: mesh 0, primitive 0 wants indices"),
        ("/bufferViews/0/byteLength", json!(1000), "buffer view 0: 1000 bytes"),
        ("/bufferViews/0/byteLength", json!(huge), "buffer view 0"),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), "buffer view 0"),
        ("/bufferViews/0/buffer", json!(1), "buffer view 0: buffer 1 does not exist"),
        ("/bufferViews/0/byteStride", json!(8), "accessor 0: elements of 12 bytes at a distance of 8"),
        ("/bufferViews/0/byteStride", json!(huge), "accessor 0: 3 elements"),
        ("/buffers", json!([{"byteLength": 1_000_000}]), "buffer 0 should have 1000000 bytes"),
        ("/buffers", json!([{"byteLength": 4, "uri": "data:;base64,AAAA"}]), "buffer 0 should have 4 bytes"),
        ("/buffers", json!([]), "buffer 0 does not exist"),
        ("/meshes/0/primitives/0/indices", json!(42), "mesh 0, primitive 0: accessor 42 does not exist"),
        ("/meshes/0/primitives/0/material", json!(7), "mesh 0, primitive 0: material 7"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(9), "accessor 9"),
        ("/materials/0/pbrMetallicRoughness/baseColorTexture/index", json!(3), "material 0: texture 3"),
        ("/textures/0/source", json!(5), "texture 0: image 5"),
        ("/textures/0/sampler", json!(5), "texture 0: sampler 5"),
        ("/images/0", json!({}), "image 0"),
        ("/images/0", json!({"bufferView": 77}), "image 0: buffer view 77"),
        ("/nodes/0/mesh", json!(3), "node 0: mesh 3"),
        ("/nodes/1/camera", json!(3), "node 1: camera 3"),
        ("/nodes/0/children", json!([5]), "node 0: child 5"),
        ("/nodes/0/children", json!([1, 1]), "node 1 is a child of node 0 and again of node 0"),
        ("/nodes/1/children", json!([0]), "its own ancestor"),
        ("/nodes/1/children", json!([1]), "node 1 is a child of node 0 and again of node 1"),
        ("/nodes/0/scale", json!([1e300, 1, 1]), "node 0: its world transform is not finite"),
        ("/nodes/1/matrix", json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]), "node 1: a matrix"),
        ("/nodes/1/matrix", json!([1, 2, 3]), "JSON"),
        ("/scenes/0/nodes", json!([0, 0]), "scene 0: node 0 is listed twice"),
        ("/scenes/0/nodes", json!([1]), "scene 0: node 1 is no root"),
        ("/scenes/0/nodes", json!([8]), "scene 0: node 8 does not exist"),
        ("/scene", json!(-1), "JSON"),
        ("/asset", json!({}), "version"),
        ("/asset/version", json!("two"), "no version"),
        ("/asset/version", json!("1.0"), "glTF 1.0"),
        ("/asset/version", json!("3.0"), "glTF 3.0"),
        ("/asset/minVersion", json!("2.1"), "glTF 2.1"),
        ("/extensionsRequired", json!(["KHR_draco_mesh_compression"]), "KHR_draco_mesh_compression"),
        ("/extensionsRequired", json!(["KHR_texture_transform", "EXT_meshopt_compression"]), "EXT_meshopt"),
    ];
    for (pointer, value, expected) in cases {
        let mut doc = rich();
        set(&mut doc, pointer, value.clone());
        let Err(error) = doc.try_load() else { panic!("{pointer} = {value} was loaded") };
        assert!(
            matches!(error, LoadError::Malformed { .. } | LoadError::Unsupported { .. }),
            "{pointer} = {value}: {error:?}"
        );
        assert!(error.to_string().contains(expected), "{pointer} = {value}: {error}");
    }
}

#[test]
fn an_index_out_of_range_is_named() {
    let mut doc = Doc::triangle();
    let indices = doc.indices(U8, &[0, 1, 3]);
    doc.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    let expected = "accessor 1: index 2 of mesh 0, primitive 0 names vertex 3, but there are only 3";
    assert!(doc.error().contains(expected), "{}", doc.error());
}

#[test]
fn zeros_that_take_no_bytes_are_not_built_without_end() {
    for count in [100_000_000, 1_u64 << 33, 1 << 62] {
        let mut doc = Doc::triangle();
        doc.json["accessors"][0] = json!({"componentType": 5126, "count": count, "type": "VEC3"});
        assert!(matches!(doc.try_load(), Err(LoadError::Unsupported { .. })), "{count}");
        let mut doc = Doc::triangle();
        let indices = doc.push("accessors", json!({"componentType": 5125, "count": count, "type": "SCALAR"}));
        doc.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
        assert!(matches!(doc.try_load(), Err(LoadError::Unsupported { .. })), "{count}");
    }
}

#[test]
fn a_few_bytes_cannot_ask_for_many_instances() {
    let mut doc = Doc::triangle();
    doc.json["meshes"][0]["primitives"] = json!(vec![json!({"attributes": {"POSITION": 0}}); 5_000]);
    doc.json["nodes"] = json!(vec![json!({"mesh": 0}); 5_000]);
    doc.json["scenes"] = json!([]);
    assert!(matches!(doc.try_load(), Err(LoadError::Unsupported { .. })));
}

#[test]
fn one_small_accessor_shared_by_many_meshes_is_no_bomb() {
    let mut doc = Doc::new();
    let positions = doc.accessor("VEC3", U8, 30_000, &vec![7; 90_000]);
    for _ in 0..2_000 {
        // Own normals, so that no two meshes are the same.
        let normals = doc.push("accessors", doc.json["accessors"][positions].clone());
        doc.draw(json!({"attributes": {"POSITION": positions, "NORMAL": normals}}));
    }
    assert!(matches!(doc.try_load(), Err(LoadError::Unsupported { .. })));
}

#[test]
fn a_picture_of_one_colour_is_no_bomb() {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::GrayImage::new(4_096, 1_024).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let picture = bytes.into_inner();
    let mut doc = Doc::textured_triangle(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let view = doc.view(&picture);
    doc.json["images"] = json!(vec![json!({"bufferView": view}); 30]);
    doc.push("samplers", json!({"minFilter": 9729}));
    doc.json["textures"] = json!((0..30).map(|source| json!({"source": source, "sampler": 0})).collect::<Vec<_>>());
    for texture in 1..30 {
        let material = doc.push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": texture}}}));
        let mut primitive = doc.json["meshes"][0]["primitives"][0].clone();
        primitive["material"] = json!(material);
        doc.draw(primitive);
    }
    let loaded = doc.load();
    assert!((8..24).contains(&loaded.scene.textures().len()), "{}", loaded.scene.textures().len());
    assert!(loaded.warnings.iter().all(|warning| warning.contains("too many")), "{:?}", loaded.warnings);
}

#[test]
fn many_warnings_are_counted() {
    let mut doc = Doc::triangle();
    doc.push("cameras", json!({}));
    for _ in 0..100 {
        doc.root(json!({"camera": 0}));
    }
    let warnings = doc.load().warnings;
    assert_eq!(warnings.len(), 21);
    assert!(warnings[20].contains("80 more"), "{}", warnings[20]);
}

#[test]
fn json_that_is_none() {
    for text in [
        "",
        "{",
        "[]",
        "null",
        "{}",
        "glT",
        r#"{"asset":{"version":"2.0"},"nodes":[{"scale":[NaN,1,1]}]}"#,
        r#"{"asset":{"version":"2.0"},"nodes":[{"scale":[1e999,1,1]}]}"#,
        r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":1.5}]}"#,
        r#"{"asset":{"version":"2.0"}} trailing"#,
        r#"{"asset":{"version":"2.0"},"meshes":[{}]}"#,
        "{\"asset\":{\"version\":\"2.0\",\"generator\":\"\u{fffd}",
    ] {
        let error = gltf::parse(text.as_bytes(), &NoAssets).unwrap_err();
        assert!(matches!(error, LoadError::Malformed { .. }), "{text}: {error:?}");
    }
    let deep = format!(r#"{{"asset":{{"version":"2.0"}},"extras":{}}}"#, "[".repeat(1_000_000));
    assert!(gltf::parse(deep.as_bytes(), &NoAssets).is_err());
    let old = r#"{"asset":{"version":"1.0"},"meshes":{"a":{}}}"#;
    assert!(matches!(gltf::parse(old.as_bytes(), &NoAssets), Err(LoadError::Unsupported { .. })));
}

#[test]
fn every_prefix_is_an_error() {
    for bytes in [rich().glb(), rich().embedded()] {
        for end in 0..bytes.len() {
            let error = gltf::parse(&bytes[..end], &NoAssets).unwrap_err();
            assert!(matches!(error, LoadError::Malformed { .. }), "{end} bytes: {error:?}");
        }
    }
}

#[test]
fn bytes_behind_the_end_are_told() {
    let mut bytes = rich().glb();
    bytes.extend([1, 2, 3]);
    let warnings = gltf::parse(&bytes, &NoAssets).unwrap().warnings;
    assert_eq!(warnings, ["3 bytes behind the end of the GLB are ignored"]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn flipped_bytes_never_panic(
        binary in any::<bool>(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let mut bytes = if binary { rich().glb() } else { rich().embedded() };
        for (at, value) in flips {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        let _ = gltf::parse(&bytes, &NoAssets);
    }

    /// Random bytes mostly break the JSON; numbers put for numbers reach what lies behind it.
    #[test]
    fn changed_numbers_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), number()), 1..6),
    ) {
        let mut doc = rich();
        for (at, value) in changes {
            let mut numbers = Vec::new();
            collect_numbers(&mut doc.json, &mut numbers);
            let at = at.index(numbers.len());
            *numbers[at] = value;
        }
        let _ = doc.try_load();
    }
}

fn number() -> impl Strategy<Value = Value> {
    prop_oneof![
        (0_u64..20).prop_map(|number| json!(number)),
        any::<u64>().prop_map(|number| json!(number)),
        any::<f64>().prop_map(|number| json!(number)),
        prop::sample::select(vec![5120, 5121, 5123, 5125, 5126]).prop_map(|number| json!(number)),
        prop::sample::select(vec![u64::MAX, 1 << 31, 1 << 32, 1 << 63, 0xffff]).prop_map(|number| json!(number)),
    ]
}

fn collect_numbers<'a>(value: &'a mut Value, into: &mut Vec<&'a mut Value>) {
    match value {
        Value::Number(_) => into.push(value),
        Value::Array(values) => values.iter_mut().for_each(|value| collect_numbers(value, into)),
        Value::Object(values) => values.values_mut().for_each(|value| collect_numbers(value, into)),
        _ => {}
    }
}
