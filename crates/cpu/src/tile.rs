//! One tile: opaque surfaces through a depth buffer, then transparent ones captured, ordered and resolved.

use glam::Vec4;
use pellucid_core::composite::Composite;
use pellucid_core::fragment::order_key;
use pellucid_core::layers::OpaqueSurface;
use pellucid_core::pixel_grid::ScreenTriangle;
use pellucid_core::primitive::Draw;
use pellucid_core::shading::Surface;
use pellucid_core::{Fragment, Layers};

use crate::bin::{PixelRect, TILE_PX, TileGrid};
use crate::raster::rasterize;
use crate::setup::{Chunk, Record};

/// Samples of a tile.
const TILE_SAMPLES: usize = (TILE_PX * TILE_PX) as usize;

/// Up to so many fragments, insertion is the fastest sort (LFB chapter, section 20.4.1).
const INSERTION_SORT_MAX: usize = 32;

/// No surface.
const NONE: u32 = u32::MAX;

/// What is captured of a tile, and the memory for it: kept from tile to tile.
#[derive(Debug)]
pub(crate) struct TileCapture {
    rect: PixelRect,
    surfaces: Vec<TileSurface>,
    /// Nearest opaque surface: order key so far, and its place in `surfaces`.
    opaque_keys: Vec<u64>,
    opaque_surfaces: Vec<u32>,
    /// Transparent fragments in draw order: sample, and depth above place in `surfaces`. As surfaces stand in draw order,
    /// this orders like the contract's order key.
    samples: Vec<u16>,
    keys: Vec<u64>,
    /// The same keys by sample, and where each sample's end.
    sorted_keys: Vec<u64>,
    ends: Vec<u32>,
}

/// A piece of a primitive with a fragment in the tile.
#[derive(Debug)]
struct TileSurface {
    draw: u32,
    primitive: u32,
    surface: Surface,
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

impl Default for TileCapture {
    fn default() -> Self {
        Self {
            rect: PixelRect { left: 0, top: 0, right: 0, bottom: 0 },
            surfaces: Vec::new(),
            opaque_keys: vec![0; TILE_SAMPLES],
            opaque_surfaces: vec![NONE; TILE_SAMPLES],
            samples: Vec::new(),
            keys: Vec::new(),
            sorted_keys: Vec::new(),
            ends: vec![0; TILE_SAMPLES],
        }
    }
}

impl TileCapture {
    /// Captures a tile and orders its fragments.
    pub(crate) fn capture(
        &mut self,
        number: u32,
        chunks: &[Chunk],
        draws: &[Draw<'_>],
        grid: &TileGrid,
    ) -> FragmentCounts {
        self.rect = grid.tile(number);
        self.surfaces.clear();
        self.samples.clear();
        self.keys.clear();
        self.opaque_keys.fill(0);
        self.opaque_surfaces.fill(NONE);
        for chunk in chunks {
            for &record in chunk.opaque.tile(number) {
                self.add_opaque(chunk, chunk.record(record), draws, grid);
            }
        }
        // Opaque surfaces may stand anywhere in draw order; those of transparent ones start after them.
        for chunk in chunks {
            for &record in chunk.transparent.tile(number) {
                self.add_transparent(chunk, chunk.record(record), draws, grid);
            }
        }
        self.order()
    }

    fn add_opaque(&mut self, chunk: &Chunk, record: &Record, draws: &[Draw<'_>], grid: &TileGrid) {
        let Some(triangle) = ScreenTriangle::new(record.vertices) else { return };
        let Some(samples) = grid.samples_in_bounds(&record.vertices) else { return };
        let draw = &draws[record.draw as usize];
        let primitive = draw.first_primitive + record.triangle;
        let mut place = NONE;
        rasterize(&triangle, samples, self.rect, |sample, x, y, depth| {
            let key = order_key(depth, primitive);
            if key < self.opaque_keys[sample] {
                return;
            }
            if place == NONE {
                place = add_surface(&mut self.surfaces, chunk, record, triangle, draw, primitive);
            }
            let surface = &self.surfaces[place as usize].surface;
            if draw.cutoff.is_none() || surface.color(draw, x, y).is_some() {
                self.opaque_keys[sample] = key;
                self.opaque_surfaces[sample] = place;
            }
        });
    }

    fn add_transparent(&mut self, chunk: &Chunk, record: &Record, draws: &[Draw<'_>], grid: &TileGrid) {
        let Some(triangle) = ScreenTriangle::new(record.vertices) else { return };
        let Some(samples) = grid.samples_in_bounds(&record.vertices) else { return };
        let draw = &draws[record.draw as usize];
        let mut place = NONE;
        rasterize(&triangle, samples, self.rect, |sample, x, y, depth| {
            // In front of the opaque surface, or level with it.
            if depth.to_bits() < (self.opaque_keys[sample] >> 32) as u32 {
                return;
            }
            if place == NONE {
                let primitive = draw.first_primitive + record.triangle;
                place = add_surface(&mut self.surfaces, chunk, record, triangle, draw, primitive);
            }
            if draw.cutoff.is_some() && self.surfaces[place as usize].surface.color(draw, x, y).is_none() {
                return;
            }
            self.samples.push(sample as u16);
            self.keys.push(order_key(depth, place));
        });
    }

    /// Brings the fragments of each sample together, nearest first.
    fn order(&mut self) -> FragmentCounts {
        let mut counts = FragmentCounts { fragments: self.keys.len() as u64, ..FragmentCounts::default() };
        self.ends.fill(0);
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
        self.sorted_keys.resize(self.keys.len(), 0);
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

    fn keys_of(&self, sample: usize) -> &[u64] {
        let start = if sample == 0 { 0 } else { self.ends[sample - 1] as usize };
        &self.sorted_keys[start..self.ends[sample] as usize]
    }

    fn opaque_surface(&self, sample: usize, x: i32, y: i32, draws: &[Draw<'_>]) -> Option<OpaqueSurface> {
        let place = self.opaque_surfaces[sample];
        if place == NONE {
            return None;
        }
        let TileSurface { draw, surface, .. } = &self.surfaces[place as usize];
        let color = surface.color(&draws[*draw as usize], x, y)?;
        Some(OpaqueSurface { color, depth: f32::from_bits((self.opaque_keys[sample] >> 32) as u32) })
    }

    fn fragment(&self, key: u64, x: i32, y: i32, draws: &[Draw<'_>]) -> Option<Fragment> {
        let TileSurface { draw, primitive, surface } = &self.surfaces[key as u32 as usize];
        let color = surface.color(&draws[*draw as usize], x, y)?;
        Some(Fragment { color, depth: f32::from_bits((key >> 32) as u32), primitive: *primitive })
    }

    /// Blends every pixel front to back before `background` into rows of pixels.
    pub(crate) fn blend(&self, draws: &[Draw<'_>], background: Vec4, rows: &mut [&mut [Vec4]]) {
        for (sample, x, y) in self.pixels() {
            let mut composite = Composite::default();
            for &key in self.keys_of(sample) {
                if let Some(fragment) = self.fragment(key, x, y, draws) {
                    composite.under(fragment.color);
                }
                // Exactly 0: nothing behind changes a bit.
                if composite.transmittance == 0.0 {
                    break;
                }
            }
            let behind = self.opaque_surface(sample, x, y, draws).map_or(background, |surface| surface.color);
            rows[(y - self.rect.top) as usize][(x - self.rect.left) as usize] = composite.over(behind);
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
            layers.fragments.extend(self.keys_of(sample).iter().filter_map(|&key| self.fragment(key, x, y, draws)));
            layers.ends.push(layers.fragments.len() as u32);
            layers.opaque.push(self.opaque_surface(sample, x, y, draws));
        }
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.surfaces.capacity() * size_of::<TileSurface>()
            + (self.opaque_keys.capacity() + self.keys.capacity() + self.sorted_keys.capacity()) * 8
            + (self.opaque_surfaces.capacity() + self.ends.capacity()) * 4
            + self.samples.capacity() * 2
    }
}

fn add_surface(
    surfaces: &mut Vec<TileSurface>,
    chunk: &Chunk,
    record: &Record,
    triangle: ScreenTriangle,
    draw: &Draw<'_>,
    primitive: u32,
) -> u32 {
    let surface = Surface::new(draw, record.triangle as usize, &chunk.piece(record, triangle));
    surfaces.push(TileSurface { draw: record.draw, primitive, surface });
    (surfaces.len() - 1) as u32
}

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
