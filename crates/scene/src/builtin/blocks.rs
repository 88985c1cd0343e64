//! Equally sized cubes anywhere and anyhow, as in Wellings' depth peeling demo.

use glam::Vec3;
use pellucid_core::Scene;

use super::palette::GLASS;
use super::parameters::{Parameter, SEED, Values, integer};
use super::random::Random;
use super::shapes::cuboid;
use super::stage::{Stage, turned};
use crate::LoadError;

pub(super) const PARAMETERS: &[Parameter] =
    &[integer("n", "100", (1, 1_000_000), "cubes, of 12 triangles each; the space they share stays the same"), SEED];

/// Half the side of a cube; cubes have their centres in a ball of radius 1.
const HALF_SIDE: f32 = 0.13;

pub(super) fn make(values: &Values) -> Result<Scene, LoadError> {
    let mut random = Random::new(values.integer("seed"));
    let mut stage = Stage::default();
    let cube = stage.mesh(cuboid(Vec3::splat(HALF_SIDE)).into_mesh()?)?;
    let mut materials = Vec::new();
    for hex in GLASS {
        materials.push(stage.glass("glass", hex, 0.45)?);
    }
    for _ in 0..values.integer("n") {
        let place = turned(1.0, random.rotation(), random.in_ball());
        stage.put(cube, materials[random.below(materials.len())], place)?;
    }
    Ok(stage.scene)
}
