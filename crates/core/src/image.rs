//! Pictures in memory.

use glam::Vec4;

use crate::color::{Srgb8Encoder, unorm8};

/// A picture: rows from top to bottom, linear light, premultiplied alpha.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    pixels: Vec<Vec4>,
}

impl Image {
    /// A picture of one colour: linear light, premultiplied alpha.
    pub fn filled(width: u32, height: u32, color: Vec4) -> Self {
        Self { width, height, pixels: vec![color; width as usize * height as usize] }
    }

    /// A picture of these pixels, row by row from the top.
    ///
    /// # Panics
    /// If there are not exactly as many as the size says.
    pub fn from_pixels(width: u32, height: u32, pixels: Vec<Vec4>) -> Self {
        assert_eq!(pixels.len(), width as usize * height as usize, "pixels of {width} x {height}");
        Self { width, height, pixels }
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row by row from the top.
    pub fn pixels(&self) -> &[Vec4] {
        &self.pixels
    }

    /// All pixels, to be changed.
    pub fn pixels_mut(&mut self) -> &mut [Vec4] {
        &mut self.pixels
    }

    /// The pixel in column `x` from the left and row `y` from the top.
    pub fn pixel(&self, x: u32, y: u32) -> Vec4 {
        self.pixels[y as usize * self.width as usize + x as usize]
    }

    /// 8-bit RGBA as PNG wants it: sRGB-encoded colour, straight alpha, rounded to nearest.
    pub fn to_srgb8(&self) -> Vec<u8> {
        let encoder = Srgb8Encoder::shared();
        let mut bytes = vec![0; self.pixels.len() * 4];
        for (bytes, &pixel) in bytes.as_chunks_mut().0.iter_mut().zip(&self.pixels) {
            *bytes = encoded_pixel(encoder, pixel);
        }
        bytes
    }
}

/// One pixel, linear and premultiplied, as 8-bit sRGB with straight alpha.
pub fn srgb8_pixel(pixel: Vec4) -> [u8; 4] {
    encoded_pixel(Srgb8Encoder::shared(), pixel)
}

fn encoded_pixel(encoder: &Srgb8Encoder, pixel: Vec4) -> [u8; 4] {
    let alpha = pixel.w;
    let straight = if alpha > 0.0 { pixel.truncate() / alpha } else { glam::Vec3::ZERO };
    let [r, g, b] = straight.to_array().map(|channel| encoder.encode(channel));
    [r, g, b, unorm8(alpha)]
}
