use glam::{Quat, Vec3, vec3};
use pellucid_core::Projection;
use serde_json::json;

use crate::build::Doc;

fn assert_near(found: Vec3, expected: Vec3) {
    assert!(found.abs_diff_eq(expected, 1e-5), "{found} is not {expected}");
}

#[test]
fn world_matrices_are_composed_along_the_hierarchy() {
    let mut doc = Doc::triangle();
    let turn = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2).to_array();
    // Column-major: scale by 2, then move by (10, 0, 0).
    let matrix = [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 10, 0, 0, 1];
    doc.json["nodes"] = json!([
        {"matrix": matrix, "children": [1]},
        {"translation": [1, 2, 3], "rotation": turn, "scale": [3, 1, 1], "children": [2]},
        {"mesh": 0},
    ]);
    let scene = doc.load().scene;
    let world_from_mesh = scene.instances()[0].world_from_mesh;
    // (1,0,0): scaled to (3,0,0), turned to (0,3,0), moved to (1,5,3); doubled to (2,10,6), moved to (12,10,6).
    assert_near(world_from_mesh.transform_point3(Vec3::X), vec3(12.0, 10.0, 6.0));
    assert_near(world_from_mesh.transform_point3(Vec3::Y), vec3(10.0, 4.0, 6.0));
}

#[test]
fn a_mirrored_node_has_a_negative_determinant() {
    let mut doc = Doc::triangle();
    doc.json["nodes"][0]["scale"] = json!([1, 1, -2]);
    let loaded = doc.load();
    assert_eq!(loaded.scene.instances()[0].world_from_mesh.matrix3.determinant(), -2.0);
    assert_eq!(loaded.scene.meshes()[0].triangles(), [[0, 1, 2]], "the winding is the renderer's business");
}

#[test]
fn rotations_need_not_be_normalized() {
    let mut doc = Doc::triangle();
    doc.json["nodes"][0]["rotation"] = json!([0, 0, 5, 5]);
    assert_near(doc.load().scene.instances()[0].world_from_mesh.transform_point3(Vec3::X), Vec3::Y);
    doc.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]);
    assert!(doc.error().contains("node 0"), "{}", doc.error());
}

#[test]
fn nodes_that_share_a_mesh_are_instances_in_document_order() {
    let mut doc = Doc::triangle();
    doc.json["nodes"] = json!([
        {"children": [2, 1]},
        {"mesh": 0, "translation": [1, 0, 0]},
        {"mesh": 0, "translation": [2, 0, 0], "children": [3]},
        {"mesh": 0, "translation": [30, 0, 0]},
    ]);
    let scene = doc.load().scene;
    assert_eq!(scene.meshes().len(), 1);
    let places: Vec<f32> = scene.instances().iter().map(|instance| instance.world_from_mesh.translation.x).collect();
    assert_eq!(places, [2.0, 32.0, 1.0]);
    assert_eq!(scene.primitive_count(), 3);
}

#[test]
fn which_scene_is_shown() {
    let mut doc = Doc::triangle();
    doc.json["nodes"] = json!([
        {"mesh": 0, "translation": [0, 0, 0]},
        {"mesh": 0, "translation": [1, 0, 0]},
        {"children": [1], "translation": [10, 0, 0]},
    ]);
    doc.json["scenes"] = json!([{"nodes": [0]}, {"nodes": [2]}]);
    let places = |doc: &Doc| -> Vec<f32> {
        doc.load().scene.instances().iter().map(|instance| instance.world_from_mesh.translation.x).collect()
    };
    assert_eq!(places(&doc), [0.0], "no default: the first");
    doc.json["scene"] = json!(1);
    assert_eq!(places(&doc), [11.0], "the default");
    doc.json["scene"] = json!(2);
    assert!(doc.error().contains("scene 2 does not exist"), "{}", doc.error());
    doc.json.as_object_mut().unwrap().remove("scene");
    doc.json["scenes"] = json!([]);
    assert_eq!(places(&doc), [0.0, 11.0], "no scenes: all root nodes");
    doc.json["scenes"] = json!([{}]);
    assert_eq!(doc.load().warnings, ["the scene has no triangles"]);
}

#[test]
fn ten_thousand_nested_nodes() {
    let mut doc = Doc::triangle();
    let depth = 10_000;
    let mut nodes: Vec<_> = (1..depth).map(|child| json!({"children": [child], "translation": [1, 0, 0]})).collect();
    nodes.push(json!({"mesh": 0}));
    doc.json["nodes"] = json!(nodes);
    assert_eq!(doc.load().scene.instances()[0].world_from_mesh.translation.x, 9_999.0);
}

#[test]
fn cameras_look_along_minus_z_of_their_node() {
    let mut doc = Doc::triangle();
    doc.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}));
    doc.push(
        "cameras",
        json!({"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 2, "znear": 0.5, "zfar": 50}}),
    );
    let turn = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2).to_array();
    let parent = doc.root(json!({"translation": [1000, 2, 3], "scale": [4, 4, 4], "children": []}));
    let first = doc.push("nodes", json!({"camera": 0, "rotation": turn}));
    let second = doc.push("nodes", json!({"camera": 1, "translation": [0, 0, 1]}));
    doc.json["nodes"][parent]["children"] = json!([first, second]);
    let loaded = doc.load();
    assert_eq!(loaded.warnings, [""; 0]);
    let [perspective, orthographic] = loaded.scene.cameras() else { panic!("two cameras") };
    assert_eq!(perspective.projection, Projection::Perspective { fov_y: 0.7, near: 0.1 });
    assert_near(perspective.eye, vec3(1000.0, 2.0, 3.0));
    assert_near((perspective.target - perspective.eye).normalize(), Vec3::NEG_X);
    assert_near(perspective.up, Vec3::Y);
    assert_eq!(orthographic.projection, Projection::Orthographic { height: 4.0, near: 0.5, far: 50.0 });
    assert_near(orthographic.eye, vec3(1000.0, 2.0, 7.0));
    assert_near((orthographic.target - orthographic.eye).normalize(), Vec3::NEG_Z);
}

#[test]
fn a_camera_that_cannot_be_used_is_left_out() {
    let mut doc = Doc::triangle();
    doc.push("cameras", json!({"perspective": {"yfov": 4, "znear": 0.1}}));
    doc.push("cameras", json!({"perspective": {"yfov": 1, "znear": 0.1}}));
    doc.push("cameras", json!({}));
    doc.root(json!({"camera": 0}));
    doc.root(json!({"camera": 1, "scale": [0, 0, 0]}));
    doc.root(json!({"camera": 2}));
    let loaded = doc.load();
    assert!(loaded.scene.cameras().is_empty());
    assert_eq!(loaded.warnings.len(), 3);
    assert!(loaded.warnings[0].starts_with("camera 0 at node 1 is left out"), "{}", loaded.warnings[0]);
}

#[test]
fn what_is_not_supported_is_told_once() {
    let mut doc = Doc::triangle();
    doc.json["extensionsUsed"] =
        json!(["EXT_mesh_gpu_instancing", "KHR_materials_ior", "KHR_texture_transform", "X_y"]);
    doc.json["animations"] = json!([{"channels": [], "samplers": []}]);
    doc.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": 0}]);
    doc.json["meshes"][0]["weights"] = json!([0.0]);
    for _ in 0..2 {
        doc.root(json!({"mesh": 0, "skin": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {}}}}));
    }
    let warnings = doc.load().warnings;
    assert_eq!(warnings[0], "ignored extensions: KHR_materials_ior, X_y");
    for (warning, word) in warnings[1..].iter().zip(["animations", "morph", "skins", "EXT_mesh_gpu_instancing"]) {
        assert!(warning.contains(word), "{warning}");
    }
    assert_eq!(warnings.len(), 5, "{warnings:?}");
}
