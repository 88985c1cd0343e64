//! A floor of dark polished tiles and a wall behind. The floor is translucent, and under it stands everything once more,
//! upside down: as good as a reflection, and twice as much to put in order.

use glam::{Affine2, Affine3A, Quat, Vec2, Vec3};
use pellucid_core::scene::MaterialTexture;
use pellucid_core::texture::Wrap;
use pellucid_core::{AlphaMode, Error, Instance, Material};

use super::super::painting::{lerp, noise, paint, smoothstep};
use super::super::palette::gradient;
use super::super::random::rotation;
use super::super::shapes::grid;
use super::super::stage::Stage;

/// Half the width of the room, and half the height of the wall.
const HALF: Vec2 = Vec2::new(16.0, 6.0);
const WALL_Z: f32 = -6.5;
/// Half the depth of the floor, which begins at the wall.
const HALF_DEPTH: f32 = 8.0;

pub(super) fn add_wall(stage: &mut Stage) -> Result<(), Error> {
    let mut wall = grid(64, 24);
    // Lit as by a lamp behind the pieces.
    let glow = |position: &Vec3| {
        let from_lamp = Vec2::new(position.x, (position.y + 1.0) * 0.62 - 0.25) * Vec2::new(2.3, 1.5);
        gradient(&[0x4d5f82, 0x34415f, 0x1f283d, 0x151b2a], smoothstep(0.0, 1.35, from_lamp.length()))
    };
    wall.colors = wall.positions.iter().map(|position| glow(position).extend(1.0)).collect();
    let mesh = stage.mesh(wall.into_mesh()?)?;
    let paint = stage.scene.add_material(Material { name: "wall".into(), unlit: true, ..Material::default() })?;
    let center = Vec3::new(0.0, HALF.y, WALL_Z);
    stage.put(mesh, paint, Affine3A::from_scale_rotation_translation(HALF.extend(1.0), Quat::IDENTITY, center))
}

/// Places all that is there again, mirrored at the floor.
pub(super) fn add_reflection(stage: &mut Stage) -> Result<(), Error> {
    let mirror = Affine3A::from_scale(Vec3::new(1.0, -1.0, 1.0));
    let upright: Vec<Instance> = stage.scene.instances().to_vec();
    for instance in upright {
        let world_from_mesh = mirror * instance.world_from_mesh;
        stage.scene.add_instance(Instance { world_from_mesh, ..instance })?;
    }
    Ok(())
}

pub(super) fn add_floor(stage: &mut Stage) -> Result<(), Error> {
    let tiles = paint(512, Wrap::Repeat, |u, v| {
        let edge = (u - 0.5).abs().max((v - 0.5).abs());
        let joint = smoothstep(0.484, 0.492, edge);
        let speckle = (noise(u, v, 90, 90, 5) - 0.5) * 0.02 + (noise(u, v, 7, 7, 6) - 0.5) * 0.03;
        let polish = lerp(0.78, 0.95, joint);
        [
            lerp(0.12, 0.22, joint) + speckle,
            lerp(0.14, 0.26, joint) + speckle,
            lerp(0.20, 0.34, joint) + speckle,
            polish,
        ]
    })?;
    let texture = stage.scene.add_texture(tiles)?;
    let transform = Affine2::from_scale(Vec2::new(2.0 * HALF.x, 2.0 * HALF_DEPTH));
    let material = stage.scene.add_material(Material {
        name: "tiles".into(),
        texture: Some(MaterialTexture { texture, transform }),
        alpha_mode: AlphaMode::Blend,
        unlit: true,
        ..Material::default()
    })?;
    let mesh = stage.mesh(grid(32, 16).into_mesh()?)?;
    let size = Vec3::new(HALF.x, HALF_DEPTH, 1.0);
    let center = Vec3::new(0.0, 0.0, WALL_Z + HALF_DEPTH);
    let lying = rotation(Vec3::X, -0.25);
    stage.put(mesh, material, Affine3A::from_scale_rotation_translation(size, lying, center))
}
