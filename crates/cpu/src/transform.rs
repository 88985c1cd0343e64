//! Vertices to the pixel grid.

use std::ops::Range;

use fearless_simd::{Level, dispatch};
use pellucid_core::pixel_grid::{ScreenVertex, Viewport};
use pellucid_core::primitive::{Draw, transform_point};
use rayon::prelude::*;

/// Stands in for x of a vertex that cannot be projected; its y then holds the outcode.
const OUTSIDE: i32 = i32::MIN;

/// Vertices one thread transforms at a time.
const CHUNK_VERTICES: usize = 4096;

/// A vertex on the pixel grid, or beyond which planes of the clip volume it lies.
pub(crate) fn outcode(vertex: &ScreenVertex) -> u8 {
    if vertex.x == OUTSIDE { vertex.y as u8 } else { 0 }
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

/// Transforms all vertices of a group; `starts` receives where each draw's vertices begin.
pub(crate) fn transform(
    draws: &[Draw<'_>],
    viewport: &Viewport,
    level: Level,
    vertices: &mut Vec<ScreenVertex>,
    starts: &mut Vec<usize>,
) {
    starts.clear();
    let mut total = 0;
    for draw in draws {
        starts.push(total);
        total += draw.mesh.positions().len();
    }
    vertices.resize(total, ScreenVertex::default());
    let starts = &*starts;
    vertices.par_chunks_mut(CHUNK_VERTICES).enumerate().for_each(|(chunk, vertices)| {
        let mut first = chunk * CHUNK_VERTICES;
        let mut draw = starts.partition_point(|&start| start <= first) - 1;
        let mut rest = vertices;
        while !rest.is_empty() {
            let positions = &draws[draw].mesh.positions()[first - starts[draw]..];
            let count = positions.len().min(rest.len());
            let (these, others) = rest.split_at_mut(count);
            dispatch!(level, _simd => transform_mesh(&draws[draw], viewport, &positions[..count], these));
            rest = others;
            first += count;
            draw += 1;
        }
    });
}

#[inline(always)]
fn transform_mesh(draw: &Draw<'_>, viewport: &Viewport, positions: &[glam::Vec3], vertices: &mut [ScreenVertex]) {
    let matrix = draw.clip_from_mesh;
    for (vertex, &position) in vertices.iter_mut().zip(positions) {
        let clip = transform_point(&matrix, position);
        let outcode = viewport.outcode(clip);
        *vertex = if outcode == 0 {
            viewport.project(clip)
        } else {
            ScreenVertex { x: OUTSIDE, y: i32::from(outcode), depth: 0.0, inv_w: 0.0 }
        };
    }
}
