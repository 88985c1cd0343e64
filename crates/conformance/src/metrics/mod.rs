//! How far two pictures are apart, as the literature measures it: greatest difference, PSNR, SSIM and FLIP, all of them of
//! 8-bit sRGB pictures, which is what a screen shows.
//!
//! They are written here because no maintained crate of a licence we can take gives the published numbers: `image-compare`
//! 0.5 takes SSIM over 8 x 8 blocks side by side instead of a sliding Gaussian window and does not divide its variances by
//! the number of pixels; `nv-flip` 0.1 binds a C++ library and needs a C++ compiler on every user's machine; `dssim` is
//! under the AGPL. Tests hold these to scikit-image and to FLIP's reference implementation on stored pictures.

pub mod flip;
mod ssim;

use glam::Vec3;
use pellucid::Image;
use pellucid::core::color::{srgb8_from_linear, unorm8};

/// A picture as a screen without anything behind it shows it: 8-bit sRGB, rows from the top, what is transparent before
/// black.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shown {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Shown {
    /// From pixels, row by row from the top.
    ///
    /// # Panics
    /// If there are not width times height of them.
    pub fn new(width: u32, height: u32, pixels: Vec<[u8; 3]>) -> Self {
        let (width, height) = (width as usize, height as usize);
        assert_eq!(pixels.len(), width * height, "pixels of a picture of {width} x {height}");
        Self { width, height, pixels }
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row by row from the top.
    pub fn pixels(&self) -> &[[u8; 3]] {
        &self.pixels
    }

    fn assert_same_size(&self, other: &Self) {
        assert_eq!((self.width, self.height), (other.width, other.height), "pictures of different sizes");
    }
}

impl From<&Image> for Shown {
    fn from(image: &Image) -> Self {
        let shown = |pixel: &glam::Vec4| pixel.truncate().to_array().map(srgb8_from_linear);
        Self::new(image.width(), image.height(), image.pixels().iter().map(shown).collect())
    }
}

/// Greatest difference of each pixel in any channel, alpha included, in steps of an 8-bit picture; row by row from the top.
///
/// # Panics
/// If the sizes differ.
pub fn differences(reference: &Image, image: &Image) -> Vec<u8> {
    assert_eq!((reference.width(), reference.height()), (image.width(), image.height()), "pictures of different sizes");
    let steps = |pixel: &glam::Vec4| {
        let [r, g, b] = pixel.truncate().to_array().map(srgb8_from_linear);
        [r, g, b, unorm8(pixel.w)]
    };
    let greatest = |(a, b)| steps(a).iter().zip(steps(b)).map(|(a, b)| a.abs_diff(b)).max().unwrap_or(0);
    reference.pixels().iter().zip(image.pixels()).map(greatest).collect()
}

/// Peak signal-to-noise ratio in decibels, over all pixels and channels; infinite if the pictures are equal.
///
/// # Panics
/// If the sizes differ.
pub fn psnr(reference: &Shown, image: &Shown) -> f64 {
    reference.assert_same_size(image);
    let channels = reference.pixels.as_flattened().iter().zip(image.pixels.as_flattened());
    let sum: u64 = channels.map(|(&a, &b)| u64::from(a.abs_diff(b)).pow(2)).sum();
    let mean_square = sum as f64 / (3 * reference.pixels.len()) as f64;
    10.0 * (255.0 * 255.0 / mean_square).log10()
}

/// Structural similarity (Wang, Bovik, Sheikh and Simoncelli 2004) as published: a Gaussian window of 11 x 11 pixels and
/// standard deviation 1.5, K1 = 0.01, K2 = 0.03, averaged over all places where the window fits and the three channels.
/// 1 for equal pictures; `None` if the window fits nowhere.
///
/// # Panics
/// If the sizes differ.
pub fn ssim(reference: &Shown, image: &Shown) -> Option<f64> {
    reference.assert_same_size(image);
    ssim::mean(reference, image)
}

/// The mean of [`flip::map`], 0 for equal pictures to 1, at the distance FLIP's authors assume.
///
/// # Panics
/// If the sizes differ.
pub fn flip(reference: &Shown, image: &Shown) -> f64 {
    let map = flip::map(reference, image, flip::PIXELS_PER_DEGREE);
    map.iter().map(|&error| f64::from(error)).sum::<f64>() / map.len() as f64
}

fn vec3(pixel: [u8; 3], channel: impl Fn(u8) -> f32) -> Vec3 {
    Vec3::from(pixel.map(channel))
}
