//! Small triangles to fragments, sixteen triangles at a time.
//!
//! A triangle of few fragments is not worth a place in the bins. Its fragments are made and lit right after set-up, eight at
//! a time, of as many triangles as that takes. All that is left for the tile is to order and blend them. A triangle that
//! reaches several blocks of samples takes part once for each.

use bytemuck::{Pod, Zeroable};
use fearless_simd::{
    Bytes, Level, Simd, SimdBase, SimdCombine, SimdInt, SimdInterleaved, SimdSplit, SimdWiden, dispatch,
};
use fearless_simd::{f32x8, f32x16, i32x8, i32x16, u16x8, u32x4, u32x8};
use glam::Vec3;
use pellucid_core::pixel_grid::{SUBPIXELS, center};
use pellucid_core::primitive::Draw;
use prefetch_index::prefetch_index;

use crate::bin::{TILE_PX, TileGrid};
use crate::simd::{Lookup, Wide, light, narrow, widen};
use crate::transform::DrawVertices;

pub(crate) const LANES: usize = 16;

/// Side of a block of samples.
pub(crate) const BLOCK_PX: i32 = 8;

/// Most fragments of a small triangle. One that has more is a record: it takes less room, and a tile makes fragments side
/// by side as fast.
pub(crate) const MOST_FRAGMENTS: u32 = 32;

/// Bits of a sample's number in its tile.
const SAMPLE_BITS: u32 = 10;
const _: () = assert!(1 << SAMPLE_BITS == TILE_PX * TILE_PX);

/// A fragment of a small triangle.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SmallFragment {
    pub(crate) depth: f32,
    /// Brightness of its surface.
    pub(crate) light: f32,
    pub(crate) primitive: u32,
    /// Number of the draw.
    pub(crate) draw: u32,
}

/// Fragments of small triangles as they come, in draw order. A thread's, used again for every chunk.
#[derive(Debug, Default)]
pub(crate) struct NewFragments {
    /// Tile and sample of each.
    places: Vec<u32>,
    fragments: Vec<SmallFragment>,
    /// How many have come; beyond is room.
    count: usize,
}

/// Fragments of small triangles by tile, in draw order.
#[derive(Debug, Default)]
pub(crate) struct SmallFragments {
    starts: Vec<u32>,
    samples: Vec<u16>,
    fragments: Vec<SmallFragment>,
}

/// Small triangles, or blocks of them, that wait to be sixteen.
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
    /// All samples that the sixteen cover.
    samples: Samples,
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

    /// Turns the triangles into fragments. A function of its own: inlined into the loop over triangles, its conditions on
    /// the draw would be taken out of that loop one by one, for minutes of compile time.
    #[inline(never)]
    pub(crate) fn flush(
        &mut self,
        level: Level,
        draw: &Draw<'_>,
        draw_number: u32,
        vertices: DrawVertices<'_>,
        grid: &TileGrid,
        fragments: &mut NewFragments,
    ) {
        dispatch!(level, simd => self.flush_simd(simd, draw, draw_number, vertices, grid, fragments));
    }

    #[inline(always)]
    fn flush_simd<S: Simd>(
        &mut self,
        simd: S,
        draw: &Draw<'_>,
        draw_number: u32,
        vertices: DrawVertices<'_>,
        grid: &TileGrid,
        fragments: &mut NewFragments,
    ) {
        let triangle_count = std::mem::take(&mut self.count);
        if triangle_count == 0 {
            return;
        }
        // The planes of weights and of depth, as `ScreenTriangle` has them.
        // Lanes without a triangle have corners of another, which do no harm.
        let corners = &self.corners;
        let a: (i32x16<S>, i32x16<S>) = gather_pairs(simd, corners, 0, vertices.positions);
        let b: (i32x16<S>, i32x16<S>) = gather_pairs(simd, corners, 1, vertices.positions);
        let c: (i32x16<S>, i32x16<S>) = gather_pairs(simd, corners, 2, vertices.positions);
        let (anchor_x, anchor_y) = (a.0 >> 8, a.1 >> 8);
        let anchor = ((anchor_x << 8) + center(0), (anchor_y << 8) + center(0));
        let area = (b.0 - a.0) * (c.1 - a.1) - (c.0 - a.0) * (b.1 - a.1);
        let inv_area = Wide::splat(simd, 1.0) / Wide::from_small_int(area);
        let second = WidePlane::weight(simd, c, a, anchor, inv_area);
        let third = WidePlane::weight(simd, a, b, anchor, inv_area);
        let (a_z, a_inv_w): (f32x16<S>, f32x16<S>) = gather_pairs(simd, corners, 0, vertices.depths);
        let (b_z, b_inv_w): (f32x16<S>, f32x16<S>) = gather_pairs(simd, corners, 1, vertices.depths);
        let (c_z, c_inv_w): (f32x16<S>, f32x16<S>) = gather_pairs(simd, corners, 2, vertices.depths);
        let (least, greatest) = (a_z.min(b_z).min(c_z), a_z.max(b_z).max(c_z));
        let first_z = Wide::from_f32(a_z);
        let (to_second, to_third) = (Wide::from_f32(b_z) - first_z, Wide::from_f32(c_z) - first_z);
        let depth_plane = WidePlane {
            value: first_z + (second.value * to_second + third.value * to_third),
            dx: second.dx * to_second + third.dx * to_third,
            dy: second.dy * to_second + third.dy * to_third,
        };

        let mut steady_light = f32x16::splat(simd, 1.0);
        let mut normal_planes = None;
        if draw.lit
            && let Some(normals) = draw.mesh.normals()
        {
            let a = in_view(draw, gather(simd, |lane| normals[corners[lane][0] as usize]));
            let b = in_view(draw, gather(simd, |lane| normals[corners[lane][1] as usize]));
            let c = in_view(draw, gather(simd, |lane| normals[corners[lane][2] as usize]));
            let weights = [second.to_f32(), third.to_f32()];
            normal_planes = Some([
                normal_plane(a[0] * a_inv_w, b[0] * b_inv_w, c[0] * c_inv_w, &weights),
                normal_plane(a[1] * a_inv_w, b[1] * b_inv_w, c[1] * c_inv_w, &weights),
                normal_plane(a[2] * a_inv_w, b[2] * b_inv_w, c[2] * c_inv_w, &weights),
            ]);
        } else if draw.lit {
            let normal = gather(simd, |lane| flat_normal(draw, self.triangles[lane]));
            steady_light = light(simd, in_view(draw, normal));
        }

        let samples = &mut self.samples;
        samples.count = 0;
        let mut ends = [0; 2];
        for lane in 0..triangle_count {
            samples.add(lane, self.covered[lane]);
            ends[lane / HALF] = samples.count;
        }
        ends[1] = samples.count;
        let (new_places, new_fragments) = fragments.add(samples.count, HALF);
        let (left, top) = (i32x16::load_array(simd, self.left), i32x16::load_array(simd, self.top));
        let primitives =
            i32x16::load_array(simd, self.triangles.map(|triangle| (draw.first_primitive + triangle) as i32));
        let places = [left - grid.window.left, top - grid.window.top];
        let from_anchor = [left - anchor_x, top - anchor_y];
        let halves = |values: f32x16<S>| <[f32x8<S>; 2]>::from(values.split());
        let int_halves = |values: i32x16<S>| <[i32x8<S>; 2]>::from(values.split());
        let places = places.map(int_halves);
        let from_anchor = from_anchor.map(int_halves);
        let depth_range = [least, greatest].map(halves);
        let primitives = int_halves(primitives);
        let steady_light = halves(steady_light);
        let depth_plane = [depth_plane.value.words(), depth_plane.dx.words(), depth_plane.dy.words()];
        let normal_planes = normal_planes.map(|planes| planes.map(|plane| plane.map(halves)));
        let draw_numbers = u32x8::splat(simd, draw_number);
        let last = TILE_PX as i32 - 1;
        let mut start = 0;
        for half in 0..2 {
            while start < ends[half] {
                let (lanes, bits) = samples.from(simd, start);
                let lookup = Lookup::new(simd, lanes);
                let (across, down) = (bits & (BLOCK_PX - 1), bits >> 3);
                let column = lookup.ints(places[0][half]) + across;
                let row = lookup.ints(places[1][half]) + down;
                let tile = (row >> 5) * grid.columns as i32 + (column >> 5);
                let place: u32x8<S> = ((tile << SAMPLE_BITS) | ((row & last) << 5) | (column & last)).bitcast();
                let x: f32x8<S> = (lookup.ints(from_anchor[0][half]) + across).to_float();
                let y: f32x8<S> = (lookup.ints(from_anchor[1][half]) + down).to_float();
                let [value, dx, dy] = [0, 1, 2].map(|i: usize| lookup.wide(depth_plane[i][half]));
                let depth = narrow((value + widen(y) * dy) + widen(x) * dx);
                let [least, greatest] = [0, 1].map(|i: usize| lookup.floats(depth_range[i][half]));
                // Adding zero turns -0 into 0.
                let depth = depth.max(least).min(greatest) + 0.0;
                let light = match &normal_planes {
                    None => lookup.floats(steady_light[half]),
                    Some(planes) => {
                        let axis = |i: usize| {
                            let [value, dx, dy] = [0, 1, 2].map(|j: usize| lookup.floats(planes[i][j][half]));
                            (value + dy * y) + dx * x
                        };
                        light(simd, [axis(0), axis(1), axis(2)])
                    }
                };
                let primitive: u32x8<S> = lookup.ints(primitives[half]).bitcast();
                let range = start..start + HALF;
                place.store_slice(&mut new_places[range.clone()]);
                let (depth, light) = (depth.bitcast::<u32x8<S>>().split(), light.bitcast::<u32x8<S>>().split());
                let (primitive, draws) = (primitive.split(), draw_numbers.split());
                let to: &mut [u32] = bytemuck::cast_slice_mut(&mut new_fragments[range]);
                let (low, high) = to.split_at_mut(LANES);
                u32x4::store_four_interleaved([depth.0, light.0, primitive.0, draws.0], low);
                u32x4::store_four_interleaved([depth.1, light.1, primitive.1, draws.1], high);
                start += HALF;
            }
            start = ends[half];
        }
    }
}

/// Lanes of which each half of the triangles is one.
const HALF: usize = LANES / 2;

/// Samples that sixteen triangles cover, triangle by triangle.
#[derive(Debug)]
struct Samples {
    /// Bit of the block, above it the lane.
    numbers: [u16; LANES * 64 + HALF],
    count: usize,
}

impl Default for Samples {
    fn default() -> Self {
        Self { numbers: [0; LANES * 64 + HALF], count: 0 }
    }
}

/// Samples put down without looking whether there are as many.
const WITHOUT_A_LOOK: usize = 4;

impl Samples {
    #[inline(always)]
    fn add(&mut self, lane: usize, covered: u64) {
        let tag = (lane << 6) as u16;
        let mut bits = covered;
        let numbers = &mut self.numbers[self.count..];
        for number in &mut numbers[..WITHOUT_A_LOOK] {
            *number = bits.trailing_zeros() as u16 | tag;
            bits &= bits.wrapping_sub(1);
        }
        let mut at = WITHOUT_A_LOOK;
        while bits != 0 {
            numbers[at] = bits.trailing_zeros() as u16 | tag;
            bits &= bits - 1;
            at += 1;
        }
        self.count += covered.count_ones() as usize;
    }

    /// Lanes and bits of eight.
    #[inline(always)]
    fn from<S: Simd>(&self, simd: S, start: usize) -> (u32x8<S>, i32x8<S>) {
        let (low, high) = u16x8::from_slice(simd, &self.numbers[start..start + HALF]).widen();
        let numbers: u32x8<S> = low.combine(high);
        (numbers >> 6, (numbers & 63).bitcast())
    }
}

/// Fetches into the cache what making fragments of a triangle takes beside the positions of its corners.
#[inline(always)]
pub(crate) fn fetch(corners: [u32; 3], draw: &Draw<'_>, vertices: DrawVertices<'_>) {
    for corner in corners {
        prefetch_index(vertices.depths, corner as usize);
    }
    if draw.lit
        && let Some(normals) = draw.mesh.normals()
    {
        for corner in corners {
            prefetch_index(normals, corner as usize);
        }
    }
}

/// A plane for each of sixteen triangles.
struct WidePlane<S: Simd> {
    value: Wide<S>,
    dx: Wide<S>,
    dy: Wide<S>,
}

impl<S: Simd> WidePlane<S> {
    /// Of the weight that an edge's opposite corner has.
    #[inline(always)]
    fn weight(
        simd: S,
        (from_x, from_y): (i32x16<S>, i32x16<S>),
        (to_x, to_y): (i32x16<S>, i32x16<S>),
        (x, y): (i32x16<S>, i32x16<S>),
        inv_area: Wide<S>,
    ) -> Self {
        let (a, b) = (from_y - to_y, to_x - from_x);
        let step = Wide::splat(simd, f64::from(SUBPIXELS)) * inv_area;
        Self {
            value: Wide::from_int(a * (x - from_x) + b * (y - from_y)) * inv_area,
            dx: Wide::from_small_int(a) * step,
            dy: Wide::from_small_int(b) * step,
        }
    }

    #[inline(always)]
    fn to_f32(&self) -> [f32x16<S>; 3] {
        [self.value.to_f32(), self.dx.to_f32(), self.dy.to_f32()]
    }
}

/// One axis of a plane of normals: value at the anchor, change to the right, change downwards.
#[inline(always)]
fn normal_plane<S: Simd>(
    a: f32x16<S>,
    b: f32x16<S>,
    c: f32x16<S>,
    [second, third]: &[[f32x16<S>; 3]; 2],
) -> [f32x16<S>; 3] {
    let (to_b, to_c) = (b - a, c - a);
    [a + (to_b * second[0] + to_c * third[0]), to_b * second[1] + to_c * third[1], to_b * second[2] + to_c * third[2]]
}

/// The geometric normal of a triangle.
#[inline(always)]
fn flat_normal(draw: &Draw<'_>, triangle: u32) -> Vec3 {
    let [a, b, c] = draw.mesh.triangles()[triangle as usize].map(|vertex| draw.mesh.positions()[vertex as usize]);
    unit(b - a).cross(unit(c - a))
}

#[inline(always)]
fn unit(edge: Vec3) -> Vec3 {
    edge / edge.abs().max_element().max(f32::MIN_POSITIVE)
}

/// What there is for each lane. Written out, so that it goes to registers: vectors that are loaded from where their lanes
/// have just been stored wait for it.
#[inline(always)]
fn each_lane<T>(of: impl Fn(usize) -> T) -> [T; LANES] {
    [
        of(0),
        of(1),
        of(2),
        of(3),
        of(4),
        of(5),
        of(6),
        of(7),
        of(8),
        of(9),
        of(10),
        of(11),
        of(12),
        of(13),
        of(14),
        of(15),
    ]
}

/// A vector for each of sixteen lanes, as structure of arrays.
#[inline(always)]
fn gather<S: Simd>(simd: S, vector: impl Fn(usize) -> Vec3) -> [f32x16<S>; 3] {
    let vectors = each_lane(vector);
    [
        f32x16::load_array(simd, each_lane(|lane| vectors[lane].x)),
        f32x16::load_array(simd, each_lane(|lane| vectors[lane].y)),
        f32x16::load_array(simd, each_lane(|lane| vectors[lane].z)),
    ]
}

/// Pairs of numbers at one corner of each triangle.
#[inline(always)]
fn gather_pairs<S: Simd, V: SimdBase<S>>(
    simd: S,
    corners: &[[u32; 3]; LANES],
    k: usize,
    from: &[[V::Element; 2]],
) -> (V, V) {
    load_pairs(simd, &each_lane(|lane| from[corners[lane][k] as usize]))
}

/// Normals in camera space.
#[inline(always)]
fn in_view<S: Simd>(draw: &Draw<'_>, [x, y, z]: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
    let matrix = &draw.view_from_normal;
    [
        (x * matrix.x_axis.x + y * matrix.y_axis.x) + z * matrix.z_axis.x,
        (x * matrix.x_axis.y + y * matrix.y_axis.y) + z * matrix.z_axis.y,
        (x * matrix.x_axis.z + y * matrix.y_axis.z) + z * matrix.z_axis.z,
    ]
}

/// Two arrays from one of pairs.
#[inline(always)]
pub(crate) fn load_pairs<S: Simd, V: SimdBase<S>>(simd: S, pairs: &[[V::Element; 2]; LANES]) -> (V, V) {
    let (low, high) = pairs.as_flattened().split_at(LANES);
    V::from_slice(simd, low).deinterleave(V::from_slice(simd, high))
}

impl NewFragments {
    /// Adds so many: their places and they themselves, to be written.
    #[inline(always)]
    fn add(&mut self, count: usize, beyond: usize) -> (&mut [u32], &mut [SmallFragment]) {
        let first = self.count;
        self.count += count;
        let end = self.count + beyond;
        if self.places.len() < end {
            let room = end.next_power_of_two().max(1024);
            self.places.resize(room, 0);
            self.fragments.resize(room, SmallFragment::default());
        }
        (&mut self.places[first..end], &mut self.fragments[first..end])
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.places.capacity() * 4 + self.fragments.capacity() * size_of::<SmallFragment>()
    }
}

impl SmallFragments {
    /// Takes over what came, sorted by tile, keeping draw order.
    pub(crate) fn take(&mut self, new: &mut NewFragments, grid: &TileGrid) {
        self.starts.clear();
        let count = std::mem::take(&mut new.count);
        if count == 0 {
            return;
        }
        let (places, fragments) = (&new.places[..count], &new.fragments[..count]);
        self.starts.resize(grid.tile_count() + 1, 0);
        let (mut last_tile, mut last_count) = (0, 0);
        for place in places {
            // Mostly the tile of the one before: its count waits in a register.
            let tile = (place >> SAMPLE_BITS) as usize;
            if tile != last_tile {
                self.starts[last_tile + 1] += std::mem::take(&mut last_count);
                last_tile = tile;
            }
            last_count += 1;
        }
        self.starts[last_tile + 1] += last_count;
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        if self.samples.len() < count {
            // A little more, so that another frame does not need a little more.
            self.samples.resize(count + count / 16, 0);
            self.fragments.resize(count + count / 16, SmallFragment::default());
        }
        // Each start moves to the next one's place while its fragments are put down ...
        let (mut last_tile, mut start) = (0, 0);
        let (sorted_samples, sorted_fragments) = (&mut self.samples[..count], &mut self.fragments[..count]);
        for (&place, fragment) in places.iter().zip(fragments) {
            let tile = (place >> SAMPLE_BITS) as usize;
            if tile != last_tile {
                self.starts[last_tile] = start as u32;
                (last_tile, start) = (tile, self.starts[tile] as usize);
            }
            sorted_samples[start] = (place & ((1 << SAMPLE_BITS) - 1)) as u16;
            sorted_fragments[start] = *fragment;
            start += 1;
        }
        self.starts[last_tile] = start as u32;
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
    pub(crate) fn add_counts(&self, counts: &mut [u64]) {
        add_counts(&self.starts, 1, counts);
    }

    /// Adds how many bytes each tile needs.
    pub(crate) fn add_bytes(&self, bytes: &mut [u64]) {
        add_counts(&self.starts, size_of::<SmallFragment>() + 2, bytes);
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.starts.capacity() * 4
            + self.fragments.capacity() * size_of::<SmallFragment>()
            + self.samples.capacity() * 2
    }
}

/// Adds the lengths of the ranges between `starts`, each place counting as so many.
pub(crate) fn add_counts(starts: &[u32], weight: usize, counts: &mut [u64]) {
    for (count, range) in counts.iter_mut().zip(starts.windows(2)) {
        *count += u64::from(range[1] - range[0]) * weight as u64;
    }
}
