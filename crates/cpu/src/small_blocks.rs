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
    /// The first sample: column, and row above it.
    pub(crate) place: u32,
    /// Number of the triangle in the meshlet.
    pub(crate) triangle: u16,
    /// The place of its tile among those of the meshlet.
    tile: u32,
    /// Vertices of the meshlet.
    pub(crate) corners: [u16; 3],
}

/// Bits of a sample's column in a block's place.
pub(crate) const COLUMN_BITS: u32 = 16;

/// The blocks of a meshlet.
#[derive(Debug, Default)]
pub(crate) struct SmallBlocks {
    /// In draw order.
    blocks: Vec<SmallBlock>,
    tiles: Vec<TileBlocks>,
    /// For each tile of the window its place among those of the meshlet plus 1, or 0.
    places_of_tiles: Vec<u32>,
    /// Tile by tile, each tile's in draw order; filled up to a multiple of eight with any of them.
    sorted: Vec<SmallBlock>,
    /// What eight of them cover.
    samples: Samples,
}

/// A tile that blocks of the meshlet lie in.
#[derive(Debug, Clone, Copy)]
struct TileBlocks {
    tile: u32,
    fragments: u32,
    /// How many blocks, then where the next one goes.
    blocks: u32,
}

/// The last column or row of a tile.
const LAST: i32 = TILE_PX as i32 - 1;

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

impl SmallBlocks {
    /// Makes ready for blocks in a window.
    pub(crate) fn begin(&mut self, grid: &TileGrid) {
        self.places_of_tiles.resize(grid.tile_count(), 0);
    }

    /// Adds what a triangle covers of a block that lies in one tile.
    #[inline(always)]
    pub(crate) fn push(&mut self, tile: u32, place: u32, covered: u64, (triangle, corners): (u16, [u16; 3])) {
        let mut place_of_tile = self.places_of_tiles[tile as usize];
        if place_of_tile == 0 {
            place_of_tile = self.add_tile(tile);
        }
        let tile = place_of_tile - 1;
        let in_tile = &mut self.tiles[tile as usize];
        in_tile.blocks += 1;
        in_tile.fragments += covered.count_ones();
        self.blocks.push(SmallBlock { covered, place, triangle, tile, corners });
    }

    /// Adds what a triangle covers of any block.
    #[inline(always)]
    pub(crate) fn push_any(&mut self, [left, top]: [i32; 2], covered: u64, triangle: (u16, [u16; 3]), grid: &TileGrid) {
        let beyond = BEYOND_RIGHT[(left & LAST) as usize] | BEYOND_BELOW[(top & LAST) as usize];
        if covered & beyond != 0 {
            self.push_parts([left, top], covered, triangle, grid);
        } else if covered != 0 {
            self.push(grid.tile_at(left, top), (top << COLUMN_BITS | left) as u32, covered, triangle);
        }
    }

    /// Adds a block cut along the borders of tiles.
    #[inline(never)]
    fn push_parts(&mut self, [left, top]: [i32; 2], covered: u64, triangle: (u16, [u16; 3]), grid: &TileGrid) {
        let (column, row) = (left & LAST, top & LAST);
        let (right, below) = (BEYOND_RIGHT[column as usize], BEYOND_BELOW[row as usize]);
        for (in_rows, down) in [(!below, 0), (below, TILE_PX as i32 - row)] {
            for (in_columns, across) in [(!right, 0), (right, TILE_PX as i32 - column)] {
                let covered = covered & in_rows & in_columns;
                if covered != 0 {
                    let (left, top) = (left + across, top + down);
                    let place = (top << COLUMN_BITS | left) as u32;
                    self.push(grid.tile_at(left, top), place, covered >> (down * BLOCK_PX + across), triangle);
                }
            }
        }
    }

    #[inline(never)]
    fn add_tile(&mut self, tile: u32) -> u32 {
        self.tiles.push(TileBlocks { tile, fragments: 0, blocks: 0 });
        let place = self.tiles.len() as u32;
        self.places_of_tiles[tile as usize] = place;
        place
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    pub(crate) fn clear(&mut self) {
        self.blocks.clear();
        for tile in self.tiles.drain(..) {
            self.places_of_tiles[tile.tile as usize] = 0;
        }
    }

    /// Sorts those of a draw by tile, keeping draw order, and tells how many fragments each tile gets.
    pub(crate) fn sort_by_tile(&mut self, draw: u32, fragments: &mut SmallFragments) {
        let mut sum = 0;
        for tile in &mut self.tiles {
            fragments.add_run(tile.tile, tile.fragments, draw);
            sum += std::mem::replace(&mut tile.blocks, sum);
        }
        let room = self.blocks.len().next_multiple_of(LANES);
        if self.sorted.len() < room {
            self.sorted.resize(room, SmallBlock::default());
        }
        for block in &self.blocks {
            let next = &mut self.tiles[block.tile as usize].blocks;
            self.sorted[*next as usize] = *block;
            *next += 1;
        }
        if let Some(&any) = self.blocks.last() {
            self.sorted[self.blocks.len()..room].fill(any);
        }
    }

    /// What was sorted, eight at a time, and room for samples of eight. Beyond the last, any of them.
    #[inline(always)]
    pub(crate) fn sorted(&mut self) -> (&[[SmallBlock; LANES]], &mut Samples) {
        let room = self.blocks.len().next_multiple_of(LANES);
        (self.sorted[..room].as_chunks().0, &mut self.samples)
    }

    pub(crate) fn len(&self) -> usize {
        self.blocks.len()
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        (self.blocks.capacity() + self.sorted.capacity()) * size_of::<SmallBlock>()
            + self.places_of_tiles.capacity() * 4
            + self.tiles.capacity() * size_of::<TileBlocks>()
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
        self.count = 0;
        for (lane, SmallBlock { covered, .. }) in blocks.iter().enumerate() {
            let lane = (lane << BLOCK_BITS) as u16;
            let mut bits = *covered;
            let mut at = self.count;
            for number in &mut self.numbers[at..at + WITHOUT_ASKING] {
                *number = lane | bits.trailing_zeros() as u16;
                bits &= bits.wrapping_sub(1);
            }
            while bits != 0 {
                self.numbers[at + WITHOUT_ASKING] = lane | bits.trailing_zeros() as u16;
                bits &= bits - 1;
                at += 1;
            }
            self.count += covered.count_ones() as usize;
        }
    }
}
