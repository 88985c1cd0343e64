//! Every built-in scene: the CPU renderer equals the oracle, at any number of threads, every time.

use glam::Vec3;
use pellucid::core::oracle;
use pellucid::core::view::direction;
use pellucid::{Camera, Renderer, Resolve, Scene, View, builtin};
use pellucid_conformance::layers;
use pellucid_cpu::{CpuRenderer, simd};

/// Smaller forms of the scenes whose usual size would keep the oracle busy for minutes.
fn small(name: &str) -> String {
    match name {
        "boxes" => "@boxes:n=4".into(),
        "hairball" => "@hairball:strands=120".into(),
        "spheres" => "@spheres:n=40".into(),
        "tree" => "@tree:leaves=300".into(),
        "grids" => "@grids:layers=5,tessellation=12".into(),
        "teapot" => "@teapot:tessellation=5".into(),
        other => format!("@{other}"),
    }
}

fn scenes() -> impl Iterator<Item = (String, Scene)> {
    builtin::all().iter().map(|scene| {
        let source = small(scene.name);
        let loaded = pellucid::load(&source).unwrap_or_else(|error| panic!("{source}: {error}"));
        (source, loaded.scene)
    })
}

#[test]
fn cpu_equals_oracle_on_every_scene() {
    let renderer = Renderer::new();
    for (source, scene) in scenes() {
        for opacity in [1.0, 0.4] {
            let view = View::of(&scene).size(64, 36).opacity(opacity);
            let capture = oracle::capture(&scene, &view).unwrap();
            let gathered = layers::gather(&renderer, &scene, &view).unwrap();
            if let Some(difference) = layers::first_difference(&capture.layers, &gathered) {
                panic!("{source}, opacity {opacity}: {difference}");
            }
            assert!(!gathered.fragments.is_empty() || gathered.opaque.iter().any(Option::is_some), "{source} is empty");
            for resolve in [Resolve::Blend, Resolve::Gelly, Resolve::Complexity(0)] {
                let (expected, _) = oracle::resolve_capture(&capture, &scene, &view, resolve);
                let frame = renderer.render(&scene, &view, resolve).unwrap();
                assert!(expected == frame.image, "{source}, {resolve}, opacity {opacity}");
            }
        }
    }
}

#[test]
fn bits_do_not_depend_on_threads_or_repetition() {
    for (source, scene) in scenes() {
        let view = View::of(&scene).size(161, 90).opacity(0.5);
        let expected = Renderer::new().threads(1).render(&scene, &view, Resolve::Blend).unwrap().image;
        for threads in [1, 2, 7] {
            let renderer = Renderer::new().threads(threads);
            for _ in 0..2 {
                let image = renderer.render(&scene, &view, Resolve::Blend).unwrap().image;
                assert!(image == expected, "{source} on {threads} threads");
            }
        }
    }
}

#[test]
fn bits_do_not_depend_on_the_simd_level() {
    for (source, scene) in scenes() {
        let view = View::of(&scene).size(113, 70).opacity(0.5);
        let expected = Renderer::new().render(&scene, &view, Resolve::Blend).unwrap().image;
        for (name, level) in simd::levels() {
            let image = CpuRenderer::new(0).level(level).render(&scene, &view, Resolve::Blend).unwrap().image;
            assert!(image == expected, "{source} at level {name}");
        }
    }
}

/// Into the geometry, behind it, and along its planes: no panic, no pixel that is not a number, and still the oracle's
/// layers.
#[test]
fn cameras_anywhere_are_right() {
    let renderer = Renderer::new();
    for source in ["@boxes:n=3", "@planes:n=6", "@cyclic", "@grids:layers=4,tessellation=4", "@blocks:n=12"] {
        let scene = pellucid::load(source).unwrap().scene;
        let sphere = scene.bounding_sphere();
        let fitted = Camera::fitted(sphere, Vec3::Z, 1.0, 1.0);
        for (azimuth, elevation) in [(0.0, 0.0), (90.0, 0.0), (45.0, 90.0), (200.0, -35.0)] {
            for distance in [0.0, 0.3, 1.0, 4.0] {
                let towards_eye = direction(azimuth, elevation);
                let eye = sphere.center + towards_eye * (sphere.radius * distance);
                for target in [eye - towards_eye, eye + towards_eye] {
                    let mut view = View::of(&scene).size(48, 32).opacity(0.7);
                    view.camera = Camera { eye, target, ..fitted };
                    let capture = oracle::capture(&scene, &view).unwrap();
                    let gathered = layers::gather(&renderer, &scene, &view).unwrap();
                    if let Some(difference) = layers::first_difference(&capture.layers, &gathered) {
                        panic!("{source}, eye {eye}, target {target}: {difference}");
                    }
                    let frame = renderer.render(&scene, &view, Resolve::Blend).unwrap();
                    assert!(frame.image.pixels().iter().all(|pixel| pixel.is_finite()));
                }
            }
        }
    }
}
