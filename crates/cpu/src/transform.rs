//! Vertices of a meshlet to the pixel grid, eight at a time.

use bytemuck::Zeroable;
use fearless_simd::{Simd, SimdBase, SimdFloat, SimdMask, f32x8, i32x8};
use glam::{Mat4, Vec3};
use pellucid_core::meshlets::{Eight, LANES, Meshlet};
use pellucid_core::pixel_grid::{GUARD_BAND_PX, SUBPIXELS, ScreenVertex, Viewport};
use pellucid_core::primitive::{Draw, transform_point};

use crate::simd::rows;

/// Stands in for x of a vertex that cannot be projected; its y then holds the outcode.
pub(crate) const OUTSIDE: i32 = i32::MIN;

/// As many as two bytes tell apart.
pub(crate) const VERTICES: usize = 1 << 16;

/// The vertices of a meshlet. Two bytes name one, so that no place has to be checked.
#[derive(Debug)]
pub(crate) struct Vertices {
    /// x and y in subpixels, or [`OUTSIDE`] and an outcode.
    pub(crate) positions: Box<[[i32; 2]; VERTICES]>,
    depths: Box<[f32; VERTICES]>,
    inv_ws: Box<[f32; VERTICES]>,
    /// Depth, and normal in camera space over w if there are normals.
    pub(crate) lit: Box<[[f32; 4]; VERTICES]>,
}

impl Default for Vertices {
    fn default() -> Self {
        Self { positions: zeros(), depths: zeros(), inv_ws: zeros(), lit: zeros() }
    }
}

fn zeros<T: Zeroable>() -> Box<[T; VERTICES]> {
    bytemuck::allocation::zeroed_box()
}

impl Vertices {
    pub(crate) const BYTES: usize = VERTICES * (size_of::<[i32; 2]>() + 2 * size_of::<f32>() + size_of::<[f32; 4]>());

    #[inline(always)]
    pub(crate) fn vertex(&self, number: u16) -> ScreenVertex {
        let number = usize::from(number);
        let [x, y] = self.positions[number];
        ScreenVertex { x, y, depth: self.depths[number], inv_w: self.inv_ws[number] }
    }

    /// Transforms the positions of a meshlet's vertices.
    #[inline(always)]
    pub(crate) fn transform<S: Simd>(&mut self, simd: S, draw: &Draw<'_>, viewport: &Viewport, meshlet: &Meshlet<'_>) {
        let screen = self.positions.as_chunks_mut::<LANES>().0.iter_mut();
        let depths = self.depths.as_chunks_mut::<LANES>().0.iter_mut();
        let inv_ws = self.inv_ws.as_chunks_mut::<LANES>().0.iter_mut();
        for (((points, screen), depths), inv_ws) in meshlet.positions.iter().zip(screen).zip(depths).zip(inv_ws) {
            if !transform_eight(simd, draw, viewport, points, screen, depths, inv_ws) {
                transform_each(draw, viewport, points, screen, depths, inv_ws);
            }
        }
    }

    /// Makes ready what small triangles take beside the positions, which are transformed already.
    #[inline(always)]
    pub(crate) fn light<S: Simd>(&mut self, simd: S, draw: &Draw<'_>, meshlet: &Meshlet<'_>) {
        if !draw.lit || meshlet.normals.is_empty() {
            let count = meshlet.positions.len() * LANES;
            for (lit, depth) in self.lit.iter_mut().zip(&self.depths[..count]) {
                lit[0] = *depth;
            }
            return;
        }
        let lit = self.lit.as_chunks_mut::<LANES>().0.iter_mut();
        let depths = self.depths.as_chunks::<LANES>().0;
        let inv_ws = self.inv_ws.as_chunks::<LANES>().0;
        for (((normals, lit), depths), inv_ws) in meshlet.normals.iter().zip(lit).zip(depths).zip(inv_ws) {
            let [x, y, z] = in_view(draw, axes(simd, normals));
            let (depth, inv_w) = (f32x8::load_array_ref(simd, depths), f32x8::load_array_ref(simd, inv_ws));
            rows(simd, [depth, x * inv_w, y * inv_w, z * inv_w], lit);
        }
    }
}

/// Beyond which planes of the clip volume a vertex lies; 0 if it is on the pixel grid.
#[inline(always)]
pub(crate) fn outcode([x, y]: [i32; 2]) -> u8 {
    if x == OUTSIDE { y as u8 } else { 0 }
}

/// Normals in camera space.
#[inline(always)]
pub(crate) fn in_view<S: Simd>(draw: &Draw<'_>, [x, y, z]: [f32x8<S>; 3]) -> [f32x8<S>; 3] {
    let matrix = &draw.view_from_normal;
    [
        (x * matrix.x_axis.x + y * matrix.y_axis.x) + z * matrix.z_axis.x,
        (x * matrix.x_axis.y + y * matrix.y_axis.y) + z * matrix.z_axis.y,
        (x * matrix.x_axis.z + y * matrix.y_axis.z) + z * matrix.z_axis.z,
    ]
}

/// Vertex by vertex, where some cannot be projected.
#[cold]
fn transform_each(
    draw: &Draw<'_>,
    viewport: &Viewport,
    [x, y, z]: &Eight,
    positions: &mut [[i32; 2]; LANES],
    depths: &mut [f32; LANES],
    inv_ws: &mut [f32; LANES],
) {
    for lane in 0..LANES {
        let clip = transform_point(&draw.clip_from_mesh, Vec3::new(x[lane], y[lane], z[lane]));
        let outcode = viewport.outcode(clip);
        (positions[lane], depths[lane], inv_ws[lane]) = if outcode == 0 {
            let vertex = viewport.project(clip);
            ([vertex.x, vertex.y], vertex.depth, vertex.inv_w)
        } else {
            ([OUTSIDE, i32::from(outcode)], 0.0, 0.0)
        };
    }
}

/// The same operations as in [`transform_point`], [`Viewport::outcode`] and [`Viewport::project`]; `false`, with nothing
/// done, unless all can be projected.
#[inline(always)]
fn transform_eight<S: Simd>(
    simd: S,
    draw: &Draw<'_>,
    viewport: &Viewport,
    points: &Eight,
    positions: &mut [[i32; 2]; LANES],
    depths: &mut [f32; LANES],
    inv_ws: &mut [f32; LANES],
) -> bool {
    let point = axes(simd, points);
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
    let inv_w = f32x8::splat(simd, 1.0) / clip_w;
    let [half_x, half_y] = viewport.half();
    let screen_x = snap(clip_x * inv_w, half_x) + half_x;
    let screen_y = i32x8::splat(simd, half_y) - snap(clip_y * inv_w, half_y);
    let depth = ((clip_z * inv_w).max_precise(0.0) + 0.0).min_precise(1.0);
    let (low, high) = screen_x.interleave(screen_y);
    let (first, second) = positions.as_flattened_mut().split_at_mut(LANES);
    low.store_slice(first);
    high.store_slice(second);
    depth.store_slice(depths);
    inv_w.store_slice(inv_ws);
    true
}

#[inline(always)]
fn axes<S: Simd>(simd: S, [x, y, z]: &Eight) -> [f32x8<S>; 3] {
    [f32x8::load_array_ref(simd, x), f32x8::load_array_ref(simd, y), f32x8::load_array_ref(simd, z)]
}

#[inline(always)]
fn matrix_row<S: Simd>(matrix: &Mat4, row: usize, [x, y, z]: [f32x8<S>; 3]) -> f32x8<S> {
    ((x * matrix.x_axis[row] + y * matrix.y_axis[row]) + z * matrix.z_axis[row]) + matrix.w_axis[row]
}

/// From -1..=1 to subpixels.
#[inline(always)]
fn snap<S: Simd>(ndc: f32x8<S>, half: i32) -> i32x8<S> {
    let guard = (GUARD_BAND_PX * SUBPIXELS) as f32;
    (ndc * half as f32).max_precise(-guard).min_precise(guard).round_ties_even().to_int()
}
