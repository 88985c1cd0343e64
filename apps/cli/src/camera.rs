//! The camera that the options mean, once the scene is known, and its way round a turntable.

use glam::{DQuat, DVec3, Vec3};
use pellucid::core::camera::{DEFAULT_FOV_Y_DEGREES, NEAR_OVER_RADIUS};
use pellucid::core::scene::BoundingSphere;
use pellucid::core::view::direction;
use pellucid::{Camera, Projection, Scene};

use crate::args::Side;

/// What was said about the camera.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct CameraPlan {
    /// The whole scene from a side, whatever camera it brought along.
    pub(crate) side: Option<Side>,
    /// Where the camera is.
    pub(crate) eye: Option<Vec3>,
    /// What it looks at.
    pub(crate) target: Option<Vec3>,
    /// What is up.
    pub(crate) up: Option<Vec3>,
    /// Full vertical angle in radians.
    pub(crate) fov_y: Option<f32>,
    /// Distance of the near plane.
    pub(crate) near: Option<f32>,
}

impl CameraPlan {
    /// Whether anything was said at all.
    pub(crate) fn is_chosen(&self) -> bool {
        *self != Self::default()
    }

    /// The camera for a picture of the given aspect (width over height): the scene's own or one that sees all of it, with
    /// what was said instead. Its target is what a turntable goes round.
    pub(crate) fn camera(&self, scene: &Scene, aspect: f32) -> Camera {
        let sphere = scene.bounding_sphere();
        let own = scene.cameras().first().filter(|_| self.side.is_none());
        let fov_y = self.fov_y.unwrap_or(DEFAULT_FOV_Y_DEGREES.to_radians());
        let fitted = |towards_eye| Camera::fitted(sphere, towards_eye, fov_y, aspect);
        let mut camera = match own {
            Some(&own) => Camera { target: middle_of_sight(&own, sphere), ..own },
            None => fitted(towards_eye(self.side.unwrap_or(Side::Iso))),
        };
        match (self.eye, self.target) {
            (Some(eye), target) => {
                camera.eye = eye;
                camera.target = target.unwrap_or(sphere.center);
                camera.up = fitted(eye - camera.target).up;
            }
            (None, Some(target)) => {
                camera.eye += target - camera.target;
                camera.target = target;
            }
            (None, None) => {}
        }
        camera.up = self.up.unwrap_or(camera.up);
        camera.projection = self.projection(camera.projection, sphere);
        camera
    }

    fn projection(&self, given: Projection, sphere: BoundingSphere) -> Projection {
        match (given, self.fov_y) {
            (Projection::Perspective { fov_y, near }, chosen) => {
                Projection::Perspective { fov_y: chosen.unwrap_or(fov_y), near: self.near.unwrap_or(near) }
            }
            // An angle makes parallel rays diverge; their near plane may even lie behind the eye.
            (Projection::Orthographic { .. }, Some(fov_y)) => {
                Projection::Perspective { fov_y, near: self.near.unwrap_or(sphere.radius * NEAR_OVER_RADIUS) }
            }
            (Projection::Orthographic { height, near, far }, None) => {
                Projection::Orthographic { height, near: self.near.unwrap_or(near), far }
            }
        }
    }
}

/// Seen from the middle of the scene.
fn towards_eye(side: Side) -> Vec3 {
    match side {
        Side::Iso => direction(30.0, 20.0),
        Side::Front => Vec3::Z,
        Side::Back => Vec3::NEG_Z,
        Side::Left => Vec3::NEG_X,
        Side::Right => Vec3::X,
        Side::Top => Vec3::Y,
        Side::Bottom => Vec3::NEG_Y,
    }
}

/// The point in the line of sight that is level with the middle of the scene. Files say where a camera looks to, but not
/// how far away what it looks at is.
fn middle_of_sight(camera: &Camera, sphere: BoundingSphere) -> Vec3 {
    let forward = (camera.target - camera.eye).normalize_or_zero();
    let distance = (sphere.center - camera.eye).dot(forward);
    if distance > 0.0 && distance.is_finite() { camera.eye + forward * distance } else { camera.target }
}

/// The camera at a part of its way (0: the start, 1: round once) round its target, about its up axis, to the right.
///
/// `None` if it is under way and looks along that axis: every picture would be the same.
pub(crate) fn around(camera: &Camera, part: f64) -> Option<Camera> {
    if part == 0.0 {
        return Some(*camera);
    }
    let axis = camera.up.as_dvec3().try_normalize()?;
    let offset: DVec3 = camera.eye.as_dvec3() - camera.target.as_dvec3();
    if offset.cross(axis).length() < 1e-6 * offset.length() {
        return None;
    }
    let turned = DQuat::from_axis_angle(axis, part * std::f64::consts::TAU) * offset;
    Some(Camera { eye: (camera.target.as_dvec3() + turned).as_vec3(), ..*camera })
}

#[cfg(test)]
mod tests {
    use glam::Affine3A;
    use pellucid::{Instance, Material, Mesh};

    use super::*;

    /// A triangle whose bounding sphere is around (1, 2, 3).
    fn scene() -> Scene {
        let positions = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0)];
        let positions = positions.map(|position| position + Vec3::new(1.0, 2.0, 3.0));
        let mut scene = Scene::new();
        let mesh = scene.add_mesh(Mesh::new(positions.to_vec(), vec![[0, 1, 2]]).unwrap()).unwrap();
        let material = scene.add_material(Material::default()).unwrap();
        scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY }).unwrap();
        scene
    }

    fn scene_with_camera() -> (Scene, Camera) {
        let mut scene = scene();
        let own = Camera {
            eye: Vec3::new(1.0, 2.0, 10.0),
            target: Vec3::new(1.0, 2.0, 9.0),
            up: Vec3::X,
            projection: Projection::Perspective { fov_y: 1.0, near: 0.5 },
        };
        scene.add_camera(own);
        (scene, own)
    }

    const CENTER: Vec3 = Vec3::new(1.0, 2.0, 3.0);

    #[test]
    fn nothing_said_is_the_librarys_own_view() {
        let scene = scene();
        let camera = CameraPlan::default().camera(&scene, 1280.0 / 720.0);
        assert_eq!(camera, pellucid::View::of(&scene).camera);
    }

    #[test]
    fn sides_are_where_they_are_called() {
        for (side, axis) in [
            (Side::Front, Vec3::Z),
            (Side::Back, Vec3::NEG_Z),
            (Side::Left, Vec3::NEG_X),
            (Side::Right, Vec3::X),
            (Side::Top, Vec3::Y),
            (Side::Bottom, Vec3::NEG_Y),
        ] {
            let plan = CameraPlan { side: Some(side), ..CameraPlan::default() };
            // The scene's own camera does not matter.
            let camera = plan.camera(&scene_with_camera().0, 1.0);
            assert!((camera.eye - camera.target).normalize().distance(axis) < 1e-6, "{side:?}");
            assert_eq!(camera.target, CENTER);
        }
    }

    #[test]
    fn an_eye_alone_looks_at_the_middle_and_a_target_alone_takes_the_camera_along() {
        let eye = CameraPlan { eye: Some(Vec3::ZERO), ..CameraPlan::default() }.camera(&scene(), 1.0);
        assert_eq!((eye.eye, eye.target, eye.up), (Vec3::ZERO, CENTER, Vec3::Y));
        let from_above = CameraPlan { eye: Some(CENTER + Vec3::Y), ..CameraPlan::default() }.camera(&scene(), 1.0);
        assert_eq!(from_above.up, Vec3::NEG_Z);

        let default = CameraPlan::default().camera(&scene(), 1.0);
        let target = CameraPlan { target: Some(Vec3::ZERO), ..CameraPlan::default() }.camera(&scene(), 1.0);
        assert_eq!(target.target, Vec3::ZERO);
        assert!((target.eye - (default.eye - CENTER)).length() < 1e-5);
    }

    #[test]
    fn the_scenes_own_camera_is_kept_but_for_what_was_said() {
        let (scene, own) = scene_with_camera();
        let camera = CameraPlan::default().camera(&scene, 1.0);
        assert_eq!(camera, Camera { target: CENTER, ..own });
        let plan = CameraPlan { fov_y: Some(0.5), near: Some(0.25), up: Some(Vec3::Z), ..CameraPlan::default() };
        let camera = plan.camera(&scene, 1.0);
        assert_eq!(camera.projection, Projection::Perspective { fov_y: 0.5, near: 0.25 });
        assert_eq!((camera.eye, camera.up), (own.eye, Vec3::Z));
    }

    #[test]
    fn parallel_rays_stay_parallel_unless_an_angle_is_asked_for() {
        let mut scene = scene();
        let projection = Projection::Orthographic { height: 2.0, near: -1.0, far: 9.0 };
        scene.add_camera(Camera { eye: Vec3::Z, target: Vec3::ZERO, up: Vec3::Y, projection });
        assert_eq!(CameraPlan::default().camera(&scene, 1.0).projection, projection);
        let plan = CameraPlan { fov_y: Some(0.5), ..CameraPlan::default() };
        let Projection::Perspective { fov_y, near } = plan.camera(&scene, 1.0).projection else { panic!() };
        assert!(fov_y == 0.5 && near > 0.0);
    }

    #[test]
    fn a_turntable_starts_where_the_camera_is_and_comes_back() {
        let start = CameraPlan { side: Some(Side::Front), ..CameraPlan::default() }.camera(&scene(), 1.0);
        assert_eq!(around(&start, 0.0), Some(start));
        let quarter = around(&start, 0.25).unwrap();
        assert!((quarter.eye - quarter.target).normalize().distance(Vec3::X) < 1e-6);
        assert!(around(&start, 1.0).unwrap().eye.distance(start.eye) < 1e-5);
        assert_eq!(around(&Camera { up: Vec3::Z, ..start }, 0.5), None);
    }
}
