//! Whole frames of the CPU renderer, without loading: `cargo bench -p pellucid [-- NAME ...]`.
//!
//! Prints the median and the spread of each scene's frames, in milliseconds. Then what a fragment costs, the more there are:
//! frames of 10 million to a billion, in turns, so that what others do to the machine meanwhile is done to all of them.
//!
//! With `--on-request` it renders a frame for each line of its input, which is the number of one of the scenes named, and
//! prints the milliseconds it took. So two builds are compared frame by frame in turns, which on a machine that others use
//! too tells apart what differs by a few hundredths.

mod common;
#[path = "common/median.rs"]
mod median;

use std::io::stdin;

use common::{Case, SCENES, case};
use median::median;
use pellucid::{Canvas, Renderer, Resolve};

/// Frames of a case.
const FRAMES: usize = 25;

/// Planes that fill the picture, drawn in any order.
const PLANES: [Case; 3] = [
    case("planes_10m", "", "@planes:n=11"),
    case("planes_100m", "", "@planes:n=109"),
    case("planes_1g", "", "@planes:n=1085"),
];

/// Frames of each of [`PLANES`].
const TURNS: usize = 9;

fn main() {
    if std::env::args().any(|argument| argument == "--on-request") {
        return render_on_request();
    }
    println!(
        "{:<20} {:>10} {:>12} {:>5} {:>9} {:>9} {:>9} {:>8}  steps of the last frame",
        "scene", "triangles", "fragments", "depth", "median ms", "least", "greatest", "peak MiB"
    );
    for case in common::wanted(SCENES) {
        measure(&case);
    }
    measure_in_turns(common::wanted(PLANES));
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

fn measure(case: &Case) {
    let (scene, view) = case.load();
    let renderer = Renderer::new();
    let mut canvas = Canvas::new();
    // The first frame allocates.
    let mut all = Vec::new();
    for _ in 0..=FRAMES {
        match renderer.render_into(&scene, &view, Resolve::Blend, &mut canvas) {
            Ok(stats) => all.push(stats),
            Err(error) => return println!("{:<20} {error}", case.name),
        }
    }
    let times = || all[1..].iter().map(|stats| stats.total_ms);
    let last = &all[all.len() - 1];
    let steps: Vec<String> = last.steps.iter().map(|step| format!("{} {:.1}", step.name, step.ms)).collect();
    let source = case.source();
    println!(
        "{:<20} {:>10} {:>12} {:>5} {:>9.2} {:>9.2} {:>9.2} {:>8.1}  {}{}",
        case.name,
        last.triangles,
        last.fragments,
        last.max_depth_complexity,
        median(times().collect()),
        times().fold(f64::INFINITY, f64::min),
        times().fold(0.0, f64::max),
        last.peak_bytes as f64 / f64::from(1 << 20),
        steps.join(", "),
        if source.starts_with('@') { format!("  ({source})") } else { String::new() }
    );
}

/// Prints what a fragment takes in each case.
fn measure_in_turns(cases: Vec<Case>) {
    if !cases.is_empty() {
        println!("\n{:<20} {:>12} {:>9} {:>13}", "scene", "fragments", "median ms", "ns a fragment");
    }
    let mut all: Vec<_> =
        cases.iter().map(|case| (case.name, case.load(), Renderer::new(), Canvas::new(), Vec::new())).collect();
    // The first turn allocates.
    for _ in 0..=TURNS {
        all.retain_mut(|(name, (scene, view), renderer, canvas, frames)| {
            let rendered = renderer.render_into(scene, view, Resolve::Blend, canvas);
            rendered.map(|stats| frames.push(stats)).inspect_err(|error| println!("{name:<20} {error}")).is_ok()
        });
    }
    for (name, .., frames) in all {
        let fragments = frames[0].fragments;
        let ms = median(frames[1..].iter().map(|stats| stats.total_ms).collect());
        println!("{name:<20} {fragments:>12} {ms:>9.2} {:>13.2}", ms * 1e6 / fragments as f64);
    }
}
