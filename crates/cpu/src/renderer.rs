//! One frame, top to bottom.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use fearless_simd::{Level, dispatch};
use glam::Vec4;
use pellucid_core::pixel_grid::Viewport;
use pellucid_core::primitive::{Draw, draws};
use pellucid_core::resolve::{PixelResolver, finish};
use pellucid_core::shading::GREATEST_COLOR;
use pellucid_core::stats::Step;
use pellucid_core::{Error, Fragment, Frame, Layers, Resolve, Scene, Stats, Technique, View};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::bin::{PixelRect, TILE_PX, TileGrid};
use crate::canvas::Canvas;
use crate::setup::{Chunk, ChunkSizes, SetupScratch, chunk_spans};
use crate::tile::{FragmentCounts, FrameParts, TILE_SAMPLES, TileCapture};
use crate::window::{DEFAULT_BUDGET_BYTES, Windows};

/// Renders on all cores. Keep it from frame to frame: it holds on to its threads and memory.
#[derive(Debug)]
pub struct CpuRenderer {
    threads: usize,
    level: Level,
    budget_bytes: usize,
    pool: OnceLock<ThreadPool>,
    memory: Mutex<Memory>,
}

/// What is kept from frame to frame.
#[derive(Debug, Default)]
struct Memory {
    scratches: Vec<SetupScratch>,
    chunks: Vec<Chunk>,
    workers: Vec<Worker>,
    last: LastFrame,
}

/// How the last frame was cut.
#[derive(Debug, Default)]
struct LastFrame {
    viewport: Option<Viewport>,
    windows: Vec<PixelRect>,
    /// What all its windows held together.
    bytes: usize,
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

/// A frame that is being rendered.
struct Run<'a> {
    draws: Vec<Draw<'a>>,
    palette: Vec<Vec4>,
    viewport: Viewport,
    level: Level,
    budget_bytes: usize,
    triangles: u64,
    /// Wall-clock milliseconds of each of [`STEPS`].
    steps_ms: [f64; STEPS.len()],
    stats: Stats,
    start: Instant,
}

/// Chunks of triangles are taken in so many turns, in each of them one out of so many.
const CHUNK_TURNS: usize = 4;

/// The steps of a frame. Those of tiles run side by side: what they took together is shared out. A picture that is not
/// filled with the background yet is filled during the first. Of tiles that have one colour nothing is left to do in
/// "raster"; if a pixel has too many fragments for that, it is found out in "order".
const STEPS: [&str; 4] = ["transform, setup and bin", "raster", "order", "shade and resolve"];

impl CpuRenderer {
    /// A renderer on this many threads; 0: one for each core. They are started with the first frame.
    pub fn new(threads: usize) -> Self {
        Self {
            threads,
            level: Level::new(),
            budget_bytes: DEFAULT_BUDGET_BYTES,
            pool: OnceLock::new(),
            memory: Mutex::default(),
        }
    }

    /// The same renderer at another SIMD level than the best of this machine, see [`simd::levels`](crate::simd::levels).
    /// The picture is the same at any.
    #[must_use]
    pub fn level(mut self, level: Level) -> Self {
        self.level = level;
        self
    }

    /// The same renderer with a budget: bytes that it may hold between setting triangles up and capturing tiles. The
    /// picture is cut into as many windows as that takes; it is the same at any budget.
    #[must_use]
    pub fn budget_bytes(mut self, budget_bytes: u64) -> Self {
        self.budget_bytes = usize::try_from(budget_bytes).unwrap_or(usize::MAX);
        self
    }

    /// Renders a view.
    ///
    /// # Errors
    /// If the view is invalid or the threads cannot be started.
    pub fn render(&self, scene: &Scene, view: &View, resolve: Resolve) -> Result<Frame, Error> {
        let mut canvas = Canvas::new();
        let stats = self.render_into(scene, view, resolve, &mut canvas)?;
        Ok(Frame { image: canvas.into_image(), stats })
    }

    /// Renders a view into a canvas: the picture is the one that [`Self::render`] makes, but what was the background in the
    /// canvas before, and is it again, is not written.
    ///
    /// # Errors
    /// As [`Self::render`]; the canvas then has the picture it had.
    pub fn render_into(
        &self,
        scene: &Scene,
        view: &View,
        resolve: Resolve,
        canvas: &mut Canvas,
    ) -> Result<Stats, Error> {
        // -0 behind something is 0: so it is everywhere.
        let view = &View { background: view.background + Vec4::ZERO, ..*view };
        self.run(|memory| {
            let mut run = Run::new(scene, view, self.level, self.budget_bytes)?;
            let begun = if canvas.suits(view) {
                run.begin(memory)
            } else {
                // Setting triangles up is bound by the processor, filling the picture by memory: side by side they take less.
                rayon::join(|| run.begin(memory), || canvas.fill(view)).0
            };
            let rows = canvas.rows(view);
            let resolver = PixelResolver::new(resolve, view);
            run.for_each_tile(memory, begun, resolve == Resolve::Blend, |frame, capture, buffers| {
                let rect = capture.rect;
                let row = &rows[rect.top as usize / TILE_PX as usize];
                if resolve == Resolve::Blend {
                    if capture.is_empty() {
                        return lock(row).leave(rect);
                    }
                    capture.blend(frame, view.background, &mut buffers.pixels);
                } else {
                    capture.layers(frame, &mut buffers.layers);
                    let layers = &buffers.layers;
                    for (sample, x, y) in capture.pixels() {
                        let (x, y) = ((x - rect.left) as u32, (y - rect.top) as u32);
                        buffers.pixels[sample] = resolver.pixel(layers.pixel(x, y), layers.opaque(x, y));
                    }
                }
                lock(row).paint(rect, &buffers.pixels);
            });
            drop(rows);
            canvas.painted(view);
            let stats = run.finish();
            finish(resolve, canvas.image_mut(), &stats);
            Ok(stats)
        })
    }

    /// Hands out the ordered layers of a view, a part of the picture at a time, for a resolve of one's own. Parts do not
    /// overlap and cover the whole picture; they come from several threads in any order.
    ///
    /// # Errors
    /// If the view is invalid or the threads cannot be started.
    pub fn layers(&self, scene: &Scene, view: &View, visit: impl Fn(&Layers) + Sync) -> Result<Stats, Error> {
        self.run(|memory| {
            let mut run = Run::new(scene, view, self.level, self.budget_bytes)?;
            let begun = run.begin(memory);
            run.for_each_tile(memory, begun, false, |frame, capture, buffers| {
                capture.layers(frame, &mut buffers.layers);
                visit(&buffers.layers);
            });
            Ok(run.finish())
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

/// Nothing that is drawn has more of a channel than this, alpha included: textures and light take away, but for what
/// rounding adds to the light of very short normals, for which there is room.
fn greatest_color(draws: &[Draw<'_>]) -> Vec4 {
    draws.iter().fold(Vec4::W, |greatest, draw| {
        let has_vertex_colors = draw.mesh.colors().is_some();
        greatest.max(if has_vertex_colors { GREATEST_COLOR } else { draw.material.base_color }.with_w(1.0))
    })
}

/// A window with its triangles set up.
struct WindowSetUp {
    grid: TileGrid,
    chunks: Vec<Chunk>,
    /// How many triangles were dropped, or which part of all there is in as much as the budget allows.
    dropped_triangles: Result<u64, f64>,
}

/// The windows of a frame, the first of which is set up.
struct Begun {
    windows: Windows,
    first: Option<WindowSetUp>,
}

impl<'a> Run<'a> {
    fn new(scene: &'a Scene, view: &View, level: Level, budget_bytes: usize) -> Result<Self, Error> {
        let start = Instant::now();
        let draws = draws(scene, view)?;
        let threads = rayon::current_num_threads();
        let device = format!("CPU, {threads} thread{}", if threads == 1 { "" } else { "s" });
        let mut stats = Stats::new(Technique::Cpu, device, view.width, view.height);
        stats.triangles = u64::from(scene.primitive_count());
        stats.windows = 0;
        Ok(Self {
            palette: std::iter::once(Vec4::ZERO).chain(draws.iter().map(|draw| draw.base_color)).collect(),
            draws,
            viewport: Viewport::of(view),
            level,
            budget_bytes,
            triangles: stats.triangles,
            steps_ms: [0.0; STEPS.len()],
            stats,
            start,
        })
    }

    /// Sets up the first window.
    fn begin(&mut self, memory: &mut Memory) -> Begun {
        let mut windows = memory.windows(&self.viewport, self.budget_bytes);
        let first = self.next_window(&mut windows, memory);
        Begun { windows, first }
    }

    fn next_window(&mut self, windows: &mut Windows, memory: &mut Memory) -> Option<WindowSetUp> {
        let window = windows.next()?;
        let grid = TileGrid::new(self.viewport, window);
        let mut chunks = std::mem::take(&mut memory.chunks);
        let dropped_triangles = self.set_up(&grid, memory, &mut chunks, grid.tile_count() == 1);
        Some(WindowSetUp { grid, chunks, dropped_triangles })
    }

    /// Captures every tile and hands it to `resolve`, on all threads, window by window. `blends`: it does no more than to
    /// blend fragments.
    fn for_each_tile(
        &mut self,
        memory: &mut Memory,
        begun: Begun,
        blends: bool,
        resolve: impl Fn(FrameParts<'_>, &TileCapture, &mut TileBuffers) + Sync,
    ) {
        let mut counts = FragmentCounts::default();
        let mut last = LastFrame { viewport: Some(self.viewport), ..LastFrame::default() };
        let Begun { mut windows, first: mut next } = begun;
        while let Some(WindowSetUp { grid, chunks, dropped_triangles }) = next {
            match dropped_triangles {
                Ok(dropped_triangles) => {
                    self.stats.dropped_triangles = dropped_triangles;
                    counts = counts.merged(self.capture_tiles(&grid, memory, &chunks, blends, &resolve));
                    last.bytes += chunks.iter().map(Chunk::bytes).sum::<usize>();
                    last.windows.push(grid.window);
                }
                Err(part) => {
                    let mut bytes = vec![0; grid.tile_count()];
                    for chunk in &chunks {
                        chunk.opaque.add_bytes(&mut bytes);
                        chunk.transparent.add_bytes(&mut bytes);
                    }
                    windows.cut(&grid, &bytes, part, self.budget_bytes);
                }
            }
            // Chunks that held much of one window would add up with those that hold much of another.
            if windows.is_empty() && last.windows.len() == 1 {
                memory.chunks = chunks;
            } else {
                drop(chunks);
            }
            next = self.next_window(&mut windows, memory);
        }
        self.stats.windows = last.windows.len() as u32;
        self.stats.fragments = counts.fragments;
        self.stats.max_depth_complexity = counts.greatest;
        self.stats.mean_depth_complexity = counts.fragments as f64 / counts.covered_pixels.max(1) as f64;
        memory.last = last;
    }

    /// Transforms, clips, sets up and bins all triangles, as far as they reach a window. Returns how many had to be dropped,
    /// or, if chunks hold more than the budget, which part of the triangles there is.
    fn set_up(
        &mut self,
        grid: &TileGrid,
        memory: &mut Memory,
        chunks: &mut Vec<Chunk>,
        is_single_tile: bool,
    ) -> Result<u64, f64> {
        let level = self.level;
        let draws = &*self.draws;
        let scratches = Mutex::new(std::mem::take(&mut memory.scratches));
        let (triangles, threads) = (self.triangles as usize, rayon::current_num_threads());
        let sizes = ChunkSizes::new(triangles, threads, grid.tile_count(), self.budget_bytes);
        let (budget_bytes, held_bytes) =
            (if is_single_tile { usize::MAX } else { self.budget_bytes }, AtomicUsize::new(0));
        let triangles_done = AtomicUsize::new(0);
        let start = Instant::now();
        // Meshes are cut into meshlets the first time.
        draws.par_iter().for_each(|draw| {
            draw.mesh.meshlets();
        });
        let spans = chunk_spans(draws, sizes);
        chunks.resize_with(spans.len(), Chunk::default);
        // From all over the scene, so that what exceeds the budget tells what the rest is like.
        let mut numbered: Vec<_> = chunks.iter_mut().zip(&spans).enumerate().collect();
        numbered.sort_by_key(|(number, _)| number % CHUNK_TURNS);
        let next = Mutex::new(numbered.into_iter());
        let take = || lock(&next).next();
        rayon::broadcast(|_| {
            let mut scratch = None;
            while let Some((_, (chunk, spans))) = take() {
                if held_bytes.load(Ordering::Relaxed) > budget_bytes {
                    *chunk = Chunk::default();
                    continue;
                }
                let scratch = scratch.get_or_insert_with(|| lock(&scratches).pop().unwrap_or_default());
                dispatch!(level, simd => chunk.fill(simd, spans, draws, grid, scratch));
                held_bytes.fetch_add(chunk.bytes(), Ordering::Relaxed);
                triangles_done.fetch_add(spans.iter().map(|span| span.triangle_count).sum(), Ordering::Relaxed);
            }
            lock(&scratches).extend(scratch);
        });
        self.steps_ms[0] += start.elapsed().as_secs_f64() * 1e3;
        memory.scratches = scratches.into_inner().unwrap_or_else(PoisonError::into_inner);
        let bytes = held_bytes.into_inner();
        let scratch_bytes: usize = memory.scratches.iter().map(SetupScratch::bytes).sum();
        self.note_bytes(bytes + scratch_bytes);
        if bytes > budget_bytes {
            return Err(triangles_done.into_inner() as f64 / self.triangles as f64);
        }
        Ok(chunks.iter().map(|chunk| chunk.dropped_triangles).sum())
    }

    /// Captures the tiles of a window and hands them to `resolve`, the dearest first. Returns the figures of all.
    fn capture_tiles(
        &mut self,
        grid: &TileGrid,
        memory: &mut Memory,
        chunks: &[Chunk],
        blends: bool,
        resolve: &(impl Fn(FrameParts<'_>, &TileCapture, &mut TileBuffers) + Sync),
    ) -> FragmentCounts {
        let start = Instant::now();
        let frame = FrameParts {
            chunks,
            draws: &self.draws,
            palette: &self.palette,
            greatest_color: greatest_color(&self.draws),
            grid,
            level: self.level,
        };
        let (mut records, mut small) = (vec![0; grid.tile_count()], vec![0; grid.tile_count()]);
        for bins in chunks.iter().flat_map(|chunk| [&chunk.opaque, &chunk.transparent]) {
            bins.records.add_counts(&mut records);
            bins.small.add_counts(&mut small);
        }
        let mut tiles: Vec<u32> = (0..grid.tile_count() as u32).collect();
        // Those that cost about the same stay next to each other, as what chunks have for them is.
        tiles.sort_by_key(|&tile| std::cmp::Reverse((records[tile as usize] + small[tile as usize]).checked_ilog2()));
        let spare = Mutex::new(std::mem::take(&mut memory.workers));
        let next = AtomicUsize::new(0);
        let results = Mutex::new((FragmentCounts::default(), [Duration::ZERO; 3], 0));
        rayon::broadcast(|_| {
            let mut worker = lock(&spare).pop().unwrap_or_default();
            let mut counts = FragmentCounts::default();
            let mut times = [Duration::ZERO; 3];
            while let Some(&tile) = tiles.get(next.fetch_add(1, Ordering::Relaxed)) {
                let (records, small) = (records[tile as usize], small[tile as usize]);
                if records == 0 && small == 0 {
                    worker.capture.capture_nothing(tile, frame);
                    resolve(frame, &worker.capture, &mut worker.buffers);
                    continue;
                }
                let mut started = Instant::now();
                let lit_source = if blends && records == 0 { frame.only_source(tile) } else { None };
                let rows = frame.band_rows(tile, records, small, lit_source);
                for first in (0..grid.tile_rows(tile)).step_by(rows as usize) {
                    worker.capture.capture(tile, [first, rows], lit_source, frame);
                    let captured = Instant::now();
                    counts = counts.merged(worker.capture.sort(frame));
                    let ordered = Instant::now();
                    resolve(frame, &worker.capture, &mut worker.buffers);
                    let resolved = Instant::now();
                    let new = [captured - started, ordered - captured, resolved - ordered];
                    for (time, new) in times.iter_mut().zip(new) {
                        *time += new;
                    }
                    started = resolved;
                }
            }
            let mut results = lock(&results);
            results.0 = results.0.merged(counts);
            for (sum, time) in results.1.iter_mut().zip(times) {
                *sum += time;
            }
            results.2 += worker.capture.bytes() + worker.buffers.layers.fragments.capacity() * size_of::<Fragment>();
            lock(&spare).push(worker);
        });
        memory.workers = spare.into_inner().unwrap_or_else(PoisonError::into_inner);
        let (counts, times, capture_bytes) = results.into_inner().unwrap_or_else(PoisonError::into_inner);
        let (elapsed, sum) = (start.elapsed().as_secs_f64() * 1e3, times.iter().sum::<Duration>().as_secs_f64());
        for (step_ms, time) in self.steps_ms[1..].iter_mut().zip(times) {
            *step_ms += elapsed * time.as_secs_f64() / sum.max(f64::MIN_POSITIVE);
        }
        let chunk_bytes: usize = chunks.iter().map(Chunk::bytes).sum();
        self.note_bytes(chunk_bytes + capture_bytes);
        counts
    }

    /// Keeps the most bytes held at once.
    fn note_bytes(&mut self, bytes: usize) {
        self.stats.peak_bytes = self.stats.peak_bytes.max(bytes as u64);
    }

    /// The figures of the frame.
    fn finish(mut self) -> Stats {
        self.stats.total_ms = self.start.elapsed().as_secs_f64() * 1e3;
        self.stats.steps = STEPS.iter().zip(self.steps_ms).map(|(name, ms)| Step { name, ms }).collect();
        self.stats
    }
}

impl Memory {
    /// The windows of the last frame, if they are likely to fit this one better than the whole picture.
    fn windows(&mut self, viewport: &Viewport, budget_bytes: usize) -> Windows {
        let last = std::mem::take(&mut self.last);
        let is_like_last = last.viewport == Some(*viewport) && last.bytes > budget_bytes;
        Windows::new(if is_like_last { last.windows } else { vec![PixelRect::all(viewport)] })
    }
}

/// What a mutex guards. A panic elsewhere ends the frame anyway.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
