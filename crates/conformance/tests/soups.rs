//! Random triangle soups: the CPU renderer captures what the oracle captures, to the last bit, and resolves it alike.

use glam::{Affine3A, Vec3, Vec4};
use pellucid::core::meshlets::MESHLET_TRIANGLES;
use pellucid::core::oracle;
use pellucid::{Instance, Material, Mesh, Renderer, Resolve, Scene, Technique, View};
use pellucid_conformance::{images, layers};
use proptest::prelude::*;

#[path = "common/beside_oracle.rs"]
mod beside_oracle;
#[path = "common/soup.rs"]
mod soup;

use beside_oracle::assert_equals_oracle;
use soup::{camera, soup};

const RESOLVES: [Resolve; 6] = [
    Resolve::Blend,
    Resolve::BlendCorrected,
    Resolve::Gelly,
    Resolve::Nearest,
    Resolve::Layer(2),
    Resolve::Complexity(0),
];

/// So many triangles anywhere before the camera, of a few pixels but for every hundredth.
fn dust(count: usize, smooth: bool) -> Mesh {
    let mut state = count as u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 23) as f32 - 1.0
    };
    let mut point = || Vec3::new(random(), random(), random());
    let mut positions = Vec::new();
    for i in 0..count {
        let (middle, size) = (point(), if i % 100 == 99 { 0.8 } else { 0.06 });
        positions.extend([middle, middle + point() * size, middle + point() * size]);
    }
    let normals: Vec<Vec3> = positions.iter().map(|position| *position + 0.1).collect();
    let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = Mesh::new(positions, triangles).unwrap();
    if smooth { mesh.with_normals(normals).unwrap() } else { mesh }
}

/// Meshes of many meshlets beside meshes of a few triangles, flat and smooth ones, and all of them in one tile.
#[test]
fn meshes_of_any_size_side_by_side_equal_the_oracle() {
    let mut scene = Scene::new();
    for (number, count) in [3000, 3, 1, 2 * MESHLET_TRIANGLES + 7, 9, 1023, 2].into_iter().enumerate() {
        let color = Vec4::new(0.2 + 0.1 * number as f32, 0.9 - 0.1 * number as f32, 0.5, 0.3);
        let mesh = scene.add_mesh(dust(count, number % 3 == 0)).unwrap();
        let material = scene.add_material(Material::translucent("dust", color)).unwrap();
        scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY }).unwrap();
    }
    let view = View::of(&scene).size(75, 61);
    assert_equals_oracle(&Renderer::new(), &scene, &view);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn cpu_equals_oracle(scene in soup(), camera in camera(), opaque in any::<bool>(), size in (1u32..80, 1u32..70)) {
        let mut view = View::of(&scene).size(size.0, size.1).opacity(if opaque { 1.0 } else { 0.6 });
        view.camera = camera;
        let capture = oracle::capture(&scene, &view).unwrap();
        let cpu = Renderer::new();
        let gathered = layers::gather(&cpu, &scene, &view).unwrap();
        if let Some(difference) = layers::first_difference(&capture.layers, &gathered) {
            return Err(TestCaseError::fail(difference));
        }
        for resolve in RESOLVES {
            let (expected, expected_stats) = oracle::resolve_capture(&capture, &scene, &view, resolve);
            let frame = cpu.render(&scene, &view, resolve).unwrap();
            let no_excuse = vec![false; capture.ambiguous.len()];
            let comparison = images::compare(&expected, &no_excuse, |_, _| true, &frame.image);
            prop_assert_eq!(comparison.unexplained, 0, "{:?} {:?}", resolve, comparison);
            prop_assert_eq!(expected_stats.fragments, frame.stats.fragments);
            prop_assert_eq!(expected_stats.dropped_triangles, frame.stats.dropped_triangles);
            prop_assert_eq!(expected_stats.max_depth_complexity, frame.stats.max_depth_complexity);
            prop_assert_eq!(frame.stats.technique, Technique::Cpu);
        }
    }
}
