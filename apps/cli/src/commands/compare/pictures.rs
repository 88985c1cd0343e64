//! Pictures about pictures.

use glam::Vec4;
use pellucid::Image;
use pellucid::core::color::linear_from_srgb8;
use pellucid::core::heat_map;

use super::measure::Measured;
use super::observation::Observation;
use crate::legend;

/// Where pixels differ: black is equal, and the scale ends at the picture's own greatest error, so that small ones show.
pub(super) fn error_map(measured: &Measured) -> Image {
    let full_scale = heat_map::full_scale(0, measured.max_error().into());
    let counts = measured.differences.iter().map(|&difference| difference.into());
    mapped(&measured.image, counts, full_scale, legend::ERROR)
}

/// Depth complexity as a heat map.
pub(super) fn complexity(observation: &Observation, title: &str) -> Image {
    let counts = &observation.depth_complexity;
    let full_scale = heat_map::full_scale(0, counts.iter().max().copied().unwrap_or(0));
    mapped(&observation.unsorted, counts.iter().copied(), full_scale, title)
}

fn mapped(like: &Image, counts: impl Iterator<Item = u32>, full_scale: u32, title: &str) -> Image {
    let mut map = Image::filled(like.width(), like.height(), Vec4::W);
    for (pixel, count) in map.pixels_mut().iter_mut().zip(counts) {
        let [r, g, b] = heat_map::color(count, full_scale).map(linear_from_srgb8);
        *pixel = Vec4::new(r, g, b, 1.0);
    }
    legend::draw(&mut map, title, full_scale, false);
    map
}

/// The left half of one picture beside the right half of another, each with its name.
pub(super) fn split((left, left_name): (&Image, &str), (right, right_name): (&Image, &str)) -> Image {
    let (width, middle) = (right.width(), right.width() / 2);
    let line = (width / 640).max(1);
    let mut split = right.clone();
    for (i, pixel) in split.pixels_mut().iter_mut().enumerate() {
        let x = i as u32 % width;
        if x < middle {
            *pixel = left.pixels()[i];
        }
        if width > 64 && x.abs_diff(middle) < line {
            *pixel = Vec4::ONE;
        }
    }
    legend::label(&mut split, left_name, (0, middle));
    legend::label(&mut split, right_name, (middle, width - middle));
    split
}
