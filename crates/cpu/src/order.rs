//! Fragments into order: those of each pixel side by side, nearest first.
//!
//! Eight pixels are sorted at a time, a pixel to a lane: neighbours of few fragments, or pixels of about equally many, are
//! put together into a *strip*, whose row `i` holds the `i`-th key of each, and sorting networks compare whole rows.
//! Networks take no branches that depend on the keys; insertion sort (LFB chapter, section 20.4.1), pixel by pixel, takes
//! one mispredicted branch for each pixel and about one for each fragment, which costs more than all its comparisons.
//!
//! A key is a fragment's depth above its number in the tile, or a [`lit_key`](crate::lit_key). As fragments are numbered in draw
//! order, this orders like the contract's order key. Keys are positive and look like f64 numbers of the same order, and of
//! those every SIMD level has maximum and minimum.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Bytes, Level, Simd, SimdBase, SimdMask, dispatch, f32x8, i32x8, u32x8};

use crate::fragments::Fragments;
use crate::lit_key;
use crate::networks::{BLOCK, Bits, Permutation, padded, sort_rows};
use crate::simd::lane_numbers;
use crate::small_fragments::RunFragments;
use crate::tile::{Band, FragmentCounts, TILE_SAMPLES};

/// Pixels of a strip.
pub(crate) const STRIP: usize = 8;

/// The order of a tile's fragments.
#[derive(Debug)]
pub(crate) struct Order {
    /// How many fragments each sample has, if there are strips, and where its first key goes, then the next one, [`STRIP`]
    /// further each; for keys with light below the next one's rank.
    counts: Vec<u32>,
    next: Vec<u32>,
    pub(crate) strips: Vec<Strip>,
    /// Rows of all strips, and those that pad them. Where a pixel has fewer fragments than its strip has rows, the last ones
    /// are 0.
    keys: Vec<Row>,
    /// How the last strip of many rows was brought into order.
    last: Permutation,
}

/// A key of each of a strip's pixels. One cache line, so that no vector lies in two.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Row(pub(crate) [u64; STRIP]);

/// Eight pixels: neighbours, or of about equally many fragments.
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
        Self {
            counts: vec![0; TILE_SAMPLES],
            next: vec![0; TILE_SAMPLES],
            strips: Vec::new(),
            keys: Vec::new(),
            last: Permutation::default(),
        }
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

/// Counts the fragments at each sample, eight at a time where they fill rows of the tile.
#[inline(always)]
fn count_rows<S: Simd>(simd: S, fragments: &Fragments, counts: &mut [u32; TILE_SAMPLES]) {
    let (samples, _) = fragments.samples_and_depths();
    let mut from = 1;
    for eight in fragments.eights() {
        count_each(&samples[from..eight], counts);
        let counts = of_eight(counts, samples[eight]);
        (u32x8::load_array_ref(simd, counts) + 1).store_array(counts);
        from = eight + STRIP;
    }
    count_each(&samples[from..], counts);
}

/// Counts fragment by fragment.
#[inline(always)]
fn count_each(samples: &[u32], counts: &mut [u32; TILE_SAMPLES]) {
    for &sample in samples {
        counts[sample as usize % TILE_SAMPLES] += 1;
    }
}

/// Puts the keys of fragments into rows, eight at a time where they fill rows of the tile: where a sample's next one goes, `next`
/// tells.
#[inline(always)]
fn put_rows_down<S: Simd>(simd: S, fragments: &Fragments, next: &mut [u32; TILE_SAMPLES], rows: &mut [Row]) {
    let lanes = lane_numbers(simd);
    let (samples, depths) = fragments.samples_and_depths();
    let mut from = 1;
    for eight in fragments.eights() {
        if from < eight {
            put_each_down(samples, depths, from..eight, next, rows);
            from = eight;
        }
        let these = eight..eight + STRIP;
        let places = of_eight(next, samples[eight]);
        let row = places[0] as usize / STRIP;
        // Unless the eight are a strip and have as many fragments so far.
        if places[0] as usize != row * STRIP
            || !u32x8::load_array_ref(simd, places).simd_eq(lanes + places[0]).all_true()
        {
            continue;
        }
        let their_depths = f32x8::from_slice(simd, &depths[these.clone()]);
        lit_key::store_halves([lanes + eight as u32, their_depths.bitcast()], &mut rows[row].0);
        (lanes + (places[0] + STRIP as u32)).store_array(places);
        from = these.end;
    }
    put_each_down(samples, depths, from..samples.len(), next, rows);
}

/// Puts the keys of fragments down one by one. A function of its own, so that its counters stay in registers.
#[inline(never)]
fn put_each_down(
    samples: &[u32],
    depths: &[f32],
    numbers: Range<usize>,
    next: &mut [u32; TILE_SAMPLES],
    rows: &mut [Row],
) {
    let keys: &mut [u64] = bytemuck::cast_slice_mut(rows);
    let first = numbers.start as u64;
    for (after, (&sample, &depth)) in samples[numbers.clone()].iter().zip(&depths[numbers]).enumerate() {
        let place = &mut next[sample as usize % TILE_SAMPLES];
        keys[*place as usize] = u64::from(depth.to_bits()) << 32 | (first + after as u64);
        *place += STRIP as u32;
    }
}

/// What there is for eight neighbours, the first of which is at a multiple of eight.
#[inline(always)]
fn of_eight(values: &mut [u32; TILE_SAMPLES], first: u32) -> &mut [u32; STRIP] {
    &mut values.as_chunks_mut().0[first as usize / STRIP % (TILE_SAMPLES / STRIP)]
}

/// Counts the fragments in a band, of a tile that is cut into several if `CUT`.
#[inline(never)]
fn count<const CUT: bool>(samples: &[u16], band: Band, counts: &mut [u32; TILE_SAMPLES]) {
    for &sample in samples {
        if let Some(sample) = in_band::<CUT>(sample, band) {
            counts[sample % TILE_SAMPLES] += 1;
        }
    }
}

/// As [`put_each_down`], of fragments in a band, whose keys only lack a rank.
#[inline(never)]
fn put_lit_down<const CUT: bool>(run: RunFragments<'_>, band: Band, next: &mut [u32; TILE_SAMPLES], keys: &mut [u64]) {
    for (&sample, &key) in run.samples.iter().zip(run.keys) {
        if let Some(sample) = in_band::<CUT>(sample, band) {
            let next = &mut next[sample % TILE_SAMPLES];
            keys[(*next & (FIRST_RANK - 1)) as usize] = key | lit_key::rank(*next >> PLACE_BITS);
            // The last rank may be followed by 0, which nothing gets.
            *next = next.wrapping_add(FIRST_RANK + STRIP as u32);
        }
    }
}

/// A sample of a tile as one of a band, which is the whole tile unless that is cut.
#[inline(always)]
fn in_band<const CUT: bool>(sample: u16, band: Band) -> Option<usize> {
    if CUT { band.sample(sample) } else { Some(usize::from(sample)) }
}

/// Bits of the place where a sample's next key goes; above them is its rank.
const PLACE_BITS: u32 = u32::BITS - lit_key::RANK_BITS;

/// The first rank, above a place.
const FIRST_RANK: u32 = 1 << PLACE_BITS;

/// What there is for each sample of a tile.
#[inline(always)]
fn of_samples(values: &mut [u32]) -> &mut [u32; TILE_SAMPLES] {
    values.try_into().unwrap_or_else(|_| unreachable!())
}

/// So many rows without any keys.
fn cleared(rows: &mut Vec<Row>, count: usize) -> &mut [Row] {
    if rows.len() < count {
        rows.resize(count.next_power_of_two(), Row::default());
    }
    let rows = &mut rows[..count];
    rows.fill(Row::default());
    rows
}

impl Order {
    /// The order of no fragments.
    pub(crate) fn clear(&mut self) {
        self.strips.clear();
    }

    /// Orders the fragments of a tile.
    pub(crate) fn sort(&mut self, level: Level, fragments: &Fragments) -> FragmentCounts {
        let mut totals = FragmentCounts::default();
        self.clear();
        if fragments.len() == 0 {
            return totals;
        }
        self.counts.fill(0);
        let counts = of_samples(&mut self.counts);
        let (samples, depths) = fragments.samples_and_depths();
        let has_whole_rows = fragments.has_whole_rows();
        if has_whole_rows {
            dispatch!(level, simd => count_rows(simd, fragments, counts));
        } else {
            count_each(&samples[1..], counts);
        }
        let row_count = dispatch!(level, simd => self.make_strips(simd, has_whole_rows, &mut totals));
        let (next, rows) = (of_samples(&mut self.next), cleared(&mut self.keys, row_count));
        if has_whole_rows {
            dispatch!(level, simd => put_rows_down(simd, fragments, next, rows));
        } else {
            put_each_down(samples, depths, 1..samples.len(), next, rows);
        }
        self.last.begin(Bits { first: 0, count: u32::BITS }, fragments.len() + 1);
        self.sort_strips(level);
        totals
    }

    /// Orders those fragments of small triangles that lie in a band, by keys with their brightness; `None`, and no
    /// order, if a pixel has too many for such keys.
    pub(crate) fn sort_lit<'a>(
        &mut self,
        level: Level,
        runs: impl Iterator<Item = RunFragments<'a>> + Clone,
        band: Band,
    ) -> Option<FragmentCounts> {
        let mut totals = FragmentCounts::default();
        self.clear();
        self.counts.fill(0);
        let counts = of_samples(&mut self.counts);
        let count_run = if band.is_whole_tile() { count::<false> } else { count::<true> };
        for run in runs.clone() {
            count_run(run.samples, band, counts);
        }
        let row_count = dispatch!(level, simd => self.make_strips(simd, false, &mut totals));
        if totals.greatest > lit_key::MOST_RANKS {
            self.clear();
            return None;
        }
        let next = of_samples(&mut self.next);
        for next in next.iter_mut() {
            *next |= FIRST_RANK;
        }
        let keys = bytemuck::cast_slice_mut(cleared(&mut self.keys, row_count));
        let put_run_down = if band.is_whole_tile() { put_lit_down::<false> } else { put_lit_down::<true> };
        for run in runs {
            put_run_down(run, band, next, keys);
        }
        self.last.begin(lit_key::RANK, lit_key::MOST_RANKS as usize + 1);
        self.sort_strips(level);
        Some(totals)
    }

    #[inline(never)]
    fn sort_strips(&mut self, level: Level) {
        dispatch!(level, simd => self.sort_strips_simd(simd));
    }

    #[inline(always)]
    fn sort_strips_simd<S: Simd>(&mut self, simd: S) {
        for strip in &self.strips {
            let (first, count) = (strip.first_row as usize, strip.row_count as usize);
            sort_rows(simd, &mut self.keys[first..first + padded(count)], count, &mut self.last);
        }
    }

    /// Puts the samples that have fragments together into strips; returns how many rows these have. Neighbours that have
    /// few are a strip, however few; others are first sorted by how many, unless neighbours shall stay together and have about
    /// equally many.
    #[inline(always)]
    fn make_strips<S: Simd>(&mut self, simd: S, stay_together: bool, totals: &mut FragmentCounts) -> usize {
        let lanes = lane_numbers(simd);
        let mut fragments = u32x8::splat(simd, 0);
        let mut row_count = 0;
        let mut many = [0u16; TILE_SAMPLES / STRIP];
        let mut many_count = 0;
        for (group, counts) in self.counts.as_chunks::<STRIP>().0.iter().enumerate() {
            let counts = u32x8::load_array_ref(simd, counts);
            let covered = counts.bitcast::<i32x8<S>>().simd_gt(0).to_bitmask();
            if covered == 0 {
                continue;
            }
            fragments += counts;
            totals.covered_pixels += u64::from(covered.count_ones());
            let greatest = counts.reduce_max();
            totals.greatest = totals.greatest.max(greatest);
            let rows = padded(greatest as usize);
            let stays =
                greatest as usize <= BLOCK || stay_together && rows <= padded(counts.reduce_min() as usize) + BLOCK;
            if !stays {
                many[many_count] = group as u16;
                many_count += 1;
                continue;
            }
            let first = group * STRIP;
            let samples = std::array::from_fn(|lane| (first + lane) as u16);
            (lanes + (row_count * STRIP) as u32).store_slice(&mut self.next[first..first + STRIP]);
            let strip = Strip { first_row: row_count as u32, row_count: greatest, samples, sample_count: STRIP as u32 };
            self.strips.push(strip);
            row_count += rows;
        }
        totals.fragments += u64::from(fragments.reduce_sum());
        if many_count > 0 {
            row_count = self.make_strips_by_count(&many[..many_count], row_count);
        }
        row_count
    }

    /// Puts the samples of groups of neighbours together by how many fragments they have.
    fn make_strips_by_count(&mut self, groups: &[u16], mut row_count: usize) -> usize {
        let samples = || groups.iter().flat_map(|&group| (0..STRIP).map(move |lane| group as usize * STRIP + lane));
        let mut starts = [0u16; CLASSES];
        for sample in samples() {
            starts[class(self.counts[sample])] += 1;
        }
        // Most fragments last; samples without any are left out.
        let mut start = 0;
        starts[0] = 0;
        for place in &mut starts {
            start += std::mem::replace(place, start);
        }
        let mut by_class = [0u16; TILE_SAMPLES];
        for sample in samples() {
            let count = self.counts[sample];
            if count > 0 {
                let place = &mut starts[class(count)];
                by_class[*place as usize] = sample as u16;
                *place += 1;
            }
        }
        for samples in by_class[..start as usize].chunks(STRIP) {
            let first_row = row_count as u32;
            let mut strip = Strip { first_row, row_count: 0, samples: [0; STRIP], sample_count: samples.len() as u32 };
            for (lane, &sample) in samples.iter().enumerate() {
                strip.samples[lane] = sample;
                strip.row_count = strip.row_count.max(self.counts[sample as usize]);
                self.next[sample as usize] = (row_count * STRIP + lane) as u32;
            }
            row_count += padded(strip.row_count as usize);
            self.strips.push(strip);
        }
        row_count
    }

    /// The rows of a strip: in each the key of a fragment of every pixel, 0 for none.
    #[inline(always)]
    pub(crate) fn rows(&self, strip: &Strip) -> &[Row] {
        &self.keys[strip.first_row as usize..(strip.first_row + strip.row_count) as usize]
    }

    /// The numbers of a sample's fragments, nearest first, if keys have numbers.
    pub(crate) fn of_sample(&self, sample: usize) -> impl Iterator<Item = u32> {
        let count = if self.strips.is_empty() { 0 } else { self.counts[sample] as usize };
        // A sample without fragments has no first one.
        let next = self.next[sample] as usize;
        let (first, lane) = ((next / STRIP).saturating_sub(count), next % STRIP);
        self.keys.iter().skip(first).take(count).map(move |row| row.0[lane] as u32)
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.keys.capacity() * size_of::<Row>()
            + self.strips.capacity() * size_of::<Strip>()
            + TILE_SAMPLES * 8
            + self.last.bytes()
    }
}
