//! Triangles to what tiles need: small ones to fragments, others to records; what is out of sight or covers no sample is
//! left out, eight triangles at a time, before more than its position on the screen is read.

use std::ops::Range;

use fearless_simd::Simd;
use pellucid_core::meshlets::{LANES, Meshlet};
use pellucid_core::pixel_grid::{ScreenTriangle, ScreenVertex, outcode, twice_signed_area};
use pellucid_core::primitive::{Corners, Draw, Fold, Pass, Piece};
use pellucid_core::shading::CornerNormals;

use crate::bin::{Bins, TileGrid};
use crate::sight::Sight;
use crate::small::{MOST_FRAGMENTS, make_fragments};
use crate::small_blocks::{MOST_PARTS, SmallBlocks};
use crate::small_fragments::SmallFragments;
use crate::transform::{Vertices, outcode};

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
    fn begin(&mut self) {
        self.records.begin();
        self.small.begin();
    }

    /// Sorts what there is by tile.
    fn finish(&mut self, grid: &TileGrid) {
        self.records.finish(grid);
        self.small.finish(grid);
    }

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
    vertices: Vertices,
    blocks: SmallBlocks,
}

impl SetupScratch {
    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        Vertices::BYTES + self.blocks.bytes()
    }
}

/// Meshlets of one draw that a chunk sets up.
#[derive(Debug, Clone)]
pub(crate) struct Span {
    /// Number of the draw.
    pub(crate) draw: usize,
    pub(crate) meshlets: Range<usize>,
    pub(crate) triangle_count: usize,
}

/// Bytes of the budget for each triangle of a chunk. One that is being filled takes some 50 a triangle beyond the budget,
/// which should not be much of it.
const BUDGET_FOR_A_TRIANGLE: usize = 512;

/// How many triangles each chunk of a window gets, unless a meshlet has more: the more are left, the more, so that tiles find
/// something in each chunk, and the last ones few, so that all threads end at about the same time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ChunkSizes {
    triangles: usize,
    threads: usize,
    least: usize,
    most: usize,
}

impl ChunkSizes {
    pub(crate) fn new(triangles: usize, threads: usize, tiles: usize, budget_bytes: usize) -> Self {
        let most = (budget_bytes / BUDGET_FOR_A_TRIANGLE).clamp(1024, 32_768);
        // Each chunk has tables of all tiles: few bytes for a triangle even where tiles are many.
        let most = most.max(2 * tiles);
        Self { triangles, threads, least: (triangles / (threads * 32)).clamp(1024, most), most }
    }

    /// Triangles of the next chunk where so many are left.
    fn next(self, left: usize) -> usize {
        (left / (self.threads * 4)).clamp(self.least, self.most)
    }
}

/// Cuts the triangles of all draws into chunks of about those sizes: the number of meshlets nearest to them, one at least.
pub(crate) fn chunk_spans(draws: &[Draw<'_>], sizes: ChunkSizes) -> Vec<Vec<Span>> {
    let mut chunks: Vec<Vec<Span>> = Vec::new();
    let (mut room, mut left) = (0, sizes.triangles);
    for (draw_number, draw) in draws.iter().enumerate() {
        let meshlets = draw.mesh.meshlets();
        let mut first = 0;
        while first < meshlets.count() {
            if room == 0 {
                chunks.push(Vec::new());
                room = sizes.next(left);
            }
            let (mut end, mut triangle_count) = (first + 1, meshlets.triangle_count(first));
            while end < meshlets.count() && triangle_count + meshlets.triangle_count(end) / 2 < room {
                triangle_count += meshlets.triangle_count(end);
                end += 1;
            }
            if let Some(chunk) = chunks.last_mut() {
                chunk.push(Span { draw: draw_number, meshlets: first..end, triangle_count });
            }
            first = end;
            room = if end < meshlets.count() { 0 } else { room.saturating_sub(triangle_count) };
            left = left.saturating_sub(triangle_count);
        }
    }
    chunks
}

impl Chunk {
    /// Sets up the triangles of `spans`.
    #[inline(always)]
    pub(crate) fn fill<S: Simd>(
        &mut self,
        simd: S,
        spans: &[Span],
        draws: &[Draw<'_>],
        grid: &TileGrid,
        scratch: &mut SetupScratch,
    ) {
        self.records.clear();
        self.clipped.clear();
        self.dropped_triangles = 0;
        self.opaque.begin();
        self.transparent.begin();
        let SetupScratch { vertices, blocks } = scratch;
        blocks.begin(grid);
        for span in spans {
            let draw = &draws[span.draw];
            let meshlets = draw.mesh.meshlets();
            for meshlet in span.meshlets.clone() {
                let meshlet = meshlets.get(meshlet);
                vertices.transform(simd, draw, &grid.viewport, &meshlet);
                self.set_up(simd, draw, span.draw, &meshlet, vertices, grid, blocks);
                if blocks.is_empty() {
                    continue;
                }
                vertices.light(simd, draw, &meshlet);
                make_fragments(
                    simd.level(),
                    blocks,
                    draw,
                    span.draw as u32,
                    &meshlet,
                    vertices,
                    &mut self.bins(draw.pass).small,
                );
            }
        }
        self.opaque.finish(grid);
        self.transparent.finish(grid);
    }

    /// Sets up the triangles of a meshlet: those that are small become blocks, others records.
    #[inline(always)]
    fn set_up<S: Simd>(
        &mut self,
        simd: S,
        draw: &Draw<'_>,
        draw_number: usize,
        meshlet: &Meshlet<'_>,
        vertices: &Vertices,
        grid: &TileGrid,
        blocks: &mut SmallBlocks,
    ) {
        let mut sight = Sight::default();
        for (eight, corners) in meshlet.corners.iter().enumerate() {
            let first = meshlet.first_triangle + eight * LANES;
            sight.look(simd, eight * LANES, corners, &vertices.positions, draw, grid);
            let mut records = sight.others;
            let count = meshlet.triangle_count - eight * LANES;
            if count < LANES {
                records &= (1 << count) - 1;
            }
            if draw.varies() {
                records |= sight.small;
            } else {
                let (mut small, mut maybe_many) = (sight.small, sight.maybe_many & sight.small);
                while maybe_many != 0 {
                    let lane = maybe_many.trailing_zeros() as usize % LANES;
                    maybe_many &= maybe_many - 1;
                    if sight.covered_count(lane) > MOST_FRAGMENTS {
                        records |= 1 << lane;
                        small &= !(1 << lane);
                    }
                }
                blocks.make_room(LANES * MOST_PARTS);
                if let [block] = sight.blocks() {
                    // Nearly always.
                    while small != 0 {
                        let lane = small.trailing_zeros() as usize % LANES;
                        small &= small - 1;
                        blocks.push(block, lane, sight.triangles[lane], grid);
                    }
                }
                while small != 0 {
                    let lane = small.trailing_zeros() as usize % LANES;
                    small &= small - 1;
                    for block in sight.blocks() {
                        blocks.push(block, lane, sight.triangles[lane], grid);
                    }
                }
            }
            while records != 0 {
                let lane = records.trailing_zeros() as usize % LANES;
                records &= records - 1;
                let corners = [corners[0][lane], corners[1][lane], corners[2][lane]];
                self.set_up_record(draw_number, draw, first + lane, corners, vertices, grid);
            }
        }
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
        corners: [u16; 3],
        vertices: &Vertices,
        grid: &TileGrid,
    ) {
        let codes = corners.map(|vertex| outcode(vertices.positions[usize::from(vertex)]));
        let any = codes[0] | codes[1] | codes[2];
        if any != 0 {
            if any & outcode::NOT_FINITE != 0 {
                self.dropped_triangles += 1;
            } else if codes[0] & codes[1] & codes[2] == 0 {
                self.set_up_clipped(draw_number, draw, triangle, grid);
            }
            return;
        }
        let mut corners = corners.map(|vertex| vertices.vertex(vertex));
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

/// Whether a triangle covers one pixel.
#[inline(always)]
fn covers(vertices: &[ScreenVertex; 3], x: i32, y: i32) -> bool {
    ScreenTriangle::new(*vertices).is_some_and(|triangle| triangle.covers(x, y))
}
