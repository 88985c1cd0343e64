//! Closed meshes have no seams: what a line of sight enters it leaves, at every pixel.

use std::collections::HashMap;

use glam::{Affine3A, Quat, Vec3, Vec4};
use pellucid::core::pixel_grid::{Viewport, twice_signed_area};
use pellucid::core::primitive::draws;
use pellucid::{Camera, Instance, Layers, Material, Mesh, Projection, Renderer, Scene, Technique, View};
use pellucid_conformance::layers;
use proptest::prelude::*;

type Shape = (Vec<Vec3>, Vec<[u32; 3]>);

fn octahedron() -> Shape {
    let positions = vec![Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    let triangles = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    (positions, triangles)
}

/// Each triangle cut in four at the middles of its edges.
fn subdivided((mut positions, triangles): Shape) -> Shape {
    let mut middles = HashMap::new();
    let mut middle = |a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            positions.push((positions[a as usize] + positions[b as usize]) * 0.5);
            positions.len() as u32 - 1
        })
    };
    let mut finer = Vec::new();
    for [a, b, c] in triangles {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    (positions, finer)
}

fn scene_of((positions, triangles): Shape, world_from_mesh: Affine3A) -> Scene {
    let mut scene = Scene::new();
    let mesh = scene.add_mesh(Mesh::new(positions, triangles).unwrap()).unwrap();
    let material = scene.add_material(Material::translucent("", Vec4::new(0.2, 0.5, 0.9, 0.4))).unwrap();
    scene.add_instance(Instance { mesh, material, world_from_mesh }).unwrap();
    scene
}

/// Pixels at which fragments that face the camera and fragments that do not differ in number.
fn unbalanced_pixels(scene: &Scene, view: &View, layers: &Layers) -> usize {
    let viewport = Viewport::of(view);
    let draws = draws(scene, view).unwrap();
    let faces_camera: Vec<bool> = (0..scene.primitive_count() as usize)
        .map(|triangle| {
            let corners = draws[0].mesh.triangles()[triangle].map(|vertex| {
                let position = draws[0].mesh.positions()[vertex as usize];
                viewport.project(draws[0].clip_from_mesh * position.extend(1.0))
            });
            twice_signed_area(corners) < 0
        })
        .collect();
    let pixels = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
    pixels
        .filter(|&(x, y)| {
            let fragments = layers.pixel(x, y);
            let entries = fragments.iter().filter(|fragment| faces_camera[fragment.primitive as usize]).count();
            2 * entries != fragments.len()
        })
        .count()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    /// A crumpled ball: closed, neither convex nor free of slivers and folds.
    #[test]
    fn entries_equal_exits(
        bumps in prop::collection::vec(0.05f32..1.5, 258),
        turn in prop::array::uniform3(-3.0f32..3.0),
        levels in 1..4usize,
        size in 5u32..120,
        perspective in any::<bool>(),
    ) {
        let mut shape = octahedron();
        for _ in 0..levels {
            shape = subdivided(shape);
        }
        for (position, bump) in shape.0.iter_mut().zip(&bumps) {
            *position = position.normalize() * *bump;
        }
        let [x, y, z] = turn;
        let scene = scene_of(shape, Affine3A::from_quat(Quat::from_euler(glam::EulerRot::XYZ, x, y, z)));
        let mut view = View::of(&scene).size(size, size);
        let projection = if perspective {
            Projection::Perspective { fov_y: 0.7, near: 0.1 }
        } else {
            Projection::Orthographic { height: 3.0, near: 0.0, far: 10.0 }
        };
        view.camera = Camera { eye: Vec3::Z * 5.0, target: Vec3::ZERO, up: Vec3::Y, projection };
        let layers = layers::gather(&Renderer::new(), &scene, &view).unwrap();
        prop_assert!(!layers.fragments.is_empty() || size < 20);
        prop_assert_eq!(unbalanced_pixels(&scene, &view, &layers), 0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, ..ProptestConfig::default() })]

    /// The near plane cuts a closed convex solid open, and the corners that this makes are snapped too: still no line of
    /// sight enters or leaves twice, or enters without leaving.
    #[test]
    fn the_near_plane_opens_no_seam(corners in prop::array::uniform4(prop::array::uniform3(-3.0f32..3.0)), near in 0.1f32..0.9) {
        let corners = corners.map(Vec3::from_array);
        let [a, b, c, d] = corners;
        prop_assume!((b - a).cross(c - a).dot(d - a).abs() > 0.1);
        let triangles = if (b - a).cross(c - a).dot(d - a) < 0.0 {
            vec![[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]
        } else {
            vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
        };
        let scene = scene_of((corners.to_vec(), triangles), Affine3A::IDENTITY);
        let mut view = View::of(&scene).size(64, 48);
        view.camera = Camera {
            eye: Vec3::ZERO,
            target: -Vec3::Z,
            up: Vec3::Y,
            projection: Projection::Perspective { fov_y: 1.0, near },
        };
        let outward: Vec<Vec3> = scene.meshes()[0]
            .triangles()
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|vertex| corners[vertex as usize]);
                (b - a).cross(c - a)
            })
            .collect();
        let layers = layers::gather(&Renderer::new(), &scene, &view).unwrap();
        for y in 0..48 {
            for x in 0..64 {
                let fragments = layers.pixel(x, y);
                // The eye is at the origin: a face is entered if it looks back at it.
                let enters = |primitive: u32| {
                    let triangle = scene.meshes()[0].triangles()[primitive as usize];
                    outward[primitive as usize].dot(corners[triangle[0] as usize]) < 0.0
                };
                let entries = fragments.iter().filter(|fragment| enters(fragment.primitive)).count();
                let exits = fragments.len() - entries;
                prop_assert!(exits <= 1 && entries <= exits, "{} entries and {} exits at {}, {}", entries, exits, x, y);
            }
        }
    }
}

/// A tetrahedron with a clipped face whose snapped pieces turn over: pixel (22, 16) was covered three times.
#[test]
fn a_piece_turned_over_is_taken_off() {
    let corners = [
        Vec3::new(1.468_432_5, -2.161_628_8, -1.339_928_2),
        Vec3::new(-1.961_872_8, 1.971_243_7, -0.738_773_3),
        Vec3::new(-2.717_852_4, 1.631_689_3, -3.194_776_5),
        Vec3::new(0.158_422_43, -0.057_478, -0.499_996),
    ];
    let scene = scene_of((corners.to_vec(), vec![[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]]), Affine3A::IDENTITY);
    let mut view = View::of(&scene).size(64, 48);
    view.camera = Camera {
        eye: Vec3::ZERO,
        target: -Vec3::Z,
        up: Vec3::Y,
        projection: Projection::Perspective { fov_y: 1.0, near: 0.5 },
    };
    for technique in [Technique::Cpu, Technique::Oracle] {
        let layers = layers::gather(&Renderer::new().technique(technique), &scene, &view).unwrap();
        assert!(layers.depth_complexity(22, 16) <= 2, "{technique}");
    }
}

/// With vertices on a lattice of even subpixels the middles of edges snap to where they are, so cutting triangles must not
/// change coverage at all, not even along the outline.
#[test]
fn subdividing_changes_no_pixel() {
    const SIZE: u32 = 64;
    // One subpixel in world units.
    let subpixel = 1.0 / 256.0;
    for seed in 0..40u32 {
        let mut shape = subdivided(subdivided(octahedron()));
        for (i, position) in shape.0.iter_mut().enumerate() {
            let bump = 8.0 + ((i as u32 * 7919 + seed * 104_729) % 997) as f32 * 0.02;
            let step = if (i as u32 + seed).is_multiple_of(3) { 128.0 } else { 4.0 };
            *position = (position.normalize() * bump / (step * subpixel)).round() * (step * subpixel);
        }
        let coverage = |shape: Shape| {
            let scene = scene_of(shape, Affine3A::IDENTITY);
            let mut view = View::of(&scene).size(SIZE, SIZE);
            view.camera = Camera {
                eye: Vec3::Z * 100.0,
                target: Vec3::ZERO,
                up: Vec3::Y,
                projection: Projection::Orthographic { height: SIZE as f32, near: 1.0, far: 200.0 },
            };
            let layers = layers::gather(&Renderer::new(), &scene, &view).unwrap();
            assert_eq!(unbalanced_pixels(&scene, &view, &layers), 0);
            let pixels = (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y)));
            pixels.map(|(x, y)| layers.depth_complexity(x, y)).collect::<Vec<_>>()
        };
        let coarse = coverage(shape.clone());
        assert!(coarse.iter().any(|&count| count > 0));
        assert_eq!(coarse, coverage(subdivided(shape)), "seed {seed}");
    }
}

/// A cube whose front is a square of whole pixels: its silhouette area is known.
#[test]
fn a_cube_covers_its_silhouette() {
    let corners: Vec<Vec3> = (0..8)
        .map(|i| Vec3::new(f32::from(i & 1 != 0), f32::from(i & 2 != 0), f32::from(i & 4 != 0)) * 10.0 - 5.0)
        .collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let scene = scene_of((corners, triangles), Affine3A::IDENTITY);
    let mut view = View::of(&scene).size(40, 30);
    view.camera = Camera {
        eye: Vec3::Z * 50.0,
        target: Vec3::ZERO,
        up: Vec3::Y,
        projection: Projection::Orthographic { height: 30.0, near: 1.0, far: 100.0 },
    };
    let layers = layers::gather(&Renderer::new(), &scene, &view).unwrap();
    let covered =
        (0..30).flat_map(|y| (0..40).map(move |x| (x, y))).filter(|&(x, y)| layers.depth_complexity(x, y) == 2);
    assert_eq!(covered.count(), 100);
    assert_eq!(layers.fragments.len(), 200, "the sides, seen edge on, cover nothing");
}
