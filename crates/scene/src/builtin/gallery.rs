//! The show piece: translucent things of every kind that run through each other, in a room of their own.

mod pieces;
mod room;

use glam::Vec3;
use pellucid_core::Scene;

use super::parameters::{Parameter, Values, choice};
use super::stage::{Stage, camera};
use crate::LoadError;

pub(super) const PARAMETERS: &[Parameter] =
    &[choice("room", "yes", &["yes", "no"], "whether the pieces stand in their room or before the background")];

pub(super) fn make(values: &Values) -> Result<Scene, LoadError> {
    let mut stage = Stage::default();
    let has_room = values.choice("room") == "yes";
    if has_room {
        room::add_wall(&mut stage)?;
    }
    pieces::add_knot(&mut stage, Vec3::new(0.0, 2.15, 0.0))?;
    pieces::add_flower(&mut stage, Vec3::new(0.0, 0.02, 0.0))?;
    pieces::add_fan(&mut stage, Vec3::new(0.0, 0.15, -1.9))?;
    pieces::add_teapot(&mut stage, Vec3::new(-3.1, 0.02, 0.9))?;
    pieces::add_bubbles(&mut stage, Vec3::new(3.15, 0.0, 0.7))?;
    pieces::add_lattice(&mut stage)?;
    pieces::add_rings(&mut stage, Vec3::new(3.35, 2.85, -1.6))?;
    pieces::add_marbles(&mut stage)?;
    if has_room {
        room::add_reflection(&mut stage)?;
        room::add_floor(&mut stage)?;
    }
    stage.scene.add_camera(camera(Vec3::new(0.0, 3.3, 12.6), Vec3::new(0.0, 1.6, 0.0), 26.5));
    Ok(stage.scene)
}
