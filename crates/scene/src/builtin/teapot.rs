//! Martin Newell's teapot (Utah, 1975), from its Bézier patches.
//!
//! Body and lid are patches of revolution: their control points are a profile times the control points of a quarter
//! circle, (1, 0) (1, 0.56) (0.56, 1) (0, 1). So only the profiles are kept here. (The published points round one value
//! of the knob, 0.448, to 0.45.) Handle and spout are symmetric; only one half of each cross-section is kept.

use glam::{Affine3A, Vec2, Vec3};
use pellucid_core::Scene;

use super::bezier::along;
use super::parameters::{Parameter, Values, integer};
use super::shapes::{Shape, revolve};
use super::stage::Stage;
use crate::LoadError;

pub(super) const PARAMETERS: &[Parameter] =
    &[integer("tessellation", "16", (1, 256), "cells along each side of the 32 patches, of 2 triangles each")];

/// (radius, height) from the middle of the bottom to the lip, four points a patch with one shared.
const BODY: [[f32; 2]; 13] = [
    [0.0, 0.0],
    [1.425, 0.0],
    [1.5, 0.075],
    [1.5, 0.15],
    [1.5, 0.225],
    [2.0, 0.45],
    [2.0, 0.9],
    [2.0, 1.35],
    [1.75, 1.875],
    [1.5, 2.4],
    [1.4375, 2.53125],
    [1.3375, 2.53125],
    [1.4, 2.4],
];

/// (radius, height) from the lid's edge to the top of the knob.
const LID: [[f32; 2]; 7] = [[1.3, 2.4], [1.3, 2.55], [0.4, 2.55], [0.2, 2.7], [0.0, 2.85], [0.8, 3.15], [0.0, 3.15]];

/// Cross-sections: (x, height) on the one side, (x, height) on the other, half the width between.
type Section = [f32; 5];

const HANDLE: [Section; 7] = [
    [-1.6, 2.025, -1.5, 2.25, 0.3],
    [-2.3, 2.025, -2.5, 2.25, 0.3],
    [-2.7, 2.025, -3.0, 2.25, 0.3],
    [-2.7, 1.8, -3.0, 1.8, 0.3],
    [-2.7, 1.575, -3.0, 1.35, 0.3],
    [-2.5, 1.125, -2.65, 0.9375, 0.3],
    [-2.0, 0.9, -1.9, 0.6, 0.3],
];

const SPOUT: [Section; 7] = [
    [1.7, 1.425, 1.7, 0.6, 0.66],
    [2.6, 1.425, 3.1, 0.825, 0.66],
    [2.3, 2.1, 2.4, 2.025, 0.25],
    [2.7, 2.4, 3.3, 2.4, 0.25],
    [2.8, 2.475, 3.525, 2.49375, 0.25],
    [2.9, 2.475, 3.45, 2.5125, 0.15],
    [2.8, 2.4, 3.2, 2.4, 0.15],
];

pub(super) fn make(values: &Values) -> Result<Scene, LoadError> {
    let mut stage = Stage::default();
    let porcelain = stage.solid("porcelain", 0xe8e4da)?;
    for part in parts(values.integer("tessellation")) {
        let mesh = stage.mesh(part.into_smooth_mesh()?)?;
        stage.put(mesh, porcelain, Affine3A::IDENTITY)?;
    }
    Ok(stage.scene)
}

/// Body, lid, handle and spout, standing on y = 0 with the spout towards +x; 3.15 high. To be lit smoothly.
pub(super) fn parts(tessellation: u32) -> [Shape; 4] {
    let ring = ring(tessellation);
    let turned = |profile: &[[f32; 2]]| {
        let profile: Vec<Vec2> = along(profile, tessellation).into_iter().map(Vec2::from).collect();
        revolve(&profile, &ring)
    };
    [turned(&BODY), turned(&LID), swept(&HANDLE, tessellation), swept(&SPOUT, tessellation)]
}

/// The teapot's circle, which is not quite round, as (x, z), counter-clockwise seen from above.
fn ring(tessellation: u32) -> Vec<Vec2> {
    let quarter = [[1.0, 0.0], [1.0, 0.56], [0.56, 1.0], [0.0, 1.0]];
    let quarter = along(&quarter, tessellation);
    let mut ring = Vec::new();
    for axes in [[Vec2::X, Vec2::NEG_Y], [Vec2::NEG_Y, Vec2::NEG_X], [Vec2::NEG_X, Vec2::Y], [Vec2::Y, Vec2::X]] {
        ring.extend(quarter[..tessellation as usize].iter().map(|&[a, b]| axes[0] * a + axes[1] * b));
    }
    ring
}

/// The surface through cross-sections.
fn swept(sections: &[Section], tessellation: u32) -> Shape {
    let mut shape = Shape::default();
    let columns = 2 * tessellation;
    let sections = along(sections, tessellation);
    for &[x0, y0, x1, y1, width] in &sections {
        for side in [-1.0, 1.0] {
            let [from, to] = if side < 0.0 { [[x0, y0], [x1, y1]] } else { [[x1, y1], [x0, y0]] };
            let half = [[from[0], from[1], 0.0], [from[0], from[1], width], [to[0], to[1], width], [to[0], to[1], 0.0]];
            let half = along(&half, tessellation);
            let points = half[..tessellation as usize].iter();
            shape.positions.extend(points.map(|&[x, y, z]| Vec3::new(x, y, -z * side)));
        }
    }
    for row in 0..sections.len() as u32 - 1 {
        for column in 0..columns {
            let at = |row: u32, column: u32| row * columns + column % columns;
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [d, c] = [at(row + 1, column), at(row + 1, column + 1)];
            shape.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    shape
}
