//! Random triangle soups: the CPU renderer captures what the oracle captures, to the last bit, and resolves it alike.

use glam::{Affine2, Affine3A, Vec2, Vec3, Vec3Swizzles, Vec4};
use pellucid::core::meshlets::MESHLET_TRIANGLES;
use pellucid::core::oracle;
use pellucid::core::scene::MaterialTexture;
use pellucid::core::texture::Sampler;
use pellucid::{AlphaMode, Camera, Instance, Material, Mesh, Renderer, Resolve, Scene, Technique, Texture, View};
use pellucid_conformance::{images, layers};
use pellucid_cpu::CpuRenderer;
use pellucid_cpu::simd::levels;
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

/// A scene of one mesh, in one colour, of triangles that are lit each in its own way.
fn one_mesh(triangles: impl Iterator<Item = [Vec3; 3]>, alpha: f32) -> Scene {
    let positions: Vec<Vec3> = triangles.flatten().collect();
    let turned = |i: usize| Vec3::new((i as f32 * 0.7).sin(), 0.0, (i as f32 * 0.7).cos());
    let normals = (0..positions.len()).map(|vertex| turned(vertex / 3)).collect();
    let numbers = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mut scene = Scene::new();
    let mesh = scene.add_mesh(Mesh::new(positions, numbers).unwrap().with_normals(normals).unwrap()).unwrap();
    let material = scene.add_material(Material::translucent("lit", Vec4::new(0.9, 0.6, 0.3, alpha))).unwrap();
    scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY }).unwrap();
    scene
}

fn facing(scene: &Scene, width: u32, height: u32, distance: f32) -> View {
    let mut view = View::of(scene).size(width, height);
    view.camera = Camera { eye: Vec3::Z * distance, target: Vec3::ZERO, ..view.camera };
    view
}

/// Small triangles on each other at five depths only, in four tiles: draw order decides nearly everywhere. More than 255 at
/// a pixel have no place for it in keys that carry their light.
#[test]
fn level_small_triangles_equal_the_oracle_however_many() {
    for count in [2, 9, 40, 255, 256, 700] {
        let triangle = |i: usize| {
            let (shift, depth) = ((i % 3) as f32 * 0.02, (i * 7 % 5) as f32 * 0.1);
            [[-0.1, -0.12], [0.13, -0.08], [0.0, 0.12]].map(|[x, y]: [f32; 2]| Vec3::new(x + shift, y, depth))
        };
        let scene = one_mesh((0..count).map(triangle), 0.1);
        let capture = assert_equals_oracle(&Renderer::new(), &scene, &facing(&scene, 64, 64, 4.0));
        let greatest = (0..64 * 64).map(|pixel| capture.layers.pixel(pixel % 64, pixel / 64).len()).max();
        assert_eq!(greatest, Some(count));
    }
}

/// More fragments of one colour in one tile than are captured at once, few and too many at a pixel for keys with light.
#[test]
fn deep_tiles_of_one_mesh_equal_the_oracle() {
    let corner = |layer: usize, x: usize, y: usize| {
        let depth = (layer * 37 % 160) as f32 * 0.001;
        Vec3::new((x as f32 - 5.0) * 0.1 + depth, (y as f32 - 5.0) * 0.1, depth)
    };
    for layers in [160, 270] {
        let triangles = (0..layers * 200).map(|i| {
            let (layer, cell) = (i / 200, i % 200 / 2);
            let (x, y) = (cell % 10, cell / 10);
            let middle = [corner(layer, x + 1, y), corner(layer, x, y + 1)];
            [middle[i % 2], middle[1 - i % 2], corner(layer, x + i % 2, y + i % 2)]
        });
        let scene = one_mesh(triangles, 0.02);
        let capture = assert_equals_oracle(&Renderer::new(), &scene, &facing(&scene, 32, 32, 1.0));
        assert!(capture.layers.fragments.len() > layers * 900, "{}", capture.layers.fragments.len());
    }
}

/// Sheets before the whole picture, through each other, of every kind of colour, so many times one behind another; and
/// in some places so much dust that neighbours have far more fragments than others.
fn sheets(copies: usize) -> Scene {
    let mut scene = Scene::new();
    let texels = (0..64u8).map(|i| [i * 4, 200, 255 - i * 3, if i % 5 == 0 { 40 } else { 230 }]).collect();
    let texture = scene.add_texture(Texture::new(8, 8, texels, Sampler::default()).unwrap()).unwrap();
    let texture = MaterialTexture { texture, transform: Affine2::from_scale(Vec2::splat(3.0)) };
    let dust_mesh = scene.add_mesh(dust(600, true)).unwrap();
    for number in 0..24 {
        let tilt = |axis: usize| ((number * (7 + axis * 4)) % 24) as f32 * 0.02 - 0.23;
        let corner = |x: f32, y: f32| Vec3::new(x, y, x * tilt(0) + y * tilt(1) + tilt(2));
        let corners = [corner(-9.0, -9.0), corner(9.0, -9.0), corner(9.0, 9.0), corner(-9.0, 9.0)].to_vec();
        let (normals, tex_coords) = (corners.iter().map(|c| c.yzx()), corners.iter().map(|c| c.xy()));
        let mut mesh = Mesh::new(corners.clone(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        if number % 2 == 0 {
            mesh = mesh.with_normals(normals.collect()).unwrap();
        }
        let kind = number % 4;
        if kind == 1 {
            mesh = mesh.with_colors((0..4).map(|i| Vec4::splat(0.2 + 0.2 * i as f32)).collect()).unwrap();
        }
        if kind >= 2 {
            mesh = mesh.with_tex_coords(tex_coords.collect()).unwrap();
        }
        let mesh = scene.add_mesh(mesh).unwrap();
        let material = scene
            .add_material(Material {
                base_color: Vec4::new(0.9, 0.04 * number as f32, 0.5, 0.4),
                alpha_mode: if kind == 3 { AlphaMode::Mask { cutoff: 0.3 } } else { AlphaMode::Blend },
                double_sided: true,
                texture: (kind >= 2).then_some(texture),
                ..Material::default()
            })
            .unwrap();
        for copy in 0..copies {
            let world_from_mesh = Affine3A::from_translation(Vec3::new(0.0, 0.0, -0.01 * copy as f32));
            scene.add_instance(Instance { mesh, material, world_from_mesh }).unwrap();
        }
        if number % 8 == 5 {
            let world_from_mesh = Affine3A::from_scale(Vec3::new(0.2, 0.2, 1.0));
            scene.add_instance(Instance { mesh: dust_mesh, material, world_from_mesh }).unwrap();
        }
    }
    scene
}

/// More sheets than are sorted in registers; and so many that tiles are done in bands. Tested surfaces are opaque at opacity
/// 1, and hide what is behind them; else they are layers.
#[test]
fn sheets_over_whole_tiles_equal_the_oracle() {
    for (copies, [width, height], opacity) in
        [(1, [109, 75], 1.0), (1, [109, 75], 0.9), (1, [109, 75], 0.6), (16, [53, 37], 0.1)]
    {
        let scene = sheets(copies);
        let view = facing(&scene, width, height, 4.0).opacity(opacity);
        let capture = assert_equals_oracle(&Renderer::new(), &scene, &view);
        let (expected, _) = oracle::resolve_capture(&capture, &scene, &view, Resolve::Blend);
        for (name, level) in levels() {
            let frame = CpuRenderer::new(0).level(level).render(&scene, &view, Resolve::Blend).unwrap();
            assert!(expected == frame.image, "{name}, {copies}, {opacity}");
        }
    }
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
