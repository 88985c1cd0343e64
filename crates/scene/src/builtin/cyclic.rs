//! Bars of which each lies over the next, all the way round (figure 20.2 of the LFB chapter): no order of drawing them
//! whole is right.

use glam::{Affine3A, Quat, Vec3};
use pellucid_core::{Material, Scene};

use super::palette::wheel;
use super::parameters::{Parameter, Values, integer, number};
use super::random::{rotation, sin_cos};
use super::shapes::cuboid;
use super::stage::{Stage, camera};
use crate::LoadError;

pub(super) const PARAMETERS: &[Parameter] =
    &[integer("n", "3", (3, 64), "bars in the ring"), number("alpha", "0.7", (0.0, 1.0), "opacity of each bar")];

pub(super) fn make(values: &Values) -> Result<Scene, LoadError> {
    let n = values.integer("n");
    // Bars run along the sides of a regular polygon of circumradius 1, and beyond its corners.
    let (sin, cos) = sin_cos(0.5 / f64::from(n));
    let overhang = sin * 0.35;
    let half_width = sin * 0.22;
    let half_length = sin + half_width + overhang;
    let thickness = half_width * 0.1;
    // High at the start and low at the end of each: at a corner, where centre lines meet, twice this apart.
    let rise = half_width * 0.9;
    let tilt = Quat::from_rotation_arc(Vec3::X, Vec3::new(sin, 0.0, -rise).normalize());

    let mut stage = Stage::default();
    let bar = stage.mesh(cuboid(Vec3::new(half_length, half_width, thickness)).into_mesh()?)?;
    for i in 0..n {
        let turns = i as f32 / n as f32;
        let color = wheel(&[0xe4572e, 0x2e9cca, 0xf4d35e], turns).extend(values.number("alpha"));
        let material = stage.scene.add_material(Material::translucent(format!("bar {i}"), color))?;
        let around = rotation(Vec3::Z, turns);
        stage.put(
            bar,
            material,
            Affine3A::from_rotation_translation(around * tilt, around * Vec3::new(0.0, -cos, 0.0)),
        )?;
    }
    stage.scene.add_camera(camera(Vec3::new(0.0, -0.9, 6.2), Vec3::ZERO, 30.0));
    Ok(stage.scene)
}
