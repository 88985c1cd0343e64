//! Where the last pass draws to: depth test, alpha test and blending.

use glam::Vec4;
use pellucid_core::Image;
use pellucid_core::fbuffer::{Output, RasterOrder};

use super::Fragment;

/// A picture with a depth for each of its pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Linear light, premultiplied alpha.
    pub color: Image,
    /// Reverse-Z, row by row; 0 is infinitely far.
    pub depth: Vec<f32>,
}

impl Target {
    /// A target of one colour, infinitely deep.
    pub fn new(width: u32, height: u32, color: Vec4) -> Self {
        Self { color: Image::filled(width, height, color), depth: vec![0.0; width as usize * height as usize] }
    }

    pub(super) fn check(&self, order: &RasterOrder<'_>) {
        let viewport = &order.geometry().viewport;
        let size = (self.color.width(), self.color.height());
        assert_eq!(size, (viewport.width, viewport.height), "a target of another size than the picture");
    }

    pub(super) fn write(&mut self, fragment: &Fragment<'_>, color: Vec4, output: Output) {
        let pixel = (fragment.y * self.color.width() + fragment.x) as usize;
        let is_behind = output.depth_test && fragment.depth < self.depth[pixel];
        if is_behind || output.alpha_test.is_some_and(|least| color.w < least) {
            return;
        }
        if output.depth_write {
            self.depth[pixel] = fragment.depth;
        }
        let under = if output.blend { self.color.pixels()[pixel] * (1.0 - color.w) } else { Vec4::ZERO };
        self.color.pixels_mut()[pixel] = color + under;
    }
}
