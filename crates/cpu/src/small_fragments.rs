//! Fragments of small triangles where they are made, those of a meshlet tile by tile, and the runs of them that each tile has.

use crate::bin::{TileGrid, sort_by_tile};

/// Fragments of a chunk's small triangles, as structure of arrays.
#[derive(Debug, Default)]
pub(crate) struct SmallFragments {
    /// Where in its tile each one is.
    samples: Vec<u16>,
    /// Depth and brightness, see [`lit_key`](crate::lit_key); without rank.
    keys: Vec<u64>,
    /// Numbers of their triangles among those of the meshlet.
    triangles: Vec<u16>,
    /// How many there are; beyond is room.
    count: usize,
    /// All of them, one run after the other.
    runs: Vec<Run>,
    /// The runs of tile `i` are `by_tile[starts[i]..starts[i + 1]]`, in draw order.
    starts: Vec<u32>,
    by_tile: Vec<Run>,
}

/// Fragments in one tile that were made one after the other, all of one draw.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Run {
    pub(crate) tile: u32,
    /// Number of the first among those of the chunk.
    pub(crate) first: u32,
    pub(crate) count: u32,
    /// Number of the draw, and the primitive that the meshlet's first triangle is.
    pub(crate) draw: u32,
    pub(crate) first_primitive: u32,
}

/// Some fragments of a draw.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunFragments<'a> {
    pub(crate) samples: &'a [u16],
    pub(crate) keys: &'a [u64],
    pub(crate) triangles: &'a [u16],
    pub(crate) draw: u32,
    pub(crate) first_primitive: u32,
}

/// Room for fragments.
pub(crate) struct NewFragments<'a> {
    pub(crate) samples: &'a mut [u16],
    pub(crate) keys: &'a mut [u64],
    pub(crate) triangles: &'a mut [u16],
}

/// Bytes of a fragment.
const FRAGMENT_BYTES: usize = 12;

impl RunFragments<'_> {
    /// The primitive of one of them.
    #[inline(always)]
    pub(crate) fn primitive(&self, place: usize) -> u32 {
        self.first_primitive + u32::from(self.triangles[place])
    }
}

impl SmallFragments {
    /// Forgets all.
    pub(crate) fn begin(&mut self) {
        self.count = 0;
        self.runs.clear();
    }

    /// Tells of fragments to be added: of a draw and of a meshlet, how many in a tile.
    pub(crate) fn add_run(&mut self, tile: u32, count: u32, [draw, first_primitive]: [u32; 2]) {
        let first = self.runs.last().map_or(0, |run| run.first + run.count);
        self.runs.push(Run { tile, first, count, draw, first_primitive });
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
            keys: &mut self.keys[first..end],
            triangles: &mut self.triangles[first..end],
        }
    }

    #[cold]
    fn grow(&mut self, end: usize) {
        let room = (end + end / 4).max(1024);
        resize(&mut self.samples, room);
        resize(&mut self.keys, room);
        resize(&mut self.triangles, room);
    }

    /// Sorts runs by tile, keeping draw order.
    pub(crate) fn finish(&mut self, grid: &TileGrid) {
        let runs = self.runs.iter().map(|&run| (run.tile, run));
        sort_by_tile(runs, grid, &mut self.starts, &mut self.by_tile);
    }

    /// The fragments in a tile.
    #[inline(always)]
    pub(crate) fn tile(&self, number: u32) -> TileRuns<'_> {
        let mut runs: &[Run] = &[];
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
            // A run stands in both lists.
            bytes[run.tile as usize] += (run.count as usize * FRAGMENT_BYTES + 2 * size_of::<Run>()) as u64;
        }
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.samples.capacity() * FRAGMENT_BYTES
            + self.runs.capacity() * size_of::<Run>()
            + self.starts.capacity() * 4
            + self.by_tile.capacity() * size_of::<Run>()
    }
}

/// To exactly so many: what vectors usually grow by is more than the budget knows of.
fn resize<T: Copy + Default>(values: &mut Vec<T>, count: usize) {
    values.reserve_exact(count - values.len());
    values.resize(count, T::default());
}

/// The runs of fragments in a tile, in draw order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TileRuns<'a> {
    all: &'a SmallFragments,
    runs: &'a [Run],
    /// How many of the first run's fragments were taken.
    begun: u32,
}

impl<'a> TileRuns<'a> {
    pub(crate) fn is_empty(self) -> bool {
        self.runs.is_empty()
    }

    /// All fragments.
    pub(crate) fn all(mut self) -> impl Iterator<Item = RunFragments<'a>> + Clone {
        std::iter::from_fn(move || self.next_before(None))
    }

    /// Takes the next fragments, up to the first one of this primitive or one behind it in draw order.
    #[inline(always)]
    pub(crate) fn next_before(&mut self, primitive: Option<u32>) -> Option<RunFragments<'a>> {
        let (run, others) = self.runs.split_first()?;
        let (first, end) = ((run.first + self.begun) as usize, (run.first + run.count) as usize);
        let count = match primitive {
            None => end - first,
            Some(primitive) => {
                let is_before = |triangle: &&u16| run.first_primitive + u32::from(**triangle) < primitive;
                self.all.triangles[first..end].iter().take_while(is_before).count()
            }
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
            keys: &self.all.keys[range.clone()],
            triangles: &self.all.triangles[range],
            draw: run.draw,
            first_primitive: run.first_primitive,
        })
    }
}
