//! Vertices to the pixel grid, sixteen at a time.

use std::ops::Range;

use fearless_simd::{Level, Simd, SimdBase, SimdFloat, SimdMask, dispatch, f32x16, i32x16};
use glam::{Mat4, Vec3};
use pellucid_core::pixel_grid::{GUARD_BAND_PX, SUBPIXELS, ScreenVertex, Viewport};
use pellucid_core::primitive::{Draw, transform_point};
use rayon::prelude::*;

/// Stands in for x of a vertex that cannot be projected; its y then holds the outcode.
pub(crate) const OUTSIDE: i32 = i32::MIN;

/// Vertices one thread transforms at a time.
const CHUNK_VERTICES: usize = 4096;

const LANES: usize = 16;

/// The vertices of a group of draws. Positions decide what is in sight, and most triangles of a fine mesh are not; so
/// what only the others need stands apart.
#[derive(Debug, Default)]
pub(crate) struct Vertices {
    /// x and y in subpixels.
    positions: Vec<[i32; 2]>,
    /// Depth and 1 / w.
    depths: Vec<[f32; 2]>,
    /// Where each draw's vertices begin.
    starts: Vec<usize>,
}

/// The vertices of a draw.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DrawVertices<'a> {
    /// x and y in subpixels, or [`OUTSIDE`] and an outcode.
    pub(crate) positions: &'a [[i32; 2]],
    /// Depth and 1 / w.
    pub(crate) depths: &'a [[f32; 2]],
}

impl DrawVertices<'_> {
    #[inline(always)]
    pub(crate) fn vertex(&self, number: u32) -> ScreenVertex {
        let [x, y] = self.positions[number as usize];
        let [depth, inv_w] = self.depths[number as usize];
        ScreenVertex { x, y, depth, inv_w }
    }
}

/// Beyond which planes of the clip volume a vertex lies; 0 if it is on the pixel grid.
#[inline(always)]
pub(crate) fn outcode([x, y]: [i32; 2]) -> u8 {
    if x == OUTSIDE { y as u8 } else { 0 }
}

/// Consecutive draws whose vertices are held at the same time.
#[derive(Debug, Clone)]
pub(crate) struct Group {
    pub(crate) draws: Range<usize>,
}

/// Vertices a group holds at most, unless one mesh alone has more: 64 MiB of them.
const GROUP_VERTICES: usize = 4 << 20;

/// Splits draws into groups, so that memory does not grow with the number of instances.
pub(crate) fn groups(draws: &[Draw<'_>]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut vertices = 0;
    for (i, draw) in draws.iter().enumerate() {
        let more = draw.mesh.positions().len();
        match groups.last_mut() {
            Some(group) if vertices + more <= GROUP_VERTICES => group.draws.end = i + 1,
            _ => {
                groups.push(Group { draws: i..i + 1 });
                vertices = 0;
            }
        }
        vertices += more;
    }
    groups
}

impl Vertices {
    /// Transforms all vertices of a group's draws.
    pub(crate) fn transform(&mut self, draws: &[Draw<'_>], viewport: &Viewport, level: Level) {
        self.starts.clear();
        let mut total = 0;
        for draw in draws {
            self.starts.push(total);
            total += draw.mesh.positions().len();
        }
        self.positions.resize(total, [0; 2]);
        self.depths.resize(total, [0.0; 2]);
        let starts = &*self.starts;
        let chunks = self.positions.par_chunks_mut(CHUNK_VERTICES).zip(self.depths.par_chunks_mut(CHUNK_VERTICES));
        chunks.enumerate().for_each(|(chunk, (mut positions, mut depths))| {
            let mut first = chunk * CHUNK_VERTICES;
            let mut draw = starts.partition_point(|&start| start <= first) - 1;
            while !positions.is_empty() {
                let points = &draws[draw].mesh.positions()[first - starts[draw]..];
                let count = points.len().min(positions.len());
                let (these_positions, other_positions) = positions.split_at_mut(count);
                let (these_depths, other_depths) = depths.split_at_mut(count);
                let points = &points[..count];
                dispatch!(level, simd => transform_mesh(simd, &draws[draw], viewport, points, these_positions, these_depths));
                (positions, depths) = (other_positions, other_depths);
                first += count;
                draw += 1;
            }
        });
    }

    /// The vertices of the group's draw of this number, counted from the group's first.
    pub(crate) fn draw(&self, number: usize) -> DrawVertices<'_> {
        let first = self.starts[number];
        DrawVertices { positions: &self.positions[first..], depths: &self.depths[first..] }
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.positions.capacity() * size_of::<[i32; 2]>() + self.depths.capacity() * size_of::<[f32; 2]>()
    }
}

#[inline(always)]
fn transform_mesh<S: Simd>(
    simd: S,
    draw: &Draw<'_>,
    viewport: &Viewport,
    points: &[Vec3],
    positions: &mut [[i32; 2]],
    depths: &mut [[f32; 2]],
) {
    let (points, last_points) = points.as_chunks::<LANES>();
    let (positions, last_positions) = positions.as_chunks_mut::<LANES>();
    let (depths, last_depths) = depths.as_chunks_mut::<LANES>();
    for ((points, positions), depths) in points.iter().zip(positions).zip(depths) {
        if !transform_lanes(simd, draw, viewport, points, positions, depths) {
            transform_each(draw, viewport, points, positions, depths);
        }
    }
    transform_each(draw, viewport, last_points, last_positions, last_depths);
}

/// Vertex by vertex: the last ones of a mesh, and where some cannot be projected.
#[inline(always)]
fn transform_each(
    draw: &Draw<'_>,
    viewport: &Viewport,
    points: &[Vec3],
    positions: &mut [[i32; 2]],
    depths: &mut [[f32; 2]],
) {
    for ((&point, position), depth) in points.iter().zip(positions).zip(depths) {
        let clip = transform_point(&draw.clip_from_mesh, point);
        let outcode = viewport.outcode(clip);
        (*position, *depth) = if outcode == 0 {
            let vertex = viewport.project(clip);
            ([vertex.x, vertex.y], [vertex.depth, vertex.inv_w])
        } else {
            ([OUTSIDE, i32::from(outcode)], [0.0; 2])
        };
    }
}

/// The same operations as in [`transform_point`], [`Viewport::outcode`] and [`Viewport::project`]; `false`, with nothing
/// done, unless all can be projected.
#[inline(always)]
fn transform_lanes<S: Simd>(
    simd: S,
    draw: &Draw<'_>,
    viewport: &Viewport,
    points: &[Vec3; LANES],
    positions: &mut [[i32; 2]; LANES],
    depths: &mut [[f32; 2]; LANES],
) -> bool {
    let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for (lane, point) in points.iter().enumerate() {
        [x[lane], y[lane], z[lane]] = point.to_array();
    }
    let point = [f32x16::load_array(simd, x), f32x16::load_array(simd, y), f32x16::load_array(simd, z)];
    let matrix = &draw.clip_from_mesh;
    let (clip_x, clip_y, clip_z, clip_w) = (
        matrix_row(matrix, 0, point),
        matrix_row(matrix, 1, point),
        matrix_row(matrix, 2, point),
        matrix_row(matrix, 3, point),
    );
    let [guard_x, guard_y] = viewport.guard();
    let (limit_x, limit_y) = (clip_w * guard_x, clip_w * guard_y);
    let outside = clip_z.simd_gt(clip_w)
        | clip_z.simd_lt(0.0)
        | clip_x.simd_lt(-limit_x)
        | clip_x.simd_gt(limit_x)
        | clip_y.simd_gt(limit_y)
        | clip_y.simd_lt(-limit_y)
        | !(clip_x.is_finite() & clip_y.is_finite() & clip_z.is_finite() & clip_w.is_finite());
    if outside.any_true() {
        return false;
    }
    let inv_w = f32x16::splat(simd, 1.0) / clip_w;
    let [half_x, half_y] = viewport.half();
    let screen_x = snap(clip_x * inv_w, half_x) + half_x;
    let screen_y = i32x16::splat(simd, half_y) - snap(clip_y * inv_w, half_y);
    let depth = ((clip_z * inv_w).max_precise(0.0) + 0.0).min_precise(1.0);
    store_pairs(screen_x, screen_y, positions.as_flattened_mut());
    store_pairs(depth, inv_w, depths.as_flattened_mut());
    true
}

#[inline(always)]
fn matrix_row<S: Simd>(matrix: &Mat4, row: usize, [x, y, z]: [f32x16<S>; 3]) -> f32x16<S> {
    ((x * matrix.x_axis[row] + y * matrix.y_axis[row]) + z * matrix.z_axis[row]) + matrix.w_axis[row]
}

/// From -1..=1 to subpixels.
#[inline(always)]
fn snap<S: Simd>(ndc: f32x16<S>, half: i32) -> i32x16<S> {
    let guard = (GUARD_BAND_PX * SUBPIXELS) as f32;
    (ndc * half as f32).max_precise(-guard).min_precise(guard).round_ties_even().to_int()
}

#[inline(always)]
fn store_pairs<S: Simd, V: SimdBase<S>>(first: V, second: V, pairs: &mut [V::Element]) {
    let (low, high) = first.interleave(second);
    let (low_pairs, high_pairs) = pairs.split_at_mut(LANES);
    low.store_slice(low_pairs);
    high.store_slice(high_pairs);
}
