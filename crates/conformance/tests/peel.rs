//! Depth peeling: coplanar fragments, layers that are cut off, and what is recorded once and replayed.

mod common;

use std::cell::RefCell;

use glam::{Affine3A, Quat, Vec3, Vec4};
use pellucid::gpu::GpuRenderer;
use pellucid::{
    AlphaMode, Frame, Image, Instance, Layers, Material, Mesh, Renderer, Resolve, Scene, Shading, Technique, View,
};
use pellucid_conformance::images::compare;
use pellucid_conformance::layers::{gather, is_covered};

use common::gpu;

const RESOLVES: [Resolve; 7] = [
    Resolve::Blend,
    Resolve::BlendCorrected,
    Resolve::Gelly,
    Resolve::Nearest,
    Resolve::Layer(1),
    Resolve::Layer(3),
    Resolve::Complexity(0),
];

fn peel(gpu: GpuRenderer) -> Renderer {
    Renderer::new().gpu(gpu).technique(Technique::Peel)
}

/// Squares in one plane, three by three over each other, drawn in this order: every one a mesh or all of them one.
fn coplanar(count: u32, in_one_mesh: bool) -> Scene {
    let mut scene = Scene::new();
    let square = |i: u32| {
        let shift = Vec3::new((i % 3) as f32, (i / 3 % 3) as f32, 0.0) * 0.1;
        [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0), Vec3::new(-1.0, 1.0, 0.0)]
            .map(|corner| corner + shift)
    };
    let color = |i: u32| Vec4::new((i % 2) as f32, (i % 3) as f32 / 2.0, (i % 5) as f32 / 4.0, 0.3);
    let world_from_mesh = Affine3A::from_quat(Quat::from_rotation_y(0.4) * Quat::from_rotation_x(0.3));
    let mut add = |mesh: Mesh, base_color| {
        let material = Material { base_color, alpha_mode: AlphaMode::Blend, ..Material::default() };
        let material = scene.add_material(material).unwrap();
        let mesh = scene.add_mesh(mesh).unwrap();
        scene.add_instance(Instance { mesh, material, world_from_mesh }).unwrap();
    };
    let triangles = |first: u32| [[first, first + 1, first + 2], [first, first + 2, first + 3]];
    if in_one_mesh {
        let positions = (0..count).flat_map(square).collect();
        let colors = (0..count).flat_map(|i| [color(i); 4]).collect();
        let mesh = Mesh::new(positions, (0..count).flat_map(|i| triangles(i * 4)).collect()).unwrap();
        add(mesh.with_colors(colors).unwrap(), Vec4::ONE);
    } else {
        (0..count).for_each(|i| add(Mesh::new(square(i).to_vec(), triangles(0).to_vec()).unwrap(), color(i)));
    }
    scene
}

#[test]
fn every_coplanar_fragment_is_peeled_in_order() {
    for floor in [false, true] {
        let Some(device) = gpu(floor) else { return };
        let whole = peel(device);
        for in_one_mesh in [false, true] {
            let scene = coplanar(20, in_one_mesh);
            let mut view = View::of(&scene).size(61, 47);
            view.shading = Shading::Unlit;
            let layers = gather(&whole, &scene, &view).unwrap();
            let expected = gather(&Renderer::new().technique(Technique::Oracle), &scene, &view).unwrap();
            let primitives = |layers: &Layers, x, y| -> Vec<u32> {
                layers.pixel(x, y).iter().map(|fragment| fragment.primitive).collect()
            };
            let mut complete = 0;
            for y in 0..view.height {
                for x in 0..view.width {
                    // Rounding parts what is coplanar, but loses nothing: the order is that of the depths there are.
                    let have = layers.pixel(x, y);
                    assert!(have.is_sorted_by(|a, b| a.order_key() > b.order_key()), "{x}, {y}: {have:?}");
                    let (mut have, mut want) = (primitives(&layers, x, y), primitives(&expected, x, y));
                    have.sort_unstable();
                    want.sort_unstable();
                    complete += usize::from(have == want);
                }
            }
            // Other rounding at edges may cover a pixel more or less.
            assert!(complete + 20 >= (view.width * view.height) as usize, "{complete} pixels");
        }
    }
}

#[test]
fn exactly_coplanar_squares_show_the_later_drawn_in_front() {
    let Some(device) = gpu(false) else { return };
    // All corners in the same place: all depths are the same bits.
    let mut scene = Scene::new();
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
    let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let mesh = scene.add_mesh(mesh).unwrap();
    for i in 0..12 {
        let base_color = Vec4::new((i % 2) as f32, (i % 3) as f32 / 2.0, 0.5, 0.4);
        let material = Material { base_color, alpha_mode: AlphaMode::Blend, ..Material::default() };
        let material = scene.add_material(material).unwrap();
        scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::from_rotation_y(0.7) }).unwrap();
    }
    let view = View::of(&scene).size(33, 27);
    let capture = pellucid::core::oracle::capture(&scene, &view).unwrap();
    let renderer = peel(device);
    let layers = gather(&renderer, &scene, &view).unwrap();
    let middle: Vec<u32> = layers.pixel(16, 13).iter().map(|fragment| fragment.primitive / 2).collect();
    assert_eq!(middle, (0..12).rev().collect::<Vec<_>>());
    for resolve in RESOLVES {
        let (expected, _) = pellucid::core::oracle::resolve_capture(&capture, &scene, &view, resolve);
        let frame = renderer.render(&scene, &view, resolve).unwrap();
        let never = vec![false; (view.width * view.height) as usize];
        let covered = |x, y| is_covered(&capture.layers, x, y);
        let comparison = compare(&expected, &never, covered, &frame.image);
        assert!(comparison.agreeing + 4 >= u64::from(view.width * view.height), "{resolve}: {comparison:?}");
    }
}

#[test]
fn layers_that_are_cut_off_are_counted() {
    for floor in [false, true] {
        let Some(mut device) = gpu(floor) else { return };
        let scene = pellucid::load("@boxes:n=3").unwrap().scene;
        let view = View::of(&scene).size(83, 61).opacity(0.5);
        let render = |device: &GpuRenderer, resolve| device.render(&scene, &view, resolve, Technique::Peel).unwrap();
        let exact = render(&device, Resolve::Blend).image;
        let complexity = RefCell::default();
        let count = |layers: &Layers| {
            let pixels = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
            complexity.replace(pixels.map(|(x, y)| ((x, y), layers.depth_complexity(x, y))).collect());
        };
        let stats = device.layers(&scene, &view, Technique::Peel, count).unwrap();
        assert_eq!(stats.windows, 1);
        let complexity: Vec<((u32, u32), u32)> = complexity.into_inner();
        let greatest = complexity.iter().map(|&(_, layers)| layers).max().unwrap();
        for limit in 1..=greatest + 1 {
            device = device.max_layers(Some(limit));
            let (cut, whole): (Vec<_>, Vec<_>) = complexity.iter().partition(|(_, layers)| *layers > limit);
            let Frame { image, stats } = render(&device, Resolve::Blend);
            assert_eq!(stats.cut_pixels, cut.len() as u64, "{limit} layers");
            assert_eq!(stats.is_exact(), limit >= greatest);
            assert_eq!(stats.max_depth_complexity, greatest.min(limit));
            // What is not cut is the same picture.
            for ((x, y), _) in whole {
                assert_eq!(image.pixel(x, y), exact.pixel(x, y));
            }
        }
        // A resolve that asks for no more than is allowed is exact.
        device = device.max_layers(Some(2));
        for (resolve, is_exact) in
            [(Resolve::Nearest, true), (Resolve::Layer(2), true), (Resolve::Layer(3), false), (Resolve::Gelly, false)]
        {
            assert_eq!(render(&device, resolve).stats.is_exact(), is_exact, "{resolve}");
        }
    }
}

#[test]
fn windows_without_attachments_show_the_same_bits() {
    for floor in [false, true] {
        let Some(device) = gpu(floor) else { return };
        let whole = peel(device);
        let mut limited = peel(gpu(floor).unwrap());
        // The tree is drawn a hundred times for each picture: one resolve of it, that which needs the most state.
        for (source, resolves) in
            [("@tree:leaves=100", &[Resolve::Gelly][..]), ("@planes:n=6", &RESOLVES), ("@spheres:n=12", &RESOLVES)]
        {
            let scene = pellucid::load(source).unwrap().scene;
            let view = View::of(&scene).size(31, 23).opacity(0.9);
            let layers = gather(&whole, &scene, &view).unwrap();
            for &resolve in resolves {
                let expected = whole.render(&scene, &view, resolve).unwrap();
                for parts in [2, 7] {
                    let budget_bytes = expected.stats.peak_bytes / parts;
                    limited = limited.budget_bytes(budget_bytes);
                    let frame = limited.render(&scene, &view, resolve).unwrap();
                    assert!(frame.stats.peak_bytes <= budget_bytes && u64::from(frame.stats.windows) >= parts);
                    assert_eq!(first_difference(&expected.image, &frame.image), None, "{source}, {resolve}");
                    assert_eq!(frame.stats.fragments, expected.stats.fragments);
                }
            }
            limited = limited.budget_bytes(9000);
            assert!(gather(&limited, &scene, &view).unwrap() == layers, "{source}: other layers");
        }
    }
}

fn first_difference(expected: &Image, image: &Image) -> Option<(usize, Vec4, Vec4)> {
    let pixels = expected.pixels().iter().zip(image.pixels()).enumerate();
    pixels.map(|(i, (&want, &have))| (i, want, have)).find(|(_, want, have)| want != have)
}

#[test]
fn a_replayed_recording_shows_the_scene_as_it_is_now() {
    let Some(device) = gpu(false) else { return };
    let renderer = peel(device);
    let fresh =
        |scene: &Scene, view: &View| peel(gpu(false).unwrap()).render(scene, view, Resolve::Blend).unwrap().image;
    let scenes = ["@boxes:n=3", "@tree:leaves=100", "@boxes:n=2"].map(|source| pellucid::load(source).unwrap().scene);
    // Another size, another camera, another part of the scene in the transparent pass.
    let looks = [((40, 30), 1.0, 0.0), ((40, 30), 1.0, 0.5), ((40, 30), 0.5, 0.5), ((57, 31), 0.5, 0.5)];
    let pictures = scenes.each_ref().map(|scene| {
        looks.map(|(size, opacity, turn)| {
            let mut view = View::of(scene).size(size.0, size.1).opacity(opacity);
            let camera = &mut view.camera;
            camera.eye = camera.target + Quat::from_rotation_y(turn) * (camera.eye - camera.target);
            let expected = fresh(scene, &view);
            (view, expected)
        })
    });
    for _ in 0..2 {
        for (scene, pictures) in scenes.iter().zip(&pictures) {
            for (view, expected) in pictures {
                for _ in 0..3 {
                    let image = renderer.render(scene, view, Resolve::Blend).unwrap().image;
                    assert_eq!(first_difference(expected, &image), None);
                }
            }
        }
    }
}
