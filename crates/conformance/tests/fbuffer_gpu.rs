//! The F-Buffer on the GPU: slots and sort are the CPU's, passes that carry values change no bit, and the technique
//! `fbuffer` gives the same bits in buffers of any size.

use glam::{Affine3A, Vec3, Vec4};
use pellucid::core::fbuffer::order::Geometry;
use pellucid::core::fbuffer::sort::{Key, merge_runs, sort};
use pellucid::core::fbuffer::{Drawn, Output, Overflow, RasterOrder, Size, Windows};
use pellucid::core::primitive::Pass;
use pellucid::gpu::fbuffer::{Content, FBuffer, FBufferError, sort_keys};
use pellucid::gpu::wgpu;
use pellucid::{Camera, Image, Instance, Material, Mesh, Projection, Renderer, Resolve, Scene, Technique, View};
use pellucid_conformance::layers;
use pellucid_conformance::suite::CASES;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

mod common;
#[path = "common/soup.rs"]
mod soup;

use common::gpu;

#[test]
fn merged_windows_give_the_same_bits_as_one() {
    let sizes = [Size::square(32), Size::square(64), Size::square(128)].map(Result::unwrap);
    let Some(device) = gpu(false) else { return };
    let whole = Renderer::new().gpu(device).technique(Technique::FBuffer);
    let [tiny, small, medium] = sizes.map(|size| {
        let device = gpu(true).unwrap().fbuffer_size(Some(size));
        (size, Renderer::new().gpu(device).technique(Technique::FBuffer))
    });
    for case in CASES {
        let (scene, view) = &case.load().unwrap();
        let expected = whole.render(scene, view, Resolve::Blend).unwrap();
        let expected_layers = layers::gather(&whole, scene, view).unwrap();
        for (size, renderer) in [&tiny, &small, &medium] {
            // Hundreds of windows take a software device a while.
            if Windows::new(expected.stats.fragments, *size).count() > 100 {
                continue;
            }
            let frame = renderer.render(scene, view, Resolve::Blend).unwrap();
            assert!(frame.image == expected.image, "{case:?} in {size}");
            assert!(layers::gather(renderer, scene, view).unwrap() == expected_layers, "{case:?} in {size}");
            // Fragments that are hidden have slots too.
            let at_least = Windows::new(expected.stats.fragments, *size).count();
            assert!(frame.stats.slot_windows >= at_least, "{case:?} in {size}: {:?}", frame.stats);
        }
    }
}

type Device = (wgpu::Device, wgpu::Queue);

/// A device of somebody else, on WebGPU's default limits. Its errors panic.
fn device() -> Option<Device> {
    gpu(true)?;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).unwrap();
    Some(pollster::block_on(adapter.request_device(&Default::default())).unwrap())
}

/// From one row of the least buffer to more than anything here takes.
fn sizes() -> impl Iterator<Item = Size> {
    let rows = [32, 64, 2048].map(|side| Size::row(side).unwrap());
    rows.into_iter().chain([32, 64, 128].map(|side| Size::square(side).unwrap()))
}

fn buffer((device, queue): &Device, size: Size, contents: &[(&str, Content<'_>)]) -> FBuffer {
    FBuffer::new(device, queue, size, contents).unwrap()
}

fn geometry<'a>(scene: &'a Scene, view: &View) -> Geometry<'a> {
    Geometry::new(scene, view, Pass::Transparent).unwrap()
}

fn picture(fbuffer: &mut FBuffer, scene: &Scene, view: &View, passes: &[&str]) -> (Image, Drawn) {
    let program = fbuffer.program(passes, [None; 3]).unwrap();
    let drawing = fbuffer.drawing(geometry(scene, view)).unwrap();
    let target = fbuffer.target(view.width, view.height, Vec4::new(0.1, 0.2, 0.3, 1.0)).unwrap();
    let drawn = fbuffer.draw(&drawing, &program, [None; 3], Output::default(), &target).unwrap();
    (fbuffer.read(&target).unwrap(), drawn)
}

/// A colour of every bit that a pass knows of a fragment.
const LOOK: &str = "fn look(fragment: Fragment) -> vec4<f32> {
        let hue = vec3(f32(fragment.draw % 5u), f32(fragment.triangle % 7u), fragment.depth * 4.0) / 7.0;
        return vec4(fragment.weights * 0.3 + hue * 0.3, 0.5);
    }";

/// What it costs to find where a fragment is.
const WHERE: (&str, Content<'_>) = (
    "found",
    Content::State {
        name: "Found",
        declaration: "struct Found { x: u32, y: u32, draw: u32, triangle: u32, slot: u32 }",
        stride: 20,
    },
);

/// Slots of a window as a pass on the GPU finds them, and as the CPU does.
fn same_slots(device: &Device, scene: &Scene, view: &View, size: Size) -> Result<(), TestCaseError> {
    let mut fbuffer = buffer(device, size, &[WHERE]);
    let passes = "fn shade(fragment: Fragment) -> vec4<f32> {
        found_store(fragment, Found(fragment.pixel.x, fragment.pixel.y, fragment.draw, fragment.triangle, fragment.slot));
        return vec4(1.0);
    }";
    let program = fbuffer.program(&[passes], [None; 3]).unwrap();
    let order = RasterOrder::new(geometry(scene, view));
    let drawing = fbuffer.drawing(geometry(scene, view)).unwrap();
    prop_assert_eq!(drawing.fragments(), order.fragments());
    let target = fbuffer.target(view.width, view.height, Vec4::ZERO).unwrap();
    let windows = Windows::new(order.fragments(), size);
    for window in 0..windows.count() {
        fbuffer.window(&drawing, &program, [None; 3], window, Output::default(), &target).unwrap();
        let slots = fbuffer.contents(0).unwrap();
        let mut found = slots.chunks_exact(5);
        let mut differing = None;
        order.rasterize(windows.slots(window), |place| {
            let primitive = &order.geometry().primitives[place.primitive];
            let expected = [place.x, place.y, primitive.draw, primitive.triangle, place.slot as u32];
            if found.next() != Some(&expected) {
                differing.get_or_insert(place);
            }
        });
        prop_assert_eq!(differing, None, "in {}", size);
    }
    Ok(())
}

#[test]
fn slots_are_those_of_the_cpu() {
    let Some(device) = device() else { return };
    let config = ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() };
    let strategy = (soup::soup(), soup::camera(), 1u32..60, 1u32..50);
    TestRunner::new(config)
        .run(&strategy, |(scene, camera, width, height): (Scene, Camera, u32, u32)| {
            let view = View { camera, ..View::of(&scene).size(width, height).opacity(0.5) };
            let size = if width.is_multiple_of(2) { Size::square(32) } else { Size::square(256) };
            same_slots(&device, &scene, &view, size.unwrap())
        })
        .unwrap();
}

/// Where the fill rule alone decides.
#[test]
fn slots_of_triangles_between_pixel_centres_are_those_of_the_cpu() {
    let Some(device) = device() else { return };
    let corner = (0i8..32, 0i8..32)
        .prop_map(|(x, y)| Vec3::new(f32::from(2 * x + 1) / 32.0 - 1.0, f32::from(2 * y + 1) / 32.0 - 1.0, 0.0));
    let config = ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() };
    TestRunner::new(config)
        .run(&prop::collection::vec(corner, 3..60), |corners| {
            let triangles = (0..corners.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let mut scene = Scene::new();
            let mesh = scene.add_mesh(Mesh::new(corners, triangles).unwrap()).unwrap();
            let material = scene.add_material(Material::translucent("glass", Vec4::splat(0.5))).unwrap();
            scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY }).unwrap();
            let mut view = View::of(&scene).size(32, 32);
            let projection = Projection::Orthographic { height: 2.0, near: 1.0, far: 3.0 };
            view.camera = Camera { eye: Vec3::Z * 2.0, target: Vec3::ZERO, up: Vec3::Y, projection };
            same_slots(&device, &scene, &view, Size::square(64).unwrap())
        })
        .unwrap();
}

#[test]
fn slots_of_pictures_as_wide_as_can_be_are_those_of_the_cpu() {
    let Some(device) = device() else { return };
    let scene = pellucid::load("@cyclic").unwrap().scene;
    for (width, height) in [(16_384, 2), (2, 16_384)] {
        let mut view = View::of(&scene).size(width, height).opacity(0.5);
        view.camera.eye.z = 0.4;
        same_slots(&device, &scene, &view, Size::square(512).unwrap()).unwrap();
    }
}

#[test]
fn passes_that_carry_values_change_no_bit_at_any_size() {
    let Some(device) = device() else { return };
    let one = [&*format!("{LOOK} fn shade(fragment: Fragment) -> vec4<f32> {{ return look(fragment); }}")];
    let first = format!("{LOOK} fn shade(fragment: Fragment) {{ a_store(fragment, 2u, look(fragment)); }}");
    // Two buffers in one pass, at the same slot.
    let three = [
        &*first,
        "fn shade(fragment: Fragment) { b_store(fragment, 1u, a_load(fragment, 2u)); a_store(fragment, 2u, vec4(9.0)); }",
        "fn shade(fragment: Fragment) -> vec4<f32> { return b_load(fragment, 1u); }",
    ];
    for source in ["@cyclic", "@boxes:n=2"] {
        let scene = pellucid::load(source).unwrap().scene;
        let view = View::of(&scene).size(47, 35).opacity(0.5);
        let (expected, drawn) = picture(&mut buffer(&device, Size::square(256).unwrap(), &[]), &scene, &view, &one);
        assert_eq!((drawn.windows, drawn.submissions), (1, 1));
        for size in sizes() {
            let mut fbuffer = buffer(&device, size, &[("a", Content::Targets(4)), ("b", Content::Targets(2))]);
            let (image, drawn) = picture(&mut fbuffer, &scene, &view, &three);
            assert!(image == expected, "{source} in {size}");
            let windows = Windows::new(drawn.fragments, size);
            assert_eq!((drawn.windows, drawn.submissions), (windows.count(), windows.submissions(3)), "{size}");
            let stages = fbuffer.bytes() - size.slots() * (6 * 16 + 2 * 16 + 12);
            assert!(stages < 16 + 256 * 100, "{stages} bytes besides the slots");
        }
    }
}

/// Sorted and blended in runs of 16,384 slots, the last of which is not full.
#[test]
fn large_windows_blend_as_small_ones_do() {
    let Some(device) = device() else { return };
    let scene = pellucid::load("@boxes:n=4").unwrap().scene;
    let view = View::of(&scene).size(200, 150).opacity(0.5);
    let text = format!("{LOOK} fn shade(fragment: Fragment) -> vec4<f32> {{ return look(fragment); }}");
    let [large, small] =
        [256, 64].map(|side| picture(&mut buffer(&device, Size::square(side).unwrap(), &[]), &scene, &view, &[&text]));
    let fragments = large.1.fragments;
    assert!(fragments > 2 * 16_384 && !fragments.is_multiple_of(16_384), "{fragments}");
    assert_eq!((large.1.windows, small.1.windows), (1, fragments.div_ceil(4096)));
    assert!(large.0 == small.0);
}

#[test]
fn kills_and_masks_lead_no_later_pass_astray() {
    let Some(device) = device() else { return };
    let is_killed = "fn is_killed(fragment: Fragment) -> bool { return fragment.slot % 3u == 0u; }";
    let one = format!(
        "{LOOK} {is_killed} fn shade(fragment: Fragment) -> vec4<f32> {{
            if is_killed(fragment) || fragment.pixel.x % 4u == 1u {{ fbuffer_kill(fragment); }}
            return look(fragment);
        }}"
    );
    let first = format!(
        "{LOOK} {is_killed} fn shade(fragment: Fragment) {{
            if is_killed(fragment) {{ fbuffer_kill(fragment); }} else {{
                a_store(fragment, 0u, vec4(look(fragment).x, 0.0, 0.0, 0.0));
            }}
        }}"
    );
    let second = format!(
        "{LOOK} fn shade(fragment: Fragment) {{
            let color = look(fragment);
            a_store(fragment, 0u, vec4(a_load(fragment, 0u).x, color.yzw));
            if fragment.pixel.x % 4u == 1u {{ fbuffer_kill(fragment); }}
        }}"
    );
    let last = "fn shade(fragment: Fragment) -> vec4<f32> { return a_load(fragment, 0u); }";
    let scene = pellucid::load("@boxes:n=2").unwrap().scene;
    let view = View::of(&scene).size(47, 35).opacity(0.5);
    let (expected, _) = picture(&mut buffer(&device, Size::square(256).unwrap(), &[]), &scene, &view, &[&one]);
    for size in [Size::row(64).unwrap(), Size::square(32).unwrap(), Size::square(128).unwrap()] {
        let mut fbuffer = buffer(&device, size, &[("a", Content::Targets(1))]);
        let (image, drawn) = picture(&mut fbuffer, &scene, &view, &[&first, &second, last]);
        assert!(image == expected, "{size}");
        if drawn.windows == 1 {
            let slots = fbuffer.contents(0).unwrap();
            let killed = slots.chunks_exact(4).take(drawn.fragments as usize).step_by(3);
            assert!(killed.flatten().all(|&word| word == 0), "no pass sees a fragment that was killed before");
        }
    }
}

#[test]
fn a_state_of_ones_own_counts_the_passes_over_its_fragment() {
    let Some(device) = device() else { return };
    let state = Content::State {
        name: "Visits",
        declaration: "struct Visits { slot: u32, passes: u32, share: f32 }",
        stride: 12,
    };
    let visit = "fn shade(fragment: Fragment) {
        var visits = state_load(fragment);
        // One more than the slot, as 0 is a slot that no pass wrote.
        if visits.passes == 0u || visits.slot == fragment.slot + 1u {
            visits = Visits(fragment.slot + 1u, visits.passes + 1u, visits.share + 0.25);
        }
        state_store(fragment, visits);
    }";
    let last = "fn shade(fragment: Fragment) -> vec4<f32> {
        let visits = state_load(fragment);
        return vec4(vec3(visits.share), select(0.0, 1.0, visits.passes == 4u && visits.slot == fragment.slot + 1u));
    }";
    let scene = pellucid::load("@cyclic").unwrap().scene;
    let view = View::of(&scene).size(47, 35).opacity(0.5);
    let one = "fn shade(fragment: Fragment) -> vec4<f32> { return vec4(1.0); }";
    let (expected, _) = picture(&mut buffer(&device, Size::square(256).unwrap(), &[]), &scene, &view, &[one]);
    for size in sizes() {
        let mut fbuffer = buffer(&device, size, &[("state", state)]);
        let (image, drawn) = picture(&mut fbuffer, &scene, &view, &[visit, visit, visit, visit, last]);
        assert!(image == expected, "{size}");
        assert_eq!(drawn.submissions, 5 * drawn.windows, "{size}");
    }
}

/// The CPU's blending of the same colours, by its own tests.
#[test]
fn tests_and_blending_are_those_of_the_cpu() {
    let Some(device) = device() else { return };
    let scene = pellucid::load("@spheres:n=8,subdivisions=2").unwrap().scene;
    let view = View::of(&scene).size(47, 35).opacity(0.5);
    let order = RasterOrder::new(geometry(&scene, &view));
    // Numbers that both compute alike.
    let shader = ["fn shade(fragment: Fragment) -> vec4<f32> {
        return vec4(vec3(f32(fragment.triangle % 8u) / 16.0), f32(fragment.triangle % 3u + 1u) / 4.0);
    }"];
    let program = pellucid::fbuffer::Program::new(|fragment, ()| {
        Some(Vec4::splat((fragment.triangle % 8) as f32 / 16.0).with_w((fragment.triangle % 3 + 1) as f32 / 4.0))
    });
    let all = [
        Output::default(),
        Output::OPAQUE,
        Output { depth_write: true, depth_test: true, ..Output::default() },
        Output { alpha_test: Some(0.4), ..Output::default() },
    ];
    for output in all {
        for size in [Size::square(32).unwrap(), Size::square(256).unwrap()] {
            let mut expected = pellucid::fbuffer::Target::new(view.width, view.height, Vec4::ONE);
            pellucid::fbuffer::FBuffer::new(size).draw(&order, &program, output, &mut expected);
            let mut fbuffer = buffer(&device, size, &[]);
            let program = fbuffer.program(&shader, [None; 3]).unwrap();
            let drawing = fbuffer.drawing(geometry(&scene, &view)).unwrap();
            let target = fbuffer.target(view.width, view.height, Vec4::ONE).unwrap();
            fbuffer.draw(&drawing, &program, [None; 3], output, &target).unwrap();
            let image = fbuffer.read(&target).unwrap();
            let pairs = image.pixels().iter().zip(expected.color.pixels());
            // Depths are interpolated apart and may differ in a last bit where surfaces meet.
            let differing = pairs.filter(|(have, want)| (**have - **want).abs().max_element() > 1e-6).count();
            assert!(differing <= if output.depth_test { 2 } else { 0 }, "{output:?} in {size}: {differing} pixels");
        }
    }
}

#[test]
fn an_overflow_tells_what_is_needed_and_batches_fit() {
    let Some(device) = device() else { return };
    let scene = pellucid::load("@boxes:n=2").unwrap().scene;
    let view = View::of(&scene).size(71, 53).opacity(0.5);
    let mut fbuffer = buffer(&device, Size::square(32).unwrap(), &[]);
    let text = format!("{LOOK} fn shade(fragment: Fragment) -> vec4<f32> {{ return look(fragment); }}");
    let program = fbuffer.program(&[&text], [None; 3]).unwrap();
    let drawing = fbuffer.drawing(geometry(&scene, &view)).unwrap();
    let target = fbuffer.target(view.width, view.height, Vec4::ZERO).unwrap();
    let error = fbuffer.query(&drawing, &program, [None; 3], Output::default(), &target).unwrap_err();
    assert_eq!(error, FBufferError::Overflow(Overflow { needed: drawing.fragments(), slots: 1024 }));
    assert!(fbuffer.read(&target).unwrap().pixels().iter().all(|&pixel| pixel == Vec4::ZERO));

    fbuffer.draw(&drawing, &program, [None; 3], Output::default(), &target).unwrap();
    let expected = fbuffer.read(&target).unwrap();
    let order = RasterOrder::new(geometry(&scene, &view));
    let target = fbuffer.target(view.width, view.height, Vec4::ZERO).unwrap();
    for batch in order.batches(fbuffer.size()).unwrap() {
        fbuffer.slots(&drawing, &program, [None; 3], order.slots(batch), Output::default(), &target).unwrap();
    }
    assert!(fbuffer.read(&target).unwrap() == expected);
}

#[test]
fn misuse_is_told() {
    let Some(device) = device() else { return };
    let size = Size::square(32).unwrap();
    let new = |name, content| FBuffer::new(&device.0, &device.1, size, &[(name, content)]);
    for (name, content) in [("a b", Content::Targets(1)), ("a", Content::Targets(0)), ("a", Content::Targets(5))] {
        assert!(matches!(new(name, content), Err(FBufferError::Buffer { .. })), "{name} {content:?}");
    }
    let mut fbuffer = buffer(&device, size, &[]);
    assert!(matches!(fbuffer.program(&[], [None; 3]), Err(FBufferError::NoPasses)));
    let good = "fn shade(fragment: Fragment) -> vec4<f32> { return vec4(1.0); }";
    let error = fbuffer.program(&["fn shade(fragment: Fragment) { nothing(); }", good], [None; 3]).unwrap_err();
    assert!(matches!(&error, FBufferError::Pass { number: 1, detail } if detail.contains("nothing")), "{error}");
    let scene = pellucid::load("@cyclic").unwrap().scene;
    let drawing = fbuffer.drawing(geometry(&scene, &View::of(&scene).size(8, 8))).unwrap();
    let (program, target) = (fbuffer.program(&[good], [None; 3]).unwrap(), fbuffer.target(8, 9, Vec4::ZERO).unwrap());
    let error = fbuffer.draw(&drawing, &program, [None; 3], Output::default(), &target).unwrap_err();
    assert_eq!(error, FBufferError::TargetSize { have: [8, 9], need: [8, 8] });
}

#[test]
fn the_sort_is_stable_and_right() {
    let Some((device, queue)) = device() else { return };
    let mix = |slot: u32, salt: u32| (slot ^ salt).wrapping_mul(0x9e37_79b9).rotate_left(13).wrapping_mul(0x85eb_ca6b);
    let lengths = [0, 1, 2, 3, 511, 512, 513, 1023, 1024, 1025, 4095, 4096, 4097, 20_000];
    for length in lengths {
        for (pixels, depths) in [(1, 1), (1, 7), (97, 7), (u32::MAX, u32::MAX)] {
            let key = |slot| Key { pixel: mix(slot, 1) % pixels, depth: mix(slot, 2) % depths, slot };
            let keys: Vec<Key> = (0..length).map(key).collect();
            let mut expected = keys.clone();
            expected.sort_by_key(|key| (key.pixel, key.depth));
            for window in [u64::from(length), 1000] {
                let sorted = sort_keys(&device, &queue, &keys, window).unwrap();
                assert!(sorted == expected, "{length} keys of {pixels} pixels in windows of {window}");
            }
            let mut on_cpu = keys;
            on_cpu.chunks_mut(1000).for_each(sort);
            merge_runs(&mut on_cpu, 1000);
            assert!(on_cpu == expected);
        }
    }
}

#[test]
fn the_technique_holds_what_its_formula_says() {
    let scene = pellucid::load("@fbuffer:figure=sphere,sides=16").unwrap().scene;
    let view = View::of(&scene).size(90, 70);
    let geometry = geometry(&scene, &view);
    assert!(geometry.primitives.iter().all(|primitive| primitive.piece_count == 1), "nothing is clipped");
    let rows: i32 = geometry.primitives.iter().map(|p| p.bounds.bottom - p.bounds.top + 1).sum();
    for size in [Size::square(32).unwrap(), Size::square(256).unwrap()] {
        let Some(gpu) = gpu(false) else { return };
        let renderer = Renderer::new().gpu(gpu.fbuffer_size(Some(size))).technique(Technique::FBuffer);
        let stats = renderer.render(&scene, &view, Resolve::Blend).unwrap().stats;
        let (triangles, rows) = (geometry.primitives.len() as u64, rows as u64);
        let merges = stats.fragments > size.slots();
        let formula = 8 * 90 * 70
            + 80 * triangles
            + 20 * rows
            + (if merges { 40 } else { 28 }) * stats.fragments
            + 32 * size.slots().min(stats.fragments);
        // Headers, sums of sums, and the parameters of each step of the sort.
        let rest = stats.peak_bytes.checked_sub(formula).expect("no less than the formula");
        assert!(rest < 300 * 256, "{rest} bytes more than {formula} in {size}");
    }
}
