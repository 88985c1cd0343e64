//! Triangles to records: what is in sight and may cover a sample, ready for the tiles.

use pellucid_core::pixel_grid::{ScreenTriangle, ScreenVertex, Viewport, outcode, twice_signed_area};
use pellucid_core::primitive::{Corners, Draw, Fold, Pass, Piece};
use pellucid_core::shading::CornerNormals;

use crate::bin::{Bins, TileGrid};
use crate::transform;

/// A triangle in sight, or a piece of a clipped one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Record {
    /// Corners, clockwise on the screen.
    pub(crate) vertices: [ScreenVertex; 3],
    /// Number of the draw.
    pub(crate) draw: u32,
    /// Number of the triangle in the draw's mesh.
    pub(crate) triangle: u32,
    /// Kept here although the mesh has them: tiles visit triangles in an order that no cache follows.
    pub(crate) normals: CornerNormals,
    corners: RecordCorners,
    pub(crate) fold: Fold,
}

/// [`Corners`] in 4 bytes: the weights of clipped ones stand in a table.
#[derive(Debug, Clone, Copy)]
enum RecordCorners {
    Whole,
    Swapped,
    Clipped(u16),
}

/// Triangles set up by one thread in one go, in draw order.
#[derive(Debug, Default)]
pub(crate) struct Chunk {
    records: Vec<Record>,
    clipped: Vec<[glam::Vec3; 3]>,
    pub(crate) opaque: Bins,
    pub(crate) transparent: Bins,
    pub(crate) dropped_triangles: u64,
}

/// Triangles of one draw that a chunk sets up.
#[derive(Debug, Clone)]
pub(crate) struct Span {
    /// Number of the draw.
    pub(crate) draw: usize,
    /// First of its triangles.
    pub(crate) first: usize,
    /// How many.
    pub(crate) count: usize,
}

/// Most triangles in a chunk. Each may leave [`MAX_PIECES`] pieces, which must be numbered in 16 bits.
pub(crate) const CHUNK_TRIANGLES: usize = 8192;

const MAX_PIECES: usize = pellucid_core::clip::MAX_CLIPPED_VERTICES - 2;
const _: () = assert!(CHUNK_TRIANGLES * MAX_PIECES <= u16::MAX as usize);

/// Cuts the triangles of a group's draws into chunks.
pub(crate) fn chunk_spans(draws: &[Draw<'_>], first_draw: usize) -> Vec<Vec<Span>> {
    let mut chunks: Vec<Vec<Span>> = Vec::new();
    let mut room = 0;
    for (i, draw) in draws.iter().enumerate() {
        let total = draw.mesh.triangles().len();
        let mut first = 0;
        while first < total {
            if room == 0 {
                chunks.push(Vec::new());
                room = CHUNK_TRIANGLES;
            }
            let count = (total - first).min(room);
            if let Some(chunk) = chunks.last_mut() {
                chunk.push(Span { draw: first_draw + i, first, count });
            }
            first += count;
            room -= count;
        }
    }
    chunks
}

impl Chunk {
    /// Sets up the triangles of `spans`; `screen_vertices` gives the transformed vertices of a draw.
    #[inline(always)]
    pub(crate) fn fill<'v>(
        &mut self,
        spans: &[Span],
        draws: &[Draw<'_>],
        screen_vertices: impl Fn(usize) -> &'v [ScreenVertex],
        viewport: &Viewport,
        grid: &TileGrid,
    ) {
        self.records.clear();
        self.clipped.clear();
        self.dropped_triangles = 0;
        self.opaque.begin();
        self.transparent.begin();
        for span in spans {
            self.set_up(span, &draws[span.draw], screen_vertices(span.draw), viewport, grid);
        }
        self.opaque.finish(grid);
        self.transparent.finish(grid);
    }

    #[inline(always)]
    fn set_up(
        &mut self,
        span: &Span,
        draw: &Draw<'_>,
        vertices: &[ScreenVertex],
        viewport: &Viewport,
        grid: &TileGrid,
    ) {
        let triangles = &draw.mesh.triangles()[span.first..span.first + span.count];
        for (triangle, indices) in (span.first..).zip(triangles) {
            let mut corners = indices.map(|vertex| vertices[vertex as usize]);
            let codes = [0, 1, 2].map(|i| transform::outcode(&corners[i]));
            let any = codes[0] | codes[1] | codes[2];
            if any != 0 {
                if any & outcode::NOT_FINITE != 0 {
                    self.dropped_triangles += 1;
                } else if codes[0] & codes[1] & codes[2] == 0 {
                    self.set_up_clipped(span.draw, draw, triangle, viewport, grid);
                }
                continue;
            }
            let area = twice_signed_area(corners);
            if area == 0 || !draw.shows_side(area) {
                continue;
            }
            let kind = if area < 0 {
                corners.swap(1, 2);
                RecordCorners::Swapped
            } else {
                RecordCorners::Whole
            };
            self.push(span.draw, draw, triangle, corners, kind, Fold::None, grid);
        }
    }

    #[cold]
    fn set_up_clipped(
        &mut self,
        draw_number: usize,
        draw: &Draw<'_>,
        triangle: usize,
        viewport: &Viewport,
        grid: &TileGrid,
    ) {
        for piece in draw.pieces(triangle, viewport).unwrap_or_default() {
            let kind = match piece.corners {
                Corners::Whole { swapped: false } => RecordCorners::Whole,
                Corners::Whole { swapped: true } => RecordCorners::Swapped,
                Corners::Clipped(weights) => {
                    self.clipped.push(weights);
                    RecordCorners::Clipped((self.clipped.len() - 1) as u16)
                }
            };
            self.push(draw_number, draw, triangle, piece.triangle.vertices, kind, piece.fold, grid);
        }
    }

    #[inline(always)]
    fn push(
        &mut self,
        draw_number: usize,
        draw: &Draw<'_>,
        triangle: usize,
        vertices: [ScreenVertex; 3],
        corners: RecordCorners,
        fold: Fold,
        grid: &TileGrid,
    ) {
        let Some(samples) = grid.samples_in_bounds(&vertices) else { return };
        if samples.is_single() && !covers(&vertices, samples.left, samples.top) {
            return;
        }
        let bins = match draw.pass {
            Pass::Opaque => &mut self.opaque,
            Pass::Transparent => &mut self.transparent,
        };
        bins.add(self.records.len() as u32, &vertices, samples, grid);
        let normals = CornerNormals::new(draw, triangle, &vertices, &self.corners(corners));
        self.records.push(Record {
            vertices,
            draw: draw_number as u32,
            triangle: triangle as u32,
            normals,
            corners,
            fold,
        });
    }

    /// The record of a number.
    #[inline]
    pub(crate) fn record(&self, number: u32) -> &Record {
        &self.records[number as usize]
    }

    /// The piece that a record stands for.
    #[inline(always)]
    pub(crate) fn piece(&self, record: &Record, triangle: ScreenTriangle) -> Piece {
        Piece { triangle, corners: self.corners(record.corners), fold: record.fold }
    }

    #[inline(always)]
    fn corners(&self, corners: RecordCorners) -> Corners {
        match corners {
            RecordCorners::Whole => Corners::Whole { swapped: false },
            RecordCorners::Swapped => Corners::Whole { swapped: true },
            RecordCorners::Clipped(number) => Corners::Clipped(self.clipped[number as usize]),
        }
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.records.capacity() * size_of::<Record>()
            + self.clipped.capacity() * size_of::<[glam::Vec3; 3]>()
            + self.opaque.bytes()
            + self.transparent.bytes()
    }
}

/// Whether a triangle covers one pixel.
#[inline(always)]
fn covers(vertices: &[ScreenVertex; 3], x: i32, y: i32) -> bool {
    ScreenTriangle::new(*vertices).is_some_and(|triangle| triangle.covers(x, y))
}
