//! Translucent and opaque spheres of many sizes, as in NVIDIA's order-independent transparency sample.

use glam::Vec3;
use pellucid_core::Scene;

use super::palette::GLASS;
use super::parameters::{MAX_TRIANGLES, Parameter, SEED, Values, check_triangles, integer};
use super::random::Random;
use super::shapes::icosphere;
use super::stage::{Stage, scaled};
use crate::LoadError;

pub(super) const PARAMETERS: &[Parameter] = &[
    integer("n", "512", (1, 1_000_000), "spheres"),
    integer("subdivisions", "3", (0, 8), "how round: 20 x 4^subdivisions triangles a sphere"),
    integer("opaque", "15", (0, 100), "opaque spheres, in percent"),
    SEED,
];

pub(super) fn make(values: &Values) -> Result<Scene, LoadError> {
    let (n, subdivisions) = (values.integer("n"), values.integer("subdivisions"));
    check_triangles("spheres", MAX_TRIANGLES, &[u64::from(n), 20, 4_u64.pow(subdivisions)])?;
    let mut random = Random::new(values.integer("seed"));
    let mut stage = Stage::default();
    let sphere = stage.mesh(icosphere(subdivisions).into_mesh()?)?;
    let mut glass = Vec::new();
    let mut solid = Vec::new();
    for hex in GLASS {
        glass.push(stage.glass("glass", hex, 0.4)?);
        solid.push(stage.solid("solid", hex)?);
    }

    // One sphere somewhere in each of n cells of a lattice, so that density is the same for every n.
    let side = (1..).find(|side| side * side * side >= n as usize).unwrap_or(1);
    let cell = 2.0 / side as f32;
    let mut cells: Vec<usize> = (0..side * side * side).collect();
    random.shuffle(&mut cells);
    let opaque_count = (u64::from(n) * u64::from(values.integer("opaque")) + 50) / 100;
    let mut is_opaque: Vec<bool> = (0..u64::from(n)).map(|i| i < opaque_count).collect();
    random.shuffle(&mut is_opaque);
    for (cell_index, is_opaque) in cells.into_iter().zip(is_opaque) {
        let corner = [cell_index % side, cell_index / side % side, cell_index / (side * side)].map(|i| i as f32);
        let center = (Vec3::from(corner) + 0.5 + random.in_cube() * 0.4) * cell - 1.0;
        let radius = cell * if is_opaque { random.between(0.12, 0.35) } else { random.between(0.25, 0.75) };
        let colors = if is_opaque { &solid } else { &glass };
        stage.put(sphere, colors[random.below(colors.len())], scaled(radius, center))?;
    }
    Ok(stage.scene)
}
