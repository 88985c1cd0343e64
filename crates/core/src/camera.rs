//! From where a scene is seen, and the matrices that follow.
//!
//! Depth is reverse-Z: 1 at the near plane, falling towards 0 far away. A perspective camera has no far plane; its
//! clip-space z is the constant `near`, so depth is `near / distance`.

use glam::{DMat4, DVec3, DVec4, Mat4, Vec3};

use crate::Error;
use crate::scene::BoundingSphere;

/// How a camera flattens space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Things shrink with distance.
    Perspective {
        /// Full vertical angle in radians, above 0 and below pi.
        fov_y: f32,
        /// Distance of the near plane in world units.
        near: f32,
    },
    /// Parallel rays.
    Orthographic {
        /// Height of the visible slab in world units.
        height: f32,
        /// Distance of the near plane in world units; may be negative.
        near: f32,
        /// Distance of the far plane in world units; beyond `near`.
        far: f32,
    },
}

/// A position, a direction and a projection. Right-handed, y up in camera space, looking along -z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Where the camera is, in world space.
    pub eye: Vec3,
    /// What it looks at, in world space.
    pub target: Vec3,
    /// What is up; need not be perpendicular to the line of sight.
    pub up: Vec3,
    /// How it flattens space.
    pub projection: Projection,
}

/// Full vertical angle, in degrees, of a camera that nobody chose.
pub const DEFAULT_FOV_Y_DEGREES: f32 = 30.0;

/// Distance of the default near plane over the radius of the scene: near enough to fly inside, and free, as reverse-Z
/// keeps its precision at any ratio.
pub const NEAR_OVER_RADIUS: f32 = 1e-3;

impl Camera {
    /// A perspective camera that sees all of `sphere`, from the direction `towards_eye` (seen from the centre), in a
    /// picture of the given `aspect` (width over height).
    pub fn fitted(sphere: BoundingSphere, towards_eye: Vec3, fov_y: f32, aspect: f32) -> Self {
        let half_y = fov_y * 0.5;
        let half_x = (half_y.tan() * aspect).atan();
        let distance = sphere.radius / half_y.min(half_x).sin();
        let direction = towards_eye.normalize_or(Vec3::Z);
        // Straight from above or below, "up" on the picture is away from the viewer's front.
        let up = if direction.y.abs() > 0.999 { Vec3::new(0.0, 0.0, -direction.y.signum()) } else { Vec3::Y };
        Self {
            eye: sphere.center + direction * distance,
            target: sphere.center,
            up,
            projection: Projection::Perspective { fov_y, near: sphere.radius * NEAR_OVER_RADIUS },
        }
    }

    /// Camera space from world space.
    ///
    /// # Errors
    /// [`Error::Camera`] if the position is not finite, or eye and target coincide.
    pub fn view_from_world(&self) -> Result<DMat4, Error> {
        let (eye, target, up) = (self.eye.as_dvec3(), self.target.as_dvec3(), self.up.as_dvec3());
        if !(eye.is_finite() && target.is_finite() && up.is_finite()) {
            return Err(Error::Camera("eye, target and up must be finite numbers".into()));
        }
        let Some(forward) = (target - eye).try_normalize() else {
            return Err(Error::Camera(format!("eye and target are the same point, {}", self.eye)));
        };
        // Looking along `up` leaves the roll open; any choice is as good, and a fixed one is repeatable.
        let right = forward
            .cross(up)
            .try_normalize()
            .filter(|_| forward.cross(up.normalize_or_zero()).length() > 1e-9)
            .unwrap_or_else(|| {
                let other = if forward.x.abs() < 0.5 { DVec3::X } else { DVec3::Z };
                forward.cross(other).normalize()
            });
        let true_up = right.cross(forward);
        Ok(DMat4::from_cols(
            DVec4::new(right.x, true_up.x, -forward.x, 0.0),
            DVec4::new(right.y, true_up.y, -forward.y, 0.0),
            DVec4::new(right.z, true_up.z, -forward.z, 0.0),
            DVec4::new(-right.dot(eye), -true_up.dot(eye), forward.dot(eye), 1.0),
        ))
    }

    /// Clip space from camera space, reverse-Z, for a picture of the given `aspect` (width over height).
    ///
    /// # Errors
    /// [`Error::Camera`] if an angle, distance or height is out of range.
    pub fn clip_from_view(&self, aspect: f64) -> Result<DMat4, Error> {
        match self.projection {
            Projection::Perspective { fov_y, near } => {
                if !(fov_y > 0.0 && fov_y < std::f32::consts::PI) {
                    let degrees = fov_y.to_degrees();
                    return Err(Error::Camera(format!(
                        "a field of view of {degrees} degrees; it must lie between 0 and 180"
                    )));
                }
                if !(near > 0.0 && near.is_finite()) {
                    return Err(Error::Camera(format!("a near plane at {near}; it must be a positive distance")));
                }
                let y = 1.0 / (f64::from(fov_y) * 0.5).tan();
                Ok(DMat4::from_cols(
                    DVec4::new(y / aspect, 0.0, 0.0, 0.0),
                    DVec4::new(0.0, y, 0.0, 0.0),
                    DVec4::new(0.0, 0.0, 0.0, -1.0),
                    DVec4::new(0.0, 0.0, f64::from(near), 0.0),
                ))
            }
            Projection::Orthographic { height, near, far } => {
                if !(height > 0.0 && height.is_finite()) {
                    return Err(Error::Camera(format!("a view {height} high; it must be a positive number")));
                }
                if !(near < far && near.is_finite() && far.is_finite()) {
                    return Err(Error::Camera(format!(
                        "near plane at {near} and far plane at {far}; near must be less"
                    )));
                }
                let (height, near, far) = (f64::from(height), f64::from(near), f64::from(far));
                let y = 2.0 / height;
                let z = 1.0 / (far - near);
                Ok(DMat4::from_cols(
                    DVec4::new(y / aspect, 0.0, 0.0, 0.0),
                    DVec4::new(0.0, y, 0.0, 0.0),
                    DVec4::new(0.0, 0.0, z, 0.0),
                    DVec4::new(0.0, 0.0, far * z, 1.0),
                ))
            }
        }
    }

    /// Clip space from world space, for a picture of the given `aspect`.
    ///
    /// # Errors
    /// As [`Self::view_from_world`] and [`Self::clip_from_view`].
    pub fn clip_from_world(&self, aspect: f64) -> Result<Mat4, Error> {
        Ok((self.clip_from_view(aspect)? * self.view_from_world()?).as_mat4())
    }

    /// Distance along the line of sight, in world units, of a reverse-Z depth in 0..=1 (infinite for depth 0 of a
    /// perspective camera).
    pub fn distance_from_depth(&self, depth: f32) -> f32 {
        match self.projection {
            Projection::Perspective { near, .. } => near / depth,
            Projection::Orthographic { near, far, .. } => far + (near - far) * depth,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(projection: Projection) -> Camera {
        Camera { eye: Vec3::new(1.0, 2.0, 10.0), target: Vec3::new(1.0, 2.0, 0.0), up: Vec3::Y, projection }
    }

    #[test]
    fn depth_is_1_at_the_near_plane_and_falls_with_distance() {
        for projection in [
            Projection::Perspective { fov_y: 1.0, near: 0.5 },
            Projection::Orthographic { height: 3.0, near: 0.5, far: 100.0 },
        ] {
            let camera = camera(projection);
            let clip_from_world = camera.clip_from_world(1.5).unwrap();
            let depth_at = |distance: f32| {
                let clip = clip_from_world * (camera.eye - Vec3::Z * distance).extend(1.0);
                clip.z / clip.w
            };
            assert!((depth_at(0.5) - 1.0).abs() < 1e-6);
            assert!(depth_at(2.0) < depth_at(1.0));
            for distance in [0.6, 3.0, 50.0] {
                let recovered = camera.distance_from_depth(depth_at(distance));
                assert!((recovered / distance - 1.0).abs() < 1e-4, "{distance} came back as {recovered}");
            }
        }
    }

    #[test]
    fn looking_along_up_still_gives_a_view() {
        let mut camera = camera(Projection::Perspective { fov_y: 1.0, near: 0.1 });
        camera.up = Vec3::Z;
        let view_from_world = camera.view_from_world().unwrap();
        assert!((view_from_world.determinant() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_camera_that_looks_nowhere_is_refused() {
        let mut bad = camera(Projection::Perspective { fov_y: 0.0, near: 0.1 });
        assert!(bad.clip_from_world(1.0).is_err());
        bad = camera(Projection::Perspective { fov_y: 1.0, near: f32::NAN });
        assert!(bad.clip_from_world(1.0).is_err());
        bad.target = bad.eye;
        assert!(bad.view_from_world().is_err());
    }
}
