//! Fragments of small triangles to tiles: as they come from the triangles of a chunk, then sorted by tile.

use bytemuck::{Pod, Zeroable};

use crate::bin::{TILE_PX, TileGrid};
use crate::small::LANES;

/// Bits of a sample's number in its tile.
pub(crate) const SAMPLE_BITS: u32 = 10;
const _: () = assert!(1 << SAMPLE_BITS == TILE_PX * TILE_PX);

/// A fragment of a small triangle.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SmallFragment {
    pub(crate) depth: f32,
    /// Brightness of its surface.
    pub(crate) light: f32,
    pub(crate) primitive: u32,
    /// Number of the draw.
    pub(crate) draw: u32,
}

/// Fragments of small triangles as they come, in draw order. A thread's, used again for every chunk.
#[derive(Debug, Default)]
pub(crate) struct NewFragments {
    /// Tile and sample of each.
    places: Vec<u32>,
    fragments: Vec<SmallFragment>,
    /// How many have come; beyond is room.
    count: usize,
}

/// Fragments of small triangles by tile, in draw order.
#[derive(Debug, Default)]
pub(crate) struct SmallFragments {
    starts: Vec<u32>,
    samples: Vec<u16>,
    fragments: Vec<SmallFragment>,
}

impl NewFragments {
    /// Adds so many: their places and they themselves, to be written, and `beyond` more that may be.
    #[inline(always)]
    pub(crate) fn add(&mut self, count: usize, beyond: usize) -> (&mut [u32], &mut [SmallFragment]) {
        let first = self.count;
        self.count += count;
        let end = self.count + beyond;
        if self.places.len() < end {
            let room = end.next_power_of_two().max(1024);
            self.places.resize(room, 0);
            self.fragments.resize(room, SmallFragment::default());
        }
        (&mut self.places[first..end], &mut self.fragments[first..end])
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.places.capacity() * 4 + self.fragments.capacity() * size_of::<SmallFragment>()
    }
}

#[inline(always)]
fn tile_of(place: u32) -> usize {
    (place >> SAMPLE_BITS) as usize
}

#[inline(always)]
fn sample_of(place: u32) -> u16 {
    (place & ((1 << SAMPLE_BITS) - 1)) as u16
}

/// The tile that all places are in, if they are in one, as those of neighbours mostly are.
#[inline(always)]
fn common_tile(places: &[u32; LANES]) -> Option<usize> {
    let differing = places.iter().fold(0, |bits, place| bits | (place ^ places[0]));
    (tile_of(differing) == 0).then_some(tile_of(places[0]))
}

impl SmallFragments {
    /// Takes over what came, sorted by tile, keeping draw order.
    pub(crate) fn take(&mut self, new: &mut NewFragments, grid: &TileGrid) {
        self.starts.clear();
        let count = std::mem::take(&mut new.count);
        if count == 0 {
            return;
        }
        let (places, other_places) = new.places[..count].as_chunks::<LANES>();
        let (fragments, other_fragments) = new.fragments[..count].as_chunks::<LANES>();
        self.starts.resize(grid.tile_count() + 1, 0);
        for places in places {
            match common_tile(places) {
                Some(tile) => self.starts[tile + 1] += LANES as u32,
                None => places.iter().for_each(|&place| self.starts[tile_of(place) + 1] += 1),
            }
        }
        other_places.iter().for_each(|&place| self.starts[tile_of(place) + 1] += 1);
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        if self.samples.len() < count {
            // A little more, so that another frame does not need a little more.
            self.samples.resize(count + count / 16, 0);
            self.fragments.resize(count + count / 16, SmallFragment::default());
        }
        // Each start moves to the next one's place while its fragments are put down ...
        for (places, fragments) in places.iter().zip(fragments) {
            match common_tile(places) {
                Some(tile) => self.put_down(tile, places, fragments),
                None => self.put_down_each(places, fragments),
            }
        }
        self.put_down_each(other_places, other_fragments);
        // ... and back.
        self.starts.copy_within(0..grid.tile_count(), 1);
        self.starts[0] = 0;
    }

    /// Puts down fragments that lie in one tile.
    #[inline(always)]
    fn put_down<const N: usize>(&mut self, tile: usize, places: &[u32; N], fragments: &[SmallFragment; N]) {
        let start = self.starts[tile] as usize;
        self.starts[tile] += N as u32;
        self.samples[start..start + N].copy_from_slice(&places.map(sample_of));
        self.fragments[start..start + N].copy_from_slice(fragments);
    }

    #[inline(always)]
    fn put_down_each(&mut self, places: &[u32], fragments: &[SmallFragment]) {
        for (&place, &fragment) in places.iter().zip(fragments) {
            self.put_down(tile_of(place), &[place], &[fragment]);
        }
    }

    /// The fragments in a tile, in draw order, and their samples.
    #[inline(always)]
    pub(crate) fn tile(&self, number: u32) -> (&[SmallFragment], &[u16]) {
        if self.starts.is_empty() {
            return (&[], &[]);
        }
        let number = number as usize;
        let range = self.starts[number] as usize..self.starts[number + 1] as usize;
        (&self.fragments[range.clone()], &self.samples[range])
    }

    /// Adds how many fragments each tile has.
    pub(crate) fn add_counts(&self, counts: &mut [u64]) {
        add_counts(&self.starts, 1, counts);
    }

    /// Adds how many bytes each tile needs.
    pub(crate) fn add_bytes(&self, bytes: &mut [u64]) {
        add_counts(&self.starts, size_of::<SmallFragment>() + 2, bytes);
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.starts.capacity() * 4
            + self.fragments.capacity() * size_of::<SmallFragment>()
            + self.samples.capacity() * 2
    }
}

/// Adds the lengths of the ranges between `starts`, each place counting as so many.
pub(crate) fn add_counts(starts: &[u32], weight: usize, counts: &mut [u64]) {
    for (count, range) in counts.iter_mut().zip(starts.windows(2)) {
        *count += u64::from(range[1] - range[0]) * weight as u64;
    }
}
