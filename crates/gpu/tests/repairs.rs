//! Techniques that allocate before they know how much: whatever they guessed, the picture is the same bits, and they hold
//! what they say.

mod common;

use pellucid_core::{Resolve, Scene, Technique, View, oracle};
use pellucid_gpu::GpuRenderer;

const TECHNIQUES: [Technique; 3] = [Technique::List, Technique::ABuffer, Technique::Pages];

fn load(source: &str) -> Scene {
    pellucid_scene::load(source).unwrap().scene
}

fn view(scene: &Scene) -> View {
    View::of(scene).size(33, 21).opacity(0.5)
}

/// Two devices: as they come, and the portability floor.
fn devices() -> impl Iterator<Item = GpuRenderer> {
    [false, true].into_iter().filter_map(common::renderer)
}

#[test]
fn a_guess_far_too_small_is_repaired_in_the_same_call() {
    for gpu in devices() {
        let [shallow, deep] = ["@planes:n=1", "@planes:n=1000"].map(load);
        let expected = gpu.render(&deep, &view(&deep), Resolve::Blend, Technique::Linear).unwrap();
        for technique in TECHNIQUES {
            for _ in 0..3 {
                gpu.render(&shallow, &view(&shallow), Resolve::Blend, technique).unwrap();
            }
            let frame = gpu.render(&deep, &view(&deep), Resolve::Blend, technique).unwrap();
            assert_eq!(frame.stats.max_depth_complexity, 1000);
            assert_eq!(frame.stats.fragments, expected.stats.fragments, "{technique}");
            assert!(frame.stats.rerenders >= 1, "{technique}: {:?}", frame.stats);
            assert!(frame.image == expected.image, "{technique}");
            let again = gpu.render(&deep, &view(&deep), Resolve::Blend, technique).unwrap();
            assert_eq!(again.stats.rerenders, 0, "{technique} learns from the last frame");
            assert!(again.image == expected.image, "{technique}");
        }
    }
}

#[test]
fn a_thousand_layers_are_in_order() {
    for gpu in devices() {
        let scene = load("@planes:n=1000");
        let view = view(&scene);
        let capture = oracle::capture(&scene, &view).unwrap();
        for technique in TECHNIQUES {
            gpu.layers(&scene, &view, technique, |layers| {
                for y in 0..layers.height {
                    for x in 0..layers.width {
                        let have = layers.pixel(x, y).iter();
                        let expected = capture.layers.pixel(x + layers.left, y + layers.top).iter();
                        if !capture.ambiguous[((y + layers.top) * view.width + x + layers.left) as usize] {
                            assert!(have.map(|f| f.primitive).eq(expected.map(|f| f.primitive)), "{technique}");
                        }
                    }
                }
            })
            .unwrap();
        }
    }
}

#[test]
fn budgets_far_below_the_guess_are_kept() {
    for technique in TECHNIQUES {
        for source in ["@planes:n=12", "@hairball:strands=60"] {
            let scene = load(source);
            let view = view(&scene);
            let Some(gpu) = common::renderer(false) else { return };
            let expected = gpu.render(&scene, &view, Resolve::Blend, Technique::Linear).unwrap();
            let whole = gpu.render(&scene, &view, Resolve::Blend, technique).unwrap().stats.peak_bytes;
            for budget_bytes in [2, 4, 16, 64].map(|parts| whole / parts) {
                let gpu = common::renderer(false).unwrap().budget_bytes(budget_bytes);
                let frame = gpu.render(&scene, &view, Resolve::Blend, technique).unwrap();
                assert!(frame.stats.peak_bytes <= budget_bytes, "{technique}, {source}: {:?}", frame.stats);
                assert!(frame.image == expected.image, "{technique}, {source} in {budget_bytes} bytes");
                assert_eq!(frame.stats.fragments, expected.stats.fragments);
            }
        }
    }
}

#[test]
fn a_repaired_capture_holds_what_its_formula_says() {
    let Some(gpu) = common::renderer(false) else { return };
    let scene = load("@planes:n=1000");
    let view = view(&scene);
    let pixels = u64::from(view.width * view.height);
    for technique in TECHNIQUES {
        let stats = gpu.render(&scene, &view, Resolve::Blend, technique).unwrap().stats;
        let bytes = match technique {
            Technique::List => 8 * pixels + 4 + 20 * stats.fragments,
            Technique::ABuffer => 4 * pixels + 4 + 16 * pixels * u64::from(stats.max_depth_complexity),
            Technique::Pages => {
                let pages = pixels * u64::from(stats.max_depth_complexity.div_ceil(4));
                8 * pixels + 4 + 68 * (pages + pages / 32)
            }
            _ => unreachable!(),
        };
        assert_eq!(stats.peak_bytes, bytes, "{technique}: {}", technique.memory_formula());
    }
}
