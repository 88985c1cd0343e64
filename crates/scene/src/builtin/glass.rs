//! Glass vessels: closed solids of revolution within each other, with a liquid in the innermost.

use glam::{Affine3A, Vec2, Vec3};
use pellucid_core::{Error, Material, Scene};

use super::bezier::along;
use super::palette::gradient;
use super::parameters::{Parameter, Values, integer};
use super::shapes::{circle, icosphere, revolve};
use super::stage::{Stage, at, camera, scaled};
use crate::LoadError;

pub(super) const PARAMETERS: &[Parameter] = &[
    integer("shells", "4", (1, 64), "vases nested in each other, and spheres nested in each other"),
    integer("sides", "96", (3, 1_024), "corners of the vessels' cross-sections"),
];

/// Steps along each curve of a profile.
const STEPS: u32 = 16;
const VASE_TINTS: [u32; 4] = [0x2fb8c6, 0x2f86e0, 0x4a55e0, 0x8a3fe0];
const SPHERE_TINTS: [u32; 4] = [0xd0307c, 0xf0483c, 0xff8a2a, 0xffc83a];

pub(super) fn make(values: &Values) -> Result<Scene, LoadError> {
    let shells = values.integer("shells");
    let ring = circle(values.integer("sides"));
    let mut stage = Stage::default();
    add_vases(&mut stage, shells, &ring)?;
    add_goblet(&mut stage, &ring, Vec3::new(2.35, 0.0, 0.35))?;
    add_spheres(&mut stage, shells, Vec3::new(-2.35, 1.0, 0.3))?;
    let tray = [[0.0, -0.14], [3.7, -0.14], [3.7, -0.14], [3.8, -0.02], [3.8, -0.02], [0.0, -0.02]].map(Vec2::from);
    let tray = stage.mesh(revolve(&tray, &ring).into_smooth_mesh()?)?;
    let smoke = stage.glass("tray", 0x6f8794, 0.3)?;
    stage.put(tray, smoke, Affine3A::IDENTITY)?;
    stage.scene.add_camera(camera(Vec3::new(0.0, 4.0, 12.5), Vec3::new(0.0, 1.25, 0.0), 25.5));
    Ok(stage.scene)
}

fn tint(tints: &[u32], shell: u32, shells: u32) -> Vec3 {
    gradient(tints, if shells > 1 { shell as f32 / (shells - 1) as f32 } else { 0.0 })
}

fn add_vases(stage: &mut Stage, shells: u32, ring: &[Vec2]) -> Result<(), Error> {
    // Walls and the gaps between them share the outer 60 % of the radius.
    let wall = 0.6 / (2.0 * shells as f32);
    let top = |size: f32| 3.0 + (1.0 - size) * 0.9;
    for shell in 0..shells {
        let size = 1.0 - 2.0 * wall * shell as f32;
        let outside = vase_wall(size, top(size));
        let inside = vase_wall(size - wall, top(size));
        let mut profile = vec![Vec2::new(0.0, outside[0].y), outside[0]];
        profile.extend(&outside);
        // The lip: a flat ring with creases.
        profile.extend([outside[outside.len() - 1], inside[inside.len() - 1]]);
        profile.extend(inside.iter().rev());
        profile.push(Vec2::new(0.0, inside[0].y));
        let mesh = stage.mesh(revolve(&profile, ring).into_smooth_mesh()?)?;
        let name = format!("vase {shell}");
        let material =
            stage.scene.add_material(Material::translucent(name, tint(&VASE_TINTS, shell, shells).extend(0.11)))?;
        stage.put(mesh, material, Affine3A::IDENTITY)?;
    }
    let innermost = vase_wall(1.0 - 2.0 * wall * shells as f32 + wall * 0.9, 3.5);
    let filled = &innermost[..innermost.len() * 3 / 5];
    add_filling(stage, filled, ring, Affine3A::IDENTITY, "syrup", 0xf0207c)
}

/// The outline of a vase from foot to lip; a smaller one stands higher.
fn vase_wall(size: f32, top: f32) -> Vec<Vec2> {
    let bottom = (1.0 - size) * 0.8;
    let curve = [
        [0.7, 0.0],
        [1.0, 0.1],
        [1.3, 0.25],
        [1.3, 0.42],
        [1.3, 0.6],
        [0.62, 0.68],
        [0.62, 0.82],
        [0.62, 0.92],
        [0.78, 0.97],
        [0.95, 1.0],
    ];
    along(&curve, STEPS).into_iter().map(|[r, h]| Vec2::new(r * size, bottom + (top - bottom) * h)).collect()
}

/// Liquid within a wall, given from the bottom up, with a flat surface; it touches the wall nowhere.
fn add_filling(
    stage: &mut Stage,
    wall: &[Vec2],
    ring: &[Vec2],
    place: Affine3A,
    name: &str,
    hex: u32,
) -> Result<(), Error> {
    let lift = Vec2::new(0.0, 0.02);
    let mut profile = vec![Vec2::new(0.0, wall[0].y) + lift];
    profile.extend(wall.iter().map(|&point| point + lift));
    let surface = profile[profile.len() - 1];
    profile.extend([surface, Vec2::new(0.0, surface.y)]);
    let mesh = stage.mesh(revolve(&profile, ring).into_smooth_mesh()?)?;
    let material = stage.glass(name, hex, 0.85)?;
    stage.put(mesh, material, place)
}

fn add_goblet(stage: &mut Stage, ring: &[Vec2], position: Vec3) -> Result<(), Error> {
    let outside = [
        [0.85, 0.0],
        [0.85, 0.06],
        [0.12, 0.1],
        [0.1, 0.35],
        [0.08, 0.7],
        [0.08, 0.9],
        [0.12, 1.05],
        [0.3, 1.2],
        [0.95, 1.35],
        [0.95, 1.95],
        [0.95, 2.3],
        [0.82, 2.6],
        [0.76, 2.75],
    ];
    let inside = [[0.001, 1.2], [0.25, 1.22], [0.89, 1.4], [0.89, 1.95], [0.89, 2.28], [0.77, 2.58], [0.71, 2.75]];
    let [outside, mut inside] =
        [&outside[..], &inside[..]].map(|curve| along(curve, STEPS).into_iter().map(Vec2::from).collect::<Vec<_>>());
    inside[0].x = 0.0;
    let mut profile = vec![Vec2::new(0.0, 0.0), outside[0]];
    profile.extend(&outside);
    profile.extend([outside[outside.len() - 1], inside[inside.len() - 1]]);
    profile.extend(inside.iter().rev());
    let mesh = stage.mesh(revolve(&profile, ring).into_smooth_mesh()?)?;
    let clear = stage.glass("goblet", 0xa9dce6, 0.09)?;
    stage.put(mesh, clear, at(position))?;
    let wine: Vec<Vec2> = inside[1..inside.len() * 3 / 5].iter().map(|p| Vec2::new(p.x * 0.985, p.y)).collect();
    add_filling(stage, &wine, ring, at(position), "wine", 0xc00a2c)
}

fn add_spheres(stage: &mut Stage, shells: u32, center: Vec3) -> Result<(), Error> {
    let sphere = stage.mesh(icosphere(5).into_mesh()?)?;
    for shell in 0..shells {
        let radius = 1.0 - 0.75 * shell as f32 / shells as f32;
        let color = tint(&SPHERE_TINTS, shell, shells).extend(0.2);
        let material = stage.scene.add_material(Material::translucent(format!("sphere {shell}"), color))?;
        stage.put(sphere, material, scaled(radius, center))?;
    }
    let pearl = stage.solid("pearl", 0xf4ead8)?;
    stage.put(sphere, pearl, scaled(0.16, center))
}
