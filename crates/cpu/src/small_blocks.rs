//! Blocks of samples that small triangles cover, sorted by tile.

use fearless_simd::{Bytes, Select, Simd, SimdBase, SimdInt, SimdMask, f32x8, i32x8, u32x8};
use pellucid_core::meshlets::LANES;

use crate::bin::{TILE_PX, TileGrid};
use crate::simd::{each_lane, unzip};
use crate::small_fragments::SmallFragments;

/// Side of a block of samples.
pub(crate) const BLOCK_PX: i32 = 8;

/// Bits of a sample's number in its block.
pub(crate) const BLOCK_BITS: u32 = 6;

/// The samples that a small triangle covers in a block, which does not reach into another tile.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SmallBlock {
    /// Row by row.
    pub(crate) covered: u64,
    /// The corners' numbers among the vertices of the meshlet, and that of the triangle in it.
    pub(crate) triangle: [u16; 4],
    pub(crate) place: Place,
}

/// Where a block's first sample is: column, and row above it; and the tile.
pub(crate) type Place = [u32; 2];

/// A block of samples at the same place in the bounds of each of eight triangles.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct EightBlocks {
    /// From the first sample of the bounds.
    pub(crate) across: i32,
    pub(crate) down: i32,
    /// Which samples each triangle covers, row by row.
    pub(crate) covered: [u64; LANES],
    pub(crate) places: [Place; LANES],
    /// Those that may cover samples in several tiles: a bit for each.
    pub(crate) leave_tile: u32,
}

/// Bits of a sample's column in a block's place.
pub(crate) const COLUMN_BITS: u32 = 16;

/// The blocks of a meshlet.
#[derive(Debug, Default)]
pub(crate) struct SmallBlocks {
    /// In draw order; beyond `count` is room.
    blocks: Vec<SmallBlock>,
    count: usize,
    /// The tiles that they lie in.
    tiles: Vec<u32>,
    /// For each tile of the window how many fragments there are, and blocks times [`BLOCK`]; while they are sorted, where
    /// its next block goes.
    in_tiles: Vec<u64>,
    /// Tile by tile, each tile's in draw order; filled up to a multiple of eight with any that covers nothing.
    sorted: Vec<SmallBlock>,
    /// What eight of them cover.
    samples: Samples,
}

/// One block among those counted for a tile, above its fragments.
const BLOCK: u64 = 1 << 32;

/// Blocks that a triangle may have, parts of them in several tiles counted.
pub(crate) const MOST_PARTS: usize = 4 * BLOCKS;

/// Blocks of samples that a small triangle may reach.
pub(crate) const BLOCKS: usize = 16;

/// The last column or row of a tile.
const LAST: u32 = TILE_PX - 1;

/// Of a block whose first sample is in this column of its tile, the samples beyond the tile.
const BEYOND_RIGHT: [u64; TILE_PX as usize] = beyond(0x0101_0101_0101_0101, 1);

/// Of a block whose first sample is in this row of its tile, the samples beyond the tile.
const BEYOND_BELOW: [u64; TILE_PX as usize] = beyond(0xFF, BLOCK_PX as u32);

/// From the samples of the first column or row, and the distance to the next one.
const fn beyond(first: u64, distance: u32) -> [u64; TILE_PX as usize] {
    let mut all = [0; TILE_PX as usize];
    let mut place = 0;
    while place < TILE_PX as usize {
        let mut line = TILE_PX as usize - place;
        while line < BLOCK_PX as usize {
            all[place] |= first << (line as u32 * distance);
            line += 1;
        }
        place += 1;
    }
    all
}

/// Shifted right, by any number of bits.
#[inline(always)]
fn shifted(samples: u64, bits: u32) -> u64 {
    samples.checked_shr(bits).unwrap_or_default()
}

impl SmallBlocks {
    /// Makes ready for blocks in a window.
    pub(crate) fn begin(&mut self, grid: &TileGrid) {
        self.in_tiles.resize(grid.tile_count(), 0);
    }

    /// Makes room for so many more.
    #[inline(always)]
    pub(crate) fn make_room(&mut self, count: usize) {
        if self.blocks.len() < self.count + count {
            self.grow(count);
        }
    }

    #[cold]
    fn grow(&mut self, count: usize) {
        let room = self.count + count;
        self.blocks.resize(room + room / 4, SmallBlock::default());
    }

    /// Adds what one of eight triangles covers of a block, which may lie in four tiles: there must be room.
    #[inline(always)]
    pub(crate) fn push(&mut self, eight: &EightBlocks, lane: usize, triangle: [u16; 4], grid: &TileGrid) {
        let (covered, place) = (eight.covered[lane], eight.places[lane]);
        if covered == 0 {
            return;
        }
        if eight.leave_tile >> lane & 1 == 0 {
            self.push_block(covered, triangle, place);
        } else {
            self.push_parts(covered, triangle, place, grid.columns);
        }
    }

    #[inline(always)]
    fn push_block(&mut self, covered: u64, triangle: [u16; 4], place: Place) {
        let [_, tile] = place;
        let in_tile = &mut self.in_tiles[tile as usize];
        if *in_tile == 0 {
            self.tiles.push(tile);
        }
        *in_tile += BLOCK + u64::from(covered.count_ones());
        self.blocks[self.count] = SmallBlock { covered, triangle, place };
        self.count += 1;
    }

    /// Adds a block tile by tile, of which there are so many columns.
    #[inline(never)]
    fn push_parts(&mut self, covered: u64, triangle: [u16; 4], [first, tile]: Place, columns: u32) {
        let (column, row) = (first & LAST, first >> COLUMN_BITS & LAST);
        let (right, below) = (covered & BEYOND_RIGHT[column as usize], covered & BEYOND_BELOW[row as usize]);
        let (to_right, down) = (TILE_PX - column, TILE_PX - row);
        let mut push = |covered: u64, place: Place| {
            if covered != 0 {
                self.push_block(covered, triangle, place);
            }
        };
        push(covered & !(right | below), [first, tile]);
        if right | below != 0 {
            let (first_right, first_below) = (first + to_right, first + (down << COLUMN_BITS));
            let lower = BLOCK_PX as u32 * down;
            push(shifted(right & !below, to_right), [first_right, tile + 1]);
            push(shifted(below & !right, lower), [first_below, tile + columns]);
            push(shifted(below & right, lower + to_right), [first_below + to_right, tile + columns + 1]);
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }

    pub(crate) fn clear(&mut self) {
        self.count = 0;
        for tile in self.tiles.drain(..) {
            self.in_tiles[tile as usize] = 0;
        }
    }

    /// Sorts those of a draw's meshlet by tile, keeping draw order, and tells how many fragments each tile gets.
    pub(crate) fn sort_by_tile(&mut self, draw_and_primitive: [u32; 2], fragments: &mut SmallFragments) {
        let mut sum = 0;
        for &tile in &self.tiles {
            let in_tile = &mut self.in_tiles[tile as usize];
            fragments.add_run(tile, *in_tile as u32, draw_and_primitive);
            sum += std::mem::replace(in_tile, sum) / BLOCK;
        }
        let room = self.count.next_multiple_of(LANES);
        if self.sorted.len() < room {
            self.sorted.resize(room, SmallBlock::default());
        }
        for block in &self.blocks[..self.count] {
            let next = &mut self.in_tiles[block.place[1] as usize];
            self.sorted[*next as usize] = *block;
            *next += 1;
        }
        if let Some(&any) = self.blocks[..self.count].last() {
            self.sorted[self.count..room].fill(SmallBlock { covered: 0, ..any });
        }
    }

    /// What was sorted, eight at a time, and room for samples of eight. Those beyond the last cover nothing.
    #[inline(always)]
    pub(crate) fn sorted(&mut self) -> (&[[SmallBlock; LANES]], &mut Samples) {
        let room = self.count.next_multiple_of(LANES);
        (self.sorted[..room].as_chunks().0, &mut self.samples)
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        (self.blocks.capacity() + self.sorted.capacity()) * size_of::<SmallBlock>()
            + self.in_tiles.capacity() * 8
            + self.tiles.capacity() * 4
    }
}

/// Samples of eight blocks, block by block.
#[derive(Debug)]
pub(crate) struct Samples {
    /// Number in the block, above it the block's lane; beyond `count` anything.
    pub(crate) numbers: [u16; LANES << BLOCK_BITS],
    pub(crate) count: usize,
}

impl Default for Samples {
    fn default() -> Self {
        Self { numbers: [0; LANES << BLOCK_BITS], count: 0 }
    }
}

/// Samples of each block that are found side by side.
const SIDE_BY_SIDE: usize = 4;

impl Samples {
    /// Puts down which samples eight blocks cover.
    #[inline(always)]
    pub(crate) fn put_down<S: Simd>(&mut self, simd: S, blocks: &[SmallBlock; LANES]) {
        let first = first_samples(simd, blocks);
        let mut end = 0;
        for lane in 0..LANES {
            let covered = blocks[lane].covered;
            let count = covered.count_ones() as usize;
            self.numbers[end..end + SIDE_BY_SIDE].copy_from_slice(&first[lane]);
            if count > SIDE_BY_SIDE {
                self.put_down_rest(lane, covered, end + SIDE_BY_SIDE);
            }
            end += count;
        }
        self.count = end;
    }

    /// Puts down all but the first four samples of a block.
    #[inline(never)]
    fn put_down_rest(&mut self, lane: usize, covered: u64, mut end: usize) {
        let lane = (lane << BLOCK_BITS) as u16;
        let mut bits = covered;
        for _ in 0..SIDE_BY_SIDE {
            bits &= bits - 1;
        }
        while bits != 0 {
            self.numbers[end] = lane | bits.trailing_zeros() as u16;
            bits &= bits - 1;
            end += 1;
        }
    }
}

/// The first four samples that each of eight blocks covers, as [`Samples`] has them; anything beyond the last.
#[inline(always)]
fn first_samples<S: Simd>(simd: S, blocks: &[SmallBlock; LANES]) -> [[u16; SIDE_BY_SIDE]; LANES] {
    let halves = each_lane(|lane| [blocks[lane].covered as u32, (blocks[lane].covered >> 32) as u32]);
    let [mut upper, mut lower]: [u32x8<S>; 2] = unzip(simd, halves);
    let zero = u32x8::splat(simd, 0);
    let mut numbers = [zero; SIDE_BY_SIDE];
    if lower.simd_eq(zero).all_true() {
        for number in &mut numbers {
            let first = upper & (zero - upper);
            *number = exponent(first);
            upper ^= first;
        }
    } else {
        for number in &mut numbers {
            let is_lower = upper.simd_eq(zero);
            let bits = is_lower.select(lower, upper);
            let first = bits & (zero - bits);
            *number = exponent(first) | is_lower.select(u32x8::splat(simd, 32), zero);
            upper ^= is_lower.select(zero, first);
            lower ^= is_lower.select(first, zero);
        }
    }
    let lanes = u32x8::load_array(simd, each_lane(|lane| (lane << BLOCK_BITS) as u32 * 0x1_0001));
    let [a, b, c, d] = numbers;
    let pairs = if cfg!(target_endian = "little") { [[a, b], [c, d]] } else { [[b, a], [d, c]] };
    let [ab, cd] = pairs.map(|[low, high]| (low | (high << 16)) | lanes);
    let (first, last) = ab.interleave(cd);
    let mut all = [[0_u32; SIDE_BY_SIDE / 2]; LANES];
    let (first_half, last_half) = all.as_flattened_mut().split_at_mut(LANES);
    first.store_slice(first_half);
    last.store_slice(last_half);
    bytemuck::cast(all)
}

/// The number of the only bit that is set; anything below 32 if none is.
#[inline(always)]
fn exponent<S: Simd>(bit: u32x8<S>) -> u32x8<S> {
    // From 127 on; the highest bit is taken for a sign, which falls away.
    let float: f32x8<S> = bit.bitcast::<i32x8<S>>().to_float();
    ((float.bitcast::<u32x8<S>>() >> 23) + 1) & 31
}
