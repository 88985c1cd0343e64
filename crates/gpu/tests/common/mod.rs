//! A device for tests, if this machine has one.

use pellucid_gpu::{ContextOptions, GpuError, GpuRenderer};

/// A renderer on the best device there is; `None`, with a notice, unless `PELLUCID_REQUIRE_GPU` is 1.
pub(crate) fn renderer(floor: bool) -> Option<GpuRenderer> {
    // Software devices may take gigabytes for the deepest scenes: asked for, not by the way.
    if std::env::var("PELLUCID_REQUIRE_GPU").as_deref() != Ok("1") {
        eprintln!("skipped: set PELLUCID_REQUIRE_GPU=1 to test on this machine's GPU, or a software one");
        return None;
    }
    match GpuRenderer::new(&ContextOptions { floor, allow_software: true }) {
        Ok(renderer) => Some(renderer),
        Err(error @ GpuError::NoAdapter) => {
            panic!("PELLUCID_REQUIRE_GPU is 1, but: {error}")
        }
        Err(error) => panic!("{error}"),
    }
}
