//! Textures are sampled in shaders as the core samples them: every wrap and filter, magnified and minified.

mod common;

use glam::{Affine2, Affine3A, Quat, Vec2, Vec3};
use pellucid_conformance::images::TOLERANCE;
use pellucid_core::scene::MaterialTexture;
use pellucid_core::texture::{Filter, Sampler, Wrap};
use pellucid_core::{
    AlphaMode, Camera, Instance, Material, Mesh, Projection, Scene, Shading, Technique, Texture, View, oracle,
};

/// A leaning square with a noisy texture of odd sides, repeated a few times.
fn scene(sampler: Sampler, repeats: f32) -> Scene {
    let texels = (0..13u32 * 10)
        .map(|i| i.wrapping_mul(2_654_435_761).rotate_left(i % 32))
        .map(|noise| noise.to_le_bytes())
        .collect();
    let mut scene = Scene::new();
    let texture = scene.add_texture(Texture::new(13, 10, texels, sampler).unwrap()).unwrap();
    let transform = Affine2::from_scale_angle_translation(Vec2::splat(repeats), 0.3, Vec2::new(-1.3, 0.2));
    let material = scene
        .add_material(Material {
            texture: Some(MaterialTexture { texture, transform }),
            alpha_mode: AlphaMode::Blend,
            ..Material::default()
        })
        .unwrap();
    let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let positions = corners.iter().map(|corner| (corner * 2.0 - 1.0).extend(0.0)).collect();
    let mesh = Mesh::new(positions, vec![[0, 1, 2], [0, 2, 3]]).unwrap().with_tex_coords(corners.to_vec()).unwrap();
    let mesh = scene.add_mesh(mesh).unwrap();
    let world_from_mesh = Affine3A::from_rotation_translation(Quat::from_rotation_y(1.1), Vec3::ZERO);
    scene.add_instance(Instance { mesh, material, world_from_mesh }).unwrap();
    scene
}

fn view(scene: &Scene) -> View {
    let mut view = View::of(scene).size(48, 40);
    view.shading = Shading::Unlit;
    view.camera = Camera {
        eye: Vec3::new(0.0, 0.2, 2.2),
        target: Vec3::ZERO,
        up: Vec3::Y,
        projection: Projection::Perspective { fov_y: 0.9, near: 0.01 },
    };
    view
}

#[test]
fn every_sampler_agrees_with_the_core() {
    let Some(gpu) = common::renderer(false) else { return };
    let filters = [Filter::Nearest, Filter::Linear];
    let mut samplers = Vec::new();
    for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
        for mip in [None, Some(Filter::Nearest), Some(Filter::Linear)] {
            for minify in filters {
                for magnify in filters {
                    samplers.push(Sampler { wrap_u: wrap, wrap_v: Wrap::MirroredRepeat, magnify, minify, mip });
                    samplers.push(Sampler { wrap_u: Wrap::ClampToEdge, wrap_v: wrap, magnify, minify, mip });
                }
            }
        }
    }
    for sampler in samplers {
        for repeats in [0.7, 3.0, 20.0] {
            let scene = scene(sampler, repeats);
            let view = view(&scene);
            let capture = oracle::capture(&scene, &view).unwrap();
            gpu.layers(&scene, &view, Technique::Linear, |layers| {
                for (i, &ambiguous) in (0..).zip(&capture.ambiguous) {
                    let (x, y) = (i % layers.width, i / layers.width);
                    let (expected, have) = (capture.layers.pixel(x, y), layers.pixel(x, y));
                    if ambiguous || (expected.is_empty() && have.is_empty()) {
                        continue;
                    }
                    let difference = (expected[0].color - have[0].color).abs();
                    let what = format!("{sampler:?}, {repeats} repeats, pixel {x}, {y}");
                    assert!(difference.max_element() <= TOLERANCE, "{what}: {expected:?} and {have:?}");
                }
            })
            .unwrap();
        }
    }
}
