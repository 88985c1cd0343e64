//! Bevy's order-independent transparency beside Pellucid's: `cargo run --release [-- NAME ...]`.
//!
//! Real scenes are taken as by the benchmarks of `pellucid` (`PELLUCID_SCENES`), without textures: one mesh, one colour. Bevy draws it
//! with a bare material, Pellucid lights it. Both get the same triangles, camera, picture of 1280 x 720 and device. They take
//! turns of two frames, each waited for and not read back, of which the second counts, as the first finds the caches full of
//! another's data. Printed are medians, and how many times as long as the fastest of Pellucid's on that device Bevy's lists take.
//!
//! Bevy is given lists long enough for all fragments and sorts as many as the deepest pixel has, so that it drops and
//! merges none. It keeps 8 bits of alpha and 24 of depth, and 9 of each channel. A frame of it is whatever `App::update` does.

#[path = "../../../crates/pellucid/benches/common/mod.rs"]
mod common;
mod engine;

use common::{Case, SCENES};
use engine::Engine;
use glam::{Affine3A, Vec3, Vec4};
use pellucid::core::Projection;
use pellucid::gpu::{ContextOptions, GpuRenderer};
use pellucid::{Instance, Material, Mesh, Renderer, Resolve, Scene, Technique, View};

/// Frames of each that count, and turns before, in which shaders are compiled and buffers grow.
const FRAMES: usize = 9;
const WARM_UP: usize = 2;

/// Techniques on Bevy's device; the first does not order.
const ON_GPU: [Technique; 5] =
    [Technique::Alpha, Technique::Linear, Technique::List, Technique::Pages, Technique::Lucid];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let cases = common::wanted(SCENES);
    if cases.is_empty() {
        return Err(format!("no scene has such a name; there are {}", SCENES.map(|case| case.name).join(", ")).into());
    }
    println!("Milliseconds a frame on {};", open()?.context().name());
    println!("in brackets Bevy's lists over the fastest exact technique on the GPU");
    let [alpha, linear, list, pages, lucid] = ON_GPU.map(|technique| technique.to_string());
    let names = ["fragments", "deepest", "Bevy, alpha", "Bevy, lists", &alpha, &linear, &list, &pages, &lucid, "cpu"];
    print_row("scene", names);
    cases.iter().try_for_each(measure)
}

fn open() -> Result<GpuRenderer, pellucid::gpu::GpuError> {
    GpuRenderer::new(&ContextOptions { allow_software: true, ..Default::default() })
}

fn print_row(scene: &str, cells: [&str; 10]) {
    let [fragments, deepest, bevy_alpha, bevy_lists, ours @ ..] = cells;
    print!("{scene:<18} {fragments:>10} {deepest:>7} {bevy_alpha:>12} {bevy_lists:>15}");
    println!(" {}", ours.map(|cell| format!("{cell:>7}")).join(" "));
}

fn measure(case: &Case) -> Result<(), Box<dyn std::error::Error>> {
    let (scene, view) = case.load();
    let scene = bare(&scene)?;
    let cpu = Renderer::new();
    let frame = cpu.render(&scene, &view, Resolve::Blend)?;
    let pixels = f64::from(view.width) * f64::from(view.height);
    // A little more than there are, as it rounds down.
    let average = (frame.stats.fragments as f64 / pixels * 1.01) as f32;
    let deepest = frame.stats.max_depth_complexity;
    let mut unsorted = Engine::new(&scene, &view, None);
    let mut lists = Engine::new(&scene, &view, Some((deepest.max(1), average.max(0.01))));
    let covered = frame.image.pixels().iter().filter(|pixel| **pixel != view.background).count();
    for (engine, name) in [(&mut unsorted, "unsorted"), (&mut lists, "lists")] {
        let drawn = engine.covered_pixels();
        if covered.abs_diff(drawn) > covered / 100 {
            return Err(format!("{}: Bevy, {name}, covers {drawn} pixels, Pellucid {covered}", case.name).into());
        }
    }

    let mut renderers = vec![cpu];
    for technique in ON_GPU {
        let gpu = open()?;
        if !gpu.context().name().starts_with(lists.adapter()) {
            return Err(format!("Bevy draws on {}, Pellucid on {}", lists.adapter(), gpu.context().name()).into());
        }
        renderers.push(Renderer::new().technique(technique).gpu(gpu));
    }
    let mut times = vec![Vec::new(); renderers.len() + 2];
    for _ in 0..FRAMES + WARM_UP {
        let [of_unsorted, of_lists, of_renderers @ ..] = &mut times[..] else { unreachable!() };
        for (engine, times) in [(&mut unsorted, of_unsorted), (&mut lists, of_lists)] {
            engine.frame_ms();
            times.push(engine.frame_ms());
        }
        for (renderer, times) in renderers.iter().zip(of_renderers) {
            renderer.render(&scene, &view, Resolve::Blend)?;
            times.push(renderer.render(&scene, &view, Resolve::Blend)?.stats.total_ms);
        }
    }
    let medians: Vec<f64> = times.iter().map(|times| median(&times[WARM_UP..])).collect();
    let [bevy_unsorted, bevy_lists, cpu, alpha, exact @ ..] = &medians[..] else { unreachable!() };
    let fastest = exact.iter().copied().fold(f64::INFINITY, f64::min);
    let [linear, list, pages, lucid] = exact else { unreachable!() };
    let [alpha, linear, list, pages, lucid, cpu] =
        [alpha, linear, list, pages, lucid, cpu].map(|ms| format!("{ms:.1}"));
    let lists = format!("{bevy_lists:.1} ({:.2})", bevy_lists / fastest);
    let (fragments, deepest) = (frame.stats.fragments.to_string(), deepest.to_string());
    let unsorted = format!("{bevy_unsorted:.1}");
    let cells = [&fragments, &deepest, &unsorted, &lists, &alpha, &linear, &list, &pages, &lucid, &cpu];
    // A built-in scene may stand in for a real one.
    let source = case.source();
    print_row(if source.starts_with('@') { &source } else { case.name }, cells.map(String::as_str));
    Ok(())
}

/// All triangles of a scene as one mesh of one colour, transparent by the view's opacity alone.
fn bare(scene: &Scene) -> Result<Scene, pellucid::core::Error> {
    let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for instance in scene.instances() {
        let mesh = scene.mesh(instance.mesh);
        let first = positions.len() as u32;
        positions.extend(mesh.positions().iter().map(|&point| instance.world_from_mesh.transform_point3(point)));
        let turned = |normal: &Vec3| instance.world_from_mesh.transform_vector3(*normal);
        match mesh.normals() {
            Some(all) => normals.extend(all.iter().map(turned)),
            None => normals.resize(positions.len(), Vec3::Z),
        }
        triangles.extend(mesh.triangles().iter().map(|corners| corners.map(|corner| corner + first)));
    }
    let mut merged = Scene::new();
    let mesh = merged.add_mesh(Mesh::new(positions, triangles)?.with_normals(normals)?)?;
    let material = merged.add_material(Material::translucent("bare", Vec4::new(0.2, 0.4, 0.6, 1.0)))?;
    merged.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY })?;
    Ok(merged)
}

fn median(times: &[f64]) -> f64 {
    let mut times = times.to_vec();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// The view's vertical angle and near plane; benchmarks have perspective cameras only.
fn perspective(view: &View) -> (f32, f32) {
    match view.camera.projection {
        Projection::Perspective { fov_y, near } => (fov_y, near),
        Projection::Orthographic { .. } => unreachable!("no benchmark has one"),
    }
}
