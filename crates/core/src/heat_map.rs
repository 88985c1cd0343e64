//! Colours for numbers of fragments.

use glam::Vec4;

use crate::Image;
use crate::color::linear_from_srgb8;

/// The number of fragments at which the scale ends: the one asked for, or, for 0, the greatest of the picture.
pub fn full_scale(asked: u32, greatest: u32) -> u32 {
    if asked > 0 { asked } else { greatest.max(1) }
}

/// The sRGB colour of a number of fragments on a scale that ends at `full_scale`: black for none, then from violet over
/// red to pale yellow (the perceptually even scale "inferno"); numbers beyond the end are white.
pub fn color(count: u32, full_scale: u32) -> [u8; 3] {
    match count {
        0 => [0, 0, 0],
        _ if count > full_scale => [255, 255, 255],
        _ => {
            // Starts inside the scale, so that one fragment is told from none.
            let t = 0.15 + 0.85 * f64::from(count) / f64::from(full_scale);
            let color = colorous::INFERNO.eval_continuous(t.min(1.0));
            [color.r, color.g, color.b]
        }
    }
}

/// Replaces the numbers of fragments in a picture's first channel by their colours.
pub fn colorize(image: &mut Image, full_scale: u32) {
    for pixel in image.pixels_mut() {
        let [r, g, b] = color(pixel.x as u32, full_scale).map(linear_from_srgb8);
        *pixel = Vec4::new(r, g, b, 1.0);
    }
}
