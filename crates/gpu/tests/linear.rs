//! The GPU against the oracle.

use pellucid_conformance::images::compare;
use pellucid_core::{Resolve, Technique, View, oracle};
use pellucid_gpu::{ContextOptions, GpuRenderer};

#[test]
fn it_renders() {
    let gpu = GpuRenderer::new(&ContextOptions { allow_software: true, ..Default::default() }).unwrap();
    println!("{}", gpu.context().name());
    let scenes = std::env::var("SCENES").unwrap_or("@boxes:n=4 @gallery".into());
    for source in scenes.split(' ') {
        let scene = pellucid_scene::load(source).unwrap().scene;
        let view = View::of(&scene).size(64, 36);
        let capture = oracle::capture(&scene, &view).unwrap();
        let (expected, oracle_stats) = oracle::resolve_capture(&capture, &scene, &view, Resolve::Blend);
        let frame = gpu.render(&scene, &view, Resolve::Blend, Technique::Linear).unwrap_or_else(|e| panic!("{e}"));
        let covered = |x, y| capture.layers.depth_complexity(x, y) > 0 || capture.layers.opaque(x, y).is_some();
        println!("{source} {:?}", compare(&expected, &capture.ambiguous, covered, &frame.image));
        println!("{} vs {} fragments; {:?}", frame.stats.fragments, oracle_stats.fragments, frame.stats.steps);
        gpu.layers(&scene, &view, Technique::Linear, |layers| {
            let mut shown = 0;
            for y in 0..view.height {
                for x in 0..view.width {
                    let (a, b) = (capture.layers.pixel(x, y), layers.pixel(x, y));
                    let (oa, ob) = (capture.layers.opaque(x, y), layers.opaque(x, y));
                    let differs = a.len() != b.len() || oa.is_some() != ob.is_some() || oa.zip(ob).is_some_and(|(a, b)| (a.color - b.color).abs().max_element() > 0.004 || (a.depth - b.depth).abs() > 1e-4 * a.depth)
                        || a.iter().zip(b).any(|(a, b)| a.primitive != b.primitive || (a.color - b.color).abs().max_element() > 0.004);
                    if differs && !capture.ambiguous[(y * view.width + x) as usize] && shown < 12 {
                        shown += 1;
                        println!("{x} {y}: {a:?}\n      {b:?}\n    {oa:?} {ob:?}");
                    }
                }
            }
        }).unwrap();
    }
}
