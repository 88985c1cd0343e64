//! Fragments into order: those of each pixel side by side, nearest first.
//!
//! Eight pixels are sorted at a time, a pixel to a lane: pixels of about equally many fragments are put together into a
//! *strip*, whose row `i` holds the `i`-th key of each, and sorting networks compare whole rows. Networks take no branches
//! that depend on the keys; insertion sort (LFB chapter, section 20.4.1), pixel by pixel, takes one mispredicted branch for
//! each pixel and about one for each fragment, which costs more than all its comparisons.
//!
//! A key is a fragment's depth above its number in the tile. As fragments are numbered in draw order, this orders like the
//! contract's order key. Keys are positive and look like f64 numbers of the same order, and of those every SIMD level has
//! maximum and minimum.

use fearless_simd::{Bytes, Level, Simd, SimdBase, SimdMask, dispatch, f64x8, u64x8};

use crate::fragments::Fragments;
use crate::tile::{FragmentCounts, TILE_SAMPLES};

/// Pixels of a strip.
pub(crate) const STRIP: usize = 8;

/// Rows that a network sorts in registers.
const BLOCK: usize = 8;

/// The order of a tile's fragments.
#[derive(Debug)]
pub(crate) struct Order {
    /// How many fragments each sample has, and where its first key stands; its next ones stand [`STRIP`] further each.
    counts: Vec<u32>,
    firsts: Vec<u32>,
    pub(crate) strips: Vec<Strip>,
    /// Rows of all strips. Where a pixel has fewer fragments than its strip has rows, the last ones are 0.
    keys: Vec<Row>,
}

/// A key of each of a strip's pixels. One cache line, so that no vector lies in two.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
pub(crate) struct Row(pub(crate) [u64; STRIP]);

/// Eight pixels of about equally many fragments.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Strip {
    first_row: u32,
    row_count: u32,
    /// Samples in the tile.
    pub(crate) samples: [u16; STRIP],
    /// How many of the samples there are: the others are 0.
    pub(crate) sample_count: u32,
}

impl Default for Order {
    fn default() -> Self {
        Self { counts: vec![0; TILE_SAMPLES], firsts: vec![0; TILE_SAMPLES], strips: Vec::new(), keys: Vec::new() }
    }
}

/// Classes of pixels by their number of fragments: exact up to 32, then eight to each doubling.
const CLASSES: usize = 256;

fn class(count: u32) -> usize {
    if count < 32 {
        return count as usize;
    }
    let log = count.ilog2();
    (32 + (log - 5) * 8 + (count >> (log - 3) & 7)) as usize
}

impl Order {
    /// Orders the fragments of a tile.
    pub(crate) fn sort(&mut self, level: Level, fragments: &Fragments) -> FragmentCounts {
        self.strips.clear();
        self.counts.fill(0);
        let mut totals = FragmentCounts { fragments: fragments.len() as u64, ..FragmentCounts::default() };
        if fragments.len() == 0 {
            return totals;
        }
        let (samples, depths) = fragments.samples_and_depths();
        let counts: &mut [u32; TILE_SAMPLES] = (&mut self.counts[..]).try_into().unwrap_or_else(|_| unreachable!());
        for &sample in &samples[1..] {
            counts[sample as usize % TILE_SAMPLES] += 1;
        }
        let row_count = self.make_strips(&mut totals);
        if self.keys.len() < row_count {
            self.keys.resize(row_count.next_power_of_two(), Row::default());
        }
        let rows = &mut self.keys[..row_count];
        rows.fill(Row::default());
        let next: &mut [u32; TILE_SAMPLES] = (&mut self.firsts[..]).try_into().unwrap_or_else(|_| unreachable!());
        for (number, (&sample, &depth)) in samples.iter().zip(depths).enumerate().skip(1) {
            let place = &mut next[sample as usize % TILE_SAMPLES];
            let (row, lane) = (*place as usize / STRIP, *place as usize % STRIP);
            rows[row].0[lane] = u64::from(depth.to_bits()) << 32 | number as u64;
            *place += STRIP as u32;
        }
        dispatch!(level, simd => self.sort_strips(simd));
        totals
    }

    #[inline(always)]
    fn sort_strips<S: Simd>(&mut self, simd: S) {
        for strip in &self.strips {
            let (first, count) = (strip.first_row as usize, strip.row_count as usize);
            for (lane, &sample) in strip.samples[..strip.sample_count as usize].iter().enumerate() {
                self.firsts[sample as usize] = (first * STRIP + lane) as u32;
            }
            sort_rows(simd, &mut self.keys[first..first + count]);
        }
    }

    /// Puts the samples that have fragments together into strips; returns how many rows these have.
    fn make_strips(&mut self, totals: &mut FragmentCounts) -> usize {
        let mut starts = [0u16; CLASSES];
        for &count in &self.counts {
            starts[class(count)] += 1;
        }
        // Most fragments last; samples without any are left out.
        let mut start = 0;
        starts[0] = 0;
        for place in &mut starts {
            start += std::mem::replace(place, start);
        }
        let covered = start as usize;
        let mut by_class = [0u16; TILE_SAMPLES];
        for (sample, &count) in self.counts.iter().enumerate() {
            if count > 0 {
                let place = &mut starts[class(count)];
                by_class[*place as usize] = sample as u16;
                *place += 1;
            }
        }
        totals.covered_pixels = covered as u64;
        let mut first_row = 0;
        for samples in by_class[..covered].chunks(STRIP) {
            let mut strip = Strip { first_row, row_count: 0, samples: [0; STRIP], sample_count: samples.len() as u32 };
            for (lane, &sample) in samples.iter().enumerate() {
                strip.samples[lane] = sample;
                strip.row_count = strip.row_count.max(self.counts[sample as usize]);
                self.firsts[sample as usize] = first_row * STRIP as u32 + lane as u32;
            }
            totals.greatest = totals.greatest.max(strip.row_count);
            first_row += strip.row_count;
            self.strips.push(strip);
        }
        first_row as usize
    }

    /// The rows of a strip: in each the number of a fragment of every pixel in the low half of a key, 0 for none.
    #[inline(always)]
    pub(crate) fn rows(&self, strip: &Strip) -> &[Row] {
        &self.keys[strip.first_row as usize..(strip.first_row + strip.row_count) as usize]
    }

    /// The numbers of a sample's fragments, nearest first.
    pub(crate) fn of_sample(&self, sample: usize) -> impl Iterator<Item = u32> {
        let (first, count) = (self.firsts[sample] as usize, self.counts[sample] as usize);
        let (first, lane) = (first / STRIP, first % STRIP);
        self.keys[first..first + count].iter().map(move |row| row.0[lane] as u32)
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.keys.capacity() * size_of::<Row>() + self.strips.capacity() * size_of::<Strip>() + TILE_SAMPLES * 8
    }
}

/// Sorts every column of `rows`, greatest first: blocks by networks, which are then merged.
#[inline(always)]
fn sort_rows<S: Simd>(simd: S, rows: &mut [Row]) {
    if rows.len() > BLOCK {
        if is_sorted(simd, rows.iter()) {
            return;
        }
        if is_sorted(simd, rows.iter().rev()) {
            rows.reverse();
            return;
        }
    }
    for block in rows.chunks_mut(BLOCK) {
        match block.len() {
            0 | 1 => {}
            2 => sort_2(simd, block),
            3 | 4 => sort_4(simd, block),
            _ => sort_8(simd, block),
        }
    }
    let mut sorted = BLOCK;
    while sorted < rows.len() {
        for pair in rows.chunks_mut(2 * sorted).filter(|pair| pair.len() > sorted) {
            merge(simd, pair, sorted);
        }
        sorted *= 2;
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, row: &Row) -> f64x8<S> {
    u64x8::load_array_ref(simd, &row.0).bitcast()
}

#[inline(always)]
fn store<S: Simd>(keys: f64x8<S>, row: &mut Row) {
    keys.bitcast::<u64x8<S>>().store_array(&mut row.0);
}

/// Sorts up to so many rows in registers by Batcher's odd-even merge sort (1968).
macro_rules! network {
    ($name:ident, $count:literal, $($near:literal $far:literal),*) => {
        #[inline(always)]
        fn $name<S: Simd>(simd: S, rows: &mut [Row]) {
            let mut sorted = [f64x8::splat(simd, 0.0); $count];
            for (keys, row) in sorted.iter_mut().zip(rows.iter()) {
                *keys = load(simd, row);
            }
            $(
                let (a, b) = (sorted[$near], sorted[$far]);
                (sorted[$near], sorted[$far]) = (a.max(b), a.min(b));
            )*
            for (row, keys) in rows.iter_mut().zip(sorted) {
                store(keys, row);
            }
        }
    };
}

network!(sort_2, 2, 0 1);
network!(sort_4, 4, 0 1, 2 3, 0 2, 1 3, 1 2);
network!(
    sort_8,
    8,
    0 1, 2 3, 4 5, 6 7, 0 2, 1 3, 4 6, 5 7, 1 2, 5 6, 0 4, 1 5, 2 6, 3 7, 2 4, 3 5, 1 2, 3 4, 5 6
);

/// Merges `sorted` sorted rows, a power of two, with the sorted rest: Batcher's odd-even merge, without the comparisons
/// that reach beyond the last row, which could only move a 0.
#[inline(always)]
fn merge<S: Simd>(simd: S, rows: &mut [Row], sorted: usize) {
    let (near, far) = rows.split_at_mut(sorted);
    exchange(simd, near, far);
    let mut step = sorted / 2;
    while step >= 1 {
        for pair in rows[step..].chunks_mut(2 * step).filter(|pair| pair.len() > step) {
            let (near, far) = pair.split_at_mut(step);
            exchange(simd, near, far);
        }
        step /= 2;
    }
}

/// Compares and exchanges each of the rows in front with the one in the same place behind, if there is one.
#[inline(always)]
fn exchange<S: Simd>(simd: S, near: &mut [Row], far: &mut [Row]) {
    for (near, far) in near.iter_mut().zip(far) {
        let (a, b) = (load(simd, near), load(simd, far));
        store(a.max(b), near);
        store(a.min(b), far);
    }
}

/// Whether all columns fall, as those of surfaces drawn in order do; or rise, seen from the other end.
#[inline(always)]
fn is_sorted<'r, S: Simd>(simd: S, mut rows: impl Iterator<Item = &'r Row>) -> bool {
    let Some(first) = rows.next() else { return true };
    let mut last = load(simd, first);
    rows.all(|row| {
        let this = load(simd, row);
        let falls = this.simd_le(last).all_true();
        last = this;
        falls
    })
}
