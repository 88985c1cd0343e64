//! What of sixteen triangles is in sight: bounds, sides and, of the small ones, every covered sample.

use fearless_simd::{Select, Simd, SimdBase, SimdMask, i32x16};
use pellucid_core::pixel_grid::{SUBPIXELS, center};
use pellucid_core::primitive::Draw;

use crate::bin::TileGrid;
use crate::small::{LANES, SMALL_PX, load_pairs};
use crate::transform::OUTSIDE;

/// Less than so many subpixels wide and high is small: at most [`SMALL_PX`] samples a side, and all edge values fit f32
/// and i32 with ease.
const SMALL_SUBPIXELS: i32 = SMALL_PX * SUBPIXELS;

/// What is known of sixteen triangles; a bit for each in a mask.
pub(crate) struct Sight {
    /// Small ones that cover samples, unless those are all beside the picture.
    pub(crate) small: u32,
    /// Others that may be in sight: large ones, and those with a corner that cannot be projected.
    pub(crate) others: u32,
    /// Small ones that run counter-clockwise on the screen.
    pub(crate) swapped: u32,
    /// First sample of the small ones' bounds, on the picture.
    pub(crate) left: [i32; LANES],
    pub(crate) top: [i32; LANES],
    width: [i32; LANES],
    height: [i32; LANES],
    low_rows: [i32; LANES],
    high_rows: [i32; LANES],
}

impl Sight {
    #[inline(always)]
    pub(crate) fn new<S: Simd>(simd: S, corners: &[[[i32; 2]; LANES]; 3], draw: &Draw<'_>, grid: &TileGrid) -> Self {
        let zero = i32x16::splat(simd, 0);
        let corner = |k: usize| -> (i32x16<S>, i32x16<S>) { load_pairs(simd, &corners[k]) };
        let ((ax, ay), (bx, by), (cx, cy)) = (corner(0), corner(1), corner(2));
        let outside = ax.simd_eq(OUTSIDE) | bx.simd_eq(OUTSIDE) | cx.simd_eq(OUTSIDE);
        // The first sample at or after the bounds' start, and the last one at or before their end.
        let first = |subpixels: i32x16<S>| ((subpixels + (SUBPIXELS / 2 - 1)) >> 8).max(0);
        let last = |subpixels: i32x16<S>, size: u32| ((subpixels - SUBPIXELS / 2) >> 8).min(size as i32 - 1);
        let (min_x, min_y) = (ax.min(bx).min(cx), ay.min(by).min(cy));
        let (max_x, max_y) = (ax.max(bx).max(cx), ay.max(by).max(cy));
        let (left, top) = (first(min_x), first(min_y));
        let (right, bottom) = (last(max_x, grid.viewport.width), last(max_y, grid.viewport.height));
        let hit = left.simd_le(right) & top.simd_le(bottom) & !outside;
        let is_small = (max_x - min_x).simd_lt(SMALL_SUBPIXELS) & (max_y - min_y).simd_lt(SMALL_SUBPIXELS);
        let others = (hit & !is_small) | outside;

        let area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
        let swapped = area.simd_lt(0);
        let mut small = hit & is_small & !area.simd_eq(0);
        if draw.culls_back_faces {
            small &= if draw.mirrored { !swapped } else { swapped };
        }
        let mut sight = Self {
            small: small.to_bitmask() as u32,
            others: others.to_bitmask() as u32,
            swapped: swapped.to_bitmask() as u32,
            left: left.into(),
            top: top.into(),
            width: (right - left).into(),
            height: (bottom - top).into(),
            low_rows: [0; LANES],
            high_rows: [0; LANES],
        };
        if sight.small == 0 {
            return sight;
        }
        let (bx, cx) = (swapped.select(cx, bx), swapped.select(bx, cx));
        let (by, cy) = (swapped.select(cy, by), swapped.select(by, cy));
        let greatest = |sizes: i32x16<S>| small.select(sizes, zero).reduce_max();
        let (columns, rows) = (greatest(right - left) + 1, greatest(bottom - top) + 1);
        let (x, y) = ((left << 8) + center(0), (top << 8) + center(0));
        // As `Edge` has them: change for one sample to the right and downwards, value at the first sample, less 1 if the
        // line itself is outside.
        let edge = |from_x: i32x16<S>, from_y: i32x16<S>, to_x: i32x16<S>, to_y: i32x16<S>| {
            let (dx, dy) = (to_x - from_x, to_y - from_y);
            let value = dx * (y - from_y) - dy * (x - from_x);
            let owns_line = dy.simd_lt(0) | (dy.simd_eq(0) & dx.simd_gt(0));
            (zero - (dy << 8), dx << 8, owns_line.select(value, value - 1))
        };
        let (a_dx, a_dy, mut a) = edge(bx, by, cx, cy);
        let (b_dx, b_dy, mut b) = edge(cx, cy, ax, ay);
        let (c_dx, c_dy, mut c) = edge(ax, ay, bx, by);
        let mut halves = [zero; 2];
        for row in 0..rows {
            let mut bit = i32x16::splat(simd, 1 << ((row & 3) * SMALL_PX));
            let (mut a_here, mut b_here, mut c_here) = (a, b, c);
            let mut covered = zero;
            for _ in 0..columns {
                covered |= (a_here | b_here | c_here).simd_ge(0).select(bit, zero);
                bit <<= 1;
                (a_here, b_here, c_here) = (a_here + a_dx, b_here + b_dx, c_here + c_dx);
            }
            let half = &mut halves[usize::from(row >= 4)];
            *half |= covered;
            (a, b, c) = (a + a_dy, b + b_dy, c + c_dy);
        }
        let [low, high] = halves;
        small &= !(low | high).simd_eq(0);
        sight.small = small.to_bitmask() as u32;
        (sight.low_rows, sight.high_rows) = (low.into(), high.into());
        sight
    }

    /// Samples of the picture that a small triangle covers: a bit for each, row by row of [`SMALL_PX`].
    #[inline(always)]
    pub(crate) fn covered(&self, lane: usize) -> u64 {
        let covered = u64::from(self.low_rows[lane] as u32) | u64::from(self.high_rows[lane] as u32) << 32;
        // Beyond the bounds there are no samples, but beyond the picture's there may be.
        let columns = 0xFF >> (7 - self.width[lane]) & 0xFF;
        let rows = u64::MAX >> (SMALL_PX * (7 - self.height[lane]));
        covered & (columns as u64 * 0x0101_0101_0101_0101) & rows
    }
}
