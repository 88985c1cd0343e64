//! Captures against the oracle's, fragment by fragment.

use std::sync::Mutex;

use glam::Vec4;
use pellucid::core::oracle::AMBIGUOUS_DEPTH;
use pellucid::{Error, Layers, Renderer, Scene, View};

use crate::images::{Comparison, difference};

/// The layers of a whole view, put together from the rectangles a renderer hands out.
///
/// # Errors
/// As [`Renderer::layers`].
///
/// # Panics
/// If the rectangles overlap or leave a gap.
pub fn gather(renderer: &Renderer, scene: &Scene, view: &View) -> Result<Layers, Error> {
    let pixel_count = view.width as usize * view.height as usize;
    let pixels = Mutex::new(vec![None; pixel_count]);
    renderer.layers(scene, view, |tile| {
        let mut pixels = pixels.lock().expect("no visitor panics");
        for y in 0..tile.height {
            for x in 0..tile.width {
                let place = &mut pixels[((tile.top + y) * view.width + tile.left + x) as usize];
                assert!(place.is_none(), "two rectangles hold one pixel");
                *place = Some((tile.pixel(x, y).to_vec(), tile.opaque(x, y)));
            }
        }
    })?;
    let mut layers = Layers { width: view.width, height: view.height, ..Layers::default() };
    for pixel in pixels.into_inner().expect("no visitor panicked") {
        let (fragments, opaque) = pixel.expect("every pixel is in a rectangle");
        layers.fragments.extend(fragments);
        layers.ends.push(layers.fragments.len() as u32);
        layers.opaque.push(opaque);
    }
    Ok(layers)
}

/// The first pixel at which two captures of one view differ by a bit, and how; `None` if they are the same.
pub fn first_difference(expected: &Layers, layers: &Layers) -> Option<String> {
    for y in 0..expected.height {
        for x in 0..expected.width {
            let (want, have) = (expected.pixel(x, y), layers.pixel(x, y));
            if want != have {
                return Some(format!("at pixel {x}, {y} expected\n{want:#?}\nand got\n{have:#?}"));
            }
            let (want, have) = (expected.opaque(x, y), layers.opaque(x, y));
            if want != have {
                return Some(format!("at pixel {x}, {y} expected the opaque surface {want:?} and got {have:?}"));
            }
        }
    }
    None
}

/// Greatest difference of the depths of one fragment, relative to the greater. Hardware rounds depth to f32 about three
/// times, at values up to the nearest corner's: sixteen times [`AMBIGUOUS_DEPTH`] allows corners two hundred times as near
/// as the fragment, as cameras inside geometry see them. Order is held apart from it, and more strictly.
pub const DEPTH_TOLERANCE: f32 = 16.0 * AMBIGUOUS_DEPTH;

/// Compares a capture with the oracle's `expected` pixel by pixel. A pixel agrees if it has the same primitives in the same
/// order, with depths within [`DEPTH_TOLERANCE`] and colours within [`TOLERANCE`](crate::images::TOLERANCE). The difference of one that has not is
/// infinite.
///
/// # Panics
/// If the sizes differ.
pub fn compare(expected: &Layers, ambiguous: &[bool], layers: &Layers) -> Comparison {
    assert_eq!((expected.width, expected.height), (layers.width, layers.height), "captures of different sizes");
    let mut comparison = Comparison::default();
    for y in 0..expected.height {
        for x in 0..expected.width {
            let difference = pixel_difference(expected, layers, x, y);
            let excused = ambiguous[(y * expected.width + x) as usize];
            comparison.count(x, y, difference, is_covered(expected, x, y), excused);
        }
    }
    comparison
}

/// Whether anything is seen at a pixel.
pub fn is_covered(layers: &Layers, x: u32, y: u32) -> bool {
    layers.depth_complexity(x, y) > 0 || layers.opaque(x, y).is_some()
}

fn pixel_difference(expected: &Layers, layers: &Layers, x: u32, y: u32) -> f32 {
    let surface = |layers: &Layers| layers.opaque(x, y).map(|surface| (surface.color, surface.depth));
    let opaque = match (surface(expected), surface(layers)) {
        (None, None) => 0.0,
        (Some(want), Some(have)) => surface_difference(want, have),
        _ => return f32::INFINITY,
    };
    let (want, have) = (expected.pixel(x, y), layers.pixel(x, y));
    if !want.iter().map(|fragment| fragment.primitive).eq(have.iter().map(|fragment| fragment.primitive)) {
        return f32::INFINITY;
    }
    let fragments = want.iter().zip(have);
    fragments.map(|(a, b)| surface_difference((a.color, a.depth), (b.color, b.depth))).fold(opaque, f32::max)
}

/// Difference of the colours, infinite if the depths are not the same.
fn surface_difference((want, want_depth): (Vec4, f32), (have, have_depth): (Vec4, f32)) -> f32 {
    let close = (want_depth - have_depth).abs() <= DEPTH_TOLERANCE * want_depth.max(have_depth);
    if close { difference(want, have) } else { f32::INFINITY }
}
