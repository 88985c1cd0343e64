//! What more threads gain: `cargo bench -p pellucid --bench threads [SCENE...]`.
//!
//! Frames on one thread and on all, in turns, and in the same turns a loop of arithmetic that touches no memory and shares
//! nothing, on one thread and on as many: what that gains is what the machine gives at all. On machines of which others use a part,
//! or whose cores slow down together, it is less than the number of threads.

mod common;
#[path = "common/median.rs"]
mod median;

use std::hint::black_box;
use std::thread;
use std::time::Instant;

use common::SCENES;
use median::median;
use pellucid::Resolve;
use pellucid_cpu::{Canvas, CpuRenderer};

/// Turns a scene is measured for, after one that allocates.
const TURNS: usize = 16;

/// Frames of a turn that count, after one in which threads that slept are given their cores.
const FRAMES: usize = 3;

/// Steps of the loop of arithmetic: some milliseconds.
const STEPS: u64 = 4_000_000;

fn main() {
    let threads = thread::available_parallelism().map_or(1, usize::from);
    println!("{threads} threads, medians of {TURNS} turns, of {FRAMES} frames each\n");
    println!(
        "{:<20} {:>12} {:>12} {:>14} {:>18} {:>16}",
        "scene", "one, ms", "all, ms", "times as fast", "arithmetic alone", "share of that"
    );
    for case in common::wanted(SCENES) {
        let (scene, view) = case.load();
        let mut renderers = [1, 0].map(|threads| (CpuRenderer::new(threads), Canvas::new()));
        let mut turns = Vec::new();
        for turn in 0..=TURNS {
            let arithmetic_ms = [arithmetic_ms(1), arithmetic_ms(threads)];
            let frame_ms = renderers.each_mut().map(|(renderer, canvas)| {
                let frames = (0..=FRAMES).map(|_| renderer.render_into(&scene, &view, Resolve::Blend, canvas));
                median(frames.skip(1).map(|stats| stats.map_or(f64::NAN, |stats| stats.total_ms)).collect())
            });
            if turn > 0 {
                let gained = frame_ms[0] / frame_ms[1];
                let at_best = threads as f64 * arithmetic_ms[0] / arithmetic_ms[1];
                turns.push([frame_ms[0], frame_ms[1], gained, at_best, gained / at_best]);
            }
        }
        let [one_ms, all_ms, gained, at_best, share] =
            [0, 1, 2, 3, 4].map(|column| median(turns.iter().map(|turn: &[f64; 5]| turn[column]).collect()));
        println!(
            "{:<20} {one_ms:>12.2} {all_ms:>12.2} {gained:>14.2} {at_best:>18.2} {:>15.0}%",
            case.name,
            share * 100.0
        );
    }
}

/// How long the loop takes, on so many threads at once.
fn arithmetic_ms(threads: usize) -> f64 {
    let start = Instant::now();
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| black_box(arithmetic(black_box(STEPS))));
        }
    });
    start.elapsed().as_secs_f64() * 1e3
}

/// Four sums that hardly wait for each other.
fn arithmetic(steps: u64) -> u64 {
    let [mut a, mut b, mut c, mut d] = [1_u64, 2, 3, 4];
    for i in 0..steps {
        a = a.wrapping_mul(3).wrapping_add(i);
        b = b.wrapping_add(a ^ i);
        c = c.wrapping_mul(5) ^ b;
        d = d.wrapping_add(c);
    }
    a ^ b ^ c ^ d
}
