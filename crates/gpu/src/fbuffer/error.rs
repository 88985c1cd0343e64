//! What can go wrong with an F-Buffer in a renderer of your own.

use pellucid_core::fbuffer::Overflow;

use crate::GpuError;

/// Any error of an [`FBuffer`](super::FBuffer). After each of them it can be used again.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FBufferError {
    /// A buffer that cannot be.
    #[error("the buffer '{name}' cannot be: {reason}")]
    Buffer {
        /// Its name.
        name: String,
        /// Why not.
        reason: &'static str,
    },
    /// A pass whose text is not valid, or does not fit the device.
    #[error("pass {number}: {detail}")]
    Pass {
        /// Number of the pass, from 1.
        number: usize,
        /// What the compiler says.
        detail: String,
    },
    /// A program without passes.
    #[error("a program needs a pass at least: the last, which returns a colour")]
    NoPasses,
    /// A target of another size than the picture that is drawn.
    #[error("a target of {have:?} pixels for a picture of {need:?}")]
    TargetSize {
        /// Width and height of the target.
        have: [u32; 2],
        /// Width and height of the picture.
        need: [u32; 2],
    },
    /// A drawing or a program of another kind of buffer.
    #[error("a drawing or a program for an F-Buffer, where a framebuffer is, or the other way round")]
    Mixed,
    /// More fragments than slots, where no window slides over them.
    #[error(transparent)]
    Overflow(#[from] Overflow),
    /// 2^32 fragments, or rows of them, or more.
    #[error("more fragments than 32 bits can number; draw the scene in parts")]
    TooManyFragments,
    /// A scene, view or size has no meaning.
    #[error(transparent)]
    Core(#[from] pellucid_core::Error),
    /// The device cannot do it.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}
