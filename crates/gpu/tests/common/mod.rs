//! A device for tests, if this machine has one.

use pellucid_gpu::{ContextOptions, GpuError, GpuRenderer};

/// A renderer on the best device there is; `None`, with a notice, if there is none, unless `PELLUCID_REQUIRE_GPU` is 1.
pub fn renderer(floor: bool) -> Option<GpuRenderer> {
    match GpuRenderer::new(&ContextOptions { floor, allow_software: true }) {
        Ok(renderer) => Some(renderer),
        Err(error @ GpuError::NoAdapter) => {
            let required = std::env::var("PELLUCID_REQUIRE_GPU").is_ok_and(|value| value == "1");
            assert!(!required, "PELLUCID_REQUIRE_GPU is 1, but: {error}");
            eprintln!("skipped: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}
