//! Fragments of small triangles to tiles: as they come from the meshlets of a chunk, then sorted by tile.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use crate::bin::TileGrid;

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

/// Fragments of a chunk's small triangles.
#[derive(Debug, Default)]
pub(crate) struct SmallFragments {
    /// Where in its tile each one is.
    samples: Vec<u16>,
    fragments: Vec<SmallFragment>,
    /// How many there are; beyond is room.
    count: usize,
    /// All of them, one run after the other: the tile and how many.
    pub(crate) runs: Vec<Run>,
    /// The runs of tile `i` are `by_tile[starts[i]..starts[i + 1]]`, in draw order.
    starts: Vec<u32>,
    by_tile: Vec<Range<u32>>,
}

/// Fragments in one tile that were made one after the other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    pub(crate) tile: u32,
    pub(crate) count: u32,
}

impl SmallFragments {
    /// Forgets all.
    pub(crate) fn begin(&mut self) {
        self.count = 0;
        self.runs.clear();
    }

    /// Adds so many: their samples and they themselves, to be written, and `beyond` more that may be.
    #[inline(always)]
    pub(crate) fn add(&mut self, count: usize, beyond: usize) -> (&mut [u16], &mut [SmallFragment]) {
        let first = self.count;
        self.count += count;
        let end = self.count + beyond;
        if self.samples.len() < end {
            self.grow(end);
        }
        (&mut self.samples[first..end], &mut self.fragments[first..end])
    }

    #[cold]
    fn grow(&mut self, end: usize) {
        let room = (end + end / 4).max(1024);
        self.samples.resize(room, 0);
        self.fragments.resize(room, SmallFragment::default());
    }

    /// Sorts runs by tile, keeping draw order.
    pub(crate) fn finish(&mut self, grid: &TileGrid) {
        self.starts.clear();
        if self.runs.is_empty() {
            return;
        }
        self.starts.resize(grid.tile_count() + 1, 0);
        for run in &self.runs {
            self.starts[run.tile as usize + 1] += 1;
        }
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        self.by_tile.resize(self.runs.len(), 0..0);
        let mut first = 0;
        // Each start moves to the next one's place while its runs are put down ...
        for run in &self.runs {
            let place = &mut self.starts[run.tile as usize];
            self.by_tile[*place as usize] = first..first + run.count;
            *place += 1;
            first += run.count;
        }
        // ... and back.
        self.starts.copy_within(0..grid.tile_count(), 1);
        self.starts[0] = 0;
    }

    /// The fragments in a tile.
    #[inline(always)]
    pub(crate) fn tile(&self, number: u32) -> TileRuns<'_> {
        let mut runs: &[Range<u32>] = &[];
        if !self.starts.is_empty() {
            let number = number as usize;
            runs = &self.by_tile[self.starts[number] as usize..self.starts[number + 1] as usize];
        }
        TileRuns { all: self, runs, begun: 0 }
    }

    /// Adds how many fragments each tile has.
    pub(crate) fn add_counts(&self, counts: &mut [u64]) {
        for run in &self.runs {
            counts[run.tile as usize] += u64::from(run.count);
        }
    }

    /// Adds how many bytes each tile needs.
    pub(crate) fn add_bytes(&self, bytes: &mut [u64]) {
        for run in &self.runs {
            bytes[run.tile as usize] += u64::from(run.count) * (size_of::<SmallFragment>() + 2) as u64;
        }
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.fragments.capacity() * size_of::<SmallFragment>()
            + self.samples.capacity() * 2
            + self.runs.capacity() * size_of::<Run>()
            + self.starts.capacity() * 4
            + self.by_tile.capacity() * size_of::<Range<u32>>()
    }
}

/// The runs of fragments in a tile, in draw order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TileRuns<'a> {
    all: &'a SmallFragments,
    runs: &'a [Range<u32>],
    /// How many of the first run's fragments were taken.
    begun: u32,
}

impl<'a> TileRuns<'a> {
    pub(crate) fn is_empty(self) -> bool {
        self.runs.is_empty()
    }

    /// Takes the next fragments and their samples, up to the first one of this primitive or one behind it in draw order.
    #[inline(always)]
    pub(crate) fn next_before(&mut self, primitive: Option<u32>) -> Option<(&'a [SmallFragment], &'a [u16])> {
        let (run, others) = self.runs.split_first()?;
        let range = (run.start + self.begun) as usize..run.end as usize;
        let (fragments, samples) = (&self.all.fragments[range.clone()], &self.all.samples[range]);
        let count = match primitive {
            None => fragments.len(),
            Some(primitive) => fragments.iter().take_while(|fragment| fragment.primitive < primitive).count(),
        };
        if count == 0 {
            return None;
        }
        if count == fragments.len() {
            (self.runs, self.begun) = (others, 0);
        } else {
            self.begun += count as u32;
        }
        Some((&fragments[..count], &samples[..count]))
    }
}
