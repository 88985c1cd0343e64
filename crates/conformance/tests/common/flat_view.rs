//! The view in which known answers are known.

use glam::Vec3;
use pellucid::{Camera, Projection, Scene, Shading, View};

/// Sees the square from -1 to 1 in x and y, from z = 10, without light or perspective.
pub(crate) fn flat_view(scene: &Scene, width: u32, height: u32) -> View {
    let mut view = View::of(scene).size(width, height);
    view.shading = Shading::Unlit;
    view.camera = Camera {
        eye: Vec3::Z * 10.0,
        target: Vec3::ZERO,
        up: Vec3::Y,
        projection: Projection::Orthographic { height: 2.0, near: 0.0, far: 20.0 },
    };
    view
}
