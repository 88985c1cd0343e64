//! The ordered layers of a rectangle of pixels: a layered fragment buffer at rest.
//!
//! Stored linearized, as the LFB chapter (section 20.4) packs it: all fragments in one array, pixel by pixel, and one
//! table of where each pixel's fragments end.

use glam::Vec4;

use crate::Fragment;

/// The nearest opaque surface at a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpaqueSurface {
    /// Linear light; alpha is 1.
    pub color: Vec4,
    /// Reverse-Z depth in 0..=1.
    pub depth: f32,
}

/// Ordered transparent fragments, and the opaque surface behind them, for a rectangle of pixels.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Layers {
    /// Column of the leftmost pixel in the picture.
    pub left: u32,
    /// Row of the topmost pixel in the picture.
    pub top: u32,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// For each pixel, row by row, the number of fragments up to and including its own.
    pub ends: Vec<u32>,
    /// All fragments; those of a pixel side by side, nearest first.
    pub fragments: Vec<Fragment>,
    /// For each pixel, the nearest opaque surface. Fragments behind it are not captured.
    pub opaque: Vec<Option<OpaqueSurface>>,
}

impl Layers {
    /// The fragments of the pixel `x` columns from the left and `y` rows from the top of the rectangle, nearest first.
    pub fn pixel(&self, x: u32, y: u32) -> &[Fragment] {
        let index = self.index(x, y);
        let start = if index == 0 { 0 } else { self.ends[index - 1] as usize };
        &self.fragments[start..self.ends[index] as usize]
    }

    /// The nearest opaque surface of that pixel.
    pub fn opaque(&self, x: u32, y: u32) -> Option<OpaqueSurface> {
        self.opaque[self.index(x, y)]
    }

    /// Number of fragments of that pixel.
    pub fn depth_complexity(&self, x: u32, y: u32) -> u32 {
        self.pixel(x, y).len() as u32
    }

    fn index(&self, x: u32, y: u32) -> usize {
        assert!(x < self.width && y < self.height, "pixel {x}, {y} of {} x {}", self.width, self.height);
        y as usize * self.width as usize + x as usize
    }
}
