//! Blocks of samples that small triangles cover, sorted by tile.

use pellucid_core::meshlets::LANES;

use crate::bin::{TILE_PX, TileGrid};
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
    /// Tile by tile, each tile's in draw order; filled up to a multiple of eight with any of them.
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

    /// Adds what one of eight triangles covers. There must be room for [`MOST_PARTS`].
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
            self.sorted[self.count..room].fill(any);
        }
    }

    /// What was sorted, eight at a time, and room for samples of eight. Beyond the last, any of them.
    #[inline(always)]
    pub(crate) fn sorted(&mut self) -> (&[[SmallBlock; LANES]], &mut Samples) {
        let room = self.count.next_multiple_of(LANES);
        (self.sorted[..room].as_chunks().0, &mut self.samples)
    }

    pub(crate) fn len(&self) -> usize {
        self.count
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

/// Samples of a block that are put down without asking whether there are as many: what asks is often mispredicted.
const WITHOUT_ASKING: usize = 4;

impl Samples {
    /// Puts down which samples are covered.
    #[inline(always)]
    pub(crate) fn put_down(&mut self, blocks: &[SmallBlock]) {
        let mut end = 0;
        for (lane, SmallBlock { covered, .. }) in blocks.iter().enumerate() {
            let lane = (lane << BLOCK_BITS) as u16;
            let mut bits = *covered;
            let mut at = end;
            for number in &mut self.numbers[at..at + WITHOUT_ASKING] {
                *number = lane | bits.trailing_zeros() as u16;
                bits &= bits.wrapping_sub(1);
            }
            while bits != 0 {
                self.numbers[at + WITHOUT_ASKING] = lane | bits.trailing_zeros() as u16;
                bits &= bits - 1;
                at += 1;
            }
            end += covered.count_ones() as usize;
        }
        self.count = end;
    }
}
