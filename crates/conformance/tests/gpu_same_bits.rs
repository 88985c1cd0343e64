//! Layered fragment buffers differ in where they keep fragments and in nothing else: on one device all give the same bits.

use pellucid::gpu::{ContextOptions, GpuError, GpuRenderer};
use pellucid::{Image, Layers, Renderer, Scene, Technique, View};
use pellucid_conformance::layers;
use pellucid_conformance::suite::{CASES, Check};

/// A device, if they are asked for; see `gpu.rs`.
fn gpu(floor: bool) -> Option<GpuRenderer> {
    if std::env::var("PELLUCID_REQUIRE_GPU").as_deref() != Ok("1") {
        eprintln!("skipped: set PELLUCID_REQUIRE_GPU=1 to test on this machine's GPU, or a software one");
        return None;
    }
    match GpuRenderer::new(&ContextOptions { floor, allow_software: true }) {
        Ok(gpu) => Some(gpu),
        Err(error @ GpuError::NoAdapter) => panic!("PELLUCID_REQUIRE_GPU is 1, but: {error}"),
        Err(error) => panic!("{error}"),
    }
}

/// Its layers and every resolve of them.
fn everything(renderer: &Renderer, scene: &Scene, view: &View) -> (Layers, Vec<Image>) {
    let pictures = Check::ALL.into_iter().filter_map(|check| match check {
        Check::Picture(resolve) => Some(renderer.render(scene, view, resolve).unwrap().image),
        Check::Layers => None,
    });
    (layers::gather(renderer, scene, view).unwrap(), pictures.collect())
}

#[test]
fn every_structure_gives_the_same_bits() {
    for case in CASES {
        let prepared = case.prepare().unwrap();
        for floor in [false, true] {
            let Some(device) = gpu(floor) else { return };
            let mut renderer = Renderer::new().gpu(device).technique(Technique::Linear);
            let expected = everything(&renderer, &prepared.scene, &prepared.view);
            for technique in [Technique::List, Technique::ABuffer, Technique::Pages] {
                renderer = renderer.technique(technique);
                let have = everything(&renderer, &prepared.scene, &prepared.view);
                assert!(have == expected, "{technique}, {case:?}, floor: {floor}");
            }
        }
    }
}
