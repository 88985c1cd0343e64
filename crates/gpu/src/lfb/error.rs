//! What can go wrong with an LFB in a renderer of your own.

use crate::GpuError;

/// Any error of an [`Lfb`](super::Lfb). After each of them it can begin again.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LfbError {
    /// There is nothing to capture.
    #[error("an LFB of {width} x {height} pixels has none; give it at least 1 x 1")]
    ZeroSize {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
    },
    /// A payload that cannot be stored.
    #[error("a payload of {0} words cannot be stored: 1 to 4 can")]
    Payload(u32),
    /// A name that WGSL does not take.
    #[error("'{0}' cannot begin names in WGSL: take ASCII letters, digits and '_', a letter first")]
    Name(String),
    /// Something does not fit the device's limits.
    #[error("{what} takes {size}, but this device allows {limit} ({limit_name})")]
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
    /// More fragments were counted than there may be room for.
    #[error(
        "{fragments} fragments take {bytes} bytes, but {limit_name} allows {limit}; nothing was captured: allow more, or \
         capture the picture in parts"
    )]
    Overflow {
        /// How many were counted; `u32::MAX` stands for that many or more.
        fragments: u32,
        /// Bytes they take.
        bytes: u64,
        /// Bytes allowed.
        limit: u64,
        /// Who sets the limit: `max_bytes`, or a limit of WebGPU.
        limit_name: &'static str,
    },
    /// An allocation was refused.
    #[error("the device has no {bytes} bytes left for {what}")]
    OutOfMemory {
        /// What they were for.
        what: String,
        /// How many.
        bytes: u64,
    },
    /// Fragments were added to pixels that the LFB does not have.
    #[error(
        "{fragments} fragments lie outside of {width} x {height} pixels; resize the LFB, or set a scissor rectangle"
    )]
    Outside {
        /// How many, in one pass.
        fragments: u32,
        /// Width of the LFB.
        width: u32,
        /// Height of the LFB.
        height: u32,
    },
    /// The capturing pass added other fragments than the counting pass.
    #[error(
        "at {pixels} pixels the capturing pass added more or fewer fragments than the counting pass ({beyond} too many in \
         all); both must draw the same, and reach `add` under the same conditions"
    )]
    Disagree {
        /// Pixels whose number of fragments differs.
        pixels: u32,
        /// Fragments that there was no room for. None of them was written.
        beyond: u32,
    },
    /// A step was called before the one it follows.
    #[error("'{step}' comes after '{after}'")]
    OutOfTurn {
        /// The step called.
        step: &'static str,
        /// The step that has to come first.
        after: &'static str,
    },
    /// Commands were recorded, but had not been submitted when their outcome was asked for.
    #[error("what '{0}' recorded was not submitted before its outcome was asked for")]
    NotSubmitted(&'static str),
    /// The device is gone, or reports an error.
    #[error("the device failed: {0}")]
    Device(String),
}

impl From<GpuError> for LfbError {
    fn from(error: GpuError) -> Self {
        match error {
            GpuError::Limit { what, size, limit, limit_name } => Self::Limit { what, size, limit, limit_name },
            GpuError::OutOfMemory { what, bytes } => Self::OutOfMemory { what, bytes },
            GpuError::Lost(detail) => Self::Device(detail),
            other => Self::Device(other.to_string()),
        }
    }
}
