//! One tile: opaque surfaces through a depth buffer, then transparent ones captured in draw order.

use fearless_simd::{Level, Simd, dispatch};
use glam::Vec4;
use pellucid_core::fragment::order_key;
use pellucid_core::layers::OpaqueSurface;
use pellucid_core::pixel_grid::ScreenTriangle;
use pellucid_core::primitive::{Draw, Fold};
use pellucid_core::shading::{NormalPlane, Varying, lit};
use pellucid_core::{Fragment, Layers};

use crate::bin::{PixelRect, TILE_PX, TileGrid};
use crate::fragments::{COLOR, Fragments};
use crate::lit_key;
use crate::order::Order;
use crate::raster::{Coverage, Depths, FoldState, RowFragments, cover};
use crate::setup::{Chunk, Record};
use crate::shade::{Unshaded, VaryingSurface};
use crate::small_fragments::RunFragments;
use crate::surfaces::Surfaces;

/// Samples of a tile.
pub(crate) const TILE_SAMPLES: usize = (TILE_PX * TILE_PX) as usize;

/// Samples beyond a tile's last that vectors may touch.
pub(crate) const TILE_SLACK: usize = 8;

/// In the source of an opaque surface's colour: a place in [`Surfaces`]. Other sources are those of fragments.
pub(crate) const SURFACE: u32 = 1 << 31;

/// What is captured of a tile, and the memory for it: kept from tile to tile.
#[derive(Debug)]
pub(crate) struct TileCapture {
    pub(crate) rect: PixelRect,
    fold: FoldState,
    pub(crate) surfaces: Surfaces,
    /// Nearest opaque surface at each sample: order key so far, brightness, source of its colour.
    opaque_keys: Vec<u64>,
    opaque_lights: Vec<f32>,
    opaque_sources: Vec<u32>,
    opaque_depths: Vec<f32>,
    pub(crate) has_opaque: bool,
    pub(crate) fragments: Fragments,
    unshaded: Unshaded,
    pub(crate) order: Order,
    /// The tile, and the band of it.
    number: u32,
    band: Band,
    /// The source of all fragments, if their keys tell the rest: then there is nothing else in the tile, and nothing is
    /// captured before they are ordered.
    pub(crate) lit_source: Option<u32>,
}

/// Fragments of a tile, or of many.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FragmentCounts {
    pub(crate) fragments: u64,
    pub(crate) covered_pixels: u64,
    pub(crate) greatest: u32,
}

impl FragmentCounts {
    pub(crate) fn merged(self, other: Self) -> Self {
        Self {
            fragments: self.fragments + other.fragments,
            covered_pixels: self.covered_pixels + other.covered_pixels,
            greatest: self.greatest.max(other.greatest),
        }
    }
}

/// Samples of a tile that are captured in one go.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Band {
    pub(crate) first: u32,
    pub(crate) count: u32,
}

impl Band {
    /// A sample of the tile as one of the band.
    #[inline(always)]
    pub(crate) fn sample(self, sample: u16) -> Option<usize> {
        let sample = u32::from(sample).wrapping_sub(self.first);
        (sample < self.count).then_some(sample as usize)
    }

    #[inline(always)]
    pub(crate) fn is_whole_tile(self) -> bool {
        self.count == TILE_PX * TILE_PX
    }
}

impl Default for TileCapture {
    fn default() -> Self {
        Self {
            rect: PixelRect { left: 0, top: 0, right: 0, bottom: 0 },
            fold: FoldState::default(),
            surfaces: Surfaces::default(),
            opaque_keys: vec![0; TILE_SAMPLES],
            opaque_lights: vec![0.0; TILE_SAMPLES],
            opaque_sources: vec![0; TILE_SAMPLES],
            opaque_depths: vec![0.0; TILE_SAMPLES + TILE_SLACK],
            has_opaque: false,
            fragments: Fragments::default(),
            unshaded: Unshaded::default(),
            order: Order::default(),
            number: 0,
            band: Band::default(),
            lit_source: None,
        }
    }
}

/// Everything a frame knows that a tile needs.
#[derive(Clone, Copy)]
pub(crate) struct FrameParts<'a> {
    pub(crate) chunks: &'a [Chunk],
    pub(crate) draws: &'a [Draw<'a>],
    /// Colours of draws where nothing varies, before lighting: that of draw `i` stands at `i + 1`, none at 0.
    pub(crate) palette: &'a [Vec4],
    /// Nothing that is drawn has more of a channel than this.
    pub(crate) greatest_color: Vec4,
    pub(crate) grid: &'a TileGrid,
    pub(crate) level: Level,
}

/// Fragments that a capture is meant to have at most: more leave the second-level cache.
const MOST_FRAGMENTS: u64 = 1 << 16;

/// Those of a tile of one source, of which nothing is kept but keys; if these have no room for its light, it is captured after
/// all, twice as many fragments at a time as others.
const MOST_LIT_FRAGMENTS: u64 = 1 << 17;

/// Fewest rows of a band: what it takes to set up a triangle again in each is shared by few fragments then.
const FEWEST_ROWS: u32 = 2;

/// Records of which one is looked at to guess how many fragments there are.
const RECORDS_FOR_A_GUESS: usize = 8;

impl FrameParts<'_> {
    /// Rows of the bands into which a tile of so many records and small fragments is cut, so that each has few enough
    /// fragments. So a tile's memory does not grow with depth complexity either, up to thousands.
    pub(crate) fn band_rows(&self, number: u32, records: u64, small: u64, lit_source: Option<u32>) -> u32 {
        let most = if lit_source.is_some() { MOST_LIT_FRAGMENTS } else { MOST_FRAGMENTS };
        let mut fragments = small;
        if small + records * TILE_SAMPLES as u64 > most {
            fragments += self.guess_fragments(number);
        }
        let mut rows = TILE_PX;
        while fragments > most && rows > FEWEST_ROWS {
            (rows, fragments) = (rows / 2, fragments / 2);
        }
        rows
    }

    /// The source of all fragments of a tile without records, if there are only those of transparent triangles of one draw.
    pub(crate) fn only_source(&self, number: u32) -> Option<u32> {
        if self.chunks.iter().any(|chunk| !chunk.opaque.small.tile(number).is_empty()) {
            return None;
        }
        let mut runs = self.small_transparent(number);
        let draw = runs.next().map_or(0, |run| run.draw);
        runs.all(|run| run.draw == draw).then_some(draw + 1)
    }

    /// The fragments of small transparent triangles in a tile, in draw order.
    fn small_transparent(&self, number: u32) -> impl Iterator<Item = RunFragments<'_>> + Clone {
        self.chunks.iter().flat_map(move |chunk| chunk.transparent.small.tile(number).all())
    }

    /// About how many fragments the records of a tile have.
    fn guess_fragments(&self, number: u32) -> u64 {
        let rect = self.grid.tile(number);
        let mut fragments = 0;
        for chunk in self.chunks {
            for bins in [&chunk.opaque, &chunk.transparent] {
                for &record in bins.records.tile(number).iter().step_by(RECORDS_FOR_A_GUESS) {
                    if let Some(samples) = self.grid.samples_in_bounds(&chunk.record(record).vertices) {
                        let columns = samples.right.min(rect.right) + 1 - samples.left.max(rect.left);
                        let rows = samples.bottom.min(rect.bottom) + 1 - samples.top.max(rect.top);
                        // A triangle fills half of its bounds.
                        fragments += (columns * rows) as u64 * RECORDS_FOR_A_GUESS as u64 / 2;
                    }
                }
            }
        }
        fragments
    }
}

impl TileCapture {
    /// Captures a band of a tile: `rows` of its rows from row `first` on. `lit_source`: the tile's only source, if fragments are
    /// wanted for their colours alone.
    pub(crate) fn capture(
        &mut self,
        number: u32,
        [first, rows]: [u32; 2],
        lit_source: Option<u32>,
        frame: FrameParts<'_>,
    ) {
        let tile = frame.grid.tile(number);
        self.rect = PixelRect {
            top: tile.top + first as i32,
            bottom: tile.bottom.min(tile.top + (first + rows) as i32 - 1),
            ..tile
        };
        self.forget_opaque();
        self.number = number;
        self.band = Band { first: first * TILE_PX, count: rows * TILE_PX };
        self.lit_source = lit_source;
        if self.lit_source.is_none() {
            self.capture_all(frame);
        }
    }

    /// Captures a tile in which nothing is.
    pub(crate) fn capture_nothing(&mut self, number: u32, frame: FrameParts<'_>) {
        self.rect = frame.grid.tile(number);
        self.forget_opaque();
        self.order.clear();
        self.lit_source = None;
    }

    fn forget_opaque(&mut self) {
        if self.has_opaque {
            self.opaque_keys.fill(0);
            self.opaque_sources.fill(0);
            self.opaque_depths.fill(0.0);
            self.has_opaque = false;
        }
    }

    /// Orders the fragments captured.
    pub(crate) fn sort(&mut self, frame: FrameParts<'_>) -> FragmentCounts {
        if self.lit_source.is_some() {
            if let Some(counts) = self.order.sort_lit(frame.level, frame.small_transparent(self.number), self.band) {
                return counts;
            }
            self.lit_source = None;
            self.capture_all(frame);
        }
        self.order.sort(frame.level, &self.fragments)
    }

    /// Whether nothing was found, once it is ordered.
    pub(crate) fn is_empty(&self) -> bool {
        self.order.strips.is_empty() && !self.has_opaque
    }

    fn capture_all(&mut self, frame: FrameParts<'_>) {
        dispatch!(frame.level, simd => self.capture_simd(simd, frame));
    }

    #[inline(always)]
    fn capture_simd<S: Simd>(&mut self, simd: S, frame: FrameParts<'_>) {
        let (number, band) = (self.number, self.band);
        self.surfaces.clear();
        self.fragments.clear();
        self.fold.reset();
        let mut coverage = Coverage::default();
        for chunk in frame.chunks {
            let mut small = chunk.opaque.small.tile(number);
            let records = chunk.opaque.records.tile(number);
            self.has_opaque |= !small.is_empty() || !records.is_empty();
            while let Some(run) = small.next_before(None) {
                for (i, &sample) in run.samples.iter().enumerate() {
                    let Some(sample) = band.sample(sample) else { continue };
                    let key = order_key(lit_key::depth(run.keys[i]), run.primitive(i));
                    if key >= self.opaque_keys[sample] {
                        self.put_opaque(sample, key, lit_key::light(run.keys[i]), run.draw + 1);
                    }
                }
            }
            for &record in records {
                self.add_opaque(simd, chunk, chunk.record(record), frame, &mut coverage);
            }
        }
        if self.has_opaque {
            for (depth, key) in self.opaque_depths.iter_mut().zip(&self.opaque_keys) {
                *depth = f32::from_bits((key >> 32) as u32);
            }
        }
        for chunk in frame.chunks {
            let mut small = chunk.transparent.small.tile(number);
            for &record in chunk.transparent.records.tile(number) {
                let record = chunk.record(record);
                let primitive = frame.draws[record.draw as usize].first_primitive + record.triangle;
                while let Some(run) = small.next_before(Some(primitive)) {
                    self.add_small(run, band, frame);
                }
                self.add_transparent(simd, chunk, record, frame, &mut coverage);
            }
            while let Some(run) = small.next_before(None) {
                self.add_small(run, band, frame);
            }
        }
        self.shade_before(None, frame);
    }

    #[inline(always)]
    fn put_opaque(&mut self, sample: usize, key: u64, light: f32, source: u32) {
        self.opaque_keys[sample] = key;
        self.opaque_lights[sample] = light;
        self.opaque_sources[sample] = source;
    }

    #[inline(always)]
    fn add_opaque<S: Simd>(
        &mut self,
        simd: S,
        chunk: &Chunk,
        record: &Record,
        frame: FrameParts<'_>,
        coverage: &mut Coverage,
    ) {
        let Some(triangle) = ScreenTriangle::new(record.vertices) else { return };
        let Some(samples) = frame.grid.samples_in_bounds(&record.vertices) else { return };
        if !cover(simd, &triangle, samples, self.rect, coverage) {
            return;
        }
        let draw = &frame.draws[record.draw as usize];
        let primitive = draw.first_primitive + record.triangle;
        if record.fold != Fold::None {
            self.fold.apply(record.fold, primitive, coverage);
        }
        let weights = triangle.weight_planes();
        let depths = Depths::new(&triangle, weights, self.rect);
        let mut place = None;
        for y in coverage.top..=coverage.bottom {
            let mut mask = coverage.rows[y];
            let row = depths.row(y);
            while mask != 0 {
                let x = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                let sample = y * TILE_PX as usize + x;
                let key = order_key(depths.at(row, x), primitive);
                if key < self.opaque_keys[sample] {
                    continue;
                }
                let place = *place.get_or_insert_with(|| self.surfaces.add(chunk, record, &triangle, weights, draw));
                let mut shaded = place;
                if draw.cutoff.is_some() {
                    let (x, y) = (self.rect.left + x as i32, self.rect.top + y as i32);
                    match self.surfaces.add_shaded(place, x, y, frame.draws) {
                        Some(fragment) => shaded = fragment,
                        None => continue,
                    }
                }
                self.put_opaque(sample, key, 0.0, shaded | SURFACE);
            }
        }
    }

    /// Adds fragments of small triangles that lie in a band, unless they lie behind an opaque surface.
    #[inline(always)]
    fn add_small(&mut self, run: RunFragments<'_>, band: Band, frame: FrameParts<'_>) {
        self.shade_before(None, frame);
        if !self.has_opaque && band.is_whole_tile() {
            self.fragments.extend(run);
            return;
        }
        let hidden = self.has_opaque.then_some(self.opaque_depths.as_slice());
        self.fragments.extend_within(frame.level, run, band, hidden);
    }

    #[inline(always)]
    fn add_transparent<S: Simd>(
        &mut self,
        simd: S,
        chunk: &Chunk,
        record: &Record,
        frame: FrameParts<'_>,
        coverage: &mut Coverage,
    ) {
        let Some(triangle) = ScreenTriangle::new(record.vertices) else { return };
        let Some(samples) = frame.grid.samples_in_bounds(&record.vertices) else { return };
        if !cover(simd, &triangle, samples, self.rect, coverage) {
            return;
        }
        let draw = &frame.draws[record.draw as usize];
        let primitive = draw.first_primitive + record.triangle;
        if record.fold != Fold::None {
            self.fold.apply(record.fold, primitive, coverage);
        }
        self.shade_before(Some(record.draw), frame);
        let weights = triangle.weight_planes();
        let depths = Depths::new(&triangle, weights, self.rect);
        let normal = NormalPlane::new(&record.normals, weights);
        let steady = !draw.lit || draw.mesh.normals().is_none();
        let rows = RowFragments::new(simd, &depths, &normal, steady);
        let first = self.fragments.end();
        let hidden = self.has_opaque.then_some(self.opaque_depths.as_slice());
        let covered_rows = coverage.bottom + 1 - coverage.top;
        let mut room = self.fragments.room(covered_rows * TILE_PX as usize + TILE_SLACK);
        let mut count = 0;
        for y in coverage.top..=coverage.bottom {
            rows.add(simd, y, coverage.rows[y], hidden, [record.draw + 1, primitive], &mut room, &mut count);
        }
        self.fragments.advance(count);
        // Where the alpha test may still leave some out, the others do not keep their numbers.
        if hidden.is_none() && draw.cutoff.is_none() && coverage.has_whole_rows() {
            self.fragments.note_whole_rows(first);
        }
        if draw.varies() && self.fragments.end() > first {
            let piece = chunk.piece(record, triangle);
            let [anchor_x, anchor_y] = triangle.anchor_px();
            let surface = VaryingSurface {
                draw,
                varying: Varying::new(draw, record.triangle as usize, &piece, weights),
                left: self.rect.left - anchor_x,
                top: self.rect.top - anchor_y,
            };
            self.unshaded.add(frame.level, record.draw, &surface, first, &mut self.fragments);
        }
    }

    /// Shades fragments that wait for it, unless those of draw `next` can join them.
    #[inline(always)]
    fn shade_before(&mut self, next: Option<u32>, frame: FrameParts<'_>) {
        if let Some(draw) = self.unshaded.draw_before(next) {
            self.unshaded.shade(frame.level, &frame.draws[draw as usize], &mut self.fragments);
        }
    }

    /// The colour that a source gives in a light, at a pixel.
    #[inline(always)]
    pub(crate) fn color(&self, source: u32, light: f32, x: i32, y: i32, frame: FrameParts<'_>) -> Option<Vec4> {
        if source & SURFACE != 0 {
            return self.surfaces.color(source & !SURFACE, x, y, frame.draws);
        }
        if source & COLOR != 0 {
            return self.fragments.colors().get((source & !COLOR) as usize).copied().map(Vec4::from_array);
        }
        Some(lit(frame.palette[source as usize], light))
    }

    /// The colour of the nearest opaque surface at a sample.
    #[inline(always)]
    pub(crate) fn opaque_color(&self, sample: usize, x: i32, y: i32, frame: FrameParts<'_>) -> Option<Vec4> {
        match self.opaque_sources[sample] {
            0 => None,
            source => self.color(source, self.opaque_lights[sample], x, y, frame),
        }
    }

    /// The samples of the tile row by row, with the column and row of their pixels.
    pub(crate) fn pixels(&self) -> impl Iterator<Item = (usize, i32, i32)> + use<> {
        let rect = self.rect;
        (rect.top..=rect.bottom).flat_map(move |y| {
            let row = (y - rect.top) as usize * TILE_PX as usize;
            (rect.left..=rect.right).map(move |x| (row + (x - rect.left) as usize, x, y))
        })
    }

    /// Shades every fragment into `layers`, whose memory is used again.
    pub(crate) fn layers(&self, frame: FrameParts<'_>, layers: &mut Layers) {
        layers.left = self.rect.left as u32;
        layers.top = self.rect.top as u32;
        layers.width = (self.rect.right - self.rect.left + 1) as u32;
        layers.height = (self.rect.bottom - self.rect.top + 1) as u32;
        layers.ends.clear();
        layers.fragments.clear();
        layers.opaque.clear();
        for (sample, x, y) in self.pixels() {
            layers.fragments.extend(self.order.of_sample(sample).filter_map(|number| {
                let fragment = self.fragments.get(number);
                let color = self.color(fragment.source, fragment.light, x, y, frame)?;
                Some(Fragment { color, depth: fragment.depth, primitive: fragment.primitive })
            }));
            layers.ends.push(layers.fragments.len() as u32);
            layers.opaque.push(
                self.opaque_color(sample, x, y, frame).map(|color| OpaqueSurface {
                    color,
                    depth: f32::from_bits((self.opaque_keys[sample] >> 32) as u32),
                }),
            );
        }
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.surfaces.bytes() + self.fragments.bytes() + self.order.bytes() + TILE_SAMPLES * 20
    }
}
