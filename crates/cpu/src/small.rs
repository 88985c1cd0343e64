//! Small triangles to fragments, as soon as sixteen wait.
//!
//! A triangle of few fragments is not worth a place in the bins. Its fragments are made and lit right after set-up, eight at
//! a time, of as many triangles as that takes. All that is left for the tile is to order and blend them. A triangle that
//! reaches several blocks of samples takes part once for each.

use fearless_simd::{
    Bytes, Level, Simd, SimdBase, SimdCombine, SimdInt, SimdInterleaved, SimdSplit, SimdWiden, dispatch,
};
use fearless_simd::{f32x8, f64x4, f64x8, i32x8, u16x8, u32x4, u32x8};
use glam::Vec3;
use pellucid_core::pixel_grid::{SUBPIXELS, center};
use pellucid_core::primitive::Draw;
use prefetch_index::prefetch_index;

use crate::bin::{TILE_PX, TileGrid};
use crate::simd::{Lookup, light, narrow, widen, words};
use crate::small_fragments::{NewFragments, SAMPLE_BITS, SmallFragment};
use crate::transform::DrawVertices;

/// Triangles that wait until fragments are made.
const WAITING: usize = 16;

/// Triangles side by side: one to a lane.
pub(crate) const LANES: usize = 8;

/// Side of a block of samples.
pub(crate) const BLOCK_PX: i32 = 8;

/// Most fragments of a small triangle. One that has more is a record: it takes less room, and a tile makes fragments side
/// by side as fast.
pub(crate) const MOST_FRAGMENTS: u32 = 32;

/// Small triangles, or blocks of them, that wait to be sixteen.
#[derive(Debug, Default)]
pub(crate) struct SmallTriangles {
    count: usize,
    /// Corners, clockwise on the screen.
    corners: [[u32; 3]; WAITING],
    /// Number of the triangle in the draw's mesh.
    triangles: [u32; WAITING],
    /// The first sample of the block ...
    left: [i32; WAITING],
    top: [i32; WAITING],
    /// ... and which ones of it are covered, row by row.
    covered: [u64; WAITING],
    /// What eight of them cover.
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
        self.count == WAITING
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
        let count = std::mem::take(&mut self.count);
        for first in (0..count).step_by(LANES) {
            let triangles = Triangles::new(simd, self, first, draw, vertices);
            self.samples.put_down(&self.covered[first..count.min(first + LANES)]);
            let (new_places, new_fragments) = fragments.add(self.samples.count, LANES);
            let samples = self.samples.numbers[..self.samples.count.next_multiple_of(LANES)].as_chunks().0;
            let room = new_places.chunks_exact_mut(LANES).zip(new_fragments.chunks_exact_mut(LANES));
            for (samples, (places, fragments)) in samples.iter().zip(room) {
                triangles.make_fragments(simd, samples, draw_number, grid, places, fragments);
            }
        }
    }
}

/// What fragments of eight triangles are made of.
struct Triangles<S: Simd> {
    /// Column and row of the block's first sample.
    first: [i32x8<S>; 2],
    /// Column and row of the triangle's anchor.
    anchor: [i32x8<S>; 2],
    depth: Plane<[u32x8<S>; 2]>,
    least_depth: f32x8<S>,
    greatest_depth: f32x8<S>,
    /// One for each axis; `None` if the normal is the same everywhere ...
    normal: Option<[Plane<f32x8<S>>; 3]>,
    /// ... and so is the brightness.
    steady_light: f32x8<S>,
    primitive: u32x8<S>,
}

/// What grows by the same from pixel to pixel.
#[derive(Clone, Copy)]
struct Plane<T> {
    /// At the anchor.
    value: T,
    dx: T,
    dy: T,
}

impl<S: Simd> Triangles<S> {
    /// Those from number `first` on; where there are fewer than eight, others that were there before.
    #[inline(always)]
    fn new(simd: S, all: &SmallTriangles, first: usize, draw: &Draw<'_>, vertices: DrawVertices<'_>) -> Self {
        let corners: &[[u32; 3]; LANES] = eight(&all.corners, first);
        let numbers: &[u32; LANES] = eight(&all.triangles, first);
        // All of one length, so that a corner is known to be in each if it is in one.
        let count = draw.mesh.positions().len();
        let (positions, depths) = (&vertices.positions[..count], &vertices.depths[..count]);
        // The planes of weights and of depth, as `ScreenTriangle` has them.
        let a: [i32x8<S>; 2] = gather_pairs(simd, corners, 0, positions);
        let b: [i32x8<S>; 2] = gather_pairs(simd, corners, 1, positions);
        let c: [i32x8<S>; 2] = gather_pairs(simd, corners, 2, positions);
        let anchor = [a[0] >> 8, a[1] >> 8];
        let at = [(anchor[0] << 8) + center(0), (anchor[1] << 8) + center(0)];
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        let inv_area = f64x8::splat(simd, 1.0) / wide(area);
        let second = weight_plane(simd, c, a, at, inv_area);
        let third = weight_plane(simd, a, b, at, inv_area);
        let [a_z, a_inv_w]: [f32x8<S>; 2] = gather_pairs(simd, corners, 0, depths);
        let [b_z, b_inv_w]: [f32x8<S>; 2] = gather_pairs(simd, corners, 1, depths);
        let [c_z, c_inv_w]: [f32x8<S>; 2] = gather_pairs(simd, corners, 2, depths);
        let first_z = widen(a_z);
        let (to_second, to_third) = (widen(b_z) - first_z, widen(c_z) - first_z);

        let mut steady_light = f32x8::splat(simd, 1.0);
        let mut normal = None;
        if draw.lit
            && let Some(normals) = draw.mesh.normals()
        {
            let normals = &normals[..count];
            let a = in_view(draw, gather(simd, |lane| normals[corners[lane][0] as usize]));
            let b = in_view(draw, gather(simd, |lane| normals[corners[lane][1] as usize]));
            let c = in_view(draw, gather(simd, |lane| normals[corners[lane][2] as usize]));
            let weights = [narrow_plane(&second), narrow_plane(&third)];
            normal = Some([
                normal_plane(a[0] * a_inv_w, b[0] * b_inv_w, c[0] * c_inv_w, &weights),
                normal_plane(a[1] * a_inv_w, b[1] * b_inv_w, c[1] * c_inv_w, &weights),
                normal_plane(a[2] * a_inv_w, b[2] * b_inv_w, c[2] * c_inv_w, &weights),
            ]);
        } else if draw.lit {
            steady_light = light(simd, in_view(draw, gather(simd, |lane| flat_normal(draw, numbers[lane]))));
        }
        Self {
            first: [&all.left, &all.top].map(|first_of_all| i32x8::load_array(simd, *eight(first_of_all, first))),
            anchor,
            depth: Plane {
                value: words(first_z + (second.value * to_second + third.value * to_third)),
                dx: words(second.dx * to_second + third.dx * to_third),
                dy: words(second.dy * to_second + third.dy * to_third),
            },
            least_depth: a_z.min(b_z).min(c_z),
            greatest_depth: a_z.max(b_z).max(c_z),
            normal,
            steady_light,
            primitive: u32x8::load_array(simd, *numbers) + draw.first_primitive,
        }
    }

    /// The fragments at eight samples.
    #[inline(always)]
    fn make_fragments(
        &self,
        simd: S,
        samples: &[u16; LANES],
        draw_number: u32,
        grid: &TileGrid,
        places: &mut [u32],
        fragments: &mut [SmallFragment],
    ) {
        let (low, high) = u16x8::load_array_ref(simd, samples).widen();
        let samples: u32x8<S> = low.combine(high);
        let lookup = Lookup::new(simd, samples >> BLOCK_BITS);
        let bit: i32x8<S> = (samples & ((1 << BLOCK_BITS) - 1)).bitcast();
        let x = lookup.ints(self.first[0]) + (bit & (BLOCK_PX - 1));
        let y = lookup.ints(self.first[1]) + (bit >> 3);

        let (column, row) = (x - grid.window.left, y - grid.window.top);
        let tile = (row >> 5) * grid.columns as i32 + (column >> 5);
        let last = TILE_PX as i32 - 1;
        let place = (tile << SAMPLE_BITS) | ((row & last) << 5) | (column & last);
        place.bitcast::<u32x8<S>>().store_slice(places);

        let x: f32x8<S> = (x - lookup.ints(self.anchor[0])).to_float();
        let y: f32x8<S> = (y - lookup.ints(self.anchor[1])).to_float();
        let (value, dx, dy) = (lookup.wide(self.depth.value), lookup.wide(self.depth.dx), lookup.wide(self.depth.dy));
        let depth = narrow((value + widen(y) * dy) + widen(x) * dx);
        let (least, greatest) = (lookup.floats(self.least_depth), lookup.floats(self.greatest_depth));
        // Adding zero turns -0 into 0.
        let depth = depth.max(least).min(greatest) + 0.0;
        let light = match &self.normal {
            None => lookup.floats(self.steady_light),
            Some([nx, ny, nz]) => {
                light(simd, [looked_up(&lookup, nx, x, y), looked_up(&lookup, ny, x, y), looked_up(&lookup, nz, x, y)])
            }
        };
        let (depth, light) = (depth.bitcast::<u32x8<S>>().split(), light.bitcast::<u32x8<S>>().split());
        let (primitive, draw) = (lookup.words(self.primitive).split(), u32x4::splat(simd, draw_number));
        let (first, second) = bytemuck::cast_slice_mut(fragments).split_at_mut(LANES / 2 * 4);
        u32x4::store_four_interleaved([depth.0, light.0, primitive.0, draw], first);
        u32x4::store_four_interleaved([depth.1, light.1, primitive.1, draw], second);
    }
}

/// Eight in a row.
#[inline(always)]
fn eight<T>(all: &[T; WAITING], first: usize) -> &[T; LANES] {
    &all.as_chunks().0[first / LANES]
}

/// Bits of a sample's number in its block.
const BLOCK_BITS: u32 = 6;

/// Samples that eight triangles cover, triangle by triangle.
#[derive(Debug)]
struct Samples {
    /// Number in the block, above it the triangle's lane; beyond `count` anything.
    numbers: [u16; LANES << BLOCK_BITS],
    count: usize,
}

impl Default for Samples {
    fn default() -> Self {
        Self { numbers: [0; LANES << BLOCK_BITS], count: 0 }
    }
}

/// Samples of a triangle that are put down without asking whether there are as many: what asks is often mispredicted.
const WITHOUT_ASKING: usize = 4;

impl Samples {
    /// Puts down which samples are covered.
    #[inline(always)]
    fn put_down(&mut self, covered: &[u64]) {
        self.count = 0;
        for (lane, &covered) in covered.iter().enumerate() {
            let lane = (lane << BLOCK_BITS) as u16;
            let mut bits = covered;
            let mut at = self.count;
            for number in &mut self.numbers[at..at + WITHOUT_ASKING] {
                *number = lane | (bits.trailing_zeros() as u16 & ((1 << BLOCK_BITS) - 1));
                bits &= bits.wrapping_sub(1);
            }
            while bits != 0 {
                self.numbers[at + WITHOUT_ASKING] = lane | bits.trailing_zeros() as u16;
                bits &= bits - 1;
                at += 1;
            }
            self.count += covered.count_ones() as usize;
        }
    }
}

/// Fetches into the cache what making fragments of a triangle takes beside the positions of its corners.
#[inline(always)]
pub(crate) fn fetch(corners: [u32; 3], depths: &[[f32; 2]], normals: &[Vec3]) {
    for corner in corners {
        prefetch_index(depths, corner as usize);
    }
    if !normals.is_empty() {
        for corner in corners {
            prefetch_index(normals, corner as usize);
        }
    }
}

/// The plane of the weight that an edge's opposite corner has.
#[inline(always)]
fn weight_plane<S: Simd>(
    simd: S,
    [from_x, from_y]: [i32x8<S>; 2],
    [to_x, to_y]: [i32x8<S>; 2],
    [x, y]: [i32x8<S>; 2],
    inv_area: f64x8<S>,
) -> Plane<f64x8<S>> {
    let (a, b) = (from_y - to_y, to_x - from_x);
    let step = f64x8::splat(simd, f64::from(SUBPIXELS)) * inv_area;
    let (low, high) = (a * (x - from_x) + b * (y - from_y)).widen();
    Plane {
        value: low.to_float::<f64x4<S>>().combine(high.to_float::<f64x4<S>>()) * inv_area,
        dx: wide(a) * step,
        dy: wide(b) * step,
    }
}

/// In f64, integers below 2^24, which f32 holds exactly.
#[inline(always)]
fn wide<S: Simd>(values: i32x8<S>) -> f64x8<S> {
    widen(values.to_float())
}

/// Rounded to nearest.
#[inline(always)]
fn narrow_plane<S: Simd>(plane: &Plane<f64x8<S>>) -> Plane<f32x8<S>> {
    Plane { value: narrow(plane.value), dx: narrow(plane.dx), dy: narrow(plane.dy) }
}

/// The plane of one axis of a normal.
#[inline(always)]
fn normal_plane<S: Simd>(
    a: f32x8<S>,
    b: f32x8<S>,
    c: f32x8<S>,
    [second, third]: &[Plane<f32x8<S>>; 2],
) -> Plane<f32x8<S>> {
    let (to_b, to_c) = (b - a, c - a);
    Plane {
        value: a + (to_b * second.value + to_c * third.value),
        dx: to_b * second.dx + to_c * third.dx,
        dy: to_b * second.dy + to_c * third.dy,
    }
}

/// The value of a plane at pixels from the anchor.
#[inline(always)]
fn looked_up<S: Simd>(lookup: &Lookup<S>, plane: &Plane<f32x8<S>>, x: f32x8<S>, y: f32x8<S>) -> f32x8<S> {
    (lookup.floats(plane.value) + lookup.floats(plane.dy) * y) + lookup.floats(plane.dx) * x
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
    [of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7)]
}

/// A vector for each of eight lanes, as structure of arrays.
#[inline(always)]
fn gather<S: Simd>(simd: S, vector: impl Fn(usize) -> Vec3) -> [f32x8<S>; 3] {
    let vectors = each_lane(vector);
    [
        f32x8::load_array(simd, each_lane(|lane| vectors[lane].x)),
        f32x8::load_array(simd, each_lane(|lane| vectors[lane].y)),
        f32x8::load_array(simd, each_lane(|lane| vectors[lane].z)),
    ]
}

/// Pairs of numbers at one corner of each triangle.
#[inline(always)]
pub(crate) fn gather_pairs<S: Simd, V: SimdBase<S>>(
    simd: S,
    corners: &[[u32; 3]; LANES],
    k: usize,
    from: &[[V::Element; 2]],
) -> [V; 2] {
    let pairs = each_lane(|lane| from[corners[lane][k] as usize]);
    let (low, high) = pairs.as_flattened().split_at(LANES);
    V::from_slice(simd, low).deinterleave(V::from_slice(simd, high)).into()
}

/// Normals in camera space.
#[inline(always)]
fn in_view<S: Simd>(draw: &Draw<'_>, [x, y, z]: [f32x8<S>; 3]) -> [f32x8<S>; 3] {
    let matrix = &draw.view_from_normal;
    [
        (x * matrix.x_axis.x + y * matrix.y_axis.x) + z * matrix.z_axis.x,
        (x * matrix.x_axis.y + y * matrix.y_axis.y) + z * matrix.z_axis.y,
        (x * matrix.x_axis.z + y * matrix.y_axis.z) + z * matrix.z_axis.z,
    ]
}
