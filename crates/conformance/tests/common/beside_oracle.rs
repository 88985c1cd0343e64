//! The CPU renderer beside the oracle.

use pellucid::core::oracle::{self, Capture};
use pellucid::{Renderer, Resolve, Scene, View};
use pellucid_conformance::layers;

/// The oracle's capture of a view; panics unless a renderer has the same layers and blends them to the same picture.
pub(crate) fn assert_equals_oracle(renderer: &Renderer, scene: &Scene, view: &View) -> Capture {
    let capture = oracle::capture(scene, view).unwrap();
    let gathered = layers::gather(renderer, scene, view).unwrap();
    if let Some(difference) = layers::first_difference(&capture.layers, &gathered) {
        panic!("{difference}");
    }
    let (expected, _) = oracle::resolve_capture(&capture, scene, view, Resolve::Blend);
    assert!(expected == renderer.render(scene, view, Resolve::Blend).unwrap().image);
    capture
}
