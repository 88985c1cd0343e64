//! Layers of tessellated grids under parallel rays: the synthetic scene of Knowles, Leach and Zambetta, Efficient
//! Layered Fragment Buffer Techniques (OpenGL Insights, chapter 20), figures 20.10 to 20.12.

use glam::{Affine3A, Quat, Vec3};
use pellucid_core::{Material, Scene};

use super::palette::gradient;
use super::parameters::{MAX_TRIANGLES, Parameter, Values, check_triangles, integer, number};
use super::shapes::grid;
use super::stage::{Stage, flat_camera};
use crate::LoadError;

pub(super) const PARAMETERS: &[Parameter] = &[
    integer("layers", "10", (1, 65_536), "grids behind each other"),
    integer("tessellation", "100", (1, 2_000), "cells along each side of a grid, of 2 triangles each"),
    number("coverage", "1", (0.0001, 1.0), "share of a 16:9 picture that the grids cover"),
];

const COLORS: [u32; 5] = [0xf2a541, 0xd9467c, 0x7a5bd0, 0x2e9cca, 0x3cb58a];
const ALPHA: f32 = 0.3;

pub(super) fn make(values: &Values) -> Result<Scene, LoadError> {
    let (layers, tessellation) = (values.integer("layers"), values.integer("tessellation"));
    let per_layer = 2 * u64::from(tessellation).pow(2);
    check_triangles("grids", MAX_TRIANGLES, &[u64::from(layers), per_layer])?;
    let mut stage = Stage::default();
    let mesh = stage.mesh(grid(tessellation, tessellation).into_mesh()?)?;

    // The picture's shape is not known here: a grid of coverage 1 is a 16:9 rectangle, so it fills narrower ones too.
    let scale = values.number("coverage").sqrt();
    let size = Vec3::new(scale * 16.0 / 9.0, scale, 1.0);
    let distinct = layers.min(256);
    let mut materials = Vec::new();
    for layer in 0..distinct {
        let color = gradient(&COLORS, (layer as f32 + 0.5) / distinct as f32).extend(ALPHA);
        materials.push(stage.scene.add_material(Material::translucent(format!("layer {layer}"), color))?);
    }
    for layer in 0..layers {
        let material = materials[(u64::from(layer) * u64::from(distinct) / u64::from(layers)) as usize];
        let z = 1.0 - 2.0 * (layer as f32 + 0.5) / layers as f32;
        let place = Affine3A::from_scale_rotation_translation(size, Quat::IDENTITY, Vec3::new(0.0, 0.0, z));
        stage.put(mesh, material, place)?;
    }
    stage.scene.add_camera(flat_camera(1.5));
    Ok(stage.scene)
}
