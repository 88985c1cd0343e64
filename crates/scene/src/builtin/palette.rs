//! Colours: chosen in sRGB, given in linear light.

use glam::{Vec3, Vec4};
use pellucid_core::color::linear_from_srgb8;

/// Clear, warm and cool hues that stay apart when they overlap.
pub(super) const GLASS: [u32; 8] = [0x2e9cca, 0xf2a541, 0xe4572e, 0x7a5bd0, 0x3cb58a, 0xd9467c, 0xf4d35e, 0x4059c9];

/// The linear-light colour of an sRGB hex code.
pub(super) fn linear(hex: u32) -> Vec3 {
    let [_, r, g, b] = hex.to_be_bytes();
    Vec3::new(linear_from_srgb8(r), linear_from_srgb8(g), linear_from_srgb8(b))
}

/// The linear-light colour of an sRGB hex code, with an alpha.
pub(super) fn tint(hex: u32, alpha: f32) -> Vec4 {
    linear(hex).extend(alpha)
}

/// The colour at `t` in 0..=1 along evenly spaced stops.
pub(super) fn gradient(stops: &[u32], t: f32) -> Vec3 {
    let last = stops.len() - 1;
    let position = t.clamp(0.0, 1.0) * last as f32;
    let index = (position as usize).min(last.saturating_sub(1));
    linear(stops[index]).lerp(linear(stops[(index + 1).min(last)]), position - index as f32)
}

/// As [`gradient`], but round and round: after the last stop comes the first.
pub(super) fn wheel(stops: &[u32], t: f32) -> Vec3 {
    let position = (t - t.floor()) * stops.len() as f32;
    let index = (position as usize).min(stops.len() - 1);
    linear(stops[index]).lerp(linear(stops[(index + 1) % stops.len()]), position - index as f32)
}
