//! Layered fragment buffers differ in where they keep fragments and in nothing else: on one device all give the same bits.

mod common;

use pellucid::{Image, Layers, Renderer, Scene, Technique, View};
use pellucid_conformance::layers;
use pellucid_conformance::suite::{CASES, Check};

use common::gpu;

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
    for floor in [false, true] {
        // One device for all cases, as most of the time goes into compiling shaders.
        let Some(device) = gpu(floor) else { return };
        let mut renderer = Renderer::new().gpu(device);
        for case in CASES {
            let prepared = case.prepare().unwrap();
            renderer = renderer.technique(Technique::Linear);
            let expected = everything(&renderer, &prepared.scene, &prepared.view);
            for technique in [Technique::List, Technique::ABuffer, Technique::Pages] {
                renderer = renderer.technique(technique);
                let have = everything(&renderer, &prepared.scene, &prepared.view);
                assert!(have == expected, "{technique}, {case:?}, floor: {floor}");
            }
        }
    }
}
