//! What of eight triangles is in sight: bounds, sides and, of the small ones, every covered sample, in blocks of 8 x 8.

use std::hint::black_box;

use fearless_simd::{Bytes, Select, Simd, SimdBase, SimdCombine, SimdMask, i32x8, u16x8, u32x4, u32x8, u64x8};
use pellucid_core::meshlets::LANES;
use pellucid_core::pixel_grid::{SUBPIXELS, center};
use pellucid_core::primitive::Draw;

use crate::bin::{TILE_PX, TileGrid};
use crate::simd::{each_lane, unzip};
use crate::small::MOST_FRAGMENTS;
use crate::small_blocks::{BLOCK_PX, BLOCKS, COLUMN_BITS, EightBlocks};
use crate::transform::{OUTSIDE, VERTICES};

/// A triangle less than so many subpixels wide and high is small: at most four blocks a side. Edge values then fit 32 bits
/// with ease.
const SMALL_SUBPIXELS: i32 = 4 * BLOCK_PX * SUBPIXELS;

const TILE_BITS: u32 = TILE_PX.ilog2();

/// What is known of eight triangles; a bit for each in a mask.
#[derive(Default)]
pub(crate) struct Sight {
    /// Small ones that cover samples.
    pub(crate) small: u32,
    /// Small ones that may have more than [`MOST_FRAGMENTS`], in more than one block.
    pub(crate) maybe_many: u32,
    /// Others that may be in sight: large ones, and those with a corner that cannot be projected.
    pub(crate) others: u32,
    /// What the small ones cover: blocks that one of them reaches, from each one's first sample on; beyond `block_count` is
    /// room.
    blocks: [EightBlocks; BLOCKS],
    block_count: usize,
    /// The eight triangles as [`SmallBlock`](crate::small_blocks::SmallBlock) has them.
    pub(crate) triangles: [[u16; 4]; LANES],
}

impl Sight {
    /// Looks at eight triangles of a draw, from a number in the meshlet on: at the vertices that are their corners.
    #[inline(always)]
    pub(crate) fn look<S: Simd>(
        &mut self,
        simd: S,
        number: usize,
        [a, b, c]: &[[u16; LANES]; 3],
        positions: &[[i32; 2]; VERTICES],
        draw: &Draw<'_>,
        grid: &TileGrid,
    ) {
        let zero = i32x8::splat(simd, 0);
        let [ax, ay]: [i32x8<S>; 2] = unzip(simd, each_lane(|lane| positions[usize::from(a[lane])]));
        let [bx, by]: [i32x8<S>; 2] = unzip(simd, each_lane(|lane| positions[usize::from(b[lane])]));
        let [cx, cy]: [i32x8<S>; 2] = unzip(simd, each_lane(|lane| positions[usize::from(c[lane])]));
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
        // Whether a small one has samples to the right of the window or below it.
        let leaves_window = (leaves_window & small).any_true();
        self.small = small.to_bitmask() as u32;
        self.others = others.to_bitmask() as u32;
        self.maybe_many = 0;
        self.block_count = 0;
        if self.small == 0 {
            return;
        }
        self.triangles = numbered(simd, [a, b, c], number);
        let (bx, cx) = (swapped.select(cx, bx), swapped.select(bx, cx));
        let (by, cy) = (swapped.select(cy, by), swapped.select(by, cy));
        let (width, height) = (right - left + 1, bottom - top + 1);
        let columns = small.select(width, zero).reduce_max();
        let rows = small.select(height, zero).reduce_max();
        let (x, y) = ((left << 8) + center(0), (top << 8) + center(0));
        let (a, b, c, first) = ([ax, ay], [bx, by], [cx, cy], [x, y]);
        let edges = [Edge::new(b, c, first), Edge::new(c, a, first), Edge::new(a, b, first)];
        let mut any = u32x8::splat(simd, 0);
        let mut row = edges;
        for down in (0..rows).step_by(BLOCK_PX as usize) {
            let mut block = row;
            for across in (0..columns).step_by(BLOCK_PX as usize) {
                let size = [(columns - across).min(BLOCK_PX), (rows - down).min(BLOCK_PX)];
                let (upper, lower) = cover_block(simd, &block, size);
                any = any | upper | lower;
                let [first, second] = if cfg!(target_endian = "little") { [upper, lower] } else { [lower, upper] };
                let (low, high) = first.interleave(second);
                let covered = low.combine(high).bitcast::<u64x8<S>>().into();
                let (left, top) = (left + across, top + down);
                let (last_column, last_row) = (right.min(left + (BLOCK_PX - 1)), bottom.min(top + (BLOCK_PX - 1)));
                let leaves_tile = (left >> TILE_BITS).simd_lt(last_column >> TILE_BITS)
                    | (top >> TILE_BITS).simd_lt(last_row >> TILE_BITS);
                let (column, row) = ((left - grid.window.left) >> TILE_BITS, (top - grid.window.top) >> TILE_BITS);
                let firsts: u32x8<S> = ((top << COLUMN_BITS) | left).bitcast();
                let (low, high) = firsts.interleave((row * grid.columns as i32 + column).bitcast::<u32x8<S>>());
                let eight = &mut self.blocks[self.block_count % BLOCKS];
                (eight.across, eight.down, eight.covered) = (across, down, covered);
                eight.leave_tile = leaves_tile.to_bitmask() as u32;
                let (first_places, last_places) = eight.places.as_flattened_mut().split_at_mut(LANES);
                low.store_slice(first_places);
                high.store_slice(last_places);
                self.block_count += 1;
                for edge in &mut block {
                    edge.value += edge.right * BLOCK_PX;
                }
            }
            for edge in &mut row {
                edge.value += edge.down * BLOCK_PX;
            }
        }
        small &= !any.simd_eq(0);
        self.small = small.to_bitmask() as u32;
        if leaves_window {
            self.leave_out_beyond(&width.into(), &height.into());
        }
        if self.block_count > 1 {
            self.maybe_many = (width * height).simd_gt(MOST_FRAGMENTS as i32).to_bitmask() as u32;
        }
    }

    /// Leaves out samples beyond so many columns and rows from a triangle's first: there are none beyond its bounds, but there
    /// may be some beyond the window.
    #[cold]
    #[inline(never)]
    fn leave_out_beyond(&mut self, columns: &[i32; LANES], rows: &[i32; LANES]) {
        let mut small = 0;
        for EightBlocks { across, down, covered, .. } in &mut self.blocks[..self.block_count] {
            for (lane, covered) in covered.iter_mut().enumerate() {
                *covered &= columns_mask(columns[lane] - *across) & rows_mask(rows[lane] - *down);
                small |= u32::from(*covered != 0) << lane;
            }
        }
        self.small &= small;
    }

    /// What there is of the small ones.
    #[inline(always)]
    pub(crate) fn blocks(&self) -> &[EightBlocks] {
        &self.blocks[..self.block_count]
    }

    /// How many samples a small triangle covers.
    pub(crate) fn covered_count(&self, lane: usize) -> u32 {
        self.blocks().iter().map(|block| block.covered[lane].count_ones()).sum()
    }
}

/// The corners of eight triangles, triangle by triangle, each with its number, the first of which is given.
#[inline(always)]
fn numbered<S: Simd>(simd: S, [a, b, c]: [&[u16; LANES]; 3], first: usize) -> [[u16; 4]; LANES] {
    let numbers = each_lane(|lane| lane as u16).map(|lane| first as u16 + lane);
    let columns = [a, b, c, &numbers].map(|column| u16x8::load_array_ref(simd, column));
    let ((ab, last_ab), (cn, last_cn)) = (columns[0].interleave(columns[1]), columns[2].interleave(columns[3]));
    let mut rows = [[0; 4]; LANES];
    for (rows, [ab, cn]) in rows.as_chunks_mut::<4>().0.iter_mut().zip([[ab, cn], [last_ab, last_cn]]) {
        let (first, last) = ab.bitcast::<u32x4<S>>().interleave(cn.bitcast::<u32x4<S>>());
        let (first_rows, last_rows) = rows.as_flattened_mut().split_at_mut(LANES);
        first.bitcast::<u16x8<S>>().store_slice(first_rows);
        last.bitcast::<u16x8<S>>().store_slice(last_rows);
    }
    rows
}

/// The first so many columns of a block.
#[inline(always)]
fn columns_mask(count: i32) -> u64 {
    if count <= 0 { 0 } else { (0xFF >> (BLOCK_PX - count.min(BLOCK_PX))) * 0x0101_0101_0101_0101 }
}

/// The first so many rows of a block.
#[inline(always)]
fn rows_mask(count: i32) -> u64 {
    if count <= 0 { 0 } else { u64::MAX >> (BLOCK_PX * (BLOCK_PX - count.min(BLOCK_PX))) }
}

/// The samples of a block that lie inside three edges: rows 0 to 3 and 4 to 7, a bit for each.
#[inline(always)]
fn cover_block<S: Simd>(simd: S, edges: &[Edge<S>; 3], size: [i32; 2]) -> (u32x8<S>, u32x8<S>) {
    // Seen to be at most 8, loops would be unrolled, and multiples of steps that are hardly ever taken computed beforehand.
    let [columns, rows] = black_box(size);
    let mut here = edges.map(|edge| edge.value);
    let upper = cover_rows(simd, edges, &mut here, [columns, rows.min(BLOCK_PX / 2)]);
    if rows <= BLOCK_PX / 2 {
        return (upper, u32x8::splat(simd, 0));
    }
    (upper, cover_rows(simd, edges, &mut here, [columns, rows - BLOCK_PX / 2]))
}

/// Those of up to four rows, from the values that edges have at the first sample. To the right in one row, back in the next: so
/// no values have to be kept but those here.
#[inline(always)]
fn cover_rows<S: Simd>(simd: S, edges: &[Edge<S>; 3], here: &mut [i32x8<S>; 3], [columns, rows]: [i32; 2]) -> u32x8<S> {
    let [a, b, c] = edges;
    let [mut a_here, mut b_here, mut c_here] = *here;
    let zero = u32x8::splat(simd, 0);
    let mut covered = zero;
    let mut bit = u32x8::splat(simd, 1);
    let mut rows_left = rows;
    loop {
        covered |= (a_here | b_here | c_here).simd_ge(0).select(bit, zero);
        for _ in 1..columns {
            (a_here, b_here, c_here) = (a_here + a.right, b_here + b.right, c_here + c.right);
            bit <<= 1;
            covered |= (a_here | b_here | c_here).simd_ge(0).select(bit, zero);
        }
        (a_here, b_here, c_here) = (a_here + a.down, b_here + b.down, c_here + c.down);
        if rows_left == 1 {
            break;
        }
        bit <<= BLOCK_PX as u32;
        covered |= (a_here | b_here | c_here).simd_ge(0).select(bit, zero);
        for _ in 1..columns {
            (a_here, b_here, c_here) = (a_here - a.right, b_here - b.right, c_here - c.right);
            bit >>= 1;
            covered |= (a_here | b_here | c_here).simd_ge(0).select(bit, zero);
        }
        (a_here, b_here, c_here) = (a_here + a.down, b_here + b.down, c_here + c.down);
        if rows_left == 2 {
            break;
        }
        bit <<= BLOCK_PX as u32;
        rows_left -= 2;
    }
    *here = [a_here, b_here, c_here];
    covered
}

/// The first sample at or after a coordinate, from the window's first on.
#[inline(always)]
fn first_sample<S: Simd>(subpixels: i32x8<S>, first: i32) -> i32x8<S> {
    ((subpixels + (SUBPIXELS / 2 - 1)) >> 8).max(first)
}

/// The last sample at or before a coordinate.
#[inline(always)]
fn last_sample<S: Simd>(subpixels: i32x8<S>) -> i32x8<S> {
    (subpixels - SUBPIXELS / 2) >> 8
}

/// An edge of eight triangles as [`pellucid_core::pixel_grid::Edge`] has it.
#[derive(Clone, Copy)]
struct Edge<S: Simd> {
    /// Change for one sample to the right.
    right: i32x8<S>,
    /// Change for one sample downwards.
    down: i32x8<S>,
    /// Value at a position, less 1 if the line itself is outside.
    value: i32x8<S>,
}

impl<S: Simd> Edge<S> {
    #[inline(always)]
    fn new(from: [i32x8<S>; 2], to: [i32x8<S>; 2], at: [i32x8<S>; 2]) -> Self {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let value = dx * (at[1] - from[1]) - dy * (at[0] - from[0]);
        let owns_line = dy.simd_lt(0) | (dy.simd_eq(0) & dx.simd_gt(0));
        Self { right: (from[1] - to[1]) << 8, down: dx << 8, value: owns_line.select(value, value - 1) }
    }
}
