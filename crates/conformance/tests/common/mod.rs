//! A device for tests, if this machine has one.

use pellucid::gpu::{ContextOptions, GpuError, GpuRenderer};

/// A renderer on the best device there is. Without a real GPU it is `None`, with a notice, unless `PELLUCID_REQUIRE_GPU` is
/// 1: software ones take minutes and are asked for, not by the way.
pub(crate) fn gpu(floor: bool) -> Option<GpuRenderer> {
    let is_required = std::env::var("PELLUCID_REQUIRE_GPU").as_deref() == Ok("1");
    match GpuRenderer::new(&ContextOptions { floor, allow_software: is_required }) {
        Ok(gpu) => Some(gpu),
        Err(error @ (GpuError::NoAdapter | GpuError::OnlySoftware { .. })) if !is_required => {
            eprintln!("skipped: {error}; PELLUCID_REQUIRE_GPU=1 makes it a failure, and takes a software GPU");
            None
        }
        Err(error) => panic!("{error}"),
    }
}
