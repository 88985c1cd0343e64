//! FLIP for pictures of low dynamic range (Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A
//! Difference Evaluator for Alternating Images", 2020): what a person sees who flips between two pictures in one place.
//!
//! Two differences are found for each pixel, one of colour (section 4.1: filtered by what the eye resolves, measured in a
//! uniform colour space) and one of edges and points (section 4.2), and the second sharpens the first (section 4.3). All
//! filters are products of one-dimensional ones, and run over four planes at once.

use std::f64::consts::PI;

use glam::{DMat3, Mat3, Vec3, Vec4};
use pellucid::core::color::linear_from_srgb8;

use super::{Shown, vec3};

/// Pixels in a degree of the field of view of the authors' observer: 0.7 m before a screen 0.7 m wide, with 3840 pixels.
pub const PIXELS_PER_DEGREE: f64 = 0.7 * 3840.0 / 0.7 * PI / 180.0;

/// Exponent of the colour difference.
const QC: f32 = 0.7;
/// Where, over the greatest colour difference, the upper part of the scale begins, and what it is mapped to.
const PC: f32 = 0.4;
const PT: f32 = 0.95;
/// Exponent of the feature difference.
const QF: f32 = 0.5;
/// Width of the edges that the eye is most sensitive to, in degrees.
const FEATURE_WIDTH: f64 = 0.082;

/// Contrast sensitivity in space: sums of Gaussians, each `a * sqrt(pi / b) * exp(-pi^2 x^2 / b)` with x in degrees.
const LIGHTNESS: (f64, f64) = (1.0, 0.0047);
const RED_GREEN: (f64, f64) = (1.0, 0.0053);
const BLUE_YELLOW: [(f64, f64); 2] = [(34.1, 0.04), (13.5, 0.025)];

/// The error of each pixel, 0 to 1, row by row from the top.
///
/// # Panics
/// If the sizes differ.
pub fn map(reference: &Shown, image: &Shown, pixels_per_degree: f64) -> Vec<f32> {
    reference.assert_same_size(image);
    let space = ColorSpace::new();
    let [a, b] = [reference, image].map(|picture| Perceived::new(picture, &space, pixels_per_degree));
    let greatest = space.difference(space.lab(Vec3::Y), space.lab(Vec3::Z));
    let errors = (0..reference.pixels().len()).map(|i| {
        let color = redistributed(space.difference(a.colors[i], b.colors[i]), greatest);
        let feature = feature_difference(a.features[i], b.features[i]);
        color.powf(1.0 - feature)
    });
    errors.collect()
}

/// A picture as the eye takes it in.
struct Perceived {
    /// After the contrast sensitivity filter: L*a*b* with Hunt's adjustment.
    colors: Vec<Vec3>,
    /// Length of the gradient of lightness, and of its second derivatives.
    features: Vec<[f32; 2]>,
}

impl Perceived {
    fn new(picture: &Shown, space: &ColorSpace, pixels_per_degree: f64) -> Self {
        let opponent: Vec<Vec3> =
            picture.pixels().iter().map(|&pixel| space.opponent(vec3(pixel, linear_from_srgb8))).collect();
        let size = (picture.width(), picture.height());

        let (taps, blue_yellow) = sensitivity(pixels_per_degree);
        let planes: Vec<Vec4> = opponent.iter().map(|color| color.extend(color.z)).collect();
        let filtered = convolved(planes, size, &taps, &taps);
        let seen = |color: Vec4| {
            let [first, second] = blue_yellow;
            space.lab(space.linear(Vec3::new(color.x, color.y, color.z * first + color.w * second)))
        };
        let colors = filtered.into_iter().map(seen).collect();

        let (along, across) = derivatives(pixels_per_degree);
        let lightness = opponent.iter().map(|color| Vec4::splat((color.x + 16.0) / 116.0)).collect();
        let features = convolved(lightness, size, &along, &across).into_iter();
        let features = features.map(|d| [d.x.hypot(d.y), d.z.hypot(d.w)]).collect();
        Self { colors, features }
    }
}

/// Taps of the contrast sensitivity filter for lightness, red-green and the two parts of blue-yellow, with the shares of
/// these two.
fn sensitivity(pixels_per_degree: f64) -> (Vec<Vec4>, [f32; 2]) {
    let gaussians = [LIGHTNESS, RED_GREEN, BLUE_YELLOW[0], BLUE_YELLOW[1]];
    let widest = gaussians.iter().map(|&(_, b)| b).fold(0.0, f64::max);
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
    let weight = |b: f64, x: i32| (-PI * PI * (f64::from(x) / pixels_per_degree).powi(2) / b).exp();
    let sums = gaussians.map(|(_, b)| (-radius..=radius).map(|x| weight(b, x)).sum::<f64>());
    let tap = |x| Vec4::from(std::array::from_fn(|i| (weight(gaussians[i].1, x) / sums[i]) as f32));
    let volumes = [2, 3].map(|i| gaussians[i].0 * (PI / gaussians[i].1).sqrt() * sums[i] * sums[i]);
    let shares = volumes.map(|volume| (volume / (volumes[0] + volumes[1])) as f32);
    ((-radius..=radius).map(tap).collect(), shares)
}

/// Taps of the feature detectors along rows and along columns: first derivative by x and y, second derivative by x and y.
/// Each is scaled so that its positive taps sum to 1 and its negative ones to -1.
fn derivatives(pixels_per_degree: f64) -> (Vec<Vec4>, Vec<Vec4>) {
    let sigma = 0.5 * FEATURE_WIDTH * pixels_per_degree;
    let radius = (3.0 * sigma).ceil() as i32;
    let normalised = |weight: &dyn Fn(f64) -> f64| -> Vec<f32> {
        let weights: Vec<f64> = (-radius..=radius).map(|x| weight(f64::from(x))).collect();
        let positive: f64 = weights.iter().filter(|&&w| w > 0.0).sum();
        let negative: f64 = -weights.iter().filter(|&&w| w < 0.0).sum::<f64>();
        weights
            .into_iter()
            .map(|w| if w > 0.0 { w / positive } else { w / negative.max(f64::MIN_POSITIVE) } as f32)
            .collect()
    };
    let gaussian = |x: f64| (-x * x / (2.0 * sigma * sigma)).exp();
    let smooth = normalised(&gaussian);
    let first = normalised(&|x| -x * gaussian(x));
    let second = normalised(&|x| (x * x / (sigma * sigma) - 1.0) * gaussian(x));
    let taps = |order: [&[f32]; 4]| (0..smooth.len()).map(|i| Vec4::from(order.map(|taps| taps[i]))).collect();
    (taps([&first, &smooth, &second, &smooth]), taps([&smooth, &first, &smooth, &second]))
}

/// Four planes filtered along rows, then along columns; beyond its border a picture goes on as at the border.
fn convolved(planes: Vec<Vec4>, (width, height): (usize, usize), along: &[Vec4], across: &[Vec4]) -> Vec<Vec4> {
    let radius = along.len() / 2;
    let mut rows = Vec::with_capacity(planes.len());
    for row in planes.chunks_exact(width) {
        let at = |x: usize| row[x.saturating_sub(radius).min(width - 1)];
        rows.extend((0..width).map(|x| (0..along.len()).map(|i| along[i] * at(x + i)).sum::<Vec4>()));
    }
    let radius = across.len() / 2;
    let mut filtered = vec![Vec4::ZERO; rows.len()];
    for (y, target) in filtered.chunks_exact_mut(width).enumerate() {
        for (i, &tap) in across.iter().enumerate() {
            let row = (y + i).saturating_sub(radius).min(height - 1) * width;
            for (target, &source) in target.iter_mut().zip(&rows[row..row + width]) {
                *target += tap * source;
            }
        }
    }
    filtered
}

/// Gives the differences that matter most of the scale.
fn redistributed(difference: f32, greatest: f32) -> f32 {
    let knee = PC * greatest;
    if difference < knee { difference * PT / knee } else { PT + (difference - knee) / (greatest - knee) * (1.0 - PT) }
}

fn feature_difference(a: [f32; 2], b: [f32; 2]) -> f32 {
    let greatest = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    (greatest * std::f32::consts::FRAC_1_SQRT_2).powf(QF)
}

/// Linear sRGB, the opponent space YCxCz, and L*a*b*, all relative to the white of sRGB.
struct ColorSpace {
    relative_xyz_from_linear: Mat3,
    linear_from_relative_xyz: Mat3,
}

impl ColorSpace {
    fn new() -> Self {
        // Chromaticities of sRGB's primaries and of D65 (IEC 61966-2-1).
        let xyz = |x: f64, y: f64| glam::DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
        let primaries = DMat3::from_cols(xyz(0.64, 0.33), xyz(0.30, 0.60), xyz(0.15, 0.06));
        let white = xyz(0.3127, 0.3290);
        let xyz_from_linear = primaries * DMat3::from_diagonal(primaries.inverse() * white);
        let relative = DMat3::from_diagonal(white.recip()) * xyz_from_linear;
        Self { relative_xyz_from_linear: relative.as_mat3(), linear_from_relative_xyz: relative.inverse().as_mat3() }
    }

    fn opponent(&self, linear: Vec3) -> Vec3 {
        let xyz = self.relative_xyz_from_linear * linear;
        Vec3::new(116.0 * xyz.y - 16.0, 500.0 * (xyz.x - xyz.y), 200.0 * (xyz.y - xyz.z))
    }

    /// The inverse of [`Self::opponent`], clamped to what a screen can show.
    fn linear(&self, opponent: Vec3) -> Vec3 {
        let y = (opponent.x + 16.0) / 116.0;
        let xyz = Vec3::new(y + opponent.y / 500.0, y, y - opponent.z / 200.0);
        (self.linear_from_relative_xyz * xyz).clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// L*a*b* with Hunt's adjustment: colour counts for less where it is dark.
    fn lab(&self, linear: Vec3) -> Vec3 {
        const DELTA: f32 = 6.0 / 29.0;
        let root = |t: f32| {
            if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
        };
        let [x, y, z] = (self.relative_xyz_from_linear * linear).to_array().map(root);
        let lightness = 116.0 * y - 16.0;
        Vec3::new(lightness, 500.0 * (x - y) * 0.01 * lightness, 200.0 * (y - z) * 0.01 * lightness)
    }

    /// The distance HyAB, compressed.
    fn difference(&self, a: Vec3, b: Vec3) -> f32 {
        let d = a - b;
        (d.x.abs() + d.y.hypot(d.z)).powf(QC)
    }
}
