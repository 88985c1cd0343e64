//! Random triangle soups: the CPU renderer captures what the oracle captures, to the last bit, and resolves it alike.

use pellucid::core::oracle;
use pellucid::{Renderer, Resolve, Technique, View};
use pellucid_conformance::{images, layers};
use proptest::prelude::*;

#[path = "common/soup.rs"]
mod soup;

use soup::{camera, soup};

const RESOLVES: [Resolve; 6] = [
    Resolve::Blend,
    Resolve::BlendCorrected,
    Resolve::Gelly,
    Resolve::Nearest,
    Resolve::Layer(2),
    Resolve::Complexity(0),
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn cpu_equals_oracle(scene in soup(), camera in camera(), opaque in any::<bool>(), size in (1u32..80, 1u32..70)) {
        let mut view = View::of(&scene).size(size.0, size.1).opacity(if opaque { 1.0 } else { 0.6 });
        view.camera = camera;
        let capture = oracle::capture(&scene, &view).unwrap();
        let cpu = Renderer::new();
        let gathered = layers::gather(&cpu, &scene, &view).unwrap();
        if let Some(difference) = layers::first_difference(&capture.layers, &gathered) {
            return Err(TestCaseError::fail(difference));
        }
        for resolve in RESOLVES {
            let (expected, expected_stats) = oracle::resolve_capture(&capture, &scene, &view, resolve);
            let frame = cpu.render(&scene, &view, resolve).unwrap();
            let no_excuse = vec![false; capture.ambiguous.len()];
            let comparison = images::compare(&expected, &no_excuse, |_, _| true, &frame.image);
            prop_assert_eq!(comparison.unexplained, 0, "{:?} {:?}", resolve, comparison);
            prop_assert_eq!(expected_stats.fragments, frame.stats.fragments);
            prop_assert_eq!(expected_stats.dropped_triangles, frame.stats.dropped_triangles);
            prop_assert_eq!(expected_stats.max_depth_complexity, frame.stats.max_depth_complexity);
            prop_assert_eq!(frame.stats.technique, Technique::Cpu);
        }
    }
}
