//! Small triangles to fragments, as soon as those of a meshlet are known.
//!
//! A triangle of few fragments is not worth a place in the bins. Its fragments are made and lit right after set-up, while the
//! meshlet's vertices are in the cache, eight at a time, of as many triangles as that takes. All that is left for
//! the tile is to order and blend them. A triangle that reaches several blocks of samples takes part once for each.

use fearless_simd::{Bytes, Level, Simd, SimdBase, SimdCombine, SimdInt, SimdNarrow, SimdSplit, SimdWiden, dispatch};
use fearless_simd::{f32x8, f64x8, i32x8, u16x8, u32x8};
use glam::Vec3;
use pellucid_core::meshlets::{LANES, Meshlet};
use pellucid_core::pixel_grid::{SUBPIXELS, center};
use pellucid_core::primitive::Draw;

use crate::bin::TILE_PX;
use crate::lit_key;
use crate::simd::{Lookup, columns, each_lane, light, narrow, unzip, wide, widen, words};
use crate::small_blocks::{BLOCK_BITS, BLOCK_PX, COLUMN_BITS, SmallBlock, SmallBlocks};
use crate::small_fragments::{NewFragments, SmallFragments};
use crate::transform::{Vertices, in_view};

/// Most fragments of a small triangle. One that has more is a record: it takes less room, and a tile makes fragments side
/// by side as fast.
pub(crate) const MOST_FRAGMENTS: u32 = 32;

/// Turns blocks of samples of a meshlet, of which there are none then, into fragments. A function of its own: inlined into
/// the loop over triangles, its conditions on the draw would be taken out of that loop one by one, for minutes of compile
/// time.
#[inline(never)]
pub(crate) fn make_fragments(
    level: Level,
    blocks: &mut SmallBlocks,
    draw: &Draw<'_>,
    draw_number: u32,
    meshlet: &Meshlet<'_>,
    vertices: &Vertices,
    fragments: &mut SmallFragments,
) {
    blocks.sort_by_tile([draw_number, draw.first_primitive + meshlet.first_triangle as u32], fragments);
    dispatch!(level, simd => make_simd(simd, blocks, draw, meshlet, vertices, fragments));
    blocks.clear();
}

#[inline(always)]
fn make_simd<S: Simd>(
    simd: S,
    blocks: &mut SmallBlocks,
    draw: &Draw<'_>,
    meshlet: &Meshlet<'_>,
    vertices: &Vertices,
    fragments: &mut SmallFragments,
) {
    let (sorted, samples) = blocks.sorted();
    for blocks in sorted {
        let triangles = Triangles::new(simd, blocks, draw, meshlet, vertices);
        samples.put_down(simd, blocks);
        let NewFragments { samples: new_samples, keys, triangles: new_triangles } = fragments.add(samples.count, LANES);
        let numbers = samples.numbers[..samples.count.next_multiple_of(LANES)].as_chunks().0;
        let (new_samples, keys) = (new_samples.as_chunks_mut().0, keys.as_chunks_mut().0);
        let room = new_samples.iter_mut().zip(keys).zip(new_triangles.as_chunks_mut().0);
        for (numbers, ((samples, keys), new_triangles)) in numbers.iter().zip(room) {
            triangles.make_fragments(simd, numbers, samples, keys, new_triangles);
        }
    }
}

/// What fragments of eight triangles are made of.
struct Triangles<S: Simd> {
    /// The block's first sample in its tile.
    first: i32x8<S>,
    /// Pixels from the triangle's anchor to the block's first sample.
    x: i32x8<S>,
    y: i32x8<S>,
    depth: Plane<[u32x8<S>; 2]>,
    least_depth: f32x8<S>,
    greatest_depth: f32x8<S>,
    /// One for each axis; `None` if the normal is the same everywhere ...
    normal: Option<[Plane<f32x8<S>>; 3]>,
    /// ... and so is the brightness.
    steady_light: f32x8<S>,
    /// Number of the triangle in the meshlet.
    number: u32x8<S>,
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
    /// Those of eight blocks.
    #[inline(always)]
    fn new(simd: S, blocks: &[SmallBlock; LANES], draw: &Draw<'_>, meshlet: &Meshlet<'_>, vertices: &Vertices) -> Self {
        let numbers = u32x8::load_array(simd, each_lane(|lane| u32::from(blocks[lane].triangle[3])));
        // The planes of weights and of depth, as `ScreenTriangle` has them. Corners need not run clockwise: if they do not, area
        // and weights are negated, and the second and third weight change places, of which neither changes a bit.
        let (a, lit_a) = corners_at(simd, blocks, 0, vertices);
        let (b, lit_b) = corners_at(simd, blocks, 1, vertices);
        let (c, lit_c) = corners_at(simd, blocks, 2, vertices);
        let anchor = [a[0] >> 8, a[1] >> 8];
        let at = [(anchor[0] << 8) + center(0), (anchor[1] << 8) + center(0)];
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        let inv_area = f64x8::splat(simd, 1.0) / wide(area);
        let second = weight_plane(simd, c, a, at, inv_area);
        let third = weight_plane(simd, a, b, at, inv_area);

        let mut steady_light = f32x8::splat(simd, 1.0);
        let mut normal = None;
        if draw.lit && draw.mesh.normals().is_some() {
            let weights = [narrow_plane(&second), narrow_plane(&third)];
            normal = Some([
                normal_plane(lit_a[1], lit_b[1], lit_c[1], &weights),
                normal_plane(lit_a[2], lit_b[2], lit_c[2], &weights),
                normal_plane(lit_a[3], lit_b[3], lit_c[3], &weights),
            ]);
        } else if draw.lit {
            steady_light =
                light(simd, in_view(draw, flat_normals(simd, numbers + meshlet.first_triangle as u32, draw)));
        }
        let [a_z, b_z, c_z] = [lit_a[0], lit_b[0], lit_c[0]];
        let first_z = widen(a_z);
        let (to_second, to_third) = (widen(b_z) - first_z, widen(c_z) - first_z);
        let places = i32x8::load_array(simd, each_lane(|lane| blocks[lane].place[0] as i32));
        let (left, top) = (places & ((1 << COLUMN_BITS) - 1), places >> COLUMN_BITS);
        let last = TILE_PX as i32 - 1;
        Self {
            first: ((top & last) << TILE_PX.ilog2()) | (left & last),
            x: left - anchor[0],
            y: top - anchor[1],
            depth: Plane {
                value: words(first_z + (second.value * to_second + third.value * to_third)),
                dx: words(second.dx * to_second + third.dx * to_third),
                dy: words(second.dy * to_second + third.dy * to_third),
            },
            least_depth: a_z.min(b_z).min(c_z),
            greatest_depth: a_z.max(b_z).max(c_z),
            normal,
            steady_light,
            number: numbers,
        }
    }

    /// The fragments at eight samples.
    #[inline(always)]
    fn make_fragments(
        &self,
        simd: S,
        numbers: &[u16; LANES],
        samples: &mut [u16; LANES],
        keys: &mut [u64; LANES],
        triangles: &mut [u16; LANES],
    ) {
        let (low, high) = u16x8::load_array_ref(simd, numbers).widen();
        let numbers: u32x8<S> = low.combine(high);
        let lookup = Lookup::new(simd, numbers >> BLOCK_BITS);
        let bit: i32x8<S> = (numbers & ((1 << BLOCK_BITS) - 1)).bitcast();
        let (column, row) = (bit & (BLOCK_PX - 1), bit >> BLOCK_PX.ilog2());

        let sample = lookup.ints(self.first) + ((row << TILE_PX.ilog2()) | column);
        let (low, high) = sample.bitcast::<u32x8<S>>().split();
        low.narrow(high).store_slice(samples);

        let x: f32x8<S> = (lookup.ints(self.x) + column).to_float();
        let y: f32x8<S> = (lookup.ints(self.y) + row).to_float();
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
        lit_key::pack(depth, light, keys);
        let (low, high) = lookup.words(self.number).split();
        low.narrow(high).store_slice(triangles);
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
    Plane { value: wide(a * (x - from_x) + b * (y - from_y)) * inv_area, dx: wide(a) * step, dy: wide(b) * step }
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

/// A corner of triangles: where it is, how deep, and the normal there over w.
#[inline(always)]
fn corners_at<S: Simd>(
    simd: S,
    blocks: &[SmallBlock; LANES],
    k: usize,
    vertices: &Vertices,
) -> ([i32x8<S>; 2], [f32x8<S>; 4]) {
    let vertex = |lane: usize| usize::from(blocks[lane].triangle[k]);
    let positions = unzip(simd, each_lane(|lane| vertices.positions[vertex(lane)]));
    (positions, columns(simd, &each_lane(|lane| vertices.lit[vertex(lane)])))
}

/// The geometric normals of triangles of a draw's mesh.
#[inline(always)]
fn flat_normals<S: Simd>(simd: S, triangles: u32x8<S>, draw: &Draw<'_>) -> [f32x8<S>; 3] {
    let triangles: [u32; LANES] = triangles.into();
    let normals = each_lane(|lane| flat_normal(draw, triangles[lane]));
    [
        f32x8::load_array(simd, each_lane(|lane| normals[lane].x)),
        f32x8::load_array(simd, each_lane(|lane| normals[lane].y)),
        f32x8::load_array(simd, each_lane(|lane| normals[lane].z)),
    ]
}
