//! The CPU renderer in a budget of bytes: the same picture from any number of windows.

use pellucid::{Resolve, Stats, View};
use pellucid_cpu::CpuRenderer;

#[test]
fn the_picture_is_the_same_in_any_budget() {
    for source in ["@gallery", "@boxes:n=4", "@hairball:strands=200,segments=12", "@tree", "@spheres:n=20"] {
        let scene = pellucid::load(source).unwrap().scene;
        for opacity in [1.0, 0.4] {
            let view = View::of(&scene).size(203, 117).opacity(opacity);
            let expected = CpuRenderer::new(2).render(&scene, &view, Resolve::Blend).unwrap();
            assert_eq!(expected.stats.windows, 1, "{source}");
            for budget_bytes in [1, 100_000] {
                let renderer = CpuRenderer::new(2).budget_bytes(budget_bytes);
                // The second frame begins with the windows of the first.
                for frame in 0..2 {
                    let actual = renderer.render(&scene, &view, Resolve::Blend).unwrap();
                    assert!(actual.image == expected.image, "{source}, {opacity}, {budget_bytes} bytes, frame {frame}");
                    assert_eq!(figures(&actual.stats), figures(&expected.stats), "{source}, {budget_bytes} bytes");
                    // A window for each of 7 x 4 tiles, but for empty ones.
                    assert!(budget_bytes > 1 || actual.stats.windows > 7, "{source}: {:?}", actual.stats);
                }
            }
        }
    }
}

fn figures(stats: &Stats) -> (u64, u32, f64, u64) {
    (stats.fragments, stats.max_depth_complexity, stats.mean_depth_complexity, stats.dropped_triangles)
}
