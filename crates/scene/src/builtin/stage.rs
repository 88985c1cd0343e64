//! Puts shapes with materials into a scene.

use glam::{Affine3A, Quat, Vec3};
use pellucid_core::{Camera, Error, Instance, Material, MaterialId, Mesh, MeshId, Projection, Scene};

use super::palette;
use super::random::sin_cos;

/// A scene in the making.
#[derive(Debug, Default)]
pub(super) struct Stage {
    pub(super) scene: Scene,
}

impl Stage {
    /// Adds a mesh that is drawn wherever it is [`put`](Self::put).
    pub(super) fn mesh(&mut self, mesh: Mesh) -> Result<MeshId, Error> {
        self.scene.add_mesh(mesh)
    }

    /// A translucent material of an sRGB colour.
    pub(super) fn glass(&mut self, name: &str, hex: u32, alpha: f32) -> Result<MaterialId, Error> {
        self.scene.add_material(Material::translucent(name, palette::tint(hex, alpha)))
    }

    /// An opaque material of an sRGB colour.
    pub(super) fn solid(&mut self, name: &str, hex: u32) -> Result<MaterialId, Error> {
        self.scene.add_material(Material::opaque(name, palette::linear(hex)))
    }

    /// Places a mesh.
    pub(super) fn put(&mut self, mesh: MeshId, material: MaterialId, place: Affine3A) -> Result<(), Error> {
        self.scene.add_instance(Instance { mesh, material, world_from_mesh: place })
    }
}

/// Moved only.
pub(super) fn at(position: Vec3) -> Affine3A {
    Affine3A::from_translation(position)
}

/// Scaled alike in all directions, then moved.
pub(super) fn scaled(scale: f32, position: Vec3) -> Affine3A {
    Affine3A::from_scale_rotation_translation(Vec3::splat(scale), Quat::IDENTITY, position)
}

/// Scaled alike in all directions, then turned, then moved.
pub(super) fn turned(scale: f32, rotation: Quat, position: Vec3) -> Affine3A {
    Affine3A::from_scale_rotation_translation(Vec3::splat(scale), rotation, position)
}

/// A perspective camera, upright.
pub(super) fn camera(eye: Vec3, target: Vec3, fov_y_degrees: f32) -> Camera {
    let projection = Projection::Perspective { fov_y: fov_y_degrees.to_radians(), near: 0.05 };
    Camera { eye, target, up: Vec3::Y, projection }
}

/// A camera that sees all of a ball, from a little above and to the right, in a picture wider than high.
pub(super) fn framing(center: Vec3, radius: f32) -> Camera {
    let ((sin_a, cos_a), (sin_e, cos_e)) = (sin_cos(1.0 / 12.0), sin_cos(1.0 / 24.0));
    let fov_y_degrees = 30.0;
    let (sin_half_fov, _) = sin_cos(fov_y_degrees / 720.0);
    let towards_eye = Vec3::new(sin_a * cos_e, sin_e, cos_a * cos_e);
    camera(center + towards_eye * (radius / sin_half_fov), center, fov_y_degrees as f32)
}

/// A camera with parallel rays along -z that sees heights from -1 to 1 and depths from `-depth` to `depth`, around the
/// origin.
pub(super) fn flat_camera(depth: f32) -> Camera {
    let distance = depth * 2.0;
    Camera {
        eye: Vec3::new(0.0, 0.0, distance),
        target: Vec3::ZERO,
        up: Vec3::Y,
        projection: Projection::Orthographic { height: 2.0, near: distance - depth, far: distance + depth },
    }
}
