//! A lattice of boxes, as in LucidRaster's test scene.

use glam::Vec3;
use pellucid_core::{Material, Scene};

use super::parameters::{Parameter, Values, integer};
use super::shapes::{Shape, cuboid};
use super::stage::{Stage, at};
use crate::LoadError;

pub(super) const PARAMETERS: &[Parameter] =
    &[integer("n", "10", (1, 255), "boxes along each side: n x n x n, of 12 triangles each")];

const ALPHA: f32 = 0.35;
/// Side of a box over the distance between two.
const FILL: f32 = 0.6;

pub(super) fn make(values: &Values) -> Result<Scene, LoadError> {
    let n = values.integer("n");
    let pitch = 2.0 / n as f32;
    let middle = |i: u32| (i as f32 + 0.5) * pitch - 1.0;
    let along = |i: u32| if n > 1 { i as f32 / (n - 1) as f32 } else { 0.5 };

    // One slab of n x n boxes, put n times: colours vary along x and y by vertex, along z by material.
    let unit = cuboid(Vec3::splat(pitch * FILL * 0.5));
    let mut slab = Shape::default();
    for y in 0..n {
        for x in 0..n {
            let color = Vec3::new(0.25 + 0.75 * along(x), 0.3 + 0.6 * along(y), 1.0);
            slab.append(&unit, &at(Vec3::new(middle(x), middle(y), 0.0)), color.extend(ALPHA));
        }
    }
    let mut stage = Stage::default();
    let slab = stage.mesh(slab.into_mesh()?)?;
    for z in 0..n {
        let color = Vec3::new(1.0, 1.0, 0.2 + 0.8 * along(z));
        let material = stage.scene.add_material(Material::translucent(format!("slab {z}"), color.extend(1.0)))?;
        stage.put(slab, material, at(Vec3::new(0.0, 0.0, middle(z))))?;
    }
    Ok(stage.scene)
}
