//! How far the CPU renderer is from what this machine can do: `cargo bench -p pellucid --bench roofline`.
//!
//! Micro-benchmarks tell what a byte, a fragment, a comparison and a layer cost at least: their loops do what no exact
//! renderer can leave out, on data in the cache, without a decision. Then each step of whole frames stands beside its floor,
//! and last come the SIMD levels, in turns: with set-up, as small triangles become fragments there, and from raster alone.

mod common;
#[path = "common/median.rs"]
mod median;

use std::hint::black_box;
use std::time::Instant;

use common::{SCENES, case};
use fearless_simd::{Level, Simd, SimdBase, SimdNarrow, SimdSplit, dispatch, f32x8, f64x8, u32x8};
use glam::Vec4;
use median::median;
use pellucid::{Mesh, Resolve, Scene, Stats, View};
use pellucid_cpu::{Canvas, CpuRenderer, simd};

/// What a machine can do at best, on all its cores together.
struct Peaks {
    bytes_per_ms: f64,
    covered_per_ms: f64,
    compared_per_ms: f64,
    blended_per_ms: f64,
}

fn main() {
    let planes = [
        case("planes_16", "", "@planes:n=16"),
        case("planes_256", "", "@planes:n=256"),
        case("planes_1024", "", "@planes:n=1024"),
    ];
    let cases = common::wanted(SCENES.into_iter().chain(planes));
    let peaks = peaks();
    println!("\nms of each step of a frame at 1280 x 720 / its floor\n");
    println!(
        "{:<18} {:>10} {:>12} {:>9}  {:<17} {:<17} {:<17} {:<17}",
        "scene", "triangles", "fragments", "ms", "set-up, bin", "raster", "order", "shade, resolve"
    );
    for case in &cases {
        let (scene, view) = case.load();
        let stats = median_frame(&CpuRenderer::new(0), &scene, &view, 9);
        let floors = peaks.floors(&scene, &stats);
        let steps: Vec<String> = stats
            .steps
            .iter()
            .zip(floors)
            .map(|(step, floor)| {
                format!("{:<17}", format!("{:.2} / {:.2} {:.1}x", step.ms, floor, step.ms / floor.max(1e-3)))
            })
            .collect();
        println!(
            "{:<18} {:>10} {:>12} {:>9.2}  {}",
            case.name,
            stats.triangles,
            stats.fragments,
            stats.total_ms,
            steps.join(" ")
        );
    }
    let all_medians: Vec<_> = cases
        .iter()
        .map(|case| {
            let (scene, view) = case.load();
            (case.name, medians_by_level(&scene, &view, 9))
        })
        .collect();
    for (count, steps) in ["set-up to resolve", "raster to resolve"].into_iter().enumerate() {
        println!("\nms from {steps} by SIMD level, in turns, and times faster than scalar\n");
        let mut gains = vec![0.0; simd::levels().len()];
        for (name, medians) in &all_medians {
            let scalar = medians[0].1[count];
            let columns: Vec<String> = medians
                .iter()
                .zip(&mut gains)
                .map(|((name, ms), gain)| {
                    *gain += (scalar / ms[count]).ln();
                    format!("{name} {:.1} ({:.2}x)", ms[count], scalar / ms[count])
                })
                .collect();
            println!("{name:<18} {}", columns.join("  "));
        }
        let columns: Vec<String> = simd::levels()
            .iter()
            .zip(gains)
            .map(|((name, _), gain)| format!("{name} {:.2}x", (gain / cases.len() as f64).exp()))
            .collect();
        println!("{:<18} {}", "geometric mean", columns.join("  "));
    }
}

/// The medians of so many frames at each SIMD level, after one that allocates: from set-up to resolve, and from raster.
fn medians_by_level(scene: &Scene, view: &View, frames: usize) -> Vec<(&'static str, [f64; 2])> {
    let renderers = simd::levels().into_iter().map(|(name, level)| (name, CpuRenderer::new(0).level(level)));
    let mut levels: Vec<_> =
        renderers.map(|(name, renderer)| (name, renderer, [const { Vec::<f64>::new() }; 2])).collect();
    for round in 0..=frames {
        for (_, renderer, all_ms) in &mut levels {
            if let Ok(frame) = renderer.render(scene, view, Resolve::Blend)
                && round > 0
            {
                for (all_ms, first) in all_ms.iter_mut().zip(0..) {
                    all_ms.push(frame.stats.steps[first..].iter().map(|step| step.ms).sum());
                }
            }
        }
    }
    levels.into_iter().map(|(name, _, all_ms)| (name, all_ms.map(median))).collect()
}

impl Peaks {
    /// Least milliseconds of each step. Set-up reads positions and normals, and six bytes a triangle; what is captured
    /// has to be covered; each pixel's fragments take as many comparisons as the best sort of their mean number,
    /// eight at a time; each is blended, and pixels are written.
    fn floors(&self, scene: &Scene, stats: &Stats) -> [f64; 4] {
        let meshes = scene.instances().iter().map(|instance| scene.mesh(instance.mesh));
        let vertex_bytes = |mesh: &Mesh| mesh.positions().len() * if mesh.normals().is_some() { 24 } else { 12 };
        let vertex_bytes: usize = meshes.map(vertex_bytes).sum();
        let (triangles, fragments) = (stats.triangles as f64, stats.fragments as f64);
        let comparisons = fragments * stats.mean_depth_complexity.max(1.0).log2();
        let pixels = f64::from(stats.width) * f64::from(stats.height);
        [
            (vertex_bytes as f64 + triangles * 6.0) / self.bytes_per_ms,
            fragments / self.covered_per_ms,
            comparisons / self.compared_per_ms,
            fragments / self.blended_per_ms + pixels * 16.0 / self.bytes_per_ms,
        ]
    }
}

/// Measures and prints what this machine can do.
fn peaks() -> Peaks {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let level = Level::new();
    let bytes_per_ms = per_ms(threads, || {
        let (from, mut to) = (vec![1u64; 1 << 24], vec![0u64; 1 << 24]);
        move || {
            to.copy_from_slice(black_box(&from));
            black_box(&mut to);
            (2 * to.len() * 8) as f64
        }
    });
    let covered_per_ms = per_ms(threads, || {
        let mut room = Room::default();
        move || dispatch!(level, simd => cover(simd, &mut room))
    });
    let compared_per_ms = per_ms(threads, || {
        let mut rows: Vec<[f64; 8]> = (0..256).map(|i| [f64::from(i * 7919 % 256); 8]).collect();
        move || dispatch!(level, simd => compare(simd, &mut rows))
    });
    let blended_per_ms = per_ms(threads, || {
        let room = Room::default();
        move || dispatch!(level, simd => blend(simd, &room))
    });
    println!("{threads} threads");
    println!("memory, read and written: {:.1} GB/s", bytes_per_ms / 1e6);
    println!("coverage: {:.2} G fragments/s, depth and all", covered_per_ms / 1e6);
    println!("sort:     {:.2} G keys compared and exchanged/s", compared_per_ms / 1e6);
    println!("blend:    {:.2} G layers/s", blended_per_ms / 1e6);
    Peaks { bytes_per_ms, covered_per_ms, compared_per_ms, blended_per_ms }
}

/// What all threads do together in a millisecond: each calls what `prepare` returns, which says how much it did, for a
/// quarter of a second.
fn per_ms<F: FnMut() -> f64>(threads: usize, prepare: impl Fn() -> F + Sync) -> f64 {
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|_| {
                scope.spawn(|| {
                    let mut work = prepare();
                    work();
                    let start = Instant::now();
                    let mut done = 0.0;
                    while start.elapsed().as_millis() < 250 {
                        done += work();
                    }
                    done / (start.elapsed().as_secs_f64() * 1e3)
                })
            })
            .collect();
        workers.into_iter().map(|worker| worker.join().unwrap_or(0.0)).sum()
    })
}

/// Fragments as the renderer has them.
struct Room {
    samples: Vec<u32>,
    depths: Vec<f32>,
    lights: Vec<f32>,
    sources: Vec<u32>,
    primitives: Vec<u32>,
}

const ROOM: usize = 1 << 13;

impl Default for Room {
    fn default() -> Self {
        Self {
            samples: vec![0; ROOM],
            depths: vec![0.0; ROOM],
            lights: vec![0.5; ROOM],
            sources: (0..ROOM as u32).map(|i| i % 16).collect(),
            primitives: vec![0; ROOM],
        }
    }
}

#[inline(always)]
fn cover<S: Simd>(simd: S, room: &mut Room) -> f64 {
    let ramp = f64x8::load_array(simd, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    let (dx, dy) = (black_box(1e-6), black_box(1e-7));
    for i in (0..ROOM).step_by(8) {
        let (x, y) = ((i % 32) as f64, (i / 32) as f64);
        let (low, high) = ((ramp + x) * dx + y * dy).split();
        let depth: f32x8<S> = low.narrow(high).max(0.0).min(1.0) + 0.0;
        u32x8::splat(simd, i as u32).store_slice(&mut room.samples[i..i + 8]);
        depth.store_slice(&mut room.depths[i..i + 8]);
        f32x8::splat(simd, 1.0).store_slice(&mut room.lights[i..i + 8]);
        u32x8::splat(simd, 1).store_slice(&mut room.sources[i..i + 8]);
        u32x8::splat(simd, 2).store_slice(&mut room.primitives[i..i + 8]);
    }
    black_box(room);
    ROOM as f64
}

/// Every key of neighbouring rows is compared and exchanged, three times while it is in a register.
#[inline(always)]
fn compare<S: Simd>(simd: S, rows: &mut [[f64; 8]]) -> f64 {
    for block in rows.as_chunks_mut::<8>().0 {
        let mut keys = [f64x8::splat(simd, 0.0); 8];
        for i in 0..8 {
            keys[i] = f64x8::load_array_ref(simd, &block[i]);
        }
        macro_rules! exchange {
            ($($near:literal $far:literal),*) => {
                $(
                    let (a, b) = (keys[$near], keys[$far]);
                    (keys[$near], keys[$far]) = (a.max(b), a.min(b));
                )*
            };
        }
        exchange!(0 4, 1 5, 2 6, 3 7, 0 2, 1 3, 4 6, 5 7, 0 1, 2 3, 4 5, 6 7);
        for i in 0..8 {
            keys[i].store_array(&mut block[i]);
        }
    }
    black_box(&mut *rows);
    (rows.len() * 8 * 3) as f64
}

#[inline(always)]
fn blend<S: Simd>(simd: S, room: &Room) -> f64 {
    // So little that no transmittance falls to where arithmetic is slow.
    let palette = black_box([Vec4::new(1e-5, 2e-5, 3e-5, 1e-4); 16]);
    let mut sums = [f32x8::splat(simd, 0.0); 3];
    let mut transmittance = f32x8::splat(simd, 1.0);
    for (sources, lights) in room.sources.as_chunks::<8>().0.iter().zip(room.lights.as_chunks::<8>().0) {
        let mut layer = [[0.0; 8]; 4];
        for lane in 0..8 {
            let light = lights[lane];
            let color = palette[sources[lane] as usize % 16] * Vec4::new(light, light, light, 1.0);
            for (channel, value) in layer.iter_mut().zip(color.to_array()) {
                channel[lane] = value;
            }
        }
        for i in 0..3 {
            sums[i] += f32x8::load_array(simd, layer[i]) * transmittance;
        }
        transmittance *= f32x8::splat(simd, 1.0) - f32x8::load_array(simd, layer[3]);
    }
    let sums: [[f32; 8]; 3] = [sums[0].into(), sums[1].into(), sums[2].into()];
    black_box(sums);
    ROOM as f64
}

/// The figures of the median of so many frames, after one that allocates.
fn median_frame(renderer: &CpuRenderer, scene: &Scene, view: &View, frames: usize) -> Stats {
    let mut canvas = Canvas::new();
    let mut all: Vec<Stats> = (0..=frames)
        .filter_map(|_| renderer.render_into(scene, view, Resolve::Blend, &mut canvas).ok())
        .skip(1)
        .collect();
    all.sort_by(|a, b| a.total_ms.total_cmp(&b.total_ms));
    all.swap_remove(frames / 2)
}
