//! Triangles to what tiles need: small ones to fragments, others to records; what is out of sight or covers no sample is
//! left out, eight triangles at a time, before more than its position on the screen is read.

use fearless_simd::Simd;
use pellucid_core::pixel_grid::{ScreenTriangle, ScreenVertex, outcode, twice_signed_area};
use pellucid_core::primitive::{Corners, Draw, Fold, Pass, Piece};
use pellucid_core::shading::CornerNormals;
use prefetch_index::prefetch_index;

use crate::bin::{Bins, TileGrid};
use crate::sight::Sight;
use crate::small::{self, LANES, MOST_FRAGMENTS, SmallTriangles};
use crate::small_fragments::{NewFragments, SmallFragments};
use crate::transform::{DrawVertices, outcode};

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

/// [`Corners`] in 8 bytes: the weights of clipped ones stand in a table.
#[derive(Debug, Clone, Copy)]
enum RecordCorners {
    Whole,
    Swapped,
    Clipped(u32),
}

/// Triangles set up by one thread in one go, in draw order.
#[derive(Debug, Default)]
pub(crate) struct Chunk {
    records: Vec<Record>,
    clipped: Vec<[glam::Vec3; 3]>,
    pub(crate) opaque: PassBins,
    pub(crate) transparent: PassBins,
    pub(crate) dropped_triangles: u64,
}

/// What a chunk has for the tiles, in one pass of the frame. Draw order runs through both.
#[derive(Debug, Default)]
pub(crate) struct PassBins {
    pub(crate) records: Bins,
    pub(crate) small: SmallFragments,
}

impl PassBins {
    /// Adds how many bytes each tile needs.
    pub(crate) fn add_bytes(&self, bytes: &mut [u64]) {
        self.records.add_bytes(size_of::<Record>(), bytes);
        self.small.add_bytes(bytes);
    }

    fn bytes(&self) -> usize {
        self.records.bytes() + self.small.bytes()
    }
}

/// What a thread needs to fill one chunk after another.
#[derive(Debug, Default)]
pub(crate) struct SetupScratch {
    opaque: NewFragments,
    transparent: NewFragments,
}

impl SetupScratch {
    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.opaque.bytes() + self.transparent.bytes()
    }
}

/// Triangles between those at hand and those whose corners are fetched into the cache meanwhile.
const FETCHED_AHEAD: usize = 4 * LANES;

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

/// Bytes of the budget for each triangle of a chunk. One that is being filled takes some 100 a triangle beyond the budget,
/// which should not be much of it.
const BUDGET_FOR_A_TRIANGLE: usize = 512;

/// Triangles in a chunk: few enough for each thread to get several, so that all end at about the same time, and for the
/// budget, but so many that tiles find something in each.
pub(crate) fn chunk_triangles(total: usize, threads: usize, tiles: usize, budget_bytes: usize) -> usize {
    let most = (budget_bytes / BUDGET_FOR_A_TRIANGLE).clamp(1024, 32_768);
    // Each chunk has tables of all tiles: few bytes for a triangle even where tiles are many.
    (total / (threads * 8)).clamp(1024, most.max(2 * tiles))
}

/// Cuts the triangles of a group's draws into chunks of `chunk_triangles`.
pub(crate) fn chunk_spans(draws: &[Draw<'_>], first_draw: usize, chunk_triangles: usize) -> Vec<Vec<Span>> {
    let mut chunks: Vec<Vec<Span>> = Vec::new();
    let mut room = 0;
    for (i, draw) in draws.iter().enumerate() {
        let total = draw.mesh.triangles().len();
        let mut first = 0;
        while first < total {
            if room == 0 {
                chunks.push(Vec::new());
                room = chunk_triangles;
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
    /// Sets up the triangles of `spans`; `draw_vertices` gives the transformed vertices of a draw.
    #[inline(always)]
    pub(crate) fn fill<'v, S: Simd>(
        &mut self,
        simd: S,
        spans: &[Span],
        draws: &[Draw<'_>],
        draw_vertices: impl Fn(usize) -> DrawVertices<'v>,
        grid: &TileGrid,
        scratch: &mut SetupScratch,
    ) {
        self.records.clear();
        self.clipped.clear();
        self.dropped_triangles = 0;
        self.opaque.records.begin();
        self.transparent.records.begin();
        for span in spans {
            let draw = &draws[span.draw];
            let new = match draw.pass {
                Pass::Opaque => &mut scratch.opaque,
                Pass::Transparent => &mut scratch.transparent,
            };
            self.set_up(simd, span, draw, draw_vertices(span.draw), grid, new);
        }
        self.opaque.records.finish(grid);
        self.transparent.records.finish(grid);
        self.opaque.small.take(&mut scratch.opaque, grid);
        self.transparent.small.take(&mut scratch.transparent, grid);
    }

    #[inline(always)]
    fn set_up<S: Simd>(
        &mut self,
        simd: S,
        span: &Span,
        draw: &Draw<'_>,
        vertices: DrawVertices<'_>,
        grid: &TileGrid,
        new: &mut NewFragments,
    ) {
        let all = &draw.mesh.triangles()[span.first..span.first + span.count];
        let mut small = SmallTriangles::default();
        let mut sight = Sight::default();
        let normals = draw.mesh.normals().filter(|_| draw.lit).unwrap_or_default();
        for start in (0..all.len()).step_by(LANES) {
            // The other corners are mostly those of neighbours.
            for &[vertex, ..] in all.iter().skip(start + FETCHED_AHEAD).take(LANES) {
                prefetch_index(vertices.positions, vertex as usize);
            }
            let padded;
            let triangles = match all[start..].first_chunk::<LANES>() {
                Some(triangles) => triangles,
                None => {
                    padded = padded_triangles(&all[start..]);
                    &padded
                }
            };
            let first = span.first + start;
            sight.look(simd, triangles, vertices.positions, draw, grid);
            let mut records = sight.others;
            if all.len() - start < LANES {
                records &= (1 << (all.len() - start)) - 1;
            }
            if draw.varies() {
                records |= sight.small;
            } else {
                let mut lanes = sight.small;
                while lanes != 0 {
                    let lane = lanes.trailing_zeros() as usize % LANES;
                    lanes &= lanes - 1;
                    if sight.maybe_many >> lane & 1 != 0 && sight.covered_count(lane) > MOST_FRAGMENTS {
                        records |= 1 << lane;
                        continue;
                    }
                    let [a, b, c] = triangles[lane];
                    let corners = if sight.swapped >> lane & 1 != 0 { [a, c, b] } else { [a, b, c] };
                    small::fetch(corners, vertices.depths, normals);
                    let mut push = |number| {
                        let (block, covered) = sight.block(number, lane);
                        if covered != 0 && small.push(first + lane, corners, block, covered) {
                            small.flush(simd.level(), draw, span.draw as u32, vertices, grid, new);
                        }
                    };
                    push(0);
                    (1..sight.block_count).for_each(push);
                }
            }
            while records != 0 {
                let lane = records.trailing_zeros() as usize;
                records &= records - 1;
                self.set_up_record(span.draw, draw, first + lane, triangles[lane], vertices, grid);
            }
        }
        small.flush(simd.level(), draw, span.draw as u32, vertices, grid, new);
    }

    #[inline(always)]
    fn bins(&mut self, pass: Pass) -> &mut PassBins {
        match pass {
            Pass::Opaque => &mut self.opaque,
            Pass::Transparent => &mut self.transparent,
        }
    }

    /// Sets up a triangle that is not small, or whose colour varies.
    #[inline(never)]
    fn set_up_record(
        &mut self,
        draw_number: usize,
        draw: &Draw<'_>,
        triangle: usize,
        indices: [u32; 3],
        vertices: DrawVertices<'_>,
        grid: &TileGrid,
    ) {
        let codes = indices.map(|vertex| outcode(vertices.positions[vertex as usize]));
        let any = codes[0] | codes[1] | codes[2];
        if any != 0 {
            if any & outcode::NOT_FINITE != 0 {
                self.dropped_triangles += 1;
            } else if codes[0] & codes[1] & codes[2] == 0 {
                self.set_up_clipped(draw_number, draw, triangle, grid);
            }
            return;
        }
        let mut corners = indices.map(|vertex| vertices.vertex(vertex));
        let area = twice_signed_area(corners);
        if area == 0 || !draw.shows_side(area) {
            return;
        }
        let kind = if area < 0 {
            corners.swap(1, 2);
            RecordCorners::Swapped
        } else {
            RecordCorners::Whole
        };
        self.push(draw_number, draw, triangle, corners, kind, Fold::None, grid);
    }

    #[cold]
    fn set_up_clipped(&mut self, draw_number: usize, draw: &Draw<'_>, triangle: usize, grid: &TileGrid) {
        for piece in draw.pieces(triangle, &grid.viewport).unwrap_or_default() {
            let kind = match piece.corners {
                Corners::Whole { swapped: false } => RecordCorners::Whole,
                Corners::Whole { swapped: true } => RecordCorners::Swapped,
                Corners::Clipped(weights) => {
                    self.clipped.push(weights);
                    RecordCorners::Clipped((self.clipped.len() - 1) as u32)
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
        let number = self.records.len() as u32;
        self.bins(draw.pass).records.add(number, &vertices, samples, grid);
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

/// A few triangles, and others without area, which are never small and in sight.
#[cold]
fn padded_triangles(few: &[[u32; 3]]) -> [[u32; 3]; LANES] {
    let mut padded = [[few[0][0]; 3]; LANES];
    padded[..few.len()].copy_from_slice(few);
    padded
}

/// Whether a triangle covers one pixel.
#[inline(always)]
fn covers(vertices: &[ScreenVertex; 3], x: i32, y: i32) -> bool {
    ScreenTriangle::new(*vertices).is_some_and(|triangle| triangle.covers(x, y))
}
