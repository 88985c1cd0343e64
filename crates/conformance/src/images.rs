//! Pictures against the oracle's.

use glam::Vec4;
use pellucid::Image;
use pellucid::core::color::srgb_from_linear;

/// Greatest difference of an agreeing pixel in any channel, as shown: sRGB-encoded, premultiplied. One code value of an
/// 8-bit picture: what rounding of a stored colour to half precision and another order of additions may cost.
pub const TOLERANCE: f32 = 1.0 / 255.0;

/// Greatest share of the covered pixels that may be both ambiguous and different, so that a dense scene, where much is
/// ambiguous, hides nothing.
pub const AMBIGUOUS_SHARE: f64 = 1e-3;

/// How a picture compares with the oracle's.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Comparison {
    /// Pixels within [`TOLERANCE`].
    pub agreeing: u64,
    /// Pixels that differ where the oracle allows it.
    pub ambiguous: u64,
    /// Pixels that differ without an excuse.
    pub unexplained: u64,
    /// The pixel that differs most, and by how much.
    pub worst: Option<(u32, u32, f32)>,
    /// Pixels of the oracle's picture that are not background.
    pub covered: u64,
}

impl Comparison {
    /// Whether the contract holds.
    pub fn passes(&self) -> bool {
        self.unexplained == 0 && self.ambiguous as f64 <= (AMBIGUOUS_SHARE * self.covered as f64).max(1.0)
    }

    /// Counts a pixel that differs by so much.
    pub(crate) fn count(&mut self, x: u32, y: u32, difference: f32, covered: bool, ambiguous: bool) {
        self.covered += u64::from(covered);
        if difference > self.worst.map_or(0.0, |(_, _, worst)| worst) {
            self.worst = Some((x, y, difference));
        }
        *if difference <= TOLERANCE {
            &mut self.agreeing
        } else if ambiguous {
            &mut self.ambiguous
        } else {
            &mut self.unexplained
        } += 1;
    }
}

/// Compares `image` with the oracle's `expected`, of the same size; `ambiguous` and `covered` say so of each pixel.
///
/// # Panics
/// If the sizes differ.
pub fn compare(expected: &Image, ambiguous: &[bool], covered: impl Fn(u32, u32) -> bool, image: &Image) -> Comparison {
    assert_eq!((expected.width(), expected.height()), (image.width(), image.height()), "pictures of different sizes");
    let mut comparison = Comparison::default();
    for (i, (&want, &have)) in expected.pixels().iter().zip(image.pixels()).enumerate() {
        let (x, y) = (i as u32 % expected.width(), i as u32 / expected.width());
        comparison.count(x, y, difference(want, have), covered(x, y), ambiguous[i]);
    }
    comparison
}

/// Greatest difference of two pixels in any channel, as shown; infinite if either is not a number.
pub fn difference(a: Vec4, b: Vec4) -> f32 {
    if a.is_nan() || b.is_nan() {
        return f32::INFINITY;
    }
    let shown = |pixel: Vec4| {
        let [r, g, b] = pixel.truncate().to_array().map(|channel| srgb_from_linear(channel.clamp(0.0, 1.0)));
        Vec4::new(r, g, b, pixel.w)
    };
    (shown(a) - shown(b)).abs().max_element()
}
