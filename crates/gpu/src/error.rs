//! What can go wrong on a GPU, in words a user can act on.

use pellucid_core::{Resolve, Technique};

/// Any error of the GPU renderer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GpuError {
    /// There is no adapter.
    #[error(
        "no GPU found: install a driver for Vulkan, Metal or DirectX 12, or use the CPU renderer (`--backend cpu`)"
    )]
    NoAdapter,
    /// There are only adapters that run on the CPU.
    #[error(
        "no GPU found, only '{name}', which runs on the CPU: ask for it with `--backend gpu`, or use the CPU renderer"
    )]
    OnlySoftware {
        /// The adapter's name.
        name: String,
    },
    /// The adapter gives no device.
    #[error("'{name}' refuses a device: {detail}; update its driver, or use the CPU renderer (`--backend cpu`)")]
    Refused {
        /// The adapter's name.
        name: String,
        /// What it says.
        detail: String,
    },
    /// The device is gone.
    #[error("the GPU was lost: {0}; make a new renderer, or use the CPU renderer (`--backend cpu`)")]
    Lost(String),
    /// An allocation was refused.
    #[error("the GPU has no {bytes} bytes left for {what}; set a smaller budget (`--budget`) or picture size")]
    OutOfMemory {
        /// What they were for.
        what: String,
        /// How many.
        bytes: u64,
    },
    /// Something does not fit the device's limits.
    #[error("{what} takes {size}, but this GPU allows {limit} ({limit_name}); use the CPU renderer (`--backend cpu`)")]
    Limit {
        /// What does not fit.
        what: String,
        /// Its size: bytes or pixels.
        size: u64,
        /// The limit.
        limit: u64,
        /// The limit's name in WebGPU.
        limit_name: &'static str,
    },
    /// One pixel alone takes more than the budget.
    #[error("one pixel takes {needed} bytes, more than the budget of {budget}; allow at least that (`--budget`)")]
    Budget {
        /// Bytes of that pixel.
        needed: u64,
        /// Bytes allowed.
        budget: u64,
    },
    /// A resolve that an inexact technique cannot serve.
    #[error("'{technique}' does not order fragments, so it cannot serve '{resolve}'; it serves blend")]
    Unordered {
        /// The technique.
        technique: Technique,
        /// The resolve.
        resolve: Resolve,
    },
    /// A technique of another backend.
    #[error("'{0}' does not run on the GPU")]
    NotOnGpu(Technique),
    /// An error of Pellucid, or of the driver.
    #[error("the GPU reports an error, please report it: {0}")]
    Validation(String),
    /// The view is invalid.
    #[error(transparent)]
    Core(#[from] pellucid_core::Error),
}
