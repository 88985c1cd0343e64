//! The transparent fragments of a tile, as structure of arrays.

use fearless_simd::{Level, Simd, SimdBase, SimdCombine, SimdMask, SimdWiden, dispatch};
use fearless_simd::{f32x8, mask32x8, u16x8, u32x8};

use crate::bin::TILE_PX;
use crate::lit_key;
use crate::order::STRIP;
use crate::shade::SHADED_LANES;
use crate::small_fragments::RunFragments;
use crate::tile::Band;

/// Where the colour of a fragment comes from: 0 for none, the number of a draw plus 1, in whose palette colour it is lit,
/// or with this bit set a place among the colours of those that are lit already.
pub(crate) const COLOR: u32 = 1 << 30;

/// Fragments in draw order. Numbers start at 1, so that 0 can stand for none.
#[derive(Debug)]
pub(crate) struct Fragments {
    /// One more than the last number; beyond is room.
    end: usize,
    samples: Vec<u32>,
    depths: Vec<f32>,
    lights: Vec<f32>,
    sources: Vec<u32>,
    primitives: Vec<u32>,
    /// Where a triangle fills every row of the tile that it reaches, and none of its fragments will be left out: numbers of the first
    /// ones of the rows. What is done with each can be done with eight of them at once.
    whole_rows: Vec<u32>,
    /// Colours of those that were shaded when they were captured; beyond `color_count` is room.
    colors: Vec<[f32; 4]>,
    color_count: usize,
}

/// One of them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TileFragment {
    pub(crate) depth: f32,
    /// Brightness, where the source does not know.
    pub(crate) light: f32,
    /// Where its colour comes from, see [`COLOR`].
    pub(crate) source: u32,
    pub(crate) primitive: u32,
}

/// Where fragments can be put.
pub(crate) struct Room<'a> {
    pub(crate) samples: &'a mut [u32],
    pub(crate) depths: &'a mut [f32],
    pub(crate) lights: &'a mut [f32],
    pub(crate) sources: &'a mut [u32],
    pub(crate) primitives: &'a mut [u32],
}

/// Where what a vector of fragments gets when it is shaded can be put.
pub(crate) struct Shaded<'a> {
    pub(crate) sources: &'a mut [u32],
    /// The source of the first; that of each other is one more.
    pub(crate) first_source: u32,
    pub(crate) colors: &'a mut [[f32; 4]],
}

impl Default for Fragments {
    fn default() -> Self {
        let mut fragments = Self {
            end: 1,
            samples: Vec::new(),
            depths: Vec::new(),
            lights: Vec::new(),
            sources: Vec::new(),
            primitives: Vec::new(),
            whole_rows: Vec::new(),
            colors: Vec::new(),
            color_count: 0,
        };
        fragments.make_room(1);
        fragments
    }
}

impl Fragments {
    pub(crate) fn clear(&mut self) {
        self.end = 1;
        self.whole_rows.clear();
        self.color_count = 0;
    }

    #[inline(always)]
    fn make_room(&mut self, count: usize) {
        if self.depths.len() < self.end + count {
            self.grow(count);
        }
    }

    #[cold]
    fn grow(&mut self, count: usize) {
        let room = (self.end + count).next_power_of_two().max(4096);
        self.samples.resize(room, 0);
        self.depths.resize(room, 0.0);
        self.lights.resize(room, 0.0);
        self.sources.resize(room, 0);
        self.primitives.resize(room, 0);
    }

    /// Room for so many; [`Self::advance`] tells how many were put there.
    #[inline(always)]
    pub(crate) fn room(&mut self, count: usize) -> Room<'_> {
        self.make_room(count);
        let range = self.end..self.end + count;
        Room {
            samples: &mut self.samples[range.clone()],
            depths: &mut self.depths[range.clone()],
            lights: &mut self.lights[range.clone()],
            sources: &mut self.sources[range.clone()],
            primitives: &mut self.primitives[range],
        }
    }

    #[inline(always)]
    pub(crate) fn advance(&mut self, count: usize) {
        self.end += count;
    }

    #[inline(always)]
    pub(crate) fn push(&mut self, sample: u32, depth: f32, light: f32, source: u32, primitive: u32) {
        self.make_room(1);
        self.samples[self.end] = sample;
        self.depths[self.end] = depth;
        self.lights[self.end] = light;
        self.sources[self.end] = source;
        self.primitives[self.end] = primitive;
        self.end += 1;
    }

    /// Room for so many numbers beyond the last, so that whole vectors can be read and written.
    #[inline(always)]
    pub(crate) fn make_room_after(&mut self, count: usize) {
        self.make_room(count);
    }

    /// Room for so many colours.
    #[inline(always)]
    pub(crate) fn make_room_for_colors(&mut self, count: usize) {
        let room = self.color_count + count;
        if self.colors.len() < room {
            self.colors.resize(room.next_power_of_two().max(4096), [0.0; 4]);
        }
    }

    /// The samples of the vector of fragments that begins at a number, some of which may not be there.
    #[inline(always)]
    pub(crate) fn samples_from(&self, first: usize) -> &[u32] {
        &self.samples[first..first + SHADED_LANES]
    }

    /// The lights of such a vector.
    #[inline(always)]
    pub(crate) fn lights_from(&self, first: usize) -> &[f32] {
        &self.lights[first..first + SHADED_LANES]
    }

    /// Of the vector of fragments that begins at number `from`, gives some the numbers from `to` on, which is not above
    /// `from`. Their colours and sources are still to come.
    #[inline(always)]
    pub(crate) fn keep<S: Simd>(&mut self, simd: S, from: usize, to: usize, kept: mask32x8<S>) {
        let (from, to) = (from..from + SHADED_LANES, to..to + SHADED_LANES);
        for numbers in [&mut self.samples, &mut self.primitives] {
            u32x8::from_slice(simd, &numbers[from.clone()]).compress(kept).store_slice(&mut numbers[to.clone()]);
        }
        for numbers in [&mut self.depths, &mut self.lights] {
            f32x8::from_slice(simd, &numbers[from.clone()]).compress(kept).store_slice(&mut numbers[to.clone()]);
        }
    }

    /// Where sources and colours of a vector of shaded fragments go, the first `count` of which are there.
    #[inline(always)]
    pub(crate) fn shaded(&mut self, first: usize, count: usize) -> Shaded<'_> {
        let colors = self.color_count..self.color_count + SHADED_LANES;
        self.color_count += count;
        Shaded {
            sources: &mut self.sources[first..first + SHADED_LANES],
            first_source: colors.start as u32 | COLOR,
            colors: &mut self.colors[colors],
        }
    }

    /// The number that the next fragment gets.
    #[inline(always)]
    pub(crate) fn end(&self) -> usize {
        self.end
    }

    /// Numbers of the first of eight fragments each, at eight neighbours from a multiple of eight on, as far as they lie in
    /// whole rows.
    #[inline(always)]
    pub(crate) fn eights(&self) -> impl Iterator<Item = usize> {
        self.whole_rows.iter().flat_map(|&row| (row as usize..row as usize + TILE_PX as usize).step_by(STRIP))
    }

    /// Notes that the fragments from a number on fill rows of the tile.
    pub(crate) fn note_whole_rows(&mut self, first: usize) {
        self.whole_rows.extend((first..self.end).step_by(TILE_PX as usize).map(|first| first as u32));
    }

    #[inline(always)]
    pub(crate) fn has_whole_rows(&self) -> bool {
        !self.whole_rows.is_empty()
    }

    /// Leaves out the fragments from a number on.
    #[inline(always)]
    pub(crate) fn truncate(&mut self, end: usize) {
        self.end = end;
    }

    #[inline(always)]
    pub(crate) fn extend(&mut self, run: RunFragments<'_>) {
        let count = run.samples.len();
        let room = self.room(count);
        for (to, from) in room.samples.iter_mut().zip(run.samples) {
            *to = u32::from(*from);
        }
        for ((depth, light), &key) in room.depths.iter_mut().zip(room.lights).zip(run.keys) {
            (*depth, *light) = (lit_key::depth(key), lit_key::light(key));
        }
        room.sources.fill(run.draw + 1);
        for (primitive, &triangle) in room.primitives.iter_mut().zip(run.triangles) {
            *primitive = run.first_primitive + u32::from(triangle);
        }
        self.end += count;
    }

    /// Adds those of small triangles' fragments that lie in a band and not behind the depths in `hidden`.
    #[inline(never)]
    pub(crate) fn extend_within(&mut self, level: Level, run: RunFragments<'_>, band: Band, hidden: Option<&[f32]>) {
        dispatch!(level, simd => self.extend_within_simd(simd, run, band, hidden));
    }

    #[inline(always)]
    fn extend_within_simd<S: Simd>(&mut self, simd: S, run: RunFragments<'_>, band: Band, hidden: Option<&[f32]>) {
        const LANES: usize = SHADED_LANES;
        let sources = u32x8::splat(simd, run.draw + 1);
        let whole = run.samples.len() / LANES * LANES;
        for (first, keys) in (0..whole).step_by(LANES).zip(run.keys.as_chunks().0) {
            let these = first..first + LANES;
            let (low, high) = u16x8::from_slice(simd, &run.samples[these.clone()]).widen();
            let samples = low.combine(high) - band.first;
            let [depths, lights] = lit_key::unpack(simd, keys);
            let mut kept = samples.simd_lt(band.count);
            if let Some(hidden) = hidden {
                let samples: [u32; LANES] = samples.into();
                let hidden = samples.map(|sample| hidden.get(sample as usize).copied().unwrap_or_default());
                kept &= depths.simd_ge(f32x8::load_array(simd, hidden));
            }
            let bits = kept.to_bitmask();
            if bits == 0 {
                continue;
            }
            let room = self.room(LANES);
            samples.compress(kept).store_slice(room.samples);
            depths.compress(kept).store_slice(room.depths);
            lights.compress(kept).store_slice(room.lights);
            sources.store_slice(room.sources);
            let (low, high) = u16x8::from_slice(simd, &run.triangles[these]).widen();
            (low.combine(high) + run.first_primitive).compress(kept).store_slice(room.primitives);
            self.advance(bits.count_ones() as usize);
        }
        for i in whole..run.samples.len() {
            let Some(sample) = band.sample(run.samples[i]) else { continue };
            let (depth, light) = (lit_key::depth(run.keys[i]), lit_key::light(run.keys[i]));
            if hidden.is_none_or(|hidden| depth >= hidden[sample]) {
                self.push(sample as u32, depth, light, run.draw + 1, run.primitive(i));
            }
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.end - 1
    }

    /// Samples and depths; number 0 among them.
    #[inline(always)]
    pub(crate) fn samples_and_depths(&self) -> (&[u32], &[f32]) {
        (&self.samples[..self.end], &self.depths[..self.end])
    }

    /// Brightness and source of each, number 0 among them, dark and without source; and the colours of those shaded.
    #[inline(always)]
    pub(crate) fn lights_and_sources(&self) -> (&[f32], &[u32], &[[f32; 4]]) {
        (&self.lights[..self.end], &self.sources[..self.end], &self.colors[..self.color_count])
    }

    #[inline(always)]
    pub(crate) fn get(&self, number: u32) -> TileFragment {
        let number = number as usize;
        TileFragment {
            depth: self.depths[number],
            light: self.lights[number],
            source: self.sources[number],
            primitive: self.primitives[number],
        }
    }

    /// The colours of those shaded.
    pub(crate) fn colors(&self) -> &[[f32; 4]] {
        &self.colors[..self.color_count]
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.depths.capacity() * 20 + self.whole_rows.capacity() * 4 + self.colors.capacity() * size_of::<[f32; 4]>()
    }
}
