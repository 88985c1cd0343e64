//! Fragments of small triangles to tiles: as they come from the meshlets of a chunk, then sorted by tile.

use crate::bin::TileGrid;

/// Fragments of a chunk's small triangles, as structure of arrays.
#[derive(Debug, Default)]
pub(crate) struct SmallFragments {
    /// Where in its tile each one is.
    samples: Vec<u16>,
    depths: Vec<f32>,
    /// Brightness of the surface.
    lights: Vec<f32>,
    primitives: Vec<u32>,
    /// How many there are; beyond is room.
    count: usize,
    /// All of them, one run after the other.
    pub(crate) runs: Vec<Run>,
    /// The runs of tile `i` are `by_tile[starts[i]..starts[i + 1]]`, in draw order.
    starts: Vec<u32>,
    by_tile: Vec<TileRun>,
}

/// Fragments in one tile that were made one after the other, all of one draw.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    pub(crate) tile: u32,
    pub(crate) count: u32,
    /// Number of the draw.
    pub(crate) draw: u32,
}

/// Such fragments among all those of the chunk.
#[derive(Debug, Clone, Copy, Default)]
struct TileRun {
    first: u32,
    count: u32,
    draw: u32,
}

/// Some fragments of a draw.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunFragments<'a> {
    pub(crate) samples: &'a [u16],
    pub(crate) depths: &'a [f32],
    pub(crate) lights: &'a [f32],
    pub(crate) primitives: &'a [u32],
    pub(crate) draw: u32,
}

/// Room for fragments.
pub(crate) struct NewFragments<'a> {
    pub(crate) samples: &'a mut [u16],
    pub(crate) depths: &'a mut [f32],
    pub(crate) lights: &'a mut [f32],
    pub(crate) primitives: &'a mut [u32],
}

/// Bytes of a fragment.
const FRAGMENT_BYTES: usize = 14;

impl SmallFragments {
    /// Forgets all.
    pub(crate) fn begin(&mut self) {
        self.count = 0;
        self.runs.clear();
    }

    /// Adds so many, to be written, and room for `beyond` more that may be.
    #[inline(always)]
    pub(crate) fn add(&mut self, count: usize, beyond: usize) -> NewFragments<'_> {
        let first = self.count;
        self.count += count;
        let end = self.count + beyond;
        if self.samples.len() < end {
            self.grow(end);
        }
        NewFragments {
            samples: &mut self.samples[first..end],
            depths: &mut self.depths[first..end],
            lights: &mut self.lights[first..end],
            primitives: &mut self.primitives[first..end],
        }
    }

    #[cold]
    fn grow(&mut self, end: usize) {
        let room = (end + end / 4).max(1024);
        self.samples.resize(room, 0);
        self.depths.resize(room, 0.0);
        self.lights.resize(room, 0.0);
        self.primitives.resize(room, 0);
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
        self.by_tile.resize(self.runs.len(), TileRun::default());
        let mut first = 0;
        // Each start moves to the next one's place while its runs are put down ...
        for run in &self.runs {
            let place = &mut self.starts[run.tile as usize];
            self.by_tile[*place as usize] = TileRun { first, count: run.count, draw: run.draw };
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
        let mut runs: &[TileRun] = &[];
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
            bytes[run.tile as usize] += u64::from(run.count) * FRAGMENT_BYTES as u64;
        }
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.samples.capacity() * FRAGMENT_BYTES
            + self.runs.capacity() * size_of::<Run>()
            + self.starts.capacity() * 4
            + self.by_tile.capacity() * size_of::<TileRun>()
    }
}

/// The runs of fragments in a tile, in draw order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TileRuns<'a> {
    all: &'a SmallFragments,
    runs: &'a [TileRun],
    /// How many of the first run's fragments were taken.
    begun: u32,
}

impl<'a> TileRuns<'a> {
    pub(crate) fn is_empty(self) -> bool {
        self.runs.is_empty()
    }

    /// Takes the next fragments, up to the first one of this primitive or one behind it in draw order.
    #[inline(always)]
    pub(crate) fn next_before(&mut self, primitive: Option<u32>) -> Option<RunFragments<'a>> {
        let (run, others) = self.runs.split_first()?;
        let (first, end) = ((run.first + self.begun) as usize, (run.first + run.count) as usize);
        let count = match primitive {
            None => end - first,
            Some(primitive) => self.all.primitives[first..end].iter().take_while(|&&other| other < primitive).count(),
        };
        if count == 0 {
            return None;
        }
        if first + count == end {
            (self.runs, self.begun) = (others, 0);
        } else {
            self.begun += count as u32;
        }
        let range = first..first + count;
        Some(RunFragments {
            samples: &self.all.samples[range.clone()],
            depths: &self.all.depths[range.clone()],
            lights: &self.all.lights[range.clone()],
            primitives: &self.all.primitives[range],
            draw: run.draw,
        })
    }
}
