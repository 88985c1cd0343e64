//! Small triangles to fragments, sixteen triangles at a time.
//!
//! A triangle less than 8 pixels wide and high is not worth a place in the bins: most have one or two fragments. These
//! are made and lit right after set-up, the first fragment of all sixteen triangles in one go, then the second, and so
//! on. All that is left for the tile is to order and blend them.

use fearless_simd::{Simd, SimdBase, SimdInt, f32x16, i32x16};
use glam::{Vec3, Vec3A};
use pellucid_core::pixel_grid::{SUBPIXELS, center};
use pellucid_core::primitive::Draw;

use crate::bin::{TILE_PX, TileGrid};
use crate::simd::{Wide, light};
use crate::transform::DrawVertices;

pub(crate) const LANES: usize = 16;

/// Side of the block of samples that a small triangle reaches at most, its first sample at the top left.
pub(crate) const SMALL_PX: i32 = 8;

/// Bits of a sample's number in its tile.
const SAMPLE_BITS: u32 = 10;
const _: () = assert!(1 << SAMPLE_BITS == TILE_PX * TILE_PX);

/// A fragment of a small triangle.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SmallFragment {
    pub(crate) depth: f32,
    /// Brightness of its surface.
    pub(crate) light: f32,
    pub(crate) primitive: u32,
    /// Number of the draw.
    pub(crate) draw: u32,
}

/// Fragments of small triangles by tile, in draw order.
#[derive(Debug, Default)]
pub(crate) struct SmallFragments {
    /// Tile and sample of each, as they come, and how many have come; beyond that is room.
    places: Vec<u32>,
    unsorted: Vec<SmallFragment>,
    count: usize,
    starts: Vec<u32>,
    samples: Vec<u16>,
    fragments: Vec<SmallFragment>,
}

/// Small triangles that wait to be sixteen.
#[derive(Debug, Default)]
pub(crate) struct SmallTriangles {
    count: usize,
    /// Corners, clockwise on the screen.
    corners: [[u32; 3]; LANES],
    /// Number of the triangle in the draw's mesh.
    triangles: [u32; LANES],
    /// The first sample of the block ...
    left: [i32; LANES],
    top: [i32; LANES],
    /// ... and which ones of it are covered, row by row.
    covered: [u64; LANES],
}

impl SmallTriangles {
    /// Adds a triangle; returns whether there are sixteen.
    #[inline(always)]
    pub(crate) fn push(&mut self, triangle: usize, corners: [u32; 3], [left, top]: [i32; 2], covered: u64) -> bool {
        let lane = self.count;
        self.corners[lane] = corners;
        self.triangles[lane] = triangle as u32;
        self.left[lane] = left;
        self.top[lane] = top;
        self.covered[lane] = covered;
        self.count += 1;
        self.count == LANES
    }

    /// Turns the triangles into fragments.
    #[inline(always)]
    pub(crate) fn flush<S: Simd>(
        &mut self,
        simd: S,
        draw: &Draw<'_>,
        draw_number: u32,
        vertices: DrawVertices<'_>,
        grid: &TileGrid,
        fragments: &mut SmallFragments,
    ) {
        let triangle_count = std::mem::take(&mut self.count);
        if triangle_count == 0 {
            return;
        }
        // The planes of depth and of weights, as `ScreenTriangle` has them.
        let corner = |k: usize| -> (i32x16<S>, i32x16<S>) {
            let mut pairs = [[0; 2]; LANES];
            for (pair, corners) in pairs.iter_mut().zip(&self.corners[..triangle_count]) {
                *pair = vertices.positions[corners[k] as usize];
            }
            load_pairs(simd, &pairs)
        };
        let ((ax, ay), (bx, by), (cx, cy)) = (corner(0), corner(1), corner(2));
        let anchor = |a: i32x16<S>| a >> 8;
        let (anchor_x, anchor_y) = (anchor(ax), anchor(ay));
        let middle = |px: i32x16<S>| (px << 8) + center(0);
        let (x, y) = (middle(anchor_x), middle(anchor_y));
        let edge = |from_x: i32x16<S>, from_y: i32x16<S>, to_x: i32x16<S>, to_y: i32x16<S>| {
            let (a, b) = (from_y - to_y, to_x - from_x);
            (a, b, a * (x - from_x) + b * (y - from_y))
        };
        let area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
        let inv_area = Wide::splat(simd, 1.0) / Wide::from_small_int(area);
        let step = Wide::splat(simd, f64::from(SUBPIXELS)) * inv_area;
        let plane = |(a, b, value): (i32x16<S>, i32x16<S>, i32x16<S>)| {
            [(value, inv_area), (a, step), (b, step)].map(|(int, factor)| Wide::from_small_int(int) * factor)
        };
        let (second, third) = (plane(edge(cx, cy, ax, ay)), plane(edge(ax, ay, bx, by)));
        let depth_w = |k: usize| -> (f32x16<S>, f32x16<S>) {
            let mut pairs = [[0.0; 2]; LANES];
            for (pair, corners) in pairs.iter_mut().zip(&self.corners[..triangle_count]) {
                *pair = vertices.depths[corners[k] as usize];
            }
            load_pairs(simd, &pairs)
        };
        let ((az, a_inv_w), (bz, b_inv_w), (cz, c_inv_w)) = (depth_w(0), depth_w(1), depth_w(2));
        let (least, greatest) = (az.min(bz).min(cz), az.max(bz).max(cz));
        let [z0, z1, z2] = [az, bz, cz].map(Wide::from_f32);
        let (dz1, dz2) = (z1 - z0, z2 - z0);
        let depth_value = z0 + (second[0] * dz1 + third[0] * dz2);
        let depth_dx = second[1] * dz1 + third[1] * dz2;
        let depth_dy = second[2] * dz1 + third[2] * dz2;

        let lighting = if !draw.lit {
            Lighting::Constant(f32x16::splat(simd, 1.0))
        } else if let Some(normals) = draw.mesh.normals() {
            let corner = |k: usize, inv_w: f32x16<S>| {
                let normal = gather(simd, &self.corners[..triangle_count], |corners| normals[corners[k] as usize]);
                in_view(draw, normal).map(|n| n * inv_w)
            };
            let (a, b, c) = (corner(0, a_inv_w), corner(1, b_inv_w), corner(2, c_inv_w));
            let [[second_value, second_dx, second_dy], [third_value, third_dx, third_dy]] =
                [second, third].map(|plane| plane.map(Wide::to_f32));
            Lighting::Smooth([0, 1, 2].map(|i| {
                let (to_b, to_c) = (b[i] - a[i], c[i] - a[i]);
                [
                    a[i] + (to_b * second_value + to_c * third_value),
                    to_b * second_dx + to_c * third_dx,
                    to_b * second_dy + to_c * third_dy,
                ]
            }))
        } else {
            let normal = gather(simd, &self.triangles[..triangle_count], |&triangle| {
                let [a, b, c] = draw.mesh.triangles()[triangle as usize].map(|v| draw.mesh.positions()[v as usize]);
                let unit = |edge: Vec3| edge / edge.abs().max_element().max(f32::MIN_POSITIVE);
                unit(b - a).cross(unit(c - a))
            });
            Lighting::Constant(light(simd, in_view(draw, normal)))
        };

        // Fragments are made in turns but put down in draw order.
        let mut next = [0; LANES];
        let mut covered = [0; LANES];
        let mut primitives = [0; LANES];
        let mut place = fragments.count;
        let mut turns = 0;
        for lane in 0..triangle_count {
            next[lane] = place;
            covered[lane] = self.covered[lane];
            primitives[lane] = draw.first_primitive + self.triangles[lane];
            let count = covered[lane].count_ones();
            place += count as usize;
            turns = turns.max(count);
        }
        fragments.make_room(place);
        let left = i32x16::load_array(simd, self.left);
        let top = i32x16::load_array(simd, self.top);
        let (columns, rows) = (TILE_PX - 1, TILE_PX - 1);
        for _ in 0..turns {
            let mut bits = [0; LANES];
            for (bit, covered) in bits.iter_mut().zip(&covered) {
                *bit = covered.trailing_zeros() as i32;
            }
            let bits = i32x16::load_array(simd, bits);
            let (x, y) = (left + (bits & (SMALL_PX - 1)), top + (bits >> 3));
            let tile = (y >> 5) * grid.columns as i32 + (x >> 5);
            let places = (tile << SAMPLE_BITS) | ((y & rows as i32) << 5) | (x & columns as i32);
            let (x, y): (f32x16<S>, f32x16<S>) = ((x - anchor_x).to_float(), (y - anchor_y).to_float());
            let depth = (depth_value + Wide::from_f32(y) * depth_dy) + Wide::from_f32(x) * depth_dx;
            // Adding zero turns -0 into 0.
            let depth = depth.to_f32().max(least).min(greatest) + 0.0;
            let light = match &lighting {
                Lighting::Constant(light) => *light,
                Lighting::Smooth(planes) => light(simd, planes.map(|[value, dx, dy]| (value + dy * y) + dx * x)),
            };
            let (places, depth, light): ([i32; LANES], [f32; LANES], [f32; LANES]) =
                (places.into(), depth.into(), light.into());
            for lane in 0..triangle_count {
                if covered[lane] == 0 {
                    continue;
                }
                covered[lane] &= covered[lane] - 1;
                let place = next[lane];
                next[lane] += 1;
                fragments.places[place] = places[lane] as u32;
                fragments.unsorted[place] = SmallFragment {
                    depth: depth[lane],
                    light: light[lane],
                    primitive: primitives[lane],
                    draw: draw_number,
                };
            }
        }
        fragments.count = place;
    }
}

/// How sixteen triangles are lit.
enum Lighting<S: Simd> {
    /// Flat, or not at all: one brightness each.
    Constant(f32x16<S>),
    /// By the normal's x, y and z: value at the anchor, change to the right, change downwards.
    Smooth([[f32x16<S>; 3]; 3]),
}

/// A vector for each of sixteen lanes, as structure of arrays.
#[inline(always)]
fn gather<S: Simd, T>(simd: S, lanes: &[T], vector: impl Fn(&T) -> Vec3) -> [f32x16<S>; 3] {
    let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for (lane, from) in lanes.iter().enumerate() {
        [x[lane], y[lane], z[lane]] = vector(from).to_array();
    }
    [x, y, z].map(|axis| f32x16::load_array(simd, axis))
}

/// Normals in camera space.
#[inline(always)]
fn in_view<S: Simd>(draw: &Draw<'_>, [x, y, z]: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
    let matrix = &draw.view_from_normal;
    let [x_axis, y_axis, z_axis] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis: Vec3A| axis.to_array());
    [0, 1, 2].map(|i| (x * x_axis[i] + y * y_axis[i]) + z * z_axis[i])
}

/// Two arrays from one of pairs.
#[inline(always)]
pub(crate) fn load_pairs<S: Simd, V: SimdBase<S>>(simd: S, pairs: &[[V::Element; 2]; LANES]) -> (V, V)
where
    V::Element: Copy,
{
    let (low, high) = pairs.as_flattened().split_at(LANES);
    V::from_slice(simd, low).deinterleave(V::from_slice(simd, high))
}

impl SmallFragments {
    /// Forgets all.
    pub(crate) fn begin(&mut self) {
        self.count = 0;
    }

    #[inline(always)]
    fn make_room(&mut self, count: usize) {
        if self.places.len() < count {
            let room = count.next_power_of_two().max(1024);
            self.places.resize(room, 0);
            self.unsorted.resize(room, SmallFragment::default());
        }
    }

    /// Sorts what came by tile, keeping draw order.
    pub(crate) fn finish(&mut self, grid: &TileGrid) {
        self.starts.clear();
        if self.count == 0 {
            return;
        }
        let (places, unsorted) = (&self.places[..self.count], &self.unsorted[..self.count]);
        self.starts.resize(grid.tile_count() + 1, 0);
        for place in places {
            self.starts[(place >> SAMPLE_BITS) as usize + 1] += 1;
        }
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        if self.samples.len() < self.count {
            self.samples.resize(self.places.len(), 0);
            self.fragments.resize(self.places.len(), SmallFragment::default());
        }
        // Each start moves to the next one's place while its fragments are put down ...
        for (&place, &fragment) in places.iter().zip(unsorted) {
            let start = &mut self.starts[(place >> SAMPLE_BITS) as usize];
            self.samples[*start as usize] = (place & ((1 << SAMPLE_BITS) - 1)) as u16;
            self.fragments[*start as usize] = fragment;
            *start += 1;
        }
        // ... and back.
        self.starts.copy_within(0..grid.tile_count(), 1);
        self.starts[0] = 0;
    }

    /// The fragments in a tile, in draw order, and their samples.
    #[inline(always)]
    pub(crate) fn tile(&self, number: u32) -> (&[SmallFragment], &[u16]) {
        if self.starts.is_empty() {
            return (&[], &[]);
        }
        let number = number as usize;
        let range = self.starts[number] as usize..self.starts[number + 1] as usize;
        (&self.fragments[range.clone()], &self.samples[range])
    }

    /// Adds how many fragments each tile has.
    pub(crate) fn add_counts(&self, counts: &mut [u32]) {
        add_counts(&self.starts, counts);
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        (self.places.capacity() + self.starts.capacity()) * 4
            + (self.unsorted.capacity() + self.fragments.capacity()) * size_of::<SmallFragment>()
            + self.samples.capacity() * 2
    }
}

/// Adds the lengths of the ranges between `starts`.
pub(crate) fn add_counts(starts: &[u32], counts: &mut [u32]) {
    for (count, range) in counts.iter_mut().zip(starts.windows(2)) {
        *count += range[1] - range[0];
    }
}
