//! One frame, top to bottom.

use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Instant;

use fearless_simd::{Level, dispatch};
use glam::Vec4;
use pellucid_core::pixel_grid::{ScreenVertex, Viewport};
use pellucid_core::primitive::{Draw, draws};
use pellucid_core::resolve::{PixelResolver, finish};
use pellucid_core::stats::Step;
use pellucid_core::{Error, Frame, Image, Layers, Resolve, Scene, Stats, Technique, View};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::bin::{TILE_PX, TileGrid};
use crate::setup::{Chunk, chunk_spans};
use crate::tile::{FragmentCounts, FrameParts, TileCapture};
use crate::transform::{groups, transform};

/// Renders on all cores. Keep it from frame to frame: it holds on to its threads and memory.
#[derive(Debug)]
pub struct CpuRenderer {
    threads: usize,
    level: Level,
    pool: OnceLock<ThreadPool>,
    memory: Mutex<Memory>,
}

/// What is kept from frame to frame.
#[derive(Debug, Default)]
struct Memory {
    vertices: Vec<ScreenVertex>,
    vertex_starts: Vec<usize>,
    chunks: Vec<Chunk>,
    captures: Vec<TileCapture>,
}

/// A scene's triangles in the bins of its tiles.
struct Binned<'a> {
    draws: Vec<Draw<'a>>,
    grid: TileGrid,
    chunks: Vec<Chunk>,
    level: Level,
    stats: Stats,
    start: Instant,
}

impl CpuRenderer {
    /// A renderer on this many threads; 0: one for each core. They are started with the first frame.
    pub fn new(threads: usize) -> Self {
        Self { threads, level: Level::new(), pool: OnceLock::new(), memory: Mutex::default() }
    }

    /// The same renderer at another SIMD level than the best of this machine, see [`simd::levels`](crate::simd::levels).
    /// The picture is the same at any.
    #[must_use]
    pub fn level(mut self, level: Level) -> Self {
        self.level = level;
        self
    }

    /// Renders a view.
    ///
    /// # Errors
    /// If the view is invalid or the threads cannot be started.
    pub fn render(&self, scene: &Scene, view: &View, resolve: Resolve) -> Result<Frame, Error> {
        self.run(|memory| {
            let mut binned = bin_scene(scene, view, self.level, memory)?;
            let mut image = Image::filled(view.width, view.height, Vec4::ZERO);
            let tiles = Mutex::new(tile_rows(&mut image, &binned.grid));
            let resolver = PixelResolver::new(resolve, view);
            let frame = binned.parts();
            let (counts, bytes) = for_each_tile(&binned, memory, |number, capture, layers| {
                let mut rows = {
                    let mut tiles = tiles.lock().unwrap_or_else(PoisonError::into_inner);
                    std::mem::take(&mut tiles[number as usize])
                };
                if resolve == Resolve::Blend {
                    capture.blend(frame, view.background, &mut rows);
                    return;
                }
                capture.layers(frame.draws, layers);
                for (y, row) in rows.iter_mut().enumerate() {
                    for (x, pixel) in row.iter_mut().enumerate() {
                        let (x, y) = (x as u32, y as u32);
                        *pixel = resolver.pixel(layers.pixel(x, y), layers.opaque(x, y));
                    }
                }
            });
            let stats = binned.finish(counts, bytes, memory, scene);
            finish(resolve, &mut image, &stats);
            Ok(Frame { image, stats })
        })
    }

    /// Hands out the ordered layers of a view, tile by tile, for a resolve of one's own. Tiles do not overlap and cover
    /// the whole picture; they come from several threads in any order.
    ///
    /// # Errors
    /// If the view is invalid or the threads cannot be started.
    pub fn layers(&self, scene: &Scene, view: &View, visit: impl Fn(&Layers) + Sync) -> Result<Stats, Error> {
        self.run(|memory| {
            let mut binned = bin_scene(scene, view, self.level, memory)?;
            let frame = binned.parts();
            let (counts, bytes) = for_each_tile(&binned, memory, |_, capture, layers| {
                capture.layers(frame.draws, layers);
                visit(layers);
            });
            Ok(binned.finish(counts, bytes, memory, scene))
        })
    }

    /// Runs a frame on the renderer's threads, with the memory of earlier frames unless another frame is using it.
    fn run<T: Send>(&self, frame: impl FnOnce(&mut Memory) -> Result<T, Error> + Send) -> Result<T, Error> {
        if self.pool.get().is_none() {
            let pool = ThreadPoolBuilder::new()
                .num_threads(self.threads)
                .build()
                .map_err(|error| Error::Threads { threads: self.threads, detail: error.to_string() })?;
            // Another frame may have been quicker; either pool will do.
            drop(self.pool.set(pool));
        }
        let mut guard = self.memory.try_lock().ok();
        let mut own = Memory::default();
        let memory = guard.as_deref_mut().unwrap_or(&mut own);
        match self.pool.get() {
            Some(pool) => pool.install(|| frame(memory)),
            None => frame(memory),
        }
    }
}

/// Transforms, clips, sets up and bins all triangles.
fn bin_scene<'a>(scene: &'a Scene, view: &View, level: Level, memory: &mut Memory) -> Result<Binned<'a>, Error> {
    let start = Instant::now();
    let draws = draws(scene, view)?;
    let viewport = Viewport::of(view);
    let grid = TileGrid::new(viewport);
    let mut chunks = std::mem::take(&mut memory.chunks);
    let mut used = 0;
    let (mut transform_ms, mut setup_ms) = (0.0, 0.0);
    for group in groups(&draws) {
        let transform_start = Instant::now();
        let group_draws = &draws[group.draws.clone()];
        transform(group_draws, &viewport, level, &mut memory.vertices, &mut memory.vertex_starts);
        let setup_start = Instant::now();
        let spans = chunk_spans(group_draws, group.draws.start);
        if chunks.len() < used + spans.len() {
            chunks.resize_with(used + spans.len(), Chunk::default);
        }
        let (vertices, starts) = (&memory.vertices, &memory.vertex_starts);
        chunks[used..used + spans.len()].par_iter_mut().zip(&spans).with_max_len(1).for_each(|(chunk, spans)| {
            let screen_vertices = |draw: usize| &vertices[starts[draw - group.draws.start]..];
            dispatch!(level, _simd => chunk.fill(spans, &draws, screen_vertices, &viewport, &grid));
        });
        used += spans.len();
        transform_ms += (setup_start - transform_start).as_secs_f64() * 1e3;
        setup_ms += setup_start.elapsed().as_secs_f64() * 1e3;
    }
    chunks.truncate(used);
    let threads = rayon::current_num_threads();
    let device = format!("CPU, {threads} thread{}", if threads == 1 { "" } else { "s" });
    let mut stats = Stats::new(Technique::Cpu, device, view.width, view.height);
    stats.triangles = u64::from(scene.primitive_count());
    stats.dropped_triangles = chunks.iter().map(|chunk| chunk.dropped_triangles).sum();
    stats.steps =
        vec![Step { name: "transform", ms: transform_ms }, Step { name: "clip, setup and bin", ms: setup_ms }];
    Ok(Binned { draws, grid, chunks, level, stats, start })
}

/// Captures every tile and hands it to `resolve`, on all threads, the dearest tiles first. Returns the figures of all and
/// the bytes that captures held.
fn for_each_tile(
    binned: &Binned<'_>,
    memory: &mut Memory,
    resolve: impl Fn(u32, &TileCapture, &mut Layers) + Sync,
) -> (FragmentCounts, usize) {
    let costs: Vec<usize> = (0..binned.grid.tile_count() as u32)
        .map(|tile| {
            binned.chunks.iter().map(|chunk| chunk.opaque.tile(tile).len() + chunk.transparent.tile(tile).len()).sum()
        })
        .collect();
    let mut tiles: Vec<u32> = (0..binned.grid.tile_count() as u32).collect();
    tiles.sort_by_key(|&tile| std::cmp::Reverse(costs[tile as usize]));
    let spare = Mutex::new(std::mem::take(&mut memory.captures));
    let lock = || spare.lock().unwrap_or_else(PoisonError::into_inner);
    let next = std::sync::atomic::AtomicUsize::new(0);
    let results = Mutex::new((FragmentCounts::default(), 0));
    rayon::broadcast(|_| {
        let mut capture = lock().pop().unwrap_or_default();
        let mut layers = Layers::default();
        let mut counts = FragmentCounts::default();
        while let Some(&tile) = tiles.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed)) {
            counts = counts.merged(capture.capture(tile, binned.parts()));
            resolve(tile, &capture, &mut layers);
        }
        let mut results = results.lock().unwrap_or_else(PoisonError::into_inner);
        results.0 = results.0.merged(counts);
        results.1 += capture.bytes() + layers.fragments.capacity() * size_of::<pellucid_core::Fragment>();
        lock().push(capture);
    });
    memory.captures = spare.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// For each tile, its rows of pixels in the picture.
fn tile_rows<'i>(image: &'i mut Image, grid: &TileGrid) -> Vec<Vec<&'i mut [Vec4]>> {
    let width = image.width() as usize;
    let mut tiles: Vec<Vec<&mut [Vec4]>> =
        (0..grid.tile_count()).map(|_| Vec::with_capacity(TILE_PX as usize)).collect();
    for (y, row) in image.pixels_mut().chunks_mut(width).enumerate() {
        let first = y / TILE_PX as usize * grid.columns as usize;
        for (column, pixels) in row.chunks_mut(TILE_PX as usize).enumerate() {
            tiles[first + column].push(pixels);
        }
    }
    tiles
}

impl Binned<'_> {
    fn parts(&self) -> FrameParts<'_> {
        FrameParts { chunks: &self.chunks, draws: &self.draws, grid: &self.grid, level: self.level }
    }

    /// Completes the figures and gives the memory back.
    fn finish(&mut self, counts: FragmentCounts, capture_bytes: usize, memory: &mut Memory, scene: &Scene) -> Stats {
        debug_assert_eq!(self.stats.triangles, u64::from(scene.primitive_count()));
        let mut stats = self.stats.clone();
        let total_ms = self.start.elapsed().as_secs_f64() * 1e3;
        let before: f64 = stats.steps.iter().map(|step| step.ms).sum();
        stats.steps.push(Step { name: "raster, sort, shade and resolve", ms: total_ms - before });
        stats.total_ms = total_ms;
        stats.fragments = counts.fragments;
        stats.max_depth_complexity = counts.greatest;
        stats.mean_depth_complexity = counts.fragments as f64 / counts.covered_pixels.max(1) as f64;
        let chunk_bytes: usize = self.chunks.iter().map(Chunk::bytes).sum();
        let vertex_bytes = memory.vertices.capacity() * size_of::<ScreenVertex>();
        stats.peak_bytes = (chunk_bytes + vertex_bytes + capture_bytes) as u64;
        memory.chunks = std::mem::take(&mut self.chunks);
        stats
    }
}
