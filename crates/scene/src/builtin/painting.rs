//! Procedural textures.

use pellucid_core::texture::{Sampler, Texture, Wrap};

use super::random::lattice_noise;

/// A square texture, `size` texels wide, of what `paint` gives at (u, v) in 0..1: sRGB colour and alpha, all in 0..=1.
pub(super) fn paint(
    size: u32,
    wrap: Wrap,
    paint: impl Fn(f32, f32) -> [f32; 4],
) -> Result<Texture, pellucid_core::Error> {
    let at = |i: u32| (i as f32 + 0.5) / size as f32;
    let texels = (0..size)
        .flat_map(|y| (0..size).map(move |x| (x, y)))
        .map(|(x, y)| paint(at(x), at(y)).map(|channel| (channel.clamp(0.0, 1.0) * 255.0 + 0.5) as u8))
        .collect();
    Texture::new(size, size, texels, Sampler { wrap_u: wrap, wrap_v: wrap, ..Sampler::default() })
}

/// Smooth noise in 0..1 with `columns` x `rows` cells in the unit square, the same at opposite edges.
pub(super) fn noise(u: f32, v: f32, columns: i32, rows: i32, seed: u32) -> f32 {
    let (x, y) = (u * columns as f32, v * rows as f32);
    let (x0, y0) = (x.floor(), y.floor());
    let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
    let (fx, fy) = (smooth(x - x0), smooth(y - y0));
    let corner =
        |dx: i32, dy: i32| lattice_noise((x0 as i32 + dx).rem_euclid(columns), (y0 as i32 + dy).rem_euclid(rows), seed);
    let (top, bottom) = (lerp(corner(0, 0), corner(1, 0), fx), lerp(corner(0, 1), corner(1, 1), fx));
    lerp(top, bottom, fy)
}

/// From `a` at 0 to `b` at 1.
pub(super) fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// 0 up to `low`, 1 from `high`, smooth between.
pub(super) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
