//! LucidRaster: its depth filter of any size, its threshold, and scenes that rasterizers in compute fail at. That it agrees
//! with the oracle in every case of the suite, at any budget and on the portability floor, stands in `gpu.rs`.

mod common;
#[path = "common/flat_view.rs"]
mod flat_view;

use glam::{Affine3A, Vec3, Vec4};
use pellucid::core::oracle;
use pellucid::gpu::{DepthFilter, GpuRenderer};
use pellucid::{Frame, Instance, Material, Mesh, Renderer, Resolve, Scene, Technique, View};
use pellucid_conformance::suite::{CASES, Candidate, Check, Prepared};

use common::gpu;
use flat_view::flat_view;

const BEHIND: Vec4 = Vec4::new(0.1, 0.2, 0.3, 1.0);
const RED: Vec4 = Vec4::new(1.0, 0.0, 0.0, 1.0);

fn render(gpu: &GpuRenderer, scene: &Scene, view: &View, resolve: Resolve) -> Frame {
    gpu.render(scene, view, resolve, Technique::Lucid).unwrap()
}

fn filter(size: u32) -> DepthFilter {
    DepthFilter { size, ..DepthFilter::default() }
}

/// Against what all fragments make that are sorted pixel by pixel; that this is right, `gpu.rs` tells. On the portability floor,
/// on which nothing is done otherwise.
#[test]
fn filters_of_any_size_give_the_same_bits_and_show_what_they_leave_out_of_order() {
    let Some(mut gpu) = gpu(true) else { return };
    let (mut repaired, mut worst) = ([0; 4], 0);
    for case in CASES {
        let (scene, view) = case.load().unwrap();
        gpu = gpu.presort(true);
        let sorted = render(&gpu, &scene, &view, Resolve::Blend);
        gpu = gpu.presort(false);
        for (size, repaired) in [1, 3, 8, 12].into_iter().zip(&mut repaired) {
            gpu = gpu.depth_filter(filter(size));
            let frame = render(&gpu, &scene, &view, Resolve::Blend);
            assert!(frame.image == sorted.image, "{case:?}, filter of {size}");
            assert_eq!(frame.stats.fragments, sorted.stats.fragments);
            assert_eq!((sorted.stats.repaired_pixels, frame.stats.cut_pixels), (0, 0));
            *repaired += frame.stats.repaired_pixels;
            if size != 1 || frame.stats.repaired_pixels == 0 {
                continue;
            }
            worst = worst.max(frame.stats.repaired_pixels);
            let errors = render(&gpu, &scene, &view, Resolve::Errors);
            assert_eq!(errors.stats.repaired_pixels, frame.stats.repaired_pixels, "{case:?}");
            let pairs = || errors.image.pixels().iter().zip(frame.image.pixels());
            assert_eq!(pairs().filter(|&(shown, _)| *shown == RED).count() as u64, frame.stats.repaired_pixels);
            assert!(pairs().all(|(shown, pixel)| *shown == RED || shown == pixel), "{case:?}");
        }
    }
    assert!(worst > 10 && repaired.is_sorted_by(|a, b| a >= b) && repaired[0] > repaired[2], "{repaired:?}");
}

#[test]
fn twenty_frames_are_the_same_bits() {
    let Some(gpu) = gpu(false) else { return };
    let gpu = gpu.depth_filter(filter(1));
    let scene = pellucid::load("@hairball:strands=60,segments=12").unwrap().scene;
    let view = View::of(&scene).size(93, 71).opacity(0.5);
    let first = render(&gpu, &scene, &view, Resolve::Blend);
    assert!(first.stats.repaired_pixels > 0);
    for _ in 0..19 {
        let frame = render(&gpu, &scene, &view, Resolve::Blend);
        assert!(frame.image == first.image);
        let figures =
            |frame: &Frame| (frame.stats.fragments, frame.stats.repaired_pixels, frame.stats.half_block_parts);
        assert_eq!(figures(&frame), figures(&first));
    }
}

/// Many surfaces that let half of the light through.
#[test]
fn a_threshold_leaves_pixels_and_says_so() {
    let Some(mut gpu) = gpu(false) else { return };
    let scene = pellucid::load("@planes:n=64").unwrap().scene;
    let view = View::of(&scene).size(40, 30);
    let whole = render(&gpu, &scene, &view, Resolve::Blend);
    gpu = gpu.depth_filter(DepthFilter { threshold: 1.0 / 128.0, ..DepthFilter::default() });
    let left = render(&gpu, &scene, &view, Resolve::Blend);
    assert!(left.stats.cut_pixels > 0 && !left.stats.is_exact() && whole.stats.is_exact());
    // What is not seen any more had less than the threshold to show, and that at most as bright as light itself.
    let difference = |(a, b): (&Vec4, &Vec4)| (*a - *b).abs().max_element();
    let greatest = left.image.pixels().iter().zip(whole.image.pixels()).map(difference).fold(0.0, f32::max);
    assert!(greatest > 0.0 && greatest <= 1.0 / 128.0, "{greatest}");
}

fn scene_of(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Scene {
    let mut scene = Scene::new();
    let mesh = scene.add_mesh(Mesh::new(positions, triangles).unwrap()).unwrap();
    let material = scene.add_material(Material::translucent("", Vec4::new(0.2, 0.5, 0.9, 0.25))).unwrap();
    scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY }).unwrap();
    scene
}

/// Triangles of a size within a square around a place, near or far in no order.
fn crowd(count: u32, middle: Vec3, reach: f32, size: f32) -> Scene {
    let mut state = 1u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 23) as f32 - 1.0
    };
    let positions = (0..count).flat_map(|_| {
        let corner = middle + Vec3::new(random(), random(), 0.0) * reach + Vec3::Z * random() * 4.0;
        [corner, corner + Vec3::X * size, corner + Vec3::Y * size]
    });
    scene_of(positions.collect(), (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// With what the oracle says.
fn prepared(scene: Scene, view: View) -> Prepared {
    Prepared { capture: oracle::capture(&scene, &view).unwrap(), scene, view }
}

#[test]
fn scenes_at_the_limits_agree_with_the_oracle() {
    let Some(gpu) = gpu(false) else { return };
    let candidate = Candidate::new(Technique::Lucid, Renderer::new().gpu(gpu));
    let triangle = |side: f32| {
        scene_of(
            vec![Vec3::new(-side, -side, 0.0), Vec3::new(side, -side, 0.5), Vec3::new(0.0, side, -0.5)],
            vec![[0, 1, 2]],
        )
    };
    let flat = |scene: Scene, width, height| {
        let view = flat_view(&scene, width, height).background(BEHIND);
        prepared(scene, view)
    };
    let boxes = || pellucid::load("@boxes:n=3").unwrap().scene;
    let of_boxes = |width, height| {
        let scene = boxes();
        let view = View::of(&scene).size(width, height).opacity(0.5);
        prepared(scene, view)
    };
    let inside = || {
        let scene = boxes();
        let mut view = View::of(&scene).size(75, 51).opacity(0.5);
        view.camera.eye = scene.bounding_sphere().center + Vec3::new(0.01, 0.02, 0.03);
        view.camera.target = view.camera.eye + Vec3::new(1.0, 0.3, -0.2);
        prepared(scene, view)
    };
    let pixel = 2.0 / 48.0;
    let cases: [(&str, Prepared); 10] = [
        ("no triangle", flat(Scene::new(), 33, 17)),
        ("one triangle", flat(triangle(0.7), 61, 43)),
        ("one triangle far beyond the picture", flat(triangle(1e4), 61, 43)),
        ("15,999 triangles", flat(crowd(15_999, Vec3::ZERO, 1.2, 0.1), 64, 48)),
        (
            "all in one pixel",
            flat(crowd(3000, Vec3::new(0.5 * pixel, 0.5 * pixel, 0.0), 0.2 * pixel, 1.5 * pixel), 64, 48),
        ),
        ("all in one block", flat(crowd(9000, Vec3::new(4.0 * pixel, 4.0 * pixel, 0.0), 2.0 * pixel, pixel), 64, 48)),
        ("from inside", inside()),
        ("1 x 1", of_boxes(1, 1)),
        ("31 x 33", of_boxes(31, 33)),
        ("a row", of_boxes(257, 1)),
    ];
    for (what, prepared) in &cases {
        for check in [Check::Layers, Check::Picture(Resolve::Blend), Check::Picture(Resolve::Gelly)] {
            let comparison = prepared.run(check, &candidate).unwrap();
            assert!(comparison.passes(), "{what}, {check}: {comparison:?}");
        }
    }
}

/// More pixels than any screen, and half a gigabyte of them.
#[test]
fn a_picture_of_33_million_pixels_is_whole() {
    let Some(gpu) = gpu(false) else { return };
    let corners = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
    let scene = scene_of(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
    let view = flat_view(&scene, 7680, 4320).background(BEHIND);
    let frame = render(&gpu, &scene, &view, Resolve::Blend);
    assert_eq!(frame.stats.fragments, 7680 * 4320);
    let expected = Vec3::new(0.2, 0.5, 0.9) * 0.25 + BEHIND.truncate() * 0.75;
    let is_right = |pixel: &Vec4| (pixel.truncate() - expected).abs().max_element() < 1e-3;
    assert!(frame.image.pixels().iter().all(is_right), "{:?}", frame.image.pixels().iter().find(|p| !is_right(p)));
}

/// Twenty instances of a file of the folder in `PELLUCID_SCENES`, which is too large for the project: skipped with a notice where
/// it is not there.
#[test]
fn twelve_million_triangles_agree_with_the_cpu() {
    let path = std::env::var_os("PELLUCID_SCENES")
        .map(|folder| std::path::Path::new(&folder).join("gltf/GearboxAssy/GearboxAssy.glb"))
        .filter(|path| path.exists());
    let Some(path) = path else {
        return eprintln!("skipped: set PELLUCID_SCENES to a folder with gltf/GearboxAssy/GearboxAssy.glb");
    };
    let Some(gpu) = gpu(false) else { return };
    let mut scene = pellucid::load_file(&path).unwrap().scene;
    let sphere = scene.bounding_sphere();
    let instances = scene.instances().to_vec();
    for copy in 1..20 {
        let place = Vec3::new((copy % 5) as f32, (copy / 5) as f32, 0.0) * sphere.radius;
        for instance in &instances {
            let world_from_mesh = Affine3A::from_translation(place) * instance.world_from_mesh;
            scene.add_instance(Instance { world_from_mesh, ..*instance }).unwrap();
        }
    }
    let view = View::of(&scene).size(640, 360).opacity(0.3);
    let frame = render(&gpu, &scene, &view, Resolve::Blend);
    let expected = Renderer::new().render(&scene, &view, Resolve::Blend).unwrap();
    eprintln!("{:?}", frame.stats);
    // Both snap to the same grid, but their transforms may round differently.
    let [ours, theirs] = [&frame, &expected].map(|frame| frame.stats.fragments as f64);
    assert!(frame.stats.triangles > 10_000_000 && (ours / theirs - 1.0).abs() < 1e-4, "{ours} of {theirs} fragments");
    let pixels = frame.image.pixels().iter().zip(expected.image.pixels());
    let differing = pixels.filter(|(a, b)| (**a - **b).abs().max_element() > 1.0 / 255.0).count();
    assert!(differing * 1000 < frame.image.pixels().len(), "{differing} pixels differ");
}

/// Files of the folder in `PELLUCID_SCENES`, with subgroups where the device has them and without: skipped with a notice where they
/// are not there.
#[test]
fn real_scenes_agree_with_the_oracle_at_any_filter() {
    let Some(folder) = std::env::var_os("PELLUCID_SCENES") else {
        return eprintln!("skipped: set PELLUCID_SCENES to a folder of scenes");
    };
    let mut scenes = Vec::new();
    for path in [
        "stanford_bunny/bunny_69k.ply",
        "stanford_dragon/dragon_871k.ply",
        "sintel_hair/sintel_hair_tubes.ply",
        "crytek_sponza/crytek_sponza.glb",
        "oak_tree/oak_tree.glb",
        "conference_room/conference.glb",
        "brain/brain_fsaverage5.glb",
    ] {
        let file = std::path::Path::new(&folder).join(path);
        if !file.exists() {
            eprintln!("skipped: there is no '{}'", file.display());
            continue;
        }
        let scene = pellucid::load_file(&file).unwrap().scene;
        let view = View::of(&scene).size(40, 30).opacity(0.5);
        scenes.push((path, prepared(scene, view)));
    }
    let mut failures = Vec::new();
    for (floor, size) in [false, true].into_iter().flat_map(|floor| [1, 3, 8].map(|size| (floor, size))) {
        let Some(gpu) = gpu(floor) else { return };
        let candidate = Candidate::new(Technique::Lucid, Renderer::new().gpu(gpu.depth_filter(filter(size))));
        for (path, prepared) in &scenes {
            for check in [Check::Layers, Check::Picture(Resolve::Blend)] {
                let comparison = prepared.run(check, &candidate).unwrap();
                // Of the layers of a pixel, hundreds of them, one often is ambiguous; the picture hides nothing in that.
                let agrees = comparison.passes() || check == Check::Layers && comparison.unexplained == 0;
                if !agrees || comparison.covered == 0 {
                    failures.push(format!("{path}, floor: {floor}, filter of {size}, {check}: {comparison:?}"));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
