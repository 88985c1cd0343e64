//! Passes through a framebuffer on the GPU: right where surfaces do not overlap, wrong where they do, as on the CPU.

use glam::Vec4;
use pellucid::core::fbuffer::order::Geometry;
use pellucid::core::fbuffer::{Drawn, Output, RasterOrder, Size, Windows};
use pellucid::core::primitive::Pass;
use pellucid::fbuffer::{Program, Target, Verdict, draw_through_framebuffer};
use pellucid::gpu::fbuffer::{Content, FBuffer, FBufferError, Framebuffer};
use pellucid::gpu::{Context, ContextOptions, wgpu};
use pellucid::multi_pass::{self, GpuMultiPass, Shader, Through, differing_pixels};
use pellucid::{Image, Scene, View};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

mod common;
#[path = "common/soup.rs"]
mod soup;

/// A device of somebody else, on WebGPU's default limits. Its errors panic.
fn device() -> Option<(wgpu::Device, wgpu::Queue)> {
    common::gpu(true)?;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).unwrap();
    Some(pollster::block_on(adapter.request_device(&Default::default())).unwrap())
}

fn geometry<'a>(scene: &'a Scene, view: &View) -> Geometry<'a> {
    Geometry::new(scene, view, Pass::Transparent).unwrap()
}

fn load(source: &str) -> (Scene, View) {
    let scene = pellucid::load(source).unwrap().scene;
    let view = View::of(&scene).size(61, 47).opacity(0.5);
    (scene, view)
}

/// Colours that CPU and GPU compute alike, to the last bit, handed from buffer to buffer; each pass ends fragments of some
/// triangles.
const PASSES: [&str; 3] = [
    "fn shade(fragment: Fragment) {
        let share = f32(fragment.triangle % 8u) / 16.0;
        a_store(fragment, 1u, vec4(share, 0.0, 0.25, f32(fragment.triangle % 3u + 1u) / 4.0));
        if fragment.triangle % 7u == 0u { fbuffer_kill(fragment); }
    }",
    "fn shade(fragment: Fragment) {
        b_store(fragment, Carried(7u, a_load(fragment, 1u)));
        if fragment.triangle % 5u == 0u { fbuffer_kill(fragment); }
    }",
    "fn shade(fragment: Fragment) -> vec4<f32> {
        let carried = b_load(fragment);
        if fragment.triangle % 11u == 0u { fbuffer_kill(fragment); }
        // What the last pass leaves is not for others.
        b_store(fragment, Carried(0u, vec4(9.0)));
        return carried.color;
    }",
];

const CONTENTS: [(&str, Content<'_>); 2] = [
    ("a", Content::Targets(2)),
    (
        "b",
        Content::State { name: "Carried", declaration: "struct Carried { mark: u32, color: vec4<f32> }", stride: 32 },
    ),
];

/// The same on the CPU.
fn program() -> Program<'static, [Vec4; 2]> {
    let unless = |is_killed| if is_killed { Verdict::Kill } else { Verdict::Keep };
    Program::new(|fragment, slot: &[Vec4; 2]| (fragment.triangle % 11 != 0).then_some(slot[1]))
        .pass(move |fragment, slot| {
            let share = (fragment.triangle % 8) as f32 / 16.0;
            slot[0] = Vec4::new(share, 0.0, 0.25, (fragment.triangle % 3 + 1) as f32 / 4.0);
            unless(fragment.triangle.is_multiple_of(7))
        })
        .pass(move |fragment, slot| {
            slot[1] = slot[0];
            unless(fragment.triangle.is_multiple_of(5))
        })
}

const GROUND: Vec4 = Vec4::new(0.5, 0.25, 0.125, 1.0);

fn through_framebuffer(
    (device, queue): &(wgpu::Device, wgpu::Queue),
    (scene, view): (&Scene, &View),
    window: Size,
) -> (Image, Drawn, u64) {
    let framebuffer = Framebuffer::new(device, queue, [view.width, view.height], window, &CONTENTS).unwrap();
    let program = framebuffer.program(&PASSES, [None; 3]).unwrap();
    let drawing = framebuffer.drawing(geometry(scene, view)).unwrap();
    let target = framebuffer.target(GROUND).unwrap();
    let drawn = framebuffer.draw(&drawing, &program, [None; 3], Output::default(), &target).unwrap();
    (framebuffer.read(&target).unwrap(), drawn, framebuffer.bytes())
}

#[test]
fn a_framebuffer_is_wrong_where_surfaces_overlap_and_as_wrong_as_on_the_cpu() {
    let Some(device) = device() else { return };
    for source in ["@cyclic", "@boxes:n=2", "@spheres:n=8,subdivisions=2"] {
        let (scene, view) = load(source);
        let order = RasterOrder::new(geometry(&scene, &view));
        let mut expected = Target::new(view.width, view.height, GROUND);
        draw_through_framebuffer(&order, &program(), Output::default(), &mut expected);
        let mut right = Target::new(view.width, view.height, GROUND);
        pellucid::fbuffer::FBuffer::new(Size::square(64).unwrap()).draw(
            &order,
            &program(),
            Output::default(),
            &mut right,
        );
        let mut depth_complexity = vec![0; (view.width * view.height) as usize];
        order.rasterize(0..order.fragments(), |place| {
            depth_complexity[(place.y * view.width + place.x) as usize] += 1;
        });
        let pixels = u64::from(view.width * view.height);
        for window in [Size::square(256), Size::square(32), Size::row(64)].map(Result::unwrap) {
            let (image, drawn, bytes) = through_framebuffer(&device, (&scene, &view), window);
            assert!(image == expected.color, "{source} in windows of {window}");
            let windows = Windows::new(order.fragments(), window).count();
            assert_eq!((drawn.windows, drawn.submissions, drawn.fragments), (windows, 2 + windows, order.fragments()));
            // Contents and a state at each pixel; places, final colours and keys in each slot.
            let stages = bytes - pixels * (32 + 32 + 16) - window.slots() * (16 + 16 + 12);
            assert!(stages < 16 + 256 * 100, "{stages} bytes besides");
        }
        let pairs = expected.color.pixels().iter().zip(right.color.pixels()).zip(&depth_complexity);
        let wrong: Vec<i32> = pairs.filter(|((have, want), _)| have != want).map(|(_, &count)| count).collect();
        let overlapping = depth_complexity.iter().filter(|&&count| count > 1).count();
        assert!(wrong.iter().all(|&count| count > 1), "{source}: wrong where one fragment is");
        assert!(wrong.len() * 10 > overlapping, "{source}: {} of {overlapping} pixels", wrong.len());
    }
}

/// Of any scene, what was drawn last is what the CPU drew last.
#[test]
fn the_last_drawn_fragment_of_random_soups_is_that_of_the_cpu() {
    let Some((device, queue)) = device() else { return };
    let size = [53, 41];
    let window = Size::square(32).unwrap();
    let framebuffer = Framebuffer::new(&device, &queue, size, window, &CONTENTS).unwrap();
    let on_gpu = framebuffer.program(&PASSES, [None; 3]).unwrap();
    // Blending would add up what is rounded differently.
    let output = Output { blend: false, ..Output::default() };
    let config = ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() };
    let strategy = (soup::soup(), soup::camera());
    TestRunner::new(config)
        .run(&strategy, |(scene, camera)| {
            let view = View { camera, ..View::of(&scene).size(size[0], size[1]).opacity(0.5) };
            let mut expected = Target::new(size[0], size[1], GROUND);
            let order = RasterOrder::new(geometry(&scene, &view));
            draw_through_framebuffer(&order, &program(), output, &mut expected);
            let drawing = framebuffer.drawing(geometry(&scene, &view)).unwrap();
            let target = framebuffer.target(GROUND).unwrap();
            framebuffer.draw(&drawing, &on_gpu, [None; 3], output, &target).unwrap();
            prop_assert!(framebuffer.read(&target).unwrap() == expected.color);
            Ok(())
        })
        .unwrap();
}

#[test]
fn what_is_for_the_other_kind_of_buffer_is_told() {
    let Some((device, queue)) = device() else { return };
    let (scene, view) = load("@cyclic");
    let size = Size::square(128).unwrap();
    let mut fbuffer = FBuffer::new(&device, &queue, size, &CONTENTS).unwrap();
    let framebuffer = Framebuffer::new(&device, &queue, [61, 47], size, &CONTENTS).unwrap();
    let programs = [fbuffer.program(&PASSES, [None; 3]).unwrap(), framebuffer.program(&PASSES, [None; 3]).unwrap()];
    let drawings =
        [fbuffer.drawing(geometry(&scene, &view)).unwrap(), framebuffer.drawing(geometry(&scene, &view)).unwrap()];
    let target = framebuffer.target(GROUND).unwrap();
    for (drawing, program) in [(0, 1), (1, 0), (1, 1), (0, 0)] {
        let (drawing_there, program_there) = (&drawings[drawing], &programs[program]);
        let output = Output::default();
        let slots = fbuffer.draw(drawing_there, program_there, [None; 3], output, &target).map(drop);
        let pixels = framebuffer.draw(drawing_there, program_there, [None; 3], output, &target).map(drop);
        let or_mixed = |fits| if fits { Ok(()) } else { Err(FBufferError::Mixed) };
        assert_eq!((slots, pixels), (or_mixed(drawing + program == 0), or_mixed(drawing + program == 2)));
    }
    let other = view.size(62, 47);
    let error = framebuffer.drawing(geometry(&scene, &other)).unwrap_err();
    assert_eq!(error, FBufferError::TargetSize { have: [61, 47], need: [62, 47] });
}

/// The shaders of `render --shader`: the CPU's pictures.
#[test]
fn pictures_by_shaders_of_several_passes_are_those_of_the_cpu() {
    if common::gpu(false).is_none() {
        return;
    }
    let context = Context::new(&ContextOptions { floor: true, allow_software: true }).unwrap();
    let mut gpu = GpuMultiPass::new(context);
    let small = Through::FBuffer(Size::square(32).unwrap());
    let large = Through::FBuffer(Size::square(256).unwrap());
    for (source, shader, tolerated) in [
        ("@fbuffer", Shader::Lighting, 0),
        ("@fbuffer:figure=rainbow", Shader::Lighting, 0),
        // Opaque surfaces behind, instances of a mesh, flat and smooth.
        ("@spheres:n=8,subdivisions=2", Shader::Lighting, 0),
        ("@boxes:n=2", Shader::PittedGlass, 30),
        ("@fbuffer:figure=sphere,sides=24", Shader::PittedGlass, 30),
    ] {
        let scene = pellucid::load(source).unwrap().scene;
        let view = View::of(&scene).size(80, 70);
        let whole = gpu.render(&scene, &view, shader, large).unwrap();
        for through in [large, small, Through::Framebuffer] {
            let want = multi_pass::render(&scene, &view, shader, through).unwrap();
            let have = gpu.render(&scene, &view, shader, through).unwrap();
            assert_eq!(have.drawn.fragments, want.drawn.fragments);
            if through != Through::Framebuffer {
                assert_eq!(have.drawn, want.drawn);
                assert!(have.image == whole.image, "{source}: other bits {through:?}");
            }
            // At edges of tiles and pits a last bit decides.
            let differing = differing_pixels(&have.image, &want.image);
            assert!(differing <= tolerated, "{source} {through:?}: {differing} pixels differ");
        }
        if source != "@boxes:n=2" && source != "@fbuffer:figure=rainbow" {
            let wrong = gpu.render(&scene, &view, shader, Through::Framebuffer).unwrap();
            assert!(differing_pixels(&wrong.image, &whole.image) > 100, "{source}");
        }
    }
}

#[test]
fn memory_shown_is_that_of_the_cpu_and_textures_are_refused() {
    if common::gpu(false).is_none() {
        return;
    }
    let context = Context::new(&ContextOptions { floor: true, allow_software: true }).unwrap();
    let mut gpu = GpuMultiPass::new(context);
    let scene = pellucid::load("@fbuffer:figure=rainbow").unwrap().scene;
    let view = View::of(&scene).size(256, 256);
    for side in [32, 128] {
        let size = Size::square(side).unwrap();
        let (want, windows) = multi_pass::slots(&scene, &view, Shader::Lighting, size).unwrap();
        let (have, of_gpu) = gpu.slots(&scene, &view, Shader::Lighting, size).unwrap();
        assert_eq!((of_gpu, differing_pixels(&have, &want)), (windows, 0), "{side}");
    }
    let scene = pellucid::load("@tree").unwrap().scene;
    let error = gpu.render(&scene, &View::of(&scene).size(8, 8), Shader::Lighting, Through::Framebuffer).unwrap_err();
    assert!(matches!(error, pellucid::Error::Textures), "{error}");
}
