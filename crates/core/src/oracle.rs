//! The oracle: every triangle against every pixel.
//!
//! No tiles, no bounding boxes, no cleverness: slow, and short enough to be believed. It shares with the renderers what
//! the contract defines (the pixel grid, the order, the lighting model) and nothing of how they go about it. Besides the
//! layers it says which pixels are *ambiguous*: where another device's rounding may give another result.

use std::time::Instant;

use crate::layers::OpaqueSurface;
use crate::pixel_grid::{Viewport, depth_at, is_near_outline, may_turn_over, twice_signed_area};
use crate::primitive::{Draw, NotFinite, Pass, Piece, covering_piece, draws};
use crate::resolve::{PixelResolver, finish};
use crate::shading::{CornerNormals, NormalPlane, Varying, color_at};
use crate::stats::Step;
use crate::{Error, Fragment, Frame, Image, Layers, Resolve, Scene, Stats, Technique, View, fragment};

/// Two depths closer than this, relative to the greater, may change places on another device. Hardware interpolates
/// depth in f32 with about three roundings of 2^-24 each, of values up to the greatest of the triangle's corners; 2^-18
/// allows corners up to a dozen times as near as the fragment.
pub const AMBIGUOUS_DEPTH: f32 = 1.0 / 262_144.0;

/// An alpha closer than this to the cutoff may pass the test or fail it on another device: texture coordinates are
/// interpolated in f32, and a texel's alpha may change by its whole range over a 4096th of the texture.
pub const AMBIGUOUS_ALPHA: f32 = 1.0 / 1024.0;

/// What the oracle captured.
#[derive(Debug, Clone)]
pub struct Capture {
    /// The layers of the whole picture.
    pub layers: Layers,
    /// For each pixel, row by row, whether another device's rounding may give another result.
    pub ambiguous: Vec<bool>,
    /// Primitives left out because they are not finite.
    pub dropped_triangles: u64,
}

/// Captures and orders all fragments of a view.
///
/// # Errors
/// If the view is invalid.
pub fn capture(scene: &Scene, view: &View) -> Result<Capture, Error> {
    let viewport = Viewport::of(view);
    let draws = draws(scene, view)?;
    let pixel_count = view.width as usize * view.height as usize;
    let mut opaque: Vec<Vec<Fragment>> = vec![Vec::new(); pixel_count];
    let mut transparent: Vec<Vec<Fragment>> = vec![Vec::new(); pixel_count];
    let mut ambiguous = vec![false; pixel_count];
    let mut dropped_triangles = 0;

    for draw in &draws {
        let buffer = match draw.pass {
            Pass::Opaque => &mut opaque,
            Pass::Transparent => &mut transparent,
        };
        for triangle in 0..draw.mesh.triangles().len() {
            mark_outlines(draw, triangle, view, &mut ambiguous);
            match draw.pieces(triangle, &viewport) {
                Ok(pieces) => rasterize(draw, triangle, &pieces, view, buffer, &mut ambiguous),
                Err(NotFinite) => dropped_triangles += 1,
            }
        }
    }

    let mut layers = Layers { width: view.width, height: view.height, ..Layers::default() };
    for (i, (opaque, transparent)) in opaque.iter_mut().zip(&mut transparent).enumerate() {
        fragment::sort(opaque);
        fragment::sort(transparent);
        let surface = opaque.first().map(|nearest| OpaqueSurface { color: nearest.color, depth: nearest.depth });
        // Behind the opaque surface nothing is captured; at its very depth, something is.
        let hidden_below = surface.map_or(0.0, |surface| surface.depth);
        let nearly_hidden_below = hidden_below * (1.0 - AMBIGUOUS_DEPTH);
        let in_sight = transparent.iter().filter(|fragment| fragment.depth >= nearly_hidden_below);
        ambiguous[i] |= any_close(opaque.iter().take(2).chain(in_sight));
        layers.fragments.extend(transparent.iter().filter(|fragment| fragment.depth >= hidden_below));
        layers.ends.push(layers.fragments.len() as u32);
        layers.opaque.push(surface);
    }
    Ok(Capture { layers, ambiguous, dropped_triangles })
}

/// Marks the pixels whose centre lies so near the outline of a triangle that is drawn, or might be if rounding turned it
/// over, that it might be covered or not.
fn mark_outlines(draw: &Draw<'_>, triangle: usize, view: &View, ambiguous: &mut [bool]) {
    for corners in draw.outlines(triangle, &Viewport::of(view)) {
        if !draw.shows_side(twice_signed_area(corners)) && !may_turn_over(corners) {
            continue;
        }
        for (i, ambiguous) in ambiguous.iter_mut().enumerate() {
            let (x, y) = (i as i32 % view.width as i32, i as i32 / view.width as i32);
            *ambiguous |= is_near_outline(corners, x, y);
        }
    }
}

/// Tests the pieces of a primitive against every pixel.
fn rasterize(
    draw: &Draw<'_>,
    triangle: usize,
    pieces: &[Piece],
    view: &View,
    buffer: &mut [Vec<Fragment>],
    ambiguous: &mut [bool],
) {
    let surfaces: Vec<_> = pieces
        .iter()
        .map(|piece| {
            let weights = piece.triangle.weight_planes();
            let normals = CornerNormals::new(draw, triangle, &piece.triangle.vertices, &piece.corners);
            let varying = draw.varies().then(|| Varying::new(draw, triangle, piece, weights));
            (NormalPlane::new(&normals, weights), varying, piece.triangle.depth_plane(weights))
        })
        .collect();
    for y in 0..view.height as i32 {
        for x in 0..view.width as i32 {
            let pixel = y as usize * view.width as usize + x as usize;
            let Some(number) = covering_piece(pieces, x, y) else { continue };
            let (triangle_on_grid, (normal, varying, depth_plane)) = (&pieces[number].triangle, &surfaces[number]);
            let [anchor_x, anchor_y] = triangle_on_grid.anchor_px();
            let (x, y) = (x - anchor_x, y - anchor_y);
            if let (Some(varying), Some(cutoff)) = (varying, draw.cutoff) {
                ambiguous[pixel] |= (varying.straight_color_at(draw, x, y).w - cutoff).abs() <= AMBIGUOUS_ALPHA;
            }
            if let Some(color) = color_at(draw, normal, varying.as_ref(), x, y) {
                let depth = depth_at(depth_plane, triangle_on_grid.depth_range(), x, y);
                buffer[pixel].push(Fragment { color, depth, primitive: draw.first_primitive + triangle as u32 });
            }
        }
    }
}

/// Whether any two of these fragments lie closer than [`AMBIGUOUS_DEPTH`].
fn any_close<'a>(fragments: impl Iterator<Item = &'a Fragment>) -> bool {
    let mut depths: Vec<f32> = fragments.map(|fragment| fragment.depth).collect();
    depths.sort_unstable_by(f32::total_cmp);
    depths.windows(2).any(|pair| pair[1] - pair[0] <= AMBIGUOUS_DEPTH * pair[1])
}

/// Renders a view.
///
/// # Errors
/// If the view is invalid.
pub fn render(scene: &Scene, view: &View, resolve: Resolve) -> Result<Frame, Error> {
    let start = Instant::now();
    let capture = capture(scene, view)?;
    let captured = Instant::now();
    let (image, mut stats) = resolve_capture(&capture, scene, view, resolve);
    stats.steps = vec![
        Step { name: "capture", ms: (captured - start).as_secs_f64() * 1e3 },
        Step { name: "resolve", ms: captured.elapsed().as_secs_f64() * 1e3 },
    ];
    stats.total_ms = start.elapsed().as_secs_f64() * 1e3;
    Ok(Frame { image, stats })
}

/// Resolves what was captured of a scene in a view; the times in the figures are left at 0.
pub fn resolve_capture(capture: &Capture, scene: &Scene, view: &View, resolve: Resolve) -> (Image, Stats) {
    let layers = &capture.layers;
    let resolver = PixelResolver::new(resolve, view);
    let mut image = Image::filled(view.width, view.height, glam::Vec4::ZERO);
    let mut covered = 0u64;
    let mut stats = Stats::new(Technique::Oracle, "one CPU thread".into(), view.width, view.height);
    for (i, pixel) in image.pixels_mut().iter_mut().enumerate() {
        let (x, y) = (i as u32 % view.width, i as u32 / view.width);
        *pixel = resolver.pixel(layers.pixel(x, y), layers.opaque(x, y));
        stats.max_depth_complexity = stats.max_depth_complexity.max(layers.depth_complexity(x, y));
        covered += u64::from(layers.depth_complexity(x, y) > 0);
    }
    stats.triangles = u64::from(scene.primitive_count());
    stats.dropped_triangles = capture.dropped_triangles;
    stats.fragments = layers.fragments.len() as u64;
    stats.mean_depth_complexity = stats.fragments as f64 / covered.max(1) as f64;
    stats.peak_bytes = (layers.fragments.capacity() * size_of::<Fragment>()) as u64;
    finish(resolve, &mut image, &stats);
    (image, stats)
}
