//! Random triangle soups, and cameras amid them.

use glam::{Affine3A, Quat, Vec2, Vec3, Vec3Swizzles, Vec4};
use pellucid::core::texture::{Filter, Sampler, Wrap};
use pellucid::{AlphaMode, Camera, Instance, Material, Mesh, Projection, Scene, Texture};
use proptest::prelude::*;

/// Values that break arithmetic.
const POISON: [f32; 12] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    1e-45,
    -0.0,
    1e30,
    -1e20,
    1e6,
    1e-20,
];

fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        20 => -2.0f32..2.0,
        // On a lattice: shared edges, coplanar faces, equal depths.
        10 => (-4i32..5).prop_map(|i| i as f32 * 0.5),
        3 => -50.0f32..50.0,
        1 => prop::sample::select(&POISON[..]),
    ]
}

fn point() -> impl Strategy<Value = Vec3> {
    (coordinate(), coordinate(), coordinate()).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

/// Three corners: anywhere, close together, in a line, or all the same.
fn triangle() -> impl Strategy<Value = [Vec3; 3]> {
    (point(), point(), point(), 0..10u8).prop_map(|(a, b, c, kind)| match kind {
        0 => [a, a, b],
        1 => [a, a + (b - a) * 0.5, b],
        2 => [a, a + b * 1e-3, a + c * 1e-3],
        3 => [a, a + b * 1e-2, a + c * 1e-2],
        _ => [a, b, c],
    })
}

#[derive(Debug, Clone)]
struct Look {
    color: Vec4,
    mode: AlphaMode,
    double_sided: bool,
    textured: bool,
    smooth: bool,
    colored: bool,
}

fn look() -> impl Strategy<Value = Look> {
    let mode = prop_oneof![
        4 => Just(AlphaMode::Blend),
        1 => Just(AlphaMode::Opaque),
        1 => Just(AlphaMode::Mask { cutoff: 0.5 }),
    ];
    let color = prop::array::uniform4(0.0f32..1.0).prop_map(Vec4::from_array);
    let flags = prop::array::uniform4(any::<bool>());
    (color, mode, flags).prop_map(|(color, mode, [double_sided, textured, smooth, colored])| Look {
        color,
        mode,
        double_sided,
        textured,
        smooth,
        colored,
    })
}

fn texture() -> impl Strategy<Value = Texture> {
    let wrap = || prop_oneof![2 => Just(Wrap::Repeat), 1 => Just(Wrap::MirroredRepeat), 1 => Just(Wrap::ClampToEdge)];
    let filter = || prop_oneof![3 => Just(Filter::Linear), 1 => Just(Filter::Nearest)];
    let mip = prop_oneof![3 => Just(Some(Filter::Linear)), 1 => Just(Some(Filter::Nearest)), 1 => Just(None)];
    (wrap(), wrap(), filter(), filter(), mip).prop_map(|(wrap_u, wrap_v, magnify, minify, mip)| {
        let texels = (0..63u8).map(|i| [i * 3, 255 - i * 2, 90, if i % 3 == 0 { 40 } else { 230 }]).collect();
        Texture::new(9, 7, texels, Sampler { wrap_u, wrap_v, magnify, minify, mip }).unwrap()
    })
}

/// A few instances of a few triangles each, of every kind.
pub(crate) fn soup() -> impl Strategy<Value = Scene> {
    let instance = (prop::collection::vec(triangle(), 1..25), look(), any::<bool>());
    (prop::collection::vec(instance, 1..4), texture()).prop_map(|(instances, texture)| {
        let mut scene = Scene::new();
        let texture = scene.add_texture(texture).unwrap();
        for (triangles, look, mirrored) in instances {
            let positions: Vec<Vec3> = triangles.as_flattened().to_vec();
            let count = positions.len() as u32;
            let indices = (0..count / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let mut mesh = Mesh::new(positions.clone(), indices).unwrap();
            if look.smooth {
                mesh = mesh.with_normals(positions.iter().map(|p| p.yzx()).collect()).unwrap();
            }
            if look.textured {
                mesh = mesh.with_tex_coords(positions.iter().map(|p| Vec2::new(p.x, p.z * 3.0)).collect()).unwrap();
            }
            if look.colored {
                mesh = mesh.with_colors((0..count).map(|i| Vec4::splat(1.0 - i as f32 / 80.0)).collect()).unwrap();
            }
            let mesh = scene.add_mesh(mesh).unwrap();
            let material = Material {
                base_color: look.color,
                alpha_mode: look.mode,
                double_sided: look.double_sided,
                texture: look.textured.then_some(pellucid::core::scene::MaterialTexture {
                    texture,
                    transform: glam::Affine2::from_scale(Vec2::new(1.5, 0.5)),
                }),
                ..Material::default()
            };
            let material = scene.add_material(material).unwrap();
            let scale = Vec3::new(if mirrored { -1.0 } else { 1.0 }, 1.0, 1.3);
            let world_from_mesh =
                Affine3A::from_scale_rotation_translation(scale, Quat::from_rotation_y(0.3), Vec3::new(0.1, 0.0, 0.2));
            scene.add_instance(Instance { mesh, material, world_from_mesh }).unwrap();
        }
        scene
    })
}

/// In front of a soup, or in it.
pub(crate) fn camera() -> impl Strategy<Value = Camera> {
    let eye = prop_oneof![
        Just(Vec3::new(0.3, 0.2, 6.0)),
        Just(Vec3::ZERO),               // amid the triangles
        Just(Vec3::new(0.0, 0.5, 0.5)), // in the plane of lattice triangles
        (-3.0f32..3.0, -3.0f32..3.0, -3.0f32..3.0).prop_map(|(x, y, z)| Vec3::new(x, y, z)),
    ];
    let projection = prop_oneof![
        3 => Just(Projection::Perspective { fov_y: 0.9, near: 0.01 }),
        1 => Just(Projection::Perspective { fov_y: 2.5, near: 0.3 }),
        1 => Just(Projection::Orthographic { height: 5.0, near: -3.0, far: 8.0 }),
    ];
    (eye, projection).prop_map(|(eye, projection)| Camera {
        eye,
        target: Vec3::new(0.05, -0.1, -20.0),
        up: Vec3::Y,
        projection,
    })
}
