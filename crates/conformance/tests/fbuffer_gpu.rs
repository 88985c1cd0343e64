//! The technique `fbuffer`: small buffers that slide over many fragments give the same bits as large ones.

use pellucid::core::fbuffer::{Size, Windows};
use pellucid::gpu::{ContextOptions, GpuError, GpuRenderer};
use pellucid::{Renderer, Resolve, Technique};
use pellucid_conformance::layers;
use pellucid_conformance::suite::CASES;

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
        let prepared = case.prepare().unwrap();
        let (scene, view) = (&prepared.scene, &prepared.view);
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
