//! One triangle in one tile: which samples it covers, and at what depth.
//!
//! The edge functions of the contract are 64-bit integers in subpixels. Seen from a tile they fit 32 bits: values at
//! neighbouring pixel centres differ by multiples of 256, so dividing by 256 and rounding down changes no sign; an edge
//! with the whole tile inside is left out, and for any other one the value at a pixel of the tile is at most
//! 31 * (2^23 + 2^23) from zero. A row of the tile is then a mask of 32 bits, made eight samples at a time.

use fearless_simd::{
    Bytes, Simd, SimdBase, SimdInt, SimdMask, SimdNarrow, SimdSplit, f32x8, f64x8, i32x8, mask32x8, u32x8,
};
use pellucid_core::pixel_grid::{Plane, ScreenTriangle, center};
use pellucid_core::primitive::Fold;
use pellucid_core::shading::NormalPlane;

use crate::bin::{PixelRect, TILE_PX};
use crate::fragments::Room;
use crate::simd::light;

/// An edge seen from a tile: not negative inside.
#[derive(Clone, Copy, Default)]
struct TileEdge {
    /// Change for one pixel to the right.
    dx: i32,
    /// Change for one pixel downwards.
    dy: i32,
    /// Value at the tile's top left pixel.
    value: i32,
}

/// Where a triangle's depth is computed from.
#[derive(Clone, Copy)]
pub(crate) struct Depths {
    plane: Plane,
    range: [f32; 2],
    /// Pixels from the anchor to the tile's top left pixel.
    left: i32,
    top: i32,
}

/// The samples of a tile that a triangle covers: rows `top..=bottom` of the tile, a bit for each column.
#[derive(Default)]
pub(crate) struct Coverage {
    pub(crate) top: usize,
    pub(crate) bottom: usize,
    pub(crate) rows: [u32; TILE_PX as usize],
}

impl Coverage {
    /// Whether every row from the first to the last is covered from end to end.
    #[inline(always)]
    pub(crate) fn has_whole_rows(&self) -> bool {
        self.rows[self.top..=self.bottom].iter().all(|&row| row == u32::MAX)
    }
}

/// Lanes of a vector of edge values.
const LANES: i32 = 8;

/// Finds the samples of a tile that a triangle covers, among those in `samples`; `false` if there are none.
#[inline(always)]
pub(crate) fn cover<S: Simd>(
    simd: S,
    triangle: &ScreenTriangle,
    samples: PixelRect,
    tile: PixelRect,
    coverage: &mut Coverage,
) -> bool {
    let mut edges = [TileEdge::default(); 3];
    let mut whole = true;
    for (tile_edge, edge) in edges.iter_mut().zip(&triangle.edges) {
        let value = edge.biased_at(center(tile.left), center(tile.top)) >> 8;
        let (across, down) = (edge.a * i64::from(TILE_PX - 1), edge.b * i64::from(TILE_PX - 1));
        if value + across.max(0) + down.max(0) < 0 {
            return false;
        }
        if value + across.min(0) + down.min(0) < 0 {
            *tile_edge = TileEdge { dx: edge.a as i32, dy: edge.b as i32, value: value as i32 };
            whole = false;
        }
    }
    let left = samples.left.max(tile.left) - tile.left;
    let right = samples.right.min(tile.right) - tile.left;
    let top = samples.top.max(tile.top) - tile.top;
    let bottom = samples.bottom.min(tile.bottom) - tile.top;
    if left > right || top > bottom {
        return false;
    }
    coverage.top = top as usize;
    coverage.bottom = bottom as usize;
    let columns = (u32::MAX >> (31 - (right - left))) << left;
    let rows = &mut coverage.rows[top as usize..=bottom as usize];
    if whole {
        rows.fill(columns);
        return true;
    }
    let lanes = i32x8::from_slice(simd, &[0, 1, 2, 3, 4, 5, 6, 7]);
    let [a, b, c] = edges;
    let first = |edge: &TileEdge| edge.value + edge.dy * top + edge.dx * left;
    let (first_a, first_b, first_c) = (first(&a), first(&b), first(&c));
    let (mut row_a, mut row_b, mut row_c) = (lanes * a.dx + first_a, lanes * b.dx + first_b, lanes * c.dx + first_c);
    let zero = i32x8::splat(simd, 0);
    let mut any = 0;
    for row in rows {
        let (mut value_a, mut value_b, mut value_c) = (row_a, row_b, row_c);
        let mut mask = 0u64;
        let mut x = left;
        while x <= right {
            mask |= (value_a | value_b | value_c).simd_ge(zero).to_bitmask() << x;
            x += LANES;
            value_a += a.dx * LANES;
            value_b += b.dx * LANES;
            value_c += c.dx * LANES;
        }
        *row = mask as u32 & columns;
        any |= *row;
        row_a += a.dy;
        row_b += b.dy;
        row_c += c.dy;
    }
    any != 0
}

/// What the pieces of a folded primitive have done to the tile so far, see [`Fold`].
#[derive(Debug)]
pub(crate) struct FoldState {
    primitive: Option<u32>,
    /// For each sample, how many coverings are still to be taken off.
    to_take_off: [[u8; TILE_PX as usize]; TILE_PX as usize],
    /// Rows of samples that the primitive covers.
    covered: [u32; TILE_PX as usize],
}

impl Default for FoldState {
    fn default() -> Self {
        Self { primitive: None, to_take_off: [[0; TILE_PX as usize]; TILE_PX as usize], covered: [0; TILE_PX as usize] }
    }
}

impl FoldState {
    /// Leaves in `coverage` what a piece adds to its primitive. The pieces of a primitive come one after another, those
    /// that take off first.
    #[cold]
    pub(crate) fn apply(&mut self, fold: Fold, primitive: u32, coverage: &mut Coverage) {
        if self.primitive != Some(primitive) {
            *self = Self { primitive: Some(primitive), ..Self::default() };
        }
        for y in coverage.top..=coverage.bottom {
            let mut samples = std::mem::take(&mut coverage.rows[y]) & !self.covered[y];
            while samples != 0 {
                let x = samples.trailing_zeros() as usize;
                samples &= samples - 1;
                let to_take_off = &mut self.to_take_off[y][x];
                if fold == Fold::TakesOff {
                    *to_take_off += 1;
                } else if *to_take_off > 0 {
                    *to_take_off -= 1;
                } else {
                    coverage.rows[y] |= 1 << x;
                }
            }
            self.covered[y] |= coverage.rows[y];
        }
    }

    /// Forgets every primitive.
    pub(crate) fn reset(&mut self) {
        self.primitive = None;
    }
}

impl Depths {
    #[inline(always)]
    pub(crate) fn new(triangle: &ScreenTriangle, weights: [Plane; 2], tile: PixelRect) -> Self {
        let [anchor_x, anchor_y] = triangle.anchor_px();
        Self {
            plane: triangle.depth_plane(weights),
            range: triangle.depth_range(),
            left: tile.left - anchor_x,
            top: tile.top - anchor_y,
        }
    }

    /// The plane's value left of row `y` of the tile.
    #[inline(always)]
    pub(crate) fn row(&self, y: usize) -> f64 {
        self.plane.value + f64::from(self.top + y as i32) * self.plane.dy
    }

    /// Depth in column `x` of a row.
    #[inline(always)]
    pub(crate) fn at(&self, row: f64, x: usize) -> f32 {
        let value = row + f64::from(self.left + x as i32) * self.plane.dx;
        // Adding zero turns -0 into 0.
        (value as f32).max(self.range[0]).min(self.range[1]) + 0.0
    }
}

/// Makes the fragments of a triangle whose colour varies by light alone, eight of a row at a time.
pub(crate) struct RowFragments<'a, S: Simd> {
    depths: &'a Depths,
    normal: &'a NormalPlane,
    /// The brightness of all, if the normal is the same everywhere.
    steady_light: Option<f32>,
    /// 0 to 7.
    ramp: f64x8<S>,
    lanes: i32x8<S>,
    /// Pixels from the anchor to the tile's top left pixel.
    left: i32,
    top: i32,
}

impl<'a, S: Simd> RowFragments<'a, S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, depths: &'a Depths, normal: &'a NormalPlane, is_steady: bool) -> Self {
        Self {
            depths,
            normal,
            steady_light: is_steady.then(|| normal.light_at(0, 0)),
            ramp: f64x8::load_array(simd, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]),
            lanes: i32x8::load_array(simd, [0, 1, 2, 3, 4, 5, 6, 7]),
            left: depths.left,
            top: depths.top,
        }
    }

    /// Puts the fragments at the samples `mask` of row `y` of the tile into room for them after the first `count`, which it
    /// counts on, unless they lie behind the depths in `hidden`.
    #[inline(always)]
    pub(crate) fn add(
        &self,
        simd: S,
        y: usize,
        mask: u32,
        hidden: Option<&[f32]>,
        [source, primitive]: [u32; 2],
        room: &mut Room<'_>,
        count: &mut usize,
    ) {
        let row = f64x8::splat(simd, self.depths.row(y));
        let dx = f64x8::splat(simd, self.depths.plane.dx);
        let [least, greatest] = self.depths.range;
        let mut mask = u64::from(mask);
        while mask != 0 {
            let x = mask.trailing_zeros();
            let mut bits = mask >> x & 0xFF;
            mask &= !(0xFF << x);
            let columns = self.ramp + f64::from(self.left + x as i32);
            let (low, high) = (row + columns * dx).split();
            // Adding zero turns -0 into 0.
            let depth = low.narrow(high).max(least).min(greatest) + 0.0;
            let sample = y * TILE_PX as usize + x as usize;
            if let Some(hidden) = hidden {
                let hidden = f32x8::from_slice(simd, &hidden[sample..sample + LANES as usize]);
                bits &= depth.simd_ge(hidden).to_bitmask();
            }
            let light = match self.steady_light {
                Some(light) => f32x8::splat(simd, light),
                None => {
                    let columns: f32x8<S> = (self.lanes + (self.left + x as i32)).to_float();
                    let row = self.normal.value + self.normal.dy * (self.top + y as i32) as f32;
                    let axis = |i: usize| columns * self.normal.dx[i] + row[i];
                    light(simd, [axis(0), axis(1), axis(2)])
                }
            };
            let range = *count..*count + LANES as usize;
            let samples: u32x8<S> = (self.lanes + sample as i32).bitcast();
            // Triangles are convex: a row has gaps only where something hides it or covers it twice.
            let has_gaps = bits & (bits + 1) != 0;
            if has_gaps {
                let kept = mask32x8::from_bitmask(simd, bits);
                samples.compress(kept).store_slice(&mut room.samples[range.clone()]);
                depth.compress(kept).store_slice(&mut room.depths[range.clone()]);
                light.compress(kept).store_slice(&mut room.lights[range.clone()]);
            } else {
                samples.store_slice(&mut room.samples[range.clone()]);
                depth.store_slice(&mut room.depths[range.clone()]);
                light.store_slice(&mut room.lights[range.clone()]);
            }
            u32x8::splat(simd, source).store_slice(&mut room.sources[range.clone()]);
            u32x8::splat(simd, primitive).store_slice(&mut room.primitives[range.clone()]);
            *count += bits.count_ones() as usize;
        }
    }
}
