//! Whole frames of the CPU renderer, without loading: `cargo bench -p pellucid [-- NAME ...]`.
//!
//! Prints the median and the spread of each scene's frames, in milliseconds.
//!
//! With `--on-request` it renders a frame for each line of its input, which is the number of one of the scenes named, and
//! prints the milliseconds it took. So two builds are compared frame by frame in turns, which on a machine that others use
//! too tells apart what differs by a few hundredths.

mod common;

use std::io::stdin;

use common::{Case, SCENES, case};
use pellucid::{Canvas, Renderer, Resolve};

/// Frames of a case, but for those of a billion fragments.
const FRAMES: usize = 25;

const FRAMES_OF_A_BILLION: usize = 3;

fn main() {
    if std::env::args().any(|argument| argument == "--on-request") {
        return render_on_request();
    }
    println!(
        "{:<20} {:>10} {:>12} {:>5} {:>9} {:>9} {:>9} {:>8}  steps of the last frame",
        "scene", "triangles", "fragments", "depth", "median ms", "least", "greatest", "peak MiB"
    );
    for case in common::wanted(SCENES) {
        measure(&case, FRAMES);
    }
    for case in common::wanted([Case { size: (1920, 1080), ..case("planes_1g", "", "@planes:n=500") }]) {
        measure(&case, FRAMES_OF_A_BILLION);
    }
}

fn render_on_request() {
    let loaded: Vec<_> = common::wanted(SCENES).iter().map(Case::load).collect();
    let renderer = Renderer::new();
    let mut canvas = Canvas::new();
    for line in stdin().lines().map_while(Result::ok) {
        let Some((scene, view)) = line.trim().parse().ok().and_then(|number: usize| loaded.get(number)) else {
            println!("{line:?} is not the number of a scene: there are {}", loaded.len());
            continue;
        };
        match renderer.render_into(scene, view, Resolve::Blend, &mut canvas) {
            Ok(stats) => println!("{}", stats.total_ms),
            Err(error) => println!("{error}"),
        }
    }
}

fn measure(case: &Case, frames: usize) {
    let (scene, view) = case.load();
    let renderer = Renderer::new();
    let mut canvas = Canvas::new();
    // The first frame allocates.
    let mut all = Vec::new();
    for _ in 0..=frames {
        match renderer.render_into(&scene, &view, Resolve::Blend, &mut canvas) {
            Ok(stats) => all.push(stats),
            Err(error) => return println!("{:<20} {error}", case.name),
        }
    }
    let mut times: Vec<f64> = all[1..].iter().map(|stats| stats.total_ms).collect();
    times.sort_by(f64::total_cmp);
    let last = &all[all.len() - 1];
    let steps: Vec<String> = last.steps.iter().map(|step| format!("{} {:.1}", step.name, step.ms)).collect();
    let source = case.source();
    println!(
        "{:<20} {:>10} {:>12} {:>5} {:>9.2} {:>9.2} {:>9.2} {:>8.1}  {}{}",
        case.name,
        last.triangles,
        last.fragments,
        last.max_depth_complexity,
        times[times.len() / 2],
        times[0],
        times[times.len() - 1],
        last.peak_bytes as f64 / f64::from(1 << 20),
        steps.join(", "),
        if source.starts_with('@') { format!("  ({source})") } else { String::new() }
    );
}
