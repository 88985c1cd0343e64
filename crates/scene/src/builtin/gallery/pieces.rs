//! What is on show.

use glam::{Affine2, Affine3A, Quat, Vec2, Vec3};
use pellucid_core::scene::MaterialTexture;
use pellucid_core::texture::Wrap;
use pellucid_core::{AlphaMode, Error, Material};

use super::super::bezier::along;
use super::super::painting::{lerp, paint, smoothstep};
use super::super::palette::{GLASS, gradient, wheel};
use super::super::random::{Random, rotation};
use super::super::shapes::{Shape, cuboid, grid, icosphere};
use super::super::stage::{Stage, scaled, turned};
use super::super::teapot;
use super::super::tube::{knot, torus};

/// A knot that changes hue along its way, through a glass sphere, around a golden one.
pub(super) fn add_knot(stage: &mut Stage, center: Vec3) -> Result<(), Error> {
    const SEGMENTS: u32 = 360;
    const SIDES: u32 = 28;
    let mut shape = knot((2, 3), 0.42, 0.2, SEGMENTS, SIDES);
    shape.colors = (0..SEGMENTS * SIDES)
        .map(|vertex| {
            let t = (vertex / SIDES) as f32 / SEGMENTS as f32;
            wheel(&[0x12b5b0, 0x2f6fe0, 0x8a4bdc, 0xe0429a, 0x8a4bdc, 0x2f6fe0], t * 2.0).extend(0.62)
        })
        .collect();
    let mesh = stage.mesh(shape.into_mesh()?)?;
    let tinted = stage.glass("knot", 0xffffff, 1.0)?;
    let upright = rotation(Vec3::X, 0.25) * rotation(Vec3::Y, 0.04);
    stage.put(mesh, tinted, turned(1.0, rotation(Vec3::Y, -0.05) * upright, center))?;

    let sphere = stage.mesh(icosphere(4).into_mesh()?)?;
    let gold = stage.solid("gold", 0xf0b840)?;
    stage.put(sphere, gold, scaled(0.4, center))?;
    let clear = stage.glass("sphere", 0x8fd3e8, 0.2)?;
    stage.put(sphere, clear, scaled(1.25, center))
}

/// A fan of panes behind the knot. Each is turned a little about its own axis, so that neighbours cross, and none is
/// wholly in front of another.
pub(super) fn add_fan(stage: &mut Stage, pivot: Vec3) -> Result<(), Error> {
    const COUNT: u32 = 11;
    const HALF_LENGTH: f32 = 1.75;
    let pane = stage.mesh(cuboid(Vec3::new(0.44, HALF_LENGTH, 0.015)).into_mesh()?)?;
    for i in 0..COUNT {
        let t = i as f32 / (COUNT - 1) as f32;
        let color = gradient(&[0xf2545b, 0xf5893d, 0xf4d35e, 0x47b881, 0x2aa7c9, 0x4169e1, 0x8a4bdc], t);
        let material = Material::translucent(format!("pane {i}"), color.extend(0.34));
        let material = stage.scene.add_material(material)?;
        let turn = rotation(Vec3::Z, 0.215 - 0.43 * t) * rotation(Vec3::Y, 0.035);
        stage.put(pane, material, turned(1.0, turn, pivot + turn * Vec3::new(0.0, HALF_LENGTH + 0.25, 0.0)))?;
    }
    Ok(())
}

/// A flower around the knot's foot: rings of curved petals, each over the next and under the one before.
pub(super) fn add_flower(stage: &mut Stage, foot: Vec3) -> Result<(), Error> {
    for (ring, (count, size, opening, stops)) in
        [(7, 1.0, 0.55, [0xfff0d6, 0xf7a8b8, 0xe0428a]), (9, 1.22, 1.0, [0xd9f2e6, 0x86c5f0, 0x4a5fd8])]
            .into_iter()
            .enumerate()
    {
        let petal = stage.mesh(petal(opening, &stops).into_smooth_mesh()?)?;
        let material = stage.glass(&format!("petals {ring}"), 0xffffff, 1.0)?;
        for i in 0..count {
            let turns = (i as f32 + 0.25 * ring as f32) / count as f32;
            stage.put(petal, material, turned(size, rotation(Vec3::Y, turns), foot))?;
        }
    }
    Ok(())
}

/// A petal that grows from the origin towards +z, twisted so that one edge lies further out than the other; denser
/// towards its tip.
fn petal(opening: f32, stops: &[u32]) -> Shape {
    const COLUMNS: u32 = 16;
    const ROWS: u32 = 32;
    let curve = [[0.25, 0.0], [0.9, 0.02], [1.15, 0.3], [1.2 + 0.35 * opening, 1.35 - 0.45 * opening]];
    let curve = along(&curve, ROWS);
    let mut shape = grid(COLUMNS, ROWS);
    shape.tex_coords.clear();
    for position in &mut shape.positions {
        let row = ((position.y + 1.0) * 0.5 * ROWS as f32).round() as usize;
        let t = row as f32 / ROWS as f32;
        let [out, up] = curve[row];
        let half_width = 0.16 + 1.7 * t * (1.0 - t) * (0.55 + 0.45 * t);
        let half_width = half_width * (1.0 - t * t * t * t);
        let across = position.x * half_width;
        // Cupped across, and twisted.
        let lift = position.x * position.x * half_width * 0.35;
        *position = Vec3::new(across, up + lift * 0.5, out - lift + across * 0.22);
        shape.colors.push(gradient(stops, t).extend(lerp(0.22, 0.62, t)));
    }
    shape
}

/// A glass teapot full of balls.
pub(super) fn add_teapot(stage: &mut Stage, foot: Vec3) -> Result<(), Error> {
    let place = turned(0.5, rotation(Vec3::Y, 0.07), foot);
    let celadon = stage.glass("teapot", 0x4fb99f, 0.4)?;
    for part in teapot::parts(20) {
        let mesh = stage.mesh(part.into_smooth_mesh()?)?;
        stage.put(mesh, celadon, place)?;
    }
    let ball = stage.mesh(icosphere(3).into_mesh()?)?;
    for (hex, position, radius) in [
        (0xf4d35e, Vec3::new(0.0, 0.36, 0.35), 0.3),
        (0xee6c4d, Vec3::new(-0.45, 0.33, -0.1), 0.27),
        (0xfaf3e3, Vec3::new(0.42, 0.34, -0.1), 0.28),
        (0x3d5a98, Vec3::new(-0.02, 0.82, 0.05), 0.25),
    ] {
        let material = stage.solid("ball", hex)?;
        stage.put(ball, material, scaled(radius, foot + position))?;
    }
    Ok(())
}

/// Bubbles that run through each other, with more inside them.
pub(super) fn add_bubbles(stage: &mut Stage, foot: Vec3) -> Result<(), Error> {
    let [fine, coarse] = [4, 3].map(icosphere);
    let (fine, coarse) = (stage.mesh(fine.into_mesh()?)?, stage.mesh(coarse.into_mesh()?)?);
    for (hex, alpha, position, radius) in [
        (0xf2545b, 0.34, Vec3::new(-0.25, 0.92, 0.0), 0.92),
        (0xf5a742, 0.36, Vec3::new(0.72, 0.72, 0.35), 0.72),
        (0x6f5bd8, 0.34, Vec3::new(0.5, 1.5, -0.3), 0.66),
        (0x2e9cca, 0.36, Vec3::new(-0.25, 0.92, 0.0), 0.55),
        (0xfff1c9, 0.4, Vec3::new(-0.25, 0.92, 0.0), 0.28),
    ] {
        let material = stage.glass("bubble", hex, alpha)?;
        stage.put(if radius > 0.6 { fine } else { coarse }, material, scaled(radius, foot + position))?;
    }
    let cube = stage.mesh(cuboid(Vec3::splat(0.21)).into_mesh()?)?;
    let white = stage.solid("cube", 0xf7f2e8)?;
    stage.put(cube, white, turned(1.0, rotation(Vec3::ONE.normalize(), 0.11), foot + Vec3::new(0.85, 0.6, 0.45)))?;
    stage.put(cube, white, turned(0.9, rotation(Vec3::Y, 0.09), foot + Vec3::new(0.5, 1.55, -0.3)))
}

/// A screen cut from a sheet, with a sphere stuck in it.
pub(super) fn add_lattice(stage: &mut Stage) -> Result<(), Error> {
    let texture = paint(512, Wrap::Repeat, |u, v| {
        // Rings of two sizes on a square lattice, one tile of the pattern.
        let distance = |x: f32, y: f32| Vec2::new(u - x, v - y).length();
        let ring = |distance: f32, radius: f32| (distance - radius).abs();
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        let nearest = corners.map(|(x, y)| ring(distance(x, y), 0.5)).into_iter().fold(f32::MAX, f32::min);
        let bars = nearest.min(ring(distance(0.5, 0.5), 0.5)).min(ring(distance(0.5, 0.5), 0.14));
        let sheet = 1.0 - smoothstep(0.045, 0.06, bars);
        let bevel = smoothstep(0.0, 0.045, bars);
        [lerp(0.80, 0.55, bevel), lerp(0.66, 0.42, bevel), lerp(0.44, 0.25, bevel), sheet]
    })?;
    let texture = stage.scene.add_texture(texture)?;
    let transform = Affine2::from_scale(Vec2::new(6.0, 6.0));
    let material = stage.scene.add_material(Material {
        name: "lattice".into(),
        texture: Some(MaterialTexture { texture, transform }),
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        ..Material::default()
    })?;
    let sheet = stage.mesh(grid(1, 1).into_mesh()?)?;
    let lean = rotation(Vec3::Y, 0.045);
    let center = Vec3::new(-3.1, 1.75, -1.75);
    stage.put(sheet, material, Affine3A::from_scale_rotation_translation(Vec3::splat(1.75), lean, center))?;
    let sphere = stage.mesh(icosphere(4).into_mesh()?)?;
    for (hex, offset, radius) in
        [(0xd9467c, Vec3::new(-0.35, 0.75, 0.15), 0.78), (0xf4d35e, Vec3::new(0.75, 0.35, 0.1), 0.5)]
    {
        let glass = stage.glass("stuck sphere", hex, 0.42)?;
        stage.put(sphere, glass, scaled(radius, center + lean * offset))?;
    }
    Ok(())
}

/// Three rings linked in a chain, none of which can be opened.
pub(super) fn add_rings(stage: &mut Stage, center: Vec3) -> Result<(), Error> {
    let ring = stage.mesh(torus(0.2, 96, 24).into_mesh()?)?;
    let tilts = [Quat::IDENTITY, rotation(Vec3::X, 0.25), rotation(Vec3::Z, 0.25)];
    for (i, (hex, tilt)) in [0x3cb58a, 0xe4572e, 0x4059c9].into_iter().zip(tilts).enumerate() {
        let material = stage.glass(&format!("ring {i}"), hex, 0.5)?;
        let turn = rotation(Vec3::Y, 0.09) * rotation(Vec3::X, 0.06);
        stage.put(ring, material, turned(0.85, turn * tilt, center))?;
    }
    Ok(())
}

/// Marbles on the floor, some of glass.
pub(super) fn add_marbles(stage: &mut Stage) -> Result<(), Error> {
    let marble = stage.mesh(icosphere(3).into_mesh()?)?;
    let mut random = Random::new(11);
    for i in 0..14 {
        let radius = random.between(0.11, 0.2);
        let x = -2.3 + 4.6 * i as f32 / 13.0 + random.between(-0.12, 0.12);
        let z = 2.75 - 0.12 * x * x + random.between(-0.3, 0.3);
        let hex = GLASS[(i * 3) % GLASS.len()];
        let material = if i % 3 == 0 { stage.solid("marble", hex)? } else { stage.glass("marble", hex, 0.5)? };
        stage.put(marble, material, scaled(radius, Vec3::new(x, radius, z)))?;
    }
    Ok(())
}
