//! Every built-in scene: the CPU renderer equals the oracle, at any number of threads, every time.

use std::collections::BTreeSet;

use glam::{Vec3, Vec4};
use pellucid::core::oracle;
use pellucid::core::view::direction;
use pellucid::{Camera, Canvas, Image, Renderer, Resolve, Scene, Technique, View, builtin};
use pellucid_conformance::layers;
use pellucid_conformance::suite::{CASES, Candidate, Check, Prepared, prepare_all};
use pellucid_cpu::{CpuRenderer, simd};

#[path = "common/beside_oracle.rs"]
mod beside_oracle;

use beside_oracle::assert_equals_oracle;

/// Every scene of the suite once.
fn scenes() -> impl Iterator<Item = (&'static str, Scene)> {
    let sources: BTreeSet<&str> = CASES.iter().map(|case| case.source).collect();
    sources.into_iter().map(|source| (source, pellucid::load(source).unwrap().scene))
}

#[test]
fn every_built_in_scene_is_in_the_suite() {
    for scene in builtin::all() {
        let is_this = |source: &str| source.strip_prefix('@').and_then(|s| s.split(':').next()) == Some(scene.name);
        assert!(CASES.iter().any(|case| is_this(case.source)), "@{}", scene.name);
    }
}

/// Stricter than `pellucid verify`: bit for bit, and so are pictures.
#[test]
fn cpu_equals_oracle_in_every_case() {
    let renderer = Renderer::new();
    for (case, Prepared { scene, view, capture }) in prepare_all().unwrap() {
        let gathered = layers::gather(&renderer, &scene, &view).unwrap();
        if let Some(difference) = layers::first_difference(&capture.layers, &gathered) {
            panic!("{case:?}: {difference}");
        }
        let sees_something = !gathered.fragments.is_empty() || gathered.opaque.iter().any(Option::is_some);
        assert!(sees_something, "{case:?} is empty");
        for check in Check::ALL {
            if let Check::Picture(resolve) = check {
                let (expected, _) = oracle::resolve_capture(&capture, &scene, &view, resolve);
                let frame = renderer.render(&scene, &view, resolve).unwrap();
                assert!(expected == frame.image, "{case:?}, {resolve}");
            }
        }
    }
}

#[test]
fn the_oracle_passes_its_own_suite_and_so_does_the_cpu() {
    for technique in [Technique::Oracle, Technique::Cpu] {
        let candidate = Candidate::new(technique, Renderer::new());
        for case in CASES.iter().filter(|case| ["@cyclic", "@teapot:tessellation=5"].contains(&case.source)) {
            let prepared = case.prepare().unwrap();
            for check in Check::ALL {
                let comparison = prepared.run(check, &candidate).unwrap();
                assert!(comparison.passes() && comparison.ambiguous == 0, "{case:?}, {check}: {comparison:?}");
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

/// What a canvas has kept of the picture before is never seen: not after things moved, nor in another size, before another
/// background, after a resolve that paints everything, with tiles in bands, in windows, or after a picture from elsewhere.
#[test]
fn a_canvas_shows_what_a_new_picture_shows() {
    let scenes =
        ["@cyclic", "@boxes:n=3", "@grids:layers=70,tessellation=10"].map(|s| pellucid::load(s).unwrap().scene);
    let renderers = [Renderer::new(), Renderer::new().threads(1).budget_bytes(50_000)];
    let mut canvas = Canvas::new();
    for (round, scene) in (0..3).flat_map(|_| &scenes).enumerate() {
        for (azimuth, distance) in [(0.0, 1.0), (40.0, 5.0), (40.0, 5.0), (90.0, 20.0), (200.0, 2.0)] {
            let [width, height] = if round % 3 == 2 { [97, 75] } else { [200, 110] };
            let mut view = View::of(scene).size(width, height).opacity(0.5);
            let towards_eye = direction(azimuth, 10.0);
            view.camera.eye = view.camera.target + towards_eye * (scene.bounding_sphere().radius * distance);
            if round > 4 && azimuth == 90.0 {
                view.background = Vec4::new(0.2, 0.0, 0.4, 1.0);
            }
            let resolve = if azimuth == 200.0 { Resolve::Errors } else { Resolve::Blend };
            let renderer = &renderers[round % renderers.len()];
            let stats = renderer.render_into(scene, &view, resolve, &mut canvas).unwrap();
            let frame = Renderer::new().render(scene, &view, resolve).unwrap();
            assert!(frame.image == *canvas.image(), "round {round}, azimuth {azimuth}");
            assert_eq!(frame.stats.fragments, stats.fragments);
            if round == 6 && distance == 5.0 {
                canvas.put(Image::filled(width, height, Vec4::ONE));
            }
        }
    }
}

/// 72 thousand fragments of small triangles in one tile: more than are captured at once.
#[test]
fn deep_tiles_of_small_triangles_equal_the_oracle() {
    let scene = pellucid::load("@grids:layers=70,tessellation=10").unwrap().scene;
    let view = View::of(&scene).size(57, 32).opacity(0.1);
    let capture = assert_equals_oracle(&Renderer::new(), &scene, &view);
    assert!(capture.layers.fragments.len() > 57 * 32 * 65);
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
