use glam::{Vec2, Vec3, Vec4, vec3, vec4};
use pellucid_scene::{NoAssets, gltf, load_file};
use serde_json::json;

use crate::build::{Doc, F32, I8, I16, U8, U16, U32};

const CORNERS: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

#[test]
fn a_triangle_from_every_kind_of_container() {
    let doc = Doc::triangle();
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("sub")).unwrap();
    std::fs::write(folder.path().join("sub/my data.bin"), &doc.bin).unwrap();
    let path = folder.path().join("scene.gltf");
    std::fs::write(&path, doc.external("sub/my%20data.bin")).unwrap();
    for loaded in [
        gltf::parse(&doc.glb(), &NoAssets).unwrap(),
        gltf::parse(&doc.embedded(), &NoAssets).unwrap(),
        load_file(&path).unwrap(),
    ] {
        assert_eq!(loaded.warnings, [""; 0]);
        let mesh = &loaded.scene.meshes()[0];
        assert_eq!(mesh.positions(), CORNERS);
        assert_eq!(mesh.triangles(), [[0, 1, 2]]);
        assert_eq!(mesh.normals(), None, "lit flat");
        assert_eq!(loaded.scene.primitive_count(), 1);
    }
}

#[test]
fn every_index_type() {
    for component in [U8, U16, U32] {
        let mut doc = Doc::new();
        let positions: Vec<f32> = (0..300).flat_map(|i| [i as f32, 0.0, 0.0]).collect();
        let positions = doc.floats("VEC3", &positions);
        let last = if component == U8 { 255 } else { 299 };
        let mut wanted = vec![2, 0, last, last, 1, 2];
        // Enough of them that no vertex is left out and renumbered.
        wanted.extend((0..300).map(|i| i % (last + 1)));
        let indices = doc.indices(component, &wanted);
        doc.draw(json!({"attributes": {"POSITION": positions}, "indices": indices}));
        let mesh = doc.mesh();
        assert_eq!(mesh.triangles()[..2], [[2, 0, last], [last, 1, 2]]);
        assert_eq!(mesh.triangles().len(), 102);
    }
}

#[test]
fn strips_and_fans() {
    for (mode, expected) in [(5, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]), (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0]])] {
        for indexed in [false, true] {
            let mut doc = Doc::new();
            let positions: Vec<f32> = (0..5).flat_map(|i| [i as f32, 0.0, 0.0]).collect();
            let positions = doc.floats("VEC3", &positions);
            let mut primitive = json!({"attributes": {"POSITION": positions}, "mode": mode});
            if indexed {
                primitive["indices"] = json!(doc.indices(U8, &[0, 1, 2, 3, 4]));
            }
            doc.draw(primitive);
            assert_eq!(doc.mesh().triangles(), expected, "mode {mode}");
        }
    }
}

#[test]
fn points_and_lines_are_left_out_with_one_warning() {
    let mut doc = Doc::triangle();
    for mode in 0..4 {
        doc.draw(json!({"attributes": {"POSITION": 0}, "mode": mode}));
    }
    let loaded = doc.load();
    assert_eq!(loaded.scene.instances().len(), 1);
    assert_eq!(loaded.warnings.len(), 1, "{:?}", loaded.warnings);
    assert!(loaded.warnings[0].contains("lines"));

    doc.draw(json!({"attributes": {"POSITION": 0}, "mode": 7}));
    assert!(doc.error().contains("mesh 5, primitive 0: unknown mode 7"), "{}", doc.error());
}

#[test]
fn sparse_positions_with_and_without_a_base() {
    for has_base in [true, false] {
        for component in [U8, U16, U32] {
            let mut doc = Doc::triangle();
            let indices = doc.indices(component, &[1, 2]);
            let values = doc.floats("VEC3", &[5.0, 6.0, 7.0, 8.0, 9.0, 10.0]);
            let view_of = |accessor: usize| doc.json["accessors"][accessor]["bufferView"].clone();
            let sparse = json!({
                "count": 2,
                "indices": {"bufferView": view_of(indices), "componentType": component},
                "values": {"bufferView": view_of(values)},
            });
            doc.json["accessors"][0]["sparse"] = sparse;
            if !has_base {
                doc.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
            }
            assert_eq!(doc.mesh().positions(), [Vec3::ZERO, vec3(5.0, 6.0, 7.0), vec3(8.0, 9.0, 10.0)]);
        }
    }
}

#[test]
fn an_accessor_without_data_is_zeros() {
    let mut doc = Doc::triangle();
    doc.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert_eq!(doc.mesh().positions(), [Vec3::ZERO; 3]);
}

#[test]
fn interleaved_attributes() {
    let mut doc = Doc::new();
    let mut bytes = vec![0xee; 4];
    for corner in CORNERS {
        bytes.extend(corner.to_array().iter().chain(&[0.0, 0.0, 2.0]).flat_map(|number| number.to_le_bytes()));
        bytes.extend([0, 128, 255, 255]);
    }
    let view = doc.view(&bytes);
    doc.json["bufferViews"][view]["byteStride"] = json!(28);
    let accessor = |offset: usize, component: u32, shape: &str| {
        json!({"bufferView": view, "byteOffset": offset, "componentType": component, "count": 3, "type": shape,
               "normalized": component == U8})
    };
    let positions = doc.push("accessors", accessor(4, F32, "VEC3"));
    let normals = doc.push("accessors", accessor(16, F32, "VEC3"));
    let colors = doc.push("accessors", accessor(28, U8, "VEC4"));
    doc.draw(json!({"attributes": {"POSITION": positions, "NORMAL": normals, "COLOR_0": colors}}));
    let mesh = doc.mesh();
    assert_eq!(mesh.positions(), CORNERS);
    assert_eq!(mesh.normals().unwrap(), [vec3(0.0, 0.0, 2.0); 3]);
    assert_eq!(mesh.colors().unwrap(), [vec4(0.0, 128.0 / 255.0, 1.0, 1.0); 3]);

    // One byte more, and the last element would end behind the view.
    doc.json["accessors"][colors]["byteOffset"] = json!(29);
    assert!(doc.error().contains("accessor 2: 3 elements of 4 bytes"), "{}", doc.error());
}

#[test]
fn quantized_positions() {
    let numbers: [i32; 9] = [0, 1, 2, 127, 64, 3, 100, 5, 6];
    for (component, size, most) in [(I8, 1, 127.0), (U8, 1, 255.0), (I16, 2, 32767.0), (U16, 2, 65535.0)] {
        for normalized in [false, true] {
            let mut doc = Doc::new();
            doc.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
            doc.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
            let mut bytes = Vec::new();
            for corner in numbers.chunks(3) {
                bytes.extend(corner.iter().flat_map(|number| number.to_le_bytes().into_iter().take(size)));
                bytes.resize(bytes.len().next_multiple_of(4), 0xee);
            }
            let positions = doc.accessor("VEC3", component, 3, &bytes);
            doc.json["accessors"][positions]["normalized"] = json!(normalized);
            doc.json["bufferViews"][0]["byteStride"] = json!(if size == 1 { 4 } else { 8 });
            doc.draw(json!({"attributes": {"POSITION": positions}}));
            let scale = if normalized { most } else { 1.0 };
            let expected: Vec<Vec3> =
                numbers.chunks(3).map(|c| Vec3::from([0, 1, 2].map(|axis| c[axis] as f32 / scale))).collect();
            assert_eq!(doc.mesh().positions(), expected, "component {component}, normalized {normalized}");
        }
    }
}

#[test]
fn signed_normalized_numbers_stop_at_minus_1() {
    let mut doc = Doc::triangle();
    let normals = doc.accessor("VEC3", I8, 3, &[0x80, 0, 127, 0, 0x81, 0, 0, 0, 0, 127, 0, 0]);
    doc.json["accessors"][normals]["normalized"] = json!(true);
    doc.json["bufferViews"][1]["byteStride"] = json!(4);
    doc.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    assert_eq!(doc.mesh().normals().unwrap(), [vec3(-1.0, 0.0, 1.0), -Vec3::X, Vec3::Y]);
}

#[test]
fn texture_coordinates_of_every_type() {
    for (component, size, normalized, expected) in [
        (U8, 1, true, 51.0 / 255.0),
        (U16, 2, true, 51.0 / 65535.0),
        (I8, 1, true, 51.0 / 127.0),
        (I16, 2, true, 51.0 / 32767.0),
        (U8, 1, false, 51.0),
        (I16, 2, false, 51.0),
    ] {
        let mut doc = Doc::textured_triangle(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
        doc.push("images", json!({"uri": crate::build::png_uri([[1, 2, 3, 4]; 2])}));
        let bytes: Vec<u8> = (0..6).flat_map(|_| 51_u32.to_le_bytes().into_iter().take(size)).collect();
        let tex_coords = doc.accessor("VEC2", component, 3, &bytes);
        doc.json["accessors"][tex_coords]["normalized"] = json!(normalized);
        doc.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(tex_coords);
        assert_eq!(doc.mesh().tex_coords().unwrap(), [Vec2::splat(expected); 3], "component {component}");
    }
}

#[test]
fn vertex_colours_of_every_type() {
    let floats: Vec<u8> = [0.25_f32, 2.0, f32::NAN, -1.0].iter().flat_map(|number| number.to_le_bytes()).collect();
    let words: Vec<u8> = [65535_u16, 0, 13107, 65535].iter().flat_map(|number| number.to_le_bytes()).collect();
    for (component, shape, element, expected) in [
        (F32, "VEC4", floats.as_slice(), vec4(0.25, 1.0, 0.0, 0.0)),
        (F32, "VEC3", &floats[..12], vec4(0.25, 1.0, 0.0, 1.0)),
        (U8, "VEC4", &[255, 0, 51, 102], vec4(1.0, 0.0, 0.2, 0.4)),
        (U8, "VEC3", &[255, 0, 51], vec4(1.0, 0.0, 0.2, 1.0)),
        (U16, "VEC4", &words, vec4(1.0, 0.0, 0.2, 1.0)),
        (U16, "VEC3", &words[..6], vec4(1.0, 0.0, 0.2, 1.0)),
    ] {
        let mut doc = Doc::triangle();
        let colors = doc.accessor(shape, component, 3, &element.repeat(3));
        doc.json["accessors"][colors]["normalized"] = json!(component != F32);
        doc.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
        let mesh = doc.mesh();
        let found: &[Vec4] = mesh.colors().unwrap();
        assert!(found.iter().all(|color| color.abs_diff_eq(expected, 1e-6)), "{component} {shape}: {found:?}");
    }
}

#[test]
fn normals_without_direction_are_replaced() {
    let mut doc = Doc::triangle();
    let normals = doc.floats("VEC3", &[0.0, 0.0, 0.0, f32::NAN, 0.0, 0.0, 0.0, 3.0, 0.0]);
    doc.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    assert_eq!(doc.mesh().normals().unwrap(), [Vec3::Z, Vec3::Z, vec3(0.0, 3.0, 0.0)]);
}

#[test]
fn primitives_take_only_their_vertices_out_of_a_shared_buffer() {
    let mut doc = Doc::new();
    let numbers: Vec<f32> = (0..1000).flat_map(|i| [i as f32, 0.0, 0.0]).collect();
    let positions = doc.floats("VEC3", &numbers);
    let normals = doc.floats("VEC3", &numbers);
    let indices = doc.indices(U16, &[900, 7, 500, 500, 7, 3]);
    doc.draw(json!({"attributes": {"POSITION": positions, "NORMAL": normals}, "indices": indices}));
    let mesh = doc.mesh();
    let expected = [3.0, 7.0, 500.0, 900.0].map(|x| vec3(x, 0.0, 0.0));
    assert_eq!(mesh.positions(), expected);
    assert_eq!(mesh.normals().unwrap(), expected);
    assert_eq!(mesh.triangles(), [[3, 1, 2], [2, 1, 0]]);
}

#[test]
fn primitives_that_differ_in_material_share_a_mesh() {
    let mut doc = Doc::triangle();
    for name in ["a", "b"] {
        let material = doc.push("materials", json!({"name": name}));
        doc.draw(json!({"attributes": {"POSITION": 0}, "material": material}));
    }
    let scene = doc.load().scene;
    assert_eq!((scene.meshes().len(), scene.materials().len(), scene.instances().len()), (1, 3, 3));
}
