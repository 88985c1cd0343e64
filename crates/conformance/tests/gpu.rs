//! Every exact technique of the GPU against the oracle, in every case of the suite; its bits at any budget and every time,
//! and, of those that differ in where they keep fragments and in nothing else, the bits of each other.

mod common;
#[path = "common/flat_view.rs"]
mod flat_view;

use std::cell::RefCell;
use std::sync::LazyLock;

use glam::{Affine3A, Vec3, Vec4};
use pellucid::core::oracle;
use pellucid::gpu::{GpuError, GpuRenderer};
use pellucid::{Error, Image, Instance, Layers, Material, Mesh, Renderer, Resolve, Scene, Technique, View};
use pellucid_conformance::suite::{Candidate, Case, Check, Prepared, Subject, prepare_all};

use common::gpu;
use flat_view::flat_view;

/// Exact techniques that run on the GPU.
fn techniques() -> impl Iterator<Item = Technique> {
    Technique::ALL.into_iter().filter(|technique| technique.backend() == "gpu" && technique.is_exact())
}

/// The suite's cases with what the oracle captures of them, which takes seconds.
static CASES: LazyLock<Vec<(&Case, Prepared)>> = LazyLock::new(|| prepare_all().unwrap());

/// Layered fragment buffers.
const LFBS: [Technique; 4] = [Technique::Linear, Technique::List, Technique::Pages, Technique::ABuffer];

/// Remembers all that a technique has made.
struct Witness<'a> {
    candidate: &'a Candidate,
    layers: RefCell<Vec<Layers>>,
    images: RefCell<Vec<Image>>,
}

impl Subject for Witness<'_> {
    fn layers(&self, scene: &Scene, view: &View) -> Result<Layers, Error> {
        let layers = self.candidate.layers(scene, view)?;
        self.layers.borrow_mut().push(layers.clone());
        Ok(layers)
    }

    fn picture(&self, scene: &Scene, view: &View, resolve: Resolve) -> Result<Image, Error> {
        let image = self.candidate.picture(scene, view, resolve)?;
        self.images.borrow_mut().push(image.clone());
        Ok(image)
    }

    fn has_own_rounding(&self) -> bool {
        self.candidate.has_own_rounding()
    }
}

#[test]
fn layered_fragment_buffers_agree_with_the_oracle_and_each_other() {
    agree_with_the_oracle(&LFBS);
}

#[test]
fn other_techniques_agree_with_the_oracle() {
    agree_with_the_oracle(&techniques().filter(|technique| !LFBS.contains(technique)).collect::<Vec<_>>());
}

/// With all useful features, and on the portability floor: one after the other, as the driver keeps what it has compiled. All
/// failures are listed, not the first alone: what fails together tells why.
fn agree_with_the_oracle(techniques: &[Technique]) {
    let mut failures = Vec::new();
    for floor in [false, true] {
        // One device for all techniques, as most of the time goes into compiling shaders.
        let Some(device) = gpu(floor) else { continue };
        let mut candidate = Candidate::new(Technique::Linear, Renderer::new().gpu(device));
        // For each case what the first LFB made of it.
        let mut first_made = vec![None; CASES.len()];
        for &technique in techniques {
            candidate = candidate.technique(technique);
            for ((case, prepared), first_made) in CASES.iter().zip(&mut first_made) {
                let witness = Witness { candidate: &candidate, layers: RefCell::default(), images: RefCell::default() };
                for check in Check::ALL.into_iter().filter(|check| !is_left_out(technique, case, *check, floor)) {
                    let comparison = prepared.run(check, &witness).unwrap_or_else(|error| panic!("{case:?}: {error}"));
                    if !comparison.passes() {
                        failures.push(format!("{technique}, {case:?}, {check}, floor {floor}: {comparison:?}"));
                    }
                }
                let made = (witness.layers.into_inner(), witness.images.into_inner());
                if LFBS.contains(&technique) && *first_made.get_or_insert_with(|| made.clone()) != made {
                    failures.push(format!("{technique}, {case:?}: other bits than another layered fragment buffer"));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// What takes long and tells little. Resolves are the same shaders on the floor, where it counts whether each is within the
/// limits: with opaque surfaces, and with so many layers that all kinds of pixels have some. Of a thousand planes one picture
/// takes peeling twenty seconds, and F-Buffers one and a half: each has one check with all features and another on the floor.
/// `verify` has all of them with all features.
fn is_left_out(technique: Technique, case: &Case, check: Check, floor: bool) -> bool {
    let is_slow = case.source == "@planes:n=1000" && matches!(technique, Technique::Peel | Technique::FBuffer);
    match check {
        Check::Layers => floor && is_slow,
        Check::Picture(Resolve::Blend) if floor => false,
        Check::Picture(_) if floor => !["@gallery", "@planes:n=64"].contains(&case.source),
        Check::Picture(_) => is_slow,
    }
}

#[test]
fn bits_depend_on_neither_budget_nor_repetition() {
    let Some(mut device) = gpu(false) else { return };
    for technique in techniques() {
        // Few triangles: peeling draws all of them three times for each layer of each window.
        for source in ["@planes:n=12", "@hairball:strands=24,segments=6", "@boxes:n=3"] {
            let scene = pellucid::load(source).unwrap().scene;
            let view = View::of(&scene).size(61, 43).opacity(0.8);
            device = device.budget_bytes(1 << 30);
            let render = |device: &GpuRenderer| device.render(&scene, &view, Resolve::Blend, technique).unwrap();
            let first = render(&device);
            assert_eq!(first.stats.windows, 1);
            let mut whole = first.clone();
            for _ in 0..20 {
                whole = render(&device);
                assert!(whole.image == first.image, "{technique}, {source}: another picture the second time");
            }
            // By now it holds what it needs, and nothing that was guessed or left behind.
            let needed_bytes = whole.stats.peak_bytes;
            for parts in [2, 4, 16, 64] {
                // A single pixel may take so much.
                let budget_bytes = (needed_bytes / parts).max(8192);
                device = device.budget_bytes(budget_bytes);
                let frame = render(&device);
                assert!(frame.image == whole.image, "{technique}, {source}: another picture at 1/{parts}");
                assert!(frame.stats.peak_bytes <= budget_bytes, "{technique}, {source}: {:?}", frame.stats);
                // Not as many as parts: an A-buffer's windows are as deep as their own deepest pixel alone.
                assert!(frame.stats.windows > 1, "{technique}, {source}: {:?}", frame.stats);
                assert_eq!(frame.stats.fragments, whole.stats.fragments);
            }
        }
    }
}

#[test]
fn sorting_before_the_resolve_changes_no_bit() {
    let Some(mut device) = gpu(false) else { return };
    for technique in LFBS {
        for source in ["@planes:n=300", "@hairball:strands=60", "@gallery"] {
            let scene = pellucid::load(source).unwrap().scene;
            let view = View::of(&scene).size(61, 35).opacity(0.8);
            for resolve in [Resolve::Blend, Resolve::Gelly, Resolve::Layer(3)] {
                let mut pictures = Vec::new();
                for presort in [false, true] {
                    device = device.presort(presort);
                    pictures.push(device.render(&scene, &view, resolve, technique).unwrap().image);
                }
                assert!(pictures[0] == pictures[1], "{technique}, {source}, {resolve}");
            }
        }
    }
}

/// So clear that the last of them counts.
#[test]
fn pixels_at_the_limits_of_their_class_keep_all_fragments() {
    let Some(mut device) = gpu(false) else { return };
    for technique in [Technique::Linear, Technique::Pages] {
        for count in [1, 2, 3, 4, 5, 8, 9, 16, 17, 32, 33, 256, 257] {
            let scene = pellucid::load(&format!("@planes:n={count}")).unwrap().scene;
            let view = View::of(&scene).size(37, 11).opacity(0.02);
            let mut pictures = Vec::new();
            for presort in [false, true] {
                device = device.presort(presort);
                let frame = device.render(&scene, &view, Resolve::Blend, technique).unwrap();
                assert_eq!(frame.stats.max_depth_complexity, count);
                pictures.push(frame.image);
            }
            assert!(pictures[0] == pictures[1], "{technique}, {count} planes");
        }
    }
}

/// To the nearest, of two the even one, on every device: those of WGSL's own packing may go either way.
#[test]
fn colours_are_kept_as_the_nearest_halves() {
    let Some(device) = gpu(false) else { return };
    // 2 to a power.
    let power = |n: i32| 2f32.powi(n);
    let cases = [
        (1.0 + power(-11), 1.0),
        (1.0 + 3.0 * power(-11), 1.0 + power(-9)),
        (1.0 + power(-11) + power(-20), 1.0 + power(-10)),
        (2.0 - power(-12), 2.0),
        (65_488.0, 65_472.0),
        (65_504.0, 65_504.0),
        // The least normal half, and what lies below.
        (power(-14), power(-14)),
        (power(-14) - power(-25), power(-14)),
        (power(-14) - 3.0 * power(-25), power(-14) - power(-23)),
        (power(-24), power(-24)),
        (power(-25), 0.0),
        (3.0 * power(-25), power(-23)),
        (power(-149), 0.0),
        (0.0, 0.0),
    ];
    let mut scene = Scene::new();
    for (i, (value, _)) in cases.into_iter().enumerate() {
        let z = -(i as f32) / cases.len() as f32;
        let corners = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]].map(|[x, y]| Vec3::new(x, y, z));
        let mesh = scene.add_mesh(Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap()).unwrap();
        let material = scene.add_material(Material::translucent("", Vec4::new(value, value, value, 1.0))).unwrap();
        scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY }).unwrap();
    }
    let view = flat_view(&scene, 4, 4);
    let expected = cases.map(|(_, half)| Vec4::new(half, half, half, 1.0));
    for technique in techniques() {
        let visit = |layers: &Layers| {
            let colors: Vec<Vec4> = layers.pixel(1, 1).iter().map(|fragment| fragment.color).collect();
            assert_eq!(colors, expected, "{technique}");
        };
        device.layers(&scene, &view, technique, visit).unwrap();
    }
}

/// Files of the folder in `PELLUCID_SCENES`, which are too large for the project: skipped with a notice where it is not.
#[test]
fn real_scenes_agree_with_the_oracle() {
    let Some(folder) = std::env::var_os("PELLUCID_SCENES") else {
        eprintln!("skipped: set PELLUCID_SCENES to a folder of scenes");
        return;
    };
    let Some(device) = gpu(false) else { return };
    let mut candidate = Candidate::new(Technique::Linear, Renderer::new().gpu(device));
    let mut failures = Vec::new();
    for (path, opacity) in [
        ("stanford_bunny/bunny_69k.ply", 0.3),
        ("utah_teapot/teapot.obj", 0.5),
        ("gltf/AlphaBlendModeTest/AlphaBlendModeTest.glb", 1.0),
        ("gltf/GlassVaseFlowers/GlassVaseFlowers.glb", 1.0),
        ("brain/brain_fsaverage5.glb", 1.0),
    ] {
        let path = std::path::Path::new(&folder).join(path);
        if !path.exists() {
            eprintln!("skipped: there is no '{}'", path.display());
            continue;
        }
        let scene = pellucid::load_file(&path).unwrap().scene;
        let view = View::of(&scene).size(64, 48).opacity(opacity);
        let capture = oracle::capture(&scene, &view).unwrap();
        let prepared = Prepared { scene, view, capture };
        for technique in techniques() {
            candidate = candidate.technique(technique);
            for check in Check::ALL {
                let comparison = prepared.run(check, &candidate).unwrap();
                if !comparison.passes() {
                    failures.push(format!("{technique}, {}, {check}: {comparison:?}", path.display()));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_budget_too_small_for_one_pixel_is_refused_with_what_it_takes() {
    let Some(gpu) = gpu(false) else { return };
    let scene = pellucid::load("@planes:n=1000").unwrap().scene;
    let view = View::of(&scene).size(8, 8);
    let renderer = Renderer::new().gpu(gpu.budget_bytes(4000)).technique(Technique::Linear);
    let error = renderer.render(&scene, &view, Resolve::Blend).unwrap_err();
    assert!(matches!(error, Error::Gpu(GpuError::Budget { needed, budget: 4000 }) if needed > 16_000), "{error}");
}

#[test]
fn a_change_of_size_scene_or_technique_leaves_no_trace() {
    let Some(device) = gpu(false) else { return };
    let mut renderer = Renderer::new().gpu(device);
    let scenes = ["@boxes:n=3", "@spheres:n=20", "@gallery"].map(|source| pellucid::load(source).unwrap().scene);
    let mut first = Vec::new();
    for round in 0..2 {
        let mut pictures = Vec::new();
        for technique in [Technique::Linear, Technique::Alpha] {
            renderer = renderer.technique(technique);
            for scene in &scenes {
                for size in [(40, 30), (129, 17)] {
                    let view = View::of(scene).size(size.0, size.1);
                    pictures.push(renderer.render(scene, &view, Resolve::Blend).unwrap().image);
                }
            }
        }
        if round == 0 {
            first = pictures;
        } else {
            assert!(first == pictures);
        }
    }
}
