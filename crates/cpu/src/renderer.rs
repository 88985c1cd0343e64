//! One frame, top to bottom.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use fearless_simd::{Level, dispatch};
use glam::Vec4;
use pellucid_core::pixel_grid::Viewport;
use pellucid_core::primitive::{Draw, draws};
use pellucid_core::resolve::{PixelResolver, finish};
use pellucid_core::stats::Step;
use pellucid_core::{Error, Fragment, Frame, Image, Layers, Resolve, Scene, Stats, Technique, View};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::bin::{TILE_PX, TileGrid};
use crate::setup::{Chunk, SetupScratch, chunk_spans, chunk_triangles};
use crate::tile::{FragmentCounts, FrameParts, TILE_SAMPLES, TileCapture};
use crate::transform::{Vertices, groups};

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
    vertices: Vertices,
    scratches: Vec<SetupScratch>,
    chunks: Vec<Chunk>,
    workers: Vec<Worker>,
}

/// What one thread needs to turn one tile after another into pixels.
#[derive(Debug, Default)]
struct Worker {
    capture: TileCapture,
    buffers: TileBuffers,
}

/// A tile's results.
#[derive(Debug)]
struct TileBuffers {
    layers: Layers,
    /// Row by row of the tile's samples.
    pixels: Box<[Vec4; TILE_SAMPLES]>,
}

impl Default for TileBuffers {
    fn default() -> Self {
        Self { layers: Layers::default(), pixels: Box::new([Vec4::ZERO; TILE_SAMPLES]) }
    }
}

/// A scene's triangles in the bins of its tiles.
struct Binned<'a> {
    draws: Vec<Draw<'a>>,
    palette: Vec<Vec4>,
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
            let mut image = filled(view);
            let bands: Vec<Mutex<&mut [Vec4]>> =
                image.pixels_mut().chunks_mut(TILE_PX as usize * view.width as usize).map(Mutex::new).collect();
            let resolver = PixelResolver::new(resolve, view);
            let frame = binned.parts();
            let (counts, bytes) = for_each_tile(&binned, memory, |number, capture, buffers| {
                if resolve == Resolve::Blend {
                    if capture.fragments.len() == 0 && !capture.has_opaque {
                        return;
                    }
                    capture.blend(frame, view.background, &mut buffers.pixels);
                } else {
                    capture.layers(frame, &mut buffers.layers);
                    let layers = &buffers.layers;
                    for (sample, x, y) in capture.pixels() {
                        let (x, y) = ((x - capture.rect.left) as u32, (y - capture.rect.top) as u32);
                        buffers.pixels[sample] = resolver.pixel(layers.pixel(x, y), layers.opaque(x, y));
                    }
                }
                let left = capture.rect.left as usize;
                let width = (capture.rect.right - capture.rect.left + 1) as usize;
                let mut band = lock(&bands[(number / binned.grid.columns) as usize]);
                for (to, from) in band.chunks_mut(view.width as usize).zip(buffers.pixels.chunks(TILE_PX as usize)) {
                    to[left..left + width].copy_from_slice(&from[..width]);
                }
            });
            drop(bands);
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
            let (counts, bytes) = for_each_tile(&binned, memory, |_, capture, buffers| {
                capture.layers(frame, &mut buffers.layers);
                visit(&buffers.layers);
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
    let scratches = Mutex::new(std::mem::take(&mut memory.scratches));
    let chunk_triangles = chunk_triangles(scene.primitive_count() as usize, rayon::current_num_threads());
    let mut used = 0;
    let (mut transform_ms, mut setup_ms) = (0.0, 0.0);
    for group in groups(&draws) {
        let transform_start = Instant::now();
        let group_draws = &draws[group.draws.clone()];
        memory.vertices.transform(group_draws, &viewport, level);
        let setup_start = Instant::now();
        let spans = chunk_spans(group_draws, group.draws.start, chunk_triangles);
        if chunks.len() < used + spans.len() {
            chunks.resize_with(used + spans.len(), Chunk::default);
        }
        let vertices = &memory.vertices;
        chunks[used..used + spans.len()].par_iter_mut().zip(&spans).with_max_len(1).for_each(|(chunk, spans)| {
            let draw_vertices = |draw: usize| vertices.draw(draw - group.draws.start);
            let mut scratch = lock(&scratches).pop().unwrap_or_default();
            dispatch!(level, simd => chunk.fill(simd, spans, &draws, draw_vertices, &grid, &mut scratch));
            lock(&scratches).push(scratch);
        });
        used += spans.len();
        transform_ms += (setup_start - transform_start).as_secs_f64() * 1e3;
        setup_ms += setup_start.elapsed().as_secs_f64() * 1e3;
    }
    chunks.truncate(used);
    memory.scratches = scratches.into_inner().unwrap_or_else(PoisonError::into_inner);
    let threads = rayon::current_num_threads();
    let device = format!("CPU, {threads} thread{}", if threads == 1 { "" } else { "s" });
    let mut stats = Stats::new(Technique::Cpu, device, view.width, view.height);
    stats.triangles = u64::from(scene.primitive_count());
    stats.dropped_triangles = chunks.iter().map(|chunk| chunk.dropped_triangles).sum();
    stats.steps =
        vec![Step { name: "transform", ms: transform_ms }, Step { name: "clip, setup and bin", ms: setup_ms }];
    let palette = std::iter::once(Vec4::ZERO).chain(draws.iter().map(|draw| draw.base_color)).collect();
    Ok(Binned { draws, palette, grid, chunks, level, stats, start })
}

/// Captures every tile and hands it to `resolve`, on all threads, the dearest tiles first. Returns the figures of all and
/// the bytes that captures held.
fn for_each_tile(
    binned: &Binned<'_>,
    memory: &mut Memory,
    resolve: impl Fn(u32, &TileCapture, &mut TileBuffers) + Sync,
) -> (FragmentCounts, usize) {
    let mut costs = vec![0; binned.grid.tile_count()];
    for chunk in &binned.chunks {
        chunk.opaque.add_counts(&mut costs);
        chunk.transparent.add_counts(&mut costs);
    }
    let mut tiles: Vec<u32> = (0..binned.grid.tile_count() as u32).collect();
    tiles.sort_unstable_by_key(|&tile| std::cmp::Reverse(costs[tile as usize]));
    let spare = Mutex::new(std::mem::take(&mut memory.workers));
    let next = std::sync::atomic::AtomicUsize::new(0);
    let results = Mutex::new((FragmentCounts::default(), 0));
    rayon::broadcast(|_| {
        let mut worker = lock(&spare).pop().unwrap_or_default();
        let mut counts = FragmentCounts::default();
        while let Some(&tile) = tiles.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed)) {
            counts = counts.merged(worker.capture.capture(tile, binned.parts()));
            resolve(tile, &worker.capture, &mut worker.buffers);
        }
        let mut results = lock(&results);
        results.0 = results.0.merged(counts);
        results.1 += worker.capture.bytes() + worker.buffers.layers.fragments.capacity() * size_of::<Fragment>();
        lock(&spare).push(worker);
    });
    memory.workers = spare.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// What a mutex guards. A panic elsewhere ends the frame anyway.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A picture of the background, made by all threads.
fn filled(view: &View) -> Image {
    let background = view.background;
    let pixels = (0..view.width as usize * view.height as usize).into_par_iter().with_min_len(1 << 15);
    Image::from_pixels(view.width, view.height, pixels.map(|_| background).collect())
}

impl Binned<'_> {
    fn parts(&self) -> FrameParts<'_> {
        FrameParts {
            chunks: &self.chunks,
            draws: &self.draws,
            palette: &self.palette,
            grid: &self.grid,
            level: self.level,
        }
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
        let scratch_bytes: usize = memory.scratches.iter().map(SetupScratch::bytes).sum();
        stats.peak_bytes = (chunk_bytes + scratch_bytes + memory.vertices.bytes() + capture_bytes) as u64;
        memory.chunks = std::mem::take(&mut self.chunks);
        stats
    }
}
