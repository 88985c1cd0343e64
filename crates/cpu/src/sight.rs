//! What of sixteen triangles is in sight: bounds, sides and, of the small ones, every covered sample, in blocks of 8 x 8.

use fearless_simd::{Select, Simd, SimdBase, SimdMask, i32x16};
use pellucid_core::pixel_grid::{SUBPIXELS, center};
use pellucid_core::primitive::Draw;

use crate::bin::TileGrid;
use crate::small::{BLOCK_PX, LANES, load_pairs};
use crate::transform::OUTSIDE;

/// A triangle less than so many subpixels wide and high is small: at most two blocks a side. Edge values then fit 32 bits
/// with ease, and sides and area fit f32.
const SMALL_SUBPIXELS: i32 = 2 * BLOCK_PX * SUBPIXELS;

/// Blocks of samples that a small triangle may reach.
const BLOCKS: usize = 4;

/// What is known of sixteen triangles; a bit for each in a mask.
pub(crate) struct Sight {
    /// Small ones that cover samples, unless those are all beside the window.
    pub(crate) small: u32,
    /// Others that may be in sight: large ones, and those with a corner that cannot be projected.
    pub(crate) others: u32,
    /// Small ones that run counter-clockwise on the screen.
    pub(crate) swapped: u32,
    /// First sample of the small ones' bounds, in the window.
    pub(crate) left: [i32; LANES],
    pub(crate) top: [i32; LANES],
    width: [i32; LANES],
    height: [i32; LANES],
    /// Whether a small one has samples to the right of the window or below it.
    leaves_window: bool,
    /// Blocks side by side, and one above another.
    block_columns: usize,
    block_rows: usize,
    /// Of each block the upper and the lower half, a bit for each sample.
    halves: [[[i32; LANES]; 2]; BLOCKS],
}

impl Sight {
    #[inline(always)]
    pub(crate) fn new<S: Simd>(simd: S, corners: &[[[i32; 2]; LANES]; 3], draw: &Draw<'_>, grid: &TileGrid) -> Self {
        let zero = i32x16::splat(simd, 0);
        let (ax, ay): (i32x16<S>, i32x16<S>) = load_pairs(simd, &corners[0]);
        let (bx, by): (i32x16<S>, i32x16<S>) = load_pairs(simd, &corners[1]);
        let (cx, cy): (i32x16<S>, i32x16<S>) = load_pairs(simd, &corners[2]);
        let outside = ax.simd_eq(OUTSIDE) | bx.simd_eq(OUTSIDE) | cx.simd_eq(OUTSIDE);
        let (min_x, min_y) = (ax.min(bx).min(cx), ay.min(by).min(cy));
        let (max_x, max_y) = (ax.max(bx).max(cx), ay.max(by).max(cy));
        let (left, top) = (first_sample(min_x, grid.window.left), first_sample(min_y, grid.window.top));
        let (last_column, last_row) = (last_sample(max_x), last_sample(max_y));
        let (right, bottom) = (last_column.min(grid.window.right), last_row.min(grid.window.bottom));
        let leaves_window = last_column.simd_gt(right) | last_row.simd_gt(bottom);
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
            leaves_window: (leaves_window & small).any_true(),
            block_columns: 0,
            block_rows: 0,
            halves: [[[0; LANES]; 2]; BLOCKS],
        };
        if sight.small == 0 {
            return sight;
        }
        let (bx, cx) = (swapped.select(cx, bx), swapped.select(bx, cx));
        let (by, cy) = (swapped.select(cy, by), swapped.select(by, cy));
        let columns = small.select(right - left, zero).reduce_max() + 1;
        let rows = small.select(bottom - top, zero).reduce_max() + 1;
        let (x, y) = ((left << 8) + center(0), (top << 8) + center(0));
        let edges =
            [edge((bx, by), (cx, cy), (x, y)), edge((cx, cy), (ax, ay), (x, y)), edge((ax, ay), (bx, by), (x, y))];
        (sight.block_columns, sight.block_rows) = (block_count(columns), block_count(rows));
        let mut any = zero;
        for block_row in 0..sight.block_rows {
            for block_column in 0..sight.block_columns {
                let (across, down) = (block_column as i32 * BLOCK_PX, block_row as i32 * BLOCK_PX);
                let size = [(columns - across).min(BLOCK_PX), (rows - down).min(BLOCK_PX)];
                let [low, high] = cover_block(simd, &edges, [across, down], size);
                any = any | low | high;
                sight.halves[block_row * 2 + block_column] = [low.into(), high.into()];
            }
        }
        small &= !any.simd_eq(0);
        sight.small = small.to_bitmask() as u32;
        sight
    }

    /// The blocks that a small triangle reaches, row by row: the first sample of each, and which of its samples are
    /// covered and in the window, a bit for each.
    #[inline(always)]
    pub(crate) fn blocks(&self, lane: usize) -> [([i32; 2], u64); BLOCKS] {
        let mut blocks = [([0; 2], 0); BLOCKS];
        for block_row in 0..self.block_rows {
            for block_column in 0..self.block_columns {
                let (across, down) = (block_column as i32 * BLOCK_PX, block_row as i32 * BLOCK_PX);
                let [low, high] = &self.halves[block_row * 2 + block_column];
                let covered = u64::from(low[lane] as u32) | u64::from(high[lane] as u32) << 32;
                // Beyond the bounds there are no samples, but beyond the window there may be.
                let mut in_window = u64::MAX;
                if self.leaves_window {
                    let (columns, rows) = (self.width[lane] - across, self.height[lane] - down);
                    in_window = columns_mask(columns) & rows_mask(rows);
                }
                let first = [self.left[lane] + across, self.top[lane] + down];
                blocks[block_row * 2 + block_column] = (first, covered & in_window);
            }
        }
        blocks
    }

    /// Whether no triangle reaches more than one block.
    #[inline(always)]
    pub(crate) fn has_one_block(&self) -> bool {
        self.block_columns * self.block_rows == 1
    }
}

/// Blocks that it takes for so many samples.
#[inline(always)]
fn block_count(samples: i32) -> usize {
    1 + usize::from(samples > BLOCK_PX)
}

/// The first `last + 1` columns of a block.
#[inline(always)]
fn columns_mask(last: i32) -> u64 {
    if last < 0 { 0 } else { (0xFF >> (7 - last.min(7))) * 0x0101_0101_0101_0101 }
}

/// The first `last + 1` rows of a block.
#[inline(always)]
fn rows_mask(last: i32) -> u64 {
    if last < 0 { 0 } else { u64::MAX >> (BLOCK_PX * (7 - last.min(7))) }
}

/// The samples of a block that lie inside three edges: rows 0 to 3 and 4 to 7, a bit for each.
#[inline(always)]
fn cover_block<S: Simd>(
    simd: S,
    [a, b, c]: &[(i32x16<S>, i32x16<S>, i32x16<S>); 3],
    [across, down]: [i32; 2],
    [columns, rows]: [i32; 2],
) -> [i32x16<S>; 2] {
    let zero = i32x16::splat(simd, 0);
    let mut a_row = a.2 + a.0 * across + a.1 * down;
    let mut b_row = b.2 + b.0 * across + b.1 * down;
    let mut c_row = c.2 + c.0 * across + c.1 * down;
    let mut halves = [zero; 2];
    for row in 0..rows {
        let mut bit = i32x16::splat(simd, 1 << ((row & 3) * BLOCK_PX));
        let (mut a_here, mut b_here, mut c_here) = (a_row, b_row, c_row);
        let mut covered = zero;
        for _ in 0..columns {
            covered |= (a_here | b_here | c_here).simd_ge(0).select(bit, zero);
            bit <<= 1;
            (a_here, b_here, c_here) = (a_here + a.0, b_here + b.0, c_here + c.0);
        }
        let half = &mut halves[usize::from(row >= 4)];
        *half |= covered;
        (a_row, b_row, c_row) = (a_row + a.1, b_row + b.1, c_row + c.1);
    }
    halves
}

/// The first sample at or after a coordinate, from the window's first on.
#[inline(always)]
fn first_sample<S: Simd>(subpixels: i32x16<S>, first: i32) -> i32x16<S> {
    ((subpixels + (SUBPIXELS / 2 - 1)) >> 8).max(first)
}

/// The last sample at or before a coordinate.
#[inline(always)]
fn last_sample<S: Simd>(subpixels: i32x16<S>) -> i32x16<S> {
    (subpixels - SUBPIXELS / 2) >> 8
}

/// An edge as [`pellucid_core::pixel_grid::Edge`] has it: change for one sample to the right and downwards, and value at a
/// position, less 1 if the line itself is outside.
#[inline(always)]
fn edge<S: Simd>(
    from: (i32x16<S>, i32x16<S>),
    to: (i32x16<S>, i32x16<S>),
    at: (i32x16<S>, i32x16<S>),
) -> (i32x16<S>, i32x16<S>, i32x16<S>) {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let value = dx * (at.1 - from.1) - dy * (at.0 - from.0);
    let owns_line = dy.simd_lt(0) | (dy.simd_eq(0) & dx.simd_gt(0));
    ((from.1 - to.1) << 8, dx << 8, owns_line.select(value, value - 1))
}
