//! Techniques that allocate before they know how much: whatever they guessed, the picture is the same bits, and they hold
//! what they say.

mod common;

use pellucid_conformance::suite::CASES;
use pellucid_core::{Resolve, Scene, Technique, View, oracle};
use pellucid_gpu::{GpuRenderer, Storage};

const SUBJECTS: [(Technique, Storage); 4] = [
    (Technique::List, Storage::Buffer),
    (Technique::Pages, Storage::Buffer),
    (Technique::ABuffer, Storage::Buffer),
    (Technique::ABuffer, Storage::Texture),
];

fn load(source: &str) -> Scene {
    pellucid_scene::load(source).unwrap().scene
}

fn view(scene: &Scene) -> View {
    View::of(scene).size(33, 21).opacity(0.5)
}

/// Goes through all of them on each of two devices: as it comes, and the portability floor. They are two in all, as most of
/// the time goes into compiling shaders.
fn for_all_subjects(check: impl Fn(Technique, Storage, &GpuRenderer)) {
    for floor in [false, true] {
        let Some(mut gpu) = common::renderer(floor) else { return };
        for (technique, storage) in SUBJECTS {
            gpu = gpu.storage(storage);
            check(technique, storage, &gpu);
        }
    }
}

#[test]
fn a_guess_far_too_small_is_repaired_in_the_same_call() {
    let [shallow, deep] = ["@planes:n=1", "@planes:n=1000"].map(load);
    for_all_subjects(|technique, storage, gpu| {
        let expected = gpu.render(&deep, &view(&deep), Resolve::Blend, Technique::Linear).unwrap();
        for _ in 0..3 {
            gpu.render(&shallow, &view(&shallow), Resolve::Blend, technique).unwrap();
        }
        let frame = gpu.render(&deep, &view(&deep), Resolve::Blend, technique).unwrap();
        assert_eq!(frame.stats.max_depth_complexity, 1000);
        assert_eq!(frame.stats.fragments, expected.stats.fragments, "{technique}, {storage:?}");
        assert!(frame.stats.rerenders >= 1, "{technique}, {storage:?}: {:?}", frame.stats);
        assert!(frame.image == expected.image, "{technique}, {storage:?}");
        let again = gpu.render(&deep, &view(&deep), Resolve::Blend, technique).unwrap();
        assert_eq!(again.stats.rerenders, 0, "{technique}, {storage:?} learns from the last frame");
        assert!(again.image == expected.image, "{technique}, {storage:?}");
    });
}

#[test]
fn a_thousand_layers_are_in_order() {
    let scene = load("@planes:n=1000");
    let view = view(&scene);
    let capture = oracle::capture(&scene, &view).unwrap();
    for_all_subjects(|technique, storage, gpu| {
        gpu.layers(&scene, &view, technique, |layers| {
            for y in 0..layers.height {
                for x in 0..layers.width {
                    let (column, row) = (x + layers.left, y + layers.top);
                    let have = layers.pixel(x, y).iter().map(|fragment| fragment.primitive);
                    let expected = capture.layers.pixel(column, row).iter().map(|fragment| fragment.primitive);
                    let is_ambiguous = capture.ambiguous[(row * view.width + column) as usize];
                    assert!(is_ambiguous || have.eq(expected), "{technique}, {storage:?}, {column} {row}");
                }
            }
        })
        .unwrap();
    });
}

/// The other storage of the A-buffer; techniques are held together in `conformance/tests/gpu.rs`.
#[test]
fn textures_give_the_same_bits_as_buffers() {
    let cases: Vec<_> = CASES.iter().map(|case| (case, case.load().unwrap())).collect();
    for floor in [false, true] {
        let Some(buffer) = common::renderer(floor) else { return };
        let texture = common::renderer(floor).unwrap().storage(Storage::Texture);
        for (case, (scene, view)) in &cases {
            for resolve in [Resolve::Blend, Resolve::Gelly, Resolve::Nearest, Resolve::Layer(2)] {
                // The same shaders on either device: here it counts whether each is within the limits.
                if floor && resolve != Resolve::Blend && case.source != "@gallery" {
                    continue;
                }
                let [expected, have] =
                    [&buffer, &texture].map(|gpu| gpu.render(scene, view, resolve, Technique::ABuffer).unwrap().image);
                assert!(have == expected, "{case:?}, {resolve}, floor: {floor}");
            }
        }
    }
}

#[test]
fn budgets_far_below_the_guess_are_kept() {
    let Some(mut whole) = common::renderer(false) else { return };
    for (technique, storage) in SUBJECTS {
        whole = whole.storage(storage);
        // It has its first guess yet to make, and the tightest budget for it.
        let mut tight = common::renderer(false).unwrap().storage(storage);
        for source in ["@planes:n=12", "@hairball:strands=60"] {
            let scene = load(source);
            let view = view(&scene);
            let expected = whole.render(&scene, &view, Resolve::Blend, Technique::Linear).unwrap();
            let needed_bytes = whole.render(&scene, &view, Resolve::Blend, technique).unwrap().stats.peak_bytes;
            for parts in [64, 16, 4, 2] {
                let budget_bytes = needed_bytes / parts;
                tight = tight.budget_bytes(budget_bytes);
                let frame = tight.render(&scene, &view, Resolve::Blend, technique).unwrap();
                let what = format!("{technique}, {storage:?}, {source} in {budget_bytes} bytes: {:?}", frame.stats);
                assert!(frame.stats.peak_bytes <= budget_bytes, "{what}");
                assert!(frame.image == expected.image, "{what}");
                assert_eq!(frame.stats.fragments, expected.stats.fragments, "{what}");
                let again = tight.render(&scene, &view, Resolve::Blend, technique).unwrap();
                assert!(
                    again.image == expected.image && again.stats.peak_bytes <= budget_bytes,
                    "{what}, second frame"
                );
                if parts == 2 {
                    assert_eq!(again.stats.rerenders, 0, "{what}: nothing is captured in vain twice");
                }
            }
        }
    }
}

#[test]
fn a_repaired_capture_holds_what_its_formula_says() {
    // Sorted in registers alone, and not.
    let [shallow, deep] = ["@planes:n=20", "@planes:n=1000"].map(load);
    for_all_subjects(|technique, storage, gpu| {
        for scene in [&shallow, &deep] {
            let view = view(scene);
            let pixels = u64::from(view.width * view.height);
            let stats = gpu.render(scene, &view, Resolve::Blend, technique).unwrap().stats;
            let (fragments, greatest) = (stats.fragments, u64::from(stats.max_depth_complexity));
            // Seven classes of runs of 16 pixels, with their numbers and dispatches.
            let lists = 7 * (pixels.div_ceil(16) * 4 + 4 + 12);
            // Buffers have 16 bytes at least.
            let references = |slots: u64| if greatest > 32 { 4 * slots } else { 16 };
            let bytes = match (technique, storage) {
                // Tables have rows of 1024.
                (Technique::List, _) => {
                    8 * pixels + 4 + 4 * fragments + 16 * fragments.next_multiple_of(1024) + references(fragments)
                }
                (Technique::Pages, _) => {
                    let pages = pixels * greatest.div_ceil(4);
                    8 * pixels + 4 + 68 * (pages + pages / 32)
                }
                (_, Storage::Buffer) => 4 * pixels + 4 + 16 * pixels * greatest,
                (_, Storage::Texture) => 4 * pixels + 4 + 16 * pixels * greatest + references(pixels * greatest),
            };
            assert_eq!(stats.peak_bytes, bytes + lists, "{technique}, {storage:?}: {}", technique.memory_formula());
            let of_a_pixel = if technique == Technique::ABuffer { 4.0 } else { 8.0 } + 7.0 * 4.0 / 16.0;
            assert!(technique.memory_formula().starts_with(&format!("{of_a_pixel} B x pixels ")), "{technique}");
        }
    });
}
