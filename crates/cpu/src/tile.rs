//! One tile: opaque surfaces through a depth buffer, then transparent ones captured, ordered and resolved.

use fearless_simd::{Level, Simd, dispatch};
use glam::{Vec3, Vec4};
use pellucid_core::composite::Composite;
use pellucid_core::fragment::order_key;
use pellucid_core::layers::OpaqueSurface;
use pellucid_core::pixel_grid::ScreenTriangle;
use pellucid_core::primitive::{Draw, Fold};
use pellucid_core::shading::{NormalPlane, Varying, color_at};
use pellucid_core::{Fragment, Layers};

use crate::bin::{PixelRect, TILE_PX, TileGrid};
use crate::raster::{Coverage, Depths, FoldState, cover};
use crate::setup::{Chunk, Record};

/// Samples of a tile.
const TILE_SAMPLES: usize = (TILE_PX * TILE_PX) as usize;

/// Up to so many fragments, insertion is the fastest sort (LFB chapter, section 20.4.1).
const INSERTION_SORT_MAX: usize = 32;

/// No surface; of a surface: no varying colour.
const NONE: u32 = u32::MAX;

/// In place of a varying colour: the surface is a single fragment, shaded when its alpha was tested. Its colour stands
/// where others have their normal.
const SHADED: u32 = u32::MAX - 1;

/// What is captured of a tile, and the memory for it: kept from tile to tile.
#[derive(Debug)]
pub(crate) struct TileCapture {
    rect: PixelRect,
    fold: FoldState,
    surfaces: Surfaces,
    /// Nearest opaque surface: order key so far, and its place in `surfaces`.
    opaque_keys: Vec<u64>,
    opaque_surfaces: Vec<u32>,
    has_opaque: bool,
    /// Transparent fragments in draw order: sample, and depth above place in `surfaces`. As surfaces stand in draw order,
    /// this orders like the contract's order key.
    samples: Vec<u16>,
    keys: Vec<u64>,
    /// The same keys by sample, and where each sample's end.
    sorted_keys: Vec<u64>,
    ends: Vec<u32>,
}

/// The pieces of primitives with a fragment in the tile.
#[derive(Debug, Default)]
struct Surfaces {
    surfaces: Vec<Surface>,
    varying: Vec<Varying>,
}

/// What it takes to shade a piece: one cache line.
#[derive(Debug, Clone, Copy)]
struct Surface {
    normal: NormalPlane,
    /// The piece's anchor: within the guard band, so that 16 bits hold it.
    anchor_px: [i16; 2],
    draw: u32,
    primitive: u32,
    /// Place in the table of varying colours, [`NONE`] or [`SHADED`].
    varying: u32,
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

impl Surfaces {
    /// Adds the piece of a record; returns its place.
    #[inline(always)]
    fn add(
        &mut self,
        chunk: &Chunk,
        record: &Record,
        triangle: &ScreenTriangle,
        weights: [pellucid_core::pixel_grid::Plane; 2],
        draw: &Draw<'_>,
    ) -> u32 {
        let varying = if draw.varies() {
            let piece = chunk.piece(record, *triangle);
            self.varying.push(Varying::new(draw, record.triangle as usize, &piece, weights));
            self.varying.len() as u32 - 1
        } else {
            NONE
        };
        let [x, y] = triangle.anchor_px();
        self.surfaces.push(Surface {
            normal: NormalPlane::new(&record.normals, weights),
            anchor_px: [x as i16, y as i16],
            draw: record.draw,
            primitive: draw.first_primitive + record.triangle,
            varying,
        });
        self.surfaces.len() as u32 - 1
    }

    /// Adds a surface that is one fragment of the surface at a place, if it passes the alpha test there.
    #[inline(always)]
    fn add_shaded(&mut self, place: u32, x: i32, y: i32, draws: &[Draw<'_>]) -> Option<u32> {
        let color = self.color(place, x, y, draws)?;
        let mut surface = self.surfaces[place as usize];
        surface.varying = SHADED;
        surface.normal.value = color.truncate().into();
        surface.normal.dx.x = color.w;
        self.surfaces.push(surface);
        Some(self.surfaces.len() as u32 - 1)
    }

    /// The colour of the surface at a place, at a pixel.
    #[inline(always)]
    fn color(&self, place: u32, x: i32, y: i32, draws: &[Draw<'_>]) -> Option<Vec4> {
        let surface = &self.surfaces[place as usize];
        if surface.varying == SHADED {
            return Some(Vec3::from(surface.normal.value).extend(surface.normal.dx.x));
        }
        let [anchor_x, anchor_y] = surface.anchor_px;
        let (x, y) = (x - i32::from(anchor_x), y - i32::from(anchor_y));
        let varying = if surface.varying == NONE { None } else { self.varying.get(surface.varying as usize) };
        color_at(&draws[surface.draw as usize], &surface.normal, varying, x, y)
    }
}

impl Default for TileCapture {
    fn default() -> Self {
        Self {
            rect: PixelRect { left: 0, top: 0, right: 0, bottom: 0 },
            fold: FoldState::default(),
            surfaces: Surfaces::default(),
            opaque_keys: vec![0; TILE_SAMPLES],
            opaque_surfaces: vec![NONE; TILE_SAMPLES],
            has_opaque: false,
            samples: Vec::new(),
            keys: Vec::new(),
            sorted_keys: Vec::new(),
            ends: vec![0; TILE_SAMPLES],
        }
    }
}

/// Everything a frame knows that a tile needs.
#[derive(Clone, Copy)]
pub(crate) struct FrameParts<'a> {
    pub(crate) chunks: &'a [Chunk],
    pub(crate) draws: &'a [Draw<'a>],
    pub(crate) grid: &'a TileGrid,
    pub(crate) level: Level,
}

impl TileCapture {
    /// Captures a tile and orders its fragments.
    pub(crate) fn capture(&mut self, number: u32, frame: FrameParts<'_>) -> FragmentCounts {
        dispatch!(frame.level, simd => self.capture_simd(simd, number, frame))
    }

    #[inline(always)]
    fn capture_simd<S: Simd>(&mut self, simd: S, number: u32, frame: FrameParts<'_>) -> FragmentCounts {
        self.rect = frame.grid.tile(number);
        self.surfaces.surfaces.clear();
        self.surfaces.varying.clear();
        self.samples.clear();
        self.keys.clear();
        self.fold.reset();
        if self.has_opaque {
            self.opaque_keys.fill(0);
            self.opaque_surfaces.fill(NONE);
            self.has_opaque = false;
        }
        let mut coverage = Coverage { top: 0, bottom: 0, rows: [0; TILE_PX as usize] };
        for chunk in frame.chunks {
            for &record in chunk.opaque.tile(number) {
                self.has_opaque = true;
                self.add_opaque(simd, chunk, chunk.record(record), frame, &mut coverage);
            }
        }
        for chunk in frame.chunks {
            for &record in chunk.transparent.tile(number) {
                self.add_transparent(simd, chunk, chunk.record(record), frame, &mut coverage);
            }
        }
        self.order()
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
        let mut place = NONE;
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
                if place == NONE {
                    place = self.surfaces.add(chunk, record, &triangle, weights, draw);
                }
                let mut shaded = place;
                if draw.cutoff.is_some() {
                    let (x, y) = (self.rect.left + x as i32, self.rect.top + y as i32);
                    match self.surfaces.add_shaded(place, x, y, frame.draws) {
                        Some(fragment) => shaded = fragment,
                        None => continue,
                    }
                }
                self.opaque_keys[sample] = key;
                self.opaque_surfaces[sample] = shaded;
            }
        }
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
        if record.fold != Fold::None {
            self.fold.apply(record.fold, draw.first_primitive + record.triangle, coverage);
        }
        let weights = triangle.weight_planes();
        let depths = Depths::new(&triangle, weights, self.rect);
        let place = self.surfaces.add(chunk, record, &triangle, weights, draw);
        for y in coverage.top..=coverage.bottom {
            let mut mask = coverage.rows[y];
            let row = depths.row(y);
            while mask != 0 {
                let x = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                let sample = y * TILE_PX as usize + x;
                let depth = depths.at(row, x);
                // In front of the opaque surface, or level with it.
                if depth.to_bits() < (self.opaque_keys[sample] >> 32) as u32 {
                    continue;
                }
                let mut shaded = place;
                if draw.cutoff.is_some() {
                    let (x, y) = (self.rect.left + x as i32, self.rect.top + y as i32);
                    match self.surfaces.add_shaded(place, x, y, frame.draws) {
                        Some(fragment) => shaded = fragment,
                        None => continue,
                    }
                }
                self.samples.push(sample as u16);
                self.keys.push(order_key(depth, shaded));
            }
        }
    }

    /// Brings the fragments of each sample together, nearest first.
    #[inline(always)]
    fn order(&mut self) -> FragmentCounts {
        let mut counts = FragmentCounts { fragments: self.keys.len() as u64, ..FragmentCounts::default() };
        self.ends.fill(0);
        if self.keys.is_empty() {
            return counts;
        }
        for &sample in &self.samples {
            self.ends[sample as usize] += 1;
        }
        let mut start = 0;
        for place in &mut self.ends {
            let count = *place;
            counts.covered_pixels += u64::from(count > 0);
            counts.greatest = counts.greatest.max(count);
            *place = start;
            start += count;
        }
        if self.sorted_keys.len() < self.keys.len() {
            self.sorted_keys.resize(self.keys.len(), 0);
        }
        // Starts become ends while the fragments are put down.
        for (&sample, &key) in self.samples.iter().zip(&self.keys) {
            let place = &mut self.ends[sample as usize];
            self.sorted_keys[*place as usize] = key;
            *place += 1;
        }
        let mut start = 0;
        for &end in &self.ends {
            sort_descending(&mut self.sorted_keys[start as usize..end as usize]);
            start = end;
        }
        counts
    }

    /// The samples of the tile row by row, with the column and row of their pixels.
    fn pixels(&self) -> impl Iterator<Item = (usize, i32, i32)> + use<> {
        let rect = self.rect;
        (rect.top..=rect.bottom).flat_map(move |y| {
            let row = (y - rect.top) as usize * TILE_PX as usize;
            (rect.left..=rect.right).map(move |x| (row + (x - rect.left) as usize, x, y))
        })
    }

    #[inline(always)]
    fn keys_of(&self, sample: usize) -> &[u64] {
        let start = if sample == 0 { 0 } else { self.ends[sample - 1] as usize };
        &self.sorted_keys[start..self.ends[sample] as usize]
    }

    #[inline(always)]
    fn opaque_surface(&self, sample: usize, x: i32, y: i32, draws: &[Draw<'_>]) -> Option<OpaqueSurface> {
        let place = self.opaque_surfaces[sample];
        if place == NONE {
            return None;
        }
        let color = self.surfaces.color(place, x, y, draws)?;
        Some(OpaqueSurface { color, depth: f32::from_bits((self.opaque_keys[sample] >> 32) as u32) })
    }

    /// Blends every pixel front to back before `background` into rows of pixels.
    pub(crate) fn blend(&self, frame: FrameParts<'_>, background: Vec4, rows: &mut [&mut [Vec4]]) {
        if self.keys.is_empty() && !self.has_opaque {
            for row in rows {
                row.fill(background);
            }
            return;
        }
        dispatch!(frame.level, _simd => self.blend_simd(frame.draws, background, rows));
    }

    #[inline(always)]
    fn blend_simd(&self, draws: &[Draw<'_>], background: Vec4, rows: &mut [&mut [Vec4]]) {
        for (row, y) in rows.iter_mut().zip(self.rect.top..) {
            let first = (y - self.rect.top) as usize * TILE_PX as usize;
            for ((pixel, x), sample) in row.iter_mut().zip(self.rect.left..).zip(first..) {
                let mut composite = Composite::default();
                for &key in self.keys_of(sample) {
                    if let Some(color) = self.surfaces.color(key as u32, x, y, draws) {
                        composite.under(color);
                    }
                    // Exactly 0: nothing behind changes a bit.
                    if composite.transmittance == 0.0 {
                        break;
                    }
                }
                let behind = self.opaque_surface(sample, x, y, draws).map_or(background, |surface| surface.color);
                *pixel = composite.over(behind);
            }
        }
    }

    /// Shades every fragment into `layers`, whose memory is used again.
    pub(crate) fn layers(&self, draws: &[Draw<'_>], layers: &mut Layers) {
        layers.left = self.rect.left as u32;
        layers.top = self.rect.top as u32;
        layers.width = (self.rect.right - self.rect.left + 1) as u32;
        layers.height = (self.rect.bottom - self.rect.top + 1) as u32;
        layers.ends.clear();
        layers.fragments.clear();
        layers.opaque.clear();
        for (sample, x, y) in self.pixels() {
            layers.fragments.extend(self.keys_of(sample).iter().filter_map(|&key| {
                let place = key as u32;
                let color = self.surfaces.color(place, x, y, draws)?;
                let primitive = self.surfaces.surfaces[place as usize].primitive;
                Some(Fragment { color, depth: f32::from_bits((key >> 32) as u32), primitive })
            }));
            layers.ends.push(layers.fragments.len() as u32);
            layers.opaque.push(self.opaque_surface(sample, x, y, draws));
        }
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.surfaces.surfaces.capacity() * size_of::<Surface>()
            + self.surfaces.varying.capacity() * size_of::<Varying>()
            + (self.opaque_keys.capacity() + self.keys.capacity() + self.sorted_keys.capacity()) * 8
            + (self.opaque_surfaces.capacity() + self.ends.capacity()) * 4
            + self.samples.capacity() * 2
    }
}

#[inline(always)]
fn sort_descending(keys: &mut [u64]) {
    if keys.len() > INSERTION_SORT_MAX {
        keys.sort_unstable_by(|a, b| b.cmp(a));
        return;
    }
    for i in 1..keys.len() {
        let key = keys[i];
        let mut place = i;
        while place > 0 && keys[place - 1] < key {
            keys[place] = keys[place - 1];
            place -= 1;
        }
        keys[place] = key;
    }
}
