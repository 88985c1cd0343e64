//! Whole frames of the CPU renderer, without loading: `cargo bench -p pellucid [-- NAME ...]`.
//!
//! Real scenes are taken from the folder in `PELLUCID_SCENES`, else from `shared/scenes` beside or above the project;
//! where they are missing, built-in scenes of like size stand in. Prints the median and the spread of each scene's
//! frames, in milliseconds.

mod common;

use pellucid::core::view::direction;
use pellucid::{Camera, Renderer, Resolve, View};

struct Case {
    name: &'static str,
    file: &'static str,
    stand_in: &'static str,
    size: (u32, u32),
    opacity: f32,
    frames: usize,
}

const fn case(name: &'static str, file: &'static str, stand_in: &'static str) -> Case {
    Case { name, file, stand_in, size: (1280, 720), opacity: 0.3, frames: 25 }
}

/// Seen from the front.
const CASES: [Case; 8] = [
    case("bunny_144k", "stanford_bunny/bunny_144k.ply", "@spheres:n=112"),
    case("dragon_871k", "stanford_dragon/dragon_871k.ply", "@spheres:n=680"),
    case("sintel_hair_tubes", "sintel_hair/sintel_hair_tubes.ply", "@hairball:strands=7000,segments=24"),
    case("conference", "conference_room/conference.glb", "@boxes:n=30"),
    case("oak_tree", "oak_tree/oak_tree.glb", "@tree"),
    case("brain", "brain/brain_fsaverage5.glb", "@spheres:n=64"),
    case("boxes", "", "@boxes:n=20"),
    Case { size: (1920, 1080), frames: 3, ..case("planes_1g", "", "@planes:n=500") },
];

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    let scenes = common::scene_folder();
    println!(
        "{:<20} {:>10} {:>12} {:>5} {:>9} {:>9} {:>9} {:>8}  steps of the last frame",
        "scene", "triangles", "fragments", "depth", "median ms", "least", "greatest", "peak MiB"
    );
    for case in CASES.iter().filter(|case| wanted.is_empty() || wanted.iter().any(|name| case.name.contains(name))) {
        let file =
            scenes.as_ref().map(|folder| folder.join(case.file)).filter(|file| !case.file.is_empty() && file.exists());
        let source = file.map_or(case.stand_in.to_owned(), |file| file.display().to_string());
        measure(case, &source);
    }
}

fn measure(case: &Case, source: &str) {
    let scene = match pellucid::load(source) {
        Ok(loaded) => loaded.scene,
        Err(error) => return println!("{:<20} {error}", case.name),
    };
    let (width, height) = case.size;
    let mut view = View::of(&scene).size(width, height).opacity(case.opacity);
    if scene.cameras().is_empty() {
        let sphere = scene.bounding_sphere();
        view.camera = Camera::fitted(sphere, direction(0.0, 0.0), 30f32.to_radians(), view.aspect() as f32);
    }
    let renderer = Renderer::new();
    let mut frames = Vec::new();
    for _ in 0..=case.frames {
        match renderer.render(&scene, &view, Resolve::Blend) {
            Ok(frame) => frames.push(frame.stats),
            Err(error) => return println!("{:<20} {error}", case.name),
        }
    }
    // The first frame allocates.
    let mut times: Vec<f64> = frames[1..].iter().map(|stats| stats.total_ms).collect();
    times.sort_by(f64::total_cmp);
    let last = &frames[frames.len() - 1];
    let steps: Vec<String> = last.steps.iter().map(|step| format!("{} {:.1}", step.name, step.ms)).collect();
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
