//! What the figures of the F-Buffer paper show (Houston, Preetham and Segal 2005): two translucent triangles, one in all
//! colours, and a sphere of thin glass.

use glam::{Affine3A, Vec2, Vec3, Vec4};
use pellucid_core::{Material, Scene};

use super::palette::{linear, tint};
use super::parameters::{MAX_STORED_TRIANGLES, Parameter, Values, check_triangles, choice, integer, number};
use super::random::sin_cos;
use super::shapes::Shape;
use super::stage::{Stage, camera, flat_camera};
use crate::LoadError;

pub(super) const PARAMETERS: &[Parameter] = &[
    choice(
        "figure",
        "triangles",
        &["triangles", "rainbow", "sphere"],
        "a cyan triangle behind a yellow one (figure 1), one in all colours (figure 2), a glass sphere (figures 3 and 4)",
    ),
    integer("sides", "64", (4, 2048), "how round the sphere: 3 x sides^2 vertices are drawn; figure 4 has 64 and 256"),
    number("fill", "0.941", (0.01, 1.0), "how much of the picture's height the sphere takes: figure 4 has about 0.636"),
];

pub(super) fn make(values: &Values) -> Result<Scene, LoadError> {
    match values.choice("figure") {
        "rainbow" => rainbow(),
        "sphere" => sphere(values.integer("sides"), values.number("fill")),
        _ => triangles(),
    }
}

/// The farther one is drawn first: blending in draw order is right, and what is wrong in figure 1 is the passes' doing.
fn triangles() -> Result<Scene, LoadError> {
    let mut stage = Stage::default();
    let shape =
        |positions: [Vec3; 3]| Shape { positions: positions.to_vec(), triangles: vec![[0, 1, 2]], ..Shape::default() };
    let cyan = [Vec3::new(-0.8, -0.75, -0.2), Vec3::new(0.45, -0.75, -0.2), Vec3::new(-0.18, 0.5, -0.2)];
    let yellow = [Vec3::new(-0.4, -0.45, 0.2), Vec3::new(0.8, -0.45, 0.2), Vec3::new(0.2, 0.8, 0.2)];
    for (name, corners, color) in [("cyan", cyan, 0x00ffff), ("yellow", yellow, 0xffff00)] {
        let mesh = stage.mesh(shape(corners).into_mesh()?)?;
        let base_color = linear(color).extend(0.5);
        let material = stage.scene.add_material(Material { unlit: true, ..Material::translucent(name, base_color) })?;
        stage.put(mesh, material, Affine3A::IDENTITY)?;
    }
    stage.scene.add_camera(flat_camera(1.0));
    Ok(stage.scene)
}

/// About 32,000 fragments at 512 x 512: they overflow a buffer of 128 x 128, and fit one of 256 x 256.
fn rainbow() -> Result<Scene, LoadError> {
    let mut stage = Stage::default();
    let corners = [Vec3::new(-0.5, -0.5, 0.0), Vec3::new(0.5, -0.5, 0.0), Vec3::new(0.0, 0.48, 0.0)];
    let colors = [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 1.0, 1.0), Vec4::new(0.0, 1.0, 0.0, 1.0)];
    let shape =
        Shape { positions: corners.to_vec(), colors: colors.to_vec(), triangles: vec![[0, 1, 2]], ..Shape::default() };
    let mesh = stage.mesh(shape.into_mesh()?)?;
    let white = Vec4::ONE;
    let material = stage.scene.add_material(Material { unlit: true, ..Material::translucent("rainbow", white) })?;
    stage.put(mesh, material, Affine3A::IDENTITY)?;
    stage.scene.add_camera(flat_camera(1.0));
    Ok(stage.scene)
}

/// A net of meridians and parallels about the line of sight, twice as many meridians, from the far pole to the near one: so
/// the camera sees it drawn back to front. At the poles, half of a cell's triangles are degenerate.
fn sphere(sides: u32, fill: f32) -> Result<Scene, LoadError> {
    check_triangles("fbuffer", MAX_STORED_TRIANGLES, &[u64::from(sides), u64::from(sides)])?;
    let rows = sides / 2;
    let mut shape = Shape::default();
    for row in 0..=rows {
        let (sin_down, cos_down) = sin_cos(f64::from(row) / f64::from(rows) * 0.5);
        for column in 0..=sides {
            let (sin, cos) = sin_cos(f64::from(column % sides) / f64::from(sides));
            // Exactly one point at each pole.
            let radius = if row == 0 || row == rows { 0.0 } else { sin_down };
            let position = Vec3::new(cos * radius, sin * radius, -cos_down);
            shape.normals.push(position.normalize());
            shape.positions.push(position);
            shape.tex_coords.push(Vec2::new(column as f32 / sides as f32, row as f32 / rows as f32));
        }
    }
    let at = |column, row| row * (sides + 1) + column;
    for row in 0..rows {
        for column in 0..sides {
            let [a, b, c, d] = [at(column, row), at(column + 1, row), at(column + 1, row + 1), at(column, row + 1)];
            shape.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let mut stage = Stage::default();
    let mesh = stage.mesh(shape.into_mesh()?)?;
    let base_color = tint(0xbfe3e0, 0.35);
    let material =
        stage.scene.add_material(Material { double_sided: true, ..Material::translucent("glass", base_color) })?;
    stage.put(mesh, material, Affine3A::IDENTITY)?;
    // Its outline is seen under an angle whose tangent is that share of half the picture's.
    let fov_y_degrees = 30.0;
    let (sin, cos) = sin_cos(f64::from(fov_y_degrees) / 720.0);
    let tangent = fill * sin / cos;
    let distance = (1.0 + 1.0 / (tangent * tangent)).sqrt();
    stage.scene.add_camera(camera(Vec3::Z * distance, Vec3::ZERO, fov_y_degrees));
    Ok(stage.scene)
}
