//! Parallel planes that fill the picture, so that the answer is known: n planes of opacity a leave (1-a)^n of what is
//! behind them.

use glam::{Affine3A, Quat, Vec3};
use pellucid_core::{Material, Scene};

use super::palette::wheel;
use super::parameters::{MAX_TRIANGLES, Parameter, SEED, Values, check_triangles, choice, integer, number};
use super::random::Random;
use super::shapes::grid;
use super::stage::{Stage, flat_camera};
use crate::LoadError;

pub(super) const PARAMETERS: &[Parameter] = &[
    integer("n", "16", (1, 65_536), "planes behind each other"),
    number("alpha", "0.5", (0.0, 1.0), "opacity of each plane"),
    choice("order", "shuffled", &["shuffled", "front", "back"], "what is drawn first: any, the nearest, the farthest"),
    choice("colours", "smooth", &["smooth", "white"], "a hue by depth, or white throughout"),
    integer("tessellation", "1", (1, 1_000), "cells along each side of a plane, of 2 triangles each"),
    SEED,
];

/// Half the width, for a half height of 1: a little more than the widest picture shows.
const HALF_WIDTH: f32 = 4.1;

pub(super) fn make(values: &Values) -> Result<Scene, LoadError> {
    let (n, tessellation) = (values.integer("n"), values.integer("tessellation"));
    check_triangles("planes", MAX_TRIANGLES, &[u64::from(n), 2, u64::from(tessellation).pow(2)])?;
    let mut stage = Stage::default();
    let mesh = stage.mesh(grid(tessellation, tessellation).into_mesh()?)?;

    let distinct = if values.choice("colours") == "white" { 1 } else { n.min(256) };
    let mut materials = Vec::new();
    for i in 0..distinct {
        let color = match values.choice("colours") {
            "white" => Vec3::ONE,
            _ => wheel(&[0x2e9cca, 0x7a5bd0, 0xd9467c, 0xf2a541, 0x3cb58a], i as f32 / distinct as f32),
        };
        let base_color = color.extend(values.number("alpha"));
        materials.push(
            stage
                .scene
                .add_material(Material { unlit: true, ..Material::translucent(format!("hue {i}"), base_color) })?,
        );
    }

    let mut order: Vec<u32> = (0..n).collect();
    match values.choice("order") {
        "shuffled" => Random::new(values.integer("seed")).shuffle(&mut order),
        "back" => order.reverse(),
        _ => {}
    }
    for index in order {
        // Plane 0 is nearest. Depth is linear in z, and neighbours differ by at least 2^-17 of it.
        let z = (1.0 - (2.0 * f64::from(index) + 1.0) / f64::from(n)) as f32;
        let size = Vec3::new(HALF_WIDTH, HALF_WIDTH / 4.0, 1.0);
        let place = Affine3A::from_scale_rotation_translation(size, Quat::IDENTITY, Vec3::new(0.0, 0.0, z));
        let material = materials[(u64::from(index) * u64::from(distinct) / u64::from(n)) as usize];
        stage.put(mesh, material, place)?;
    }
    stage.scene.add_camera(flat_camera(1.5));
    Ok(stage.scene)
}
