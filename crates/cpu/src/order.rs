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

use fearless_simd::{Bytes, Simd, SimdBase, SimdMask, f64x8, u64x8};

use crate::fragments::Fragments;
use crate::tile::{FragmentCounts, TILE_SAMPLES};

/// Pixels of a strip.
pub(crate) const STRIP: usize = 8;

/// Rows that a network sorts in registers.
const BLOCK: usize = 16;

/// The order of a tile's fragments.
#[derive(Debug)]
pub(crate) struct Order {
    /// How many fragments each sample has, and where its first key stands; its next ones stand [`STRIP`] further each.
    counts: Vec<u32>,
    firsts: Vec<u32>,
    pub(crate) strips: Vec<Strip>,
    /// Rows of all strips. Where a pixel has fewer fragments than its strip has rows, the last ones are 0.
    keys: Vec<[u64; STRIP]>,
}

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
    #[inline(always)]
    pub(crate) fn sort<S: Simd>(&mut self, simd: S, fragments: &Fragments) -> FragmentCounts {
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
            self.keys.resize(row_count.next_power_of_two(), [0; STRIP]);
        }
        let rows = &mut self.keys[..row_count];
        rows.fill([0; STRIP]);
        let keys = rows.as_flattened_mut();
        let next: &mut [u32; TILE_SAMPLES] = (&mut self.firsts[..]).try_into().unwrap_or_else(|_| unreachable!());
        for (number, (&sample, &depth)) in samples.iter().zip(depths).enumerate().skip(1) {
            let place = &mut next[sample as usize % TILE_SAMPLES];
            keys[*place as usize] = u64::from(depth.to_bits()) << 32 | number as u64;
            *place += STRIP as u32;
        }
        for strip in &self.strips {
            let (first, count) = (strip.first_row as usize, strip.row_count as usize);
            for (lane, &sample) in strip.samples[..strip.sample_count as usize].iter().enumerate() {
                self.firsts[sample as usize] = (first * STRIP + lane) as u32;
            }
            sort_rows(simd, &mut self.keys[first..first + count]);
        }
        totals
    }

    /// Puts the samples that have fragments together into strips; returns how many rows these have.
    #[inline(always)]
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
    pub(crate) fn rows(&self, strip: &Strip) -> &[[u64; STRIP]] {
        &self.keys[strip.first_row as usize..(strip.first_row + strip.row_count) as usize]
    }

    /// The numbers of a sample's fragments, nearest first.
    pub(crate) fn of_sample(&self, sample: usize) -> impl Iterator<Item = u32> {
        let (first, count) = (self.firsts[sample] as usize, self.counts[sample] as usize);
        let keys = self.keys.as_flattened();
        (0..count).map(move |row| keys[first + row * STRIP] as u32)
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.keys.capacity() * size_of::<[u64; STRIP]>()
            + self.strips.capacity() * size_of::<Strip>()
            + TILE_SAMPLES * 8
    }
}

/// Sorts every column of `rows`, greatest first.
#[inline(always)]
fn sort_rows<S: Simd>(simd: S, rows: &mut [[u64; STRIP]]) {
    match rows.len() {
        0 | 1 => {}
        2 => sort_block::<S, 2>(simd, rows),
        3..=4 => sort_block::<S, 4>(simd, rows),
        5..=8 => sort_block::<S, 8>(simd, rows),
        9..=BLOCK => sort_block::<S, BLOCK>(simd, rows),
        _ => sort_many(simd, rows),
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, row: &[u64; STRIP]) -> f64x8<S> {
    u64x8::load_array_ref(simd, row).bitcast()
}

#[inline(always)]
fn store<S: Simd>(keys: f64x8<S>, row: &mut [u64; STRIP]) {
    keys.bitcast::<u64x8<S>>().store_array(row);
}

/// Compares and exchanges pairs of rows.
macro_rules! network {
    ($rows:ident: $($near:literal $far:literal),*) => {
        $(
            let (a, b) = ($rows[$near], $rows[$far]);
            ($rows[$near], $rows[$far]) = (a.max(b), a.min(b));
        )*
    };
}

/// Sorts up to `N` rows in registers by Batcher's odd-even merge sort (1968).
#[inline(always)]
fn sort_block<S: Simd, const N: usize>(simd: S, rows: &mut [[u64; STRIP]]) {
    let mut sorted: [f64x8<S>; N] = std::array::from_fn(|i| match rows.get(i) {
        Some(row) => load(simd, row),
        None => f64x8::splat(simd, 0.0),
    });
    match N {
        2 => {
            network!(sorted: 0 1);
        }
        4 => {
            network!(sorted:
            0 1, 2 3, 0 2, 1 3, 1 2
            );
        }
        8 => {
            network!(sorted:
            0 1, 2 3, 4 5, 6 7, 0 2, 1 3, 4 6, 5 7, 1 2, 5 6, 0 4, 1 5, 2 6, 3 7, 2 4, 3 5, 1 2, 3 4, 5 6
            );
        }
        _ => {
            network!(sorted:
            0 1, 2 3, 4 5, 6 7, 8 9, 10 11, 12 13, 14 15, 0 2, 1 3, 4 6, 5 7, 8 10, 9 11, 12 14, 13 15, 1 2, 5
            6, 9 10, 13 14, 0 4, 1 5, 2 6, 3 7, 8 12, 9 13, 10 14, 11 15, 2 4, 3 5, 10 12, 11 13, 1 2, 3 4, 5 6,
            9 10, 11 12, 13 14, 0 8, 1 9, 2 10, 3 11, 4 12, 5 13, 6 14, 7 15, 4 8, 5 9, 6 10, 7 11, 2 4, 3 5, 6
            8, 7 9, 10 12, 11 13, 1 2, 3 4, 5 6, 7 8, 9 10, 11 12, 13 14
            );
        }
    }
    for (row, keys) in rows.iter_mut().zip(sorted) {
        store(keys, row);
    }
}

/// Sorts blocks of rows and merges them.
#[inline(always)]
fn sort_many<S: Simd>(simd: S, rows: &mut [[u64; STRIP]]) {
    if is_sorted(simd, rows.iter()) {
        return;
    }
    if is_sorted(simd, rows.iter().rev()) {
        rows.reverse();
        return;
    }
    for block in rows.chunks_mut(BLOCK) {
        sort_block::<S, BLOCK>(simd, block);
    }
    let count = rows.len();
    let mut sorted = BLOCK;
    while sorted < count {
        let mut step = sorted;
        while step >= 1 {
            let mut start = step % sorted;
            while start + step < count {
                for i in start..(start + step).min(count - step) {
                    if i / (2 * sorted) == (i + step) / (2 * sorted) {
                        let (a, b) = (load(simd, &rows[i]), load(simd, &rows[i + step]));
                        store(a.max(b), &mut rows[i]);
                        store(a.min(b), &mut rows[i + step]);
                    }
                }
                start += 2 * step;
            }
            step /= 2;
        }
        sorted *= 2;
    }
}

/// Whether all columns fall, as those of surfaces drawn in order do; or rise, seen from the other end.
#[inline(always)]
fn is_sorted<'r, S: Simd>(simd: S, mut rows: impl Iterator<Item = &'r [u64; STRIP]>) -> bool {
    let Some(first) = rows.next() else { return true };
    let mut last = load(simd, first);
    rows.all(|row| {
        let this = load(simd, row);
        let falls = this.simd_le(last).all_true();
        last = this;
        falls
    })
}
