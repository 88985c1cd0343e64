//! How a scene is looked at: camera, picture size, lighting, opacity, background.

use glam::{DMat4, Mat4, Vec3, Vec4};

use crate::camera::DEFAULT_FOV_Y_DEGREES;
use crate::{Camera, Error, Scene};

/// Largest width or height of a picture, in pixels. Beyond it the guard band would leave the range in which the edge
/// functions are exact in 32 bits within a tile.
pub const MAX_SIZE_PX: u32 = 16_384;

/// Length, over the radius of the scene, over which a material shows its stated opacity in the resolves that weigh by
/// thickness, if nobody chose another.
pub const THICKNESS_OVER_RADIUS: f32 = 0.25;

/// Whether surfaces are lit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shading {
    /// Two-sided Lambert head light plus ambient.
    #[default]
    Lit,
    /// Base colour alone.
    Unlit,
}

/// Everything about a picture but the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Width in pixels, 1 to [`MAX_SIZE_PX`].
    pub width: u32,
    /// Height in pixels, 1 to [`MAX_SIZE_PX`].
    pub height: u32,
    /// From where.
    pub camera: Camera,
    /// Whether surfaces are lit.
    pub shading: Shading,
    /// Multiplies every material's alpha, 0 to 1; below 1 opaque and masked materials become transparent.
    pub opacity: f32,
    /// What is behind everything: linear light, premultiplied alpha. Zero for nothing.
    pub background: Vec4,
    /// Length in world units over which a material shows its stated opacity, for `gelly` and corrected `blend`.
    pub thickness_unit: f32,
}

impl View {
    /// A view of `scene` at 1280 x 720 pixels, else as [`View::new`].
    pub fn of(scene: &Scene) -> Self {
        Self::new(scene, 1280, 720)
    }

    /// A view of `scene` with nothing behind: through the scene's own first camera, else fitted to its bounding sphere,
    /// from azimuth 30 and elevation 20 degrees.
    pub fn new(scene: &Scene, width: u32, height: u32) -> Self {
        let sphere = scene.bounding_sphere();
        let camera = scene.cameras().first().copied().unwrap_or_else(|| {
            Camera::fitted(
                sphere,
                direction(30.0, 20.0),
                DEFAULT_FOV_Y_DEGREES.to_radians(),
                width as f32 / height as f32,
            )
        });
        Self {
            width,
            height,
            camera,
            shading: Shading::default(),
            opacity: 1.0,
            background: Vec4::ZERO,
            thickness_unit: sphere.radius * THICKNESS_OVER_RADIUS,
        }
    }

    /// The same view at another size. The camera stays: a picture narrower than high cuts off what a camera fitted to a
    /// wide one saw, where [`View::new`] would step back.
    #[must_use]
    pub fn size(mut self, width: u32, height: u32) -> Self {
        (self.width, self.height) = (width, height);
        self
    }

    /// The same view with every material's alpha multiplied.
    #[must_use]
    pub fn opacity(mut self, opacity: f32) -> Self {
        self.opacity = opacity;
        self
    }

    /// The same view before another background: linear light, premultiplied alpha.
    #[must_use]
    pub fn background(mut self, background: Vec4) -> Self {
        self.background = background;
        self
    }

    /// Width over height.
    pub fn aspect(&self) -> f64 {
        f64::from(self.width) / f64::from(self.height)
    }

    /// Checks every setting.
    ///
    /// # Errors
    /// [`Error::View`] or [`Error::Camera`], naming the first setting out of range.
    pub fn check(&self) -> Result<(), Error> {
        for (what, size) in [("width", self.width), ("height", self.height)] {
            if !(1..=MAX_SIZE_PX).contains(&size) {
                return Err(Error::View(format!("a {what} of {size} pixels; it must lie between 1 and {MAX_SIZE_PX}")));
            }
        }
        if !(0.0..=1.0).contains(&self.opacity) {
            return Err(Error::View(format!("an opacity of {}; it must lie between 0 and 1", self.opacity)));
        }
        if !(self.thickness_unit > 0.0 && self.thickness_unit.is_finite()) {
            return Err(Error::View(format!("a thickness of {}; it must be a positive length", self.thickness_unit)));
        }
        if !self.background.is_finite() {
            return Err(Error::View("a background that is not finite".into()));
        }
        self.camera.clip_from_world(self.aspect()).map(|_| ())
    }

    /// Clip space from world space.
    ///
    /// # Errors
    /// [`Error::Camera`] if the camera looks nowhere.
    pub fn clip_from_world(&self) -> Result<Mat4, Error> {
        self.camera.clip_from_world(self.aspect())
    }

    /// Camera space from world space.
    ///
    /// # Errors
    /// [`Error::Camera`] if the camera looks nowhere.
    pub fn view_from_world(&self) -> Result<DMat4, Error> {
        self.camera.view_from_world()
    }
}

/// The direction, seen from the target, of an eye at `azimuth` degrees (0: from the front, +z; 90: from the right, +x)
/// and `elevation` degrees above the horizon.
pub fn direction(azimuth: f32, elevation: f32) -> Vec3 {
    let (sin_a, cos_a) = azimuth.to_radians().sin_cos();
    let (sin_e, cos_e) = elevation.to_radians().sin_cos();
    Vec3::new(sin_a * cos_e, sin_e, cos_a * cos_e)
}
