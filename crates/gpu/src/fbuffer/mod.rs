//! The F-Buffer on the GPU: shaders of several passes, each fragment with a slot of its own between them, on your device
//! and in your WGSL (Houston, Preetham and Segal 2005).
//!
//! A slot is a fragment's position in rasterization order. The order is found in compute: the rows of pixels that
//! primitives cover are measured in integers, as the contract's pixel grid has it, and summed up; there are no atomics, and
//! slots are those of the CPU, bit for bit. The geometry stage before that, transform and clipping, stays on the host:
//! clipping needs the f64 that WGSL has not, and hardware may round a product of matrices as it likes, either of which
//! would move fragments to other slots.
//!
//! What each pass of each window rasterizes again is the table of rows: from a slot to its row by halving, from there to
//! pixel, depth and weights. Slots outside of the window are never touched. The alternative, to walk over all primitives
//! in every pass as the hardware had to, would find the same places more slowly.
//!
//! ```no_run
//! use pellucid_core::fbuffer::{Output, Size, order::Geometry};
//! use pellucid_core::{Scene, View, primitive::Pass};
//! use pellucid_gpu::fbuffer::{Content, FBuffer, FBufferError};
//! # use glam::Vec4;
//! # fn f(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene, view: &View) -> Result<(), FBufferError> {
//! let mut fbuffer = FBuffer::new(device, queue, Size::square(128)?, &[("light", Content::Targets(1))])?;
//! let program = fbuffer.program(
//!     &[
//!         "fn shade(fragment: Fragment) { light_store(fragment, 0u, vec4(fragment.weights, 0.5)); }",
//!         "fn shade(fragment: Fragment) -> vec4<f32> { return light_load(fragment, 0u); }",
//!     ],
//!     [None; 3],
//! )?;
//! let drawing = fbuffer.drawing(Geometry::new(scene, view, Pass::Transparent)?)?;
//! let target = fbuffer.target(view.width, view.height, Vec4::ZERO)?;
//! let drawn = fbuffer.draw(&drawing, &program, [None; 3], Output::default(), &target)?;
//! println!("{} windows, {} submissions", drawn.windows, drawn.submissions);
//! let image = fbuffer.read(&target)?;
//! # Ok(())
//! # }
//! ```
//!
//! By module: `geometry` is what is sent to the device, `raster` counts and sums, `drawing` holds the outcome; `program` is
//! the text of passes, `buffer` runs them, `target` tests and blends, `sort` orders fragments; `framebuffer` runs the same
//! passes with one intermediate result a pixel, to compare. The renderer's technique `fbuffer` is made of the same parts.

mod buffer;
mod drawing;
mod error;
mod framebuffer;
pub(crate) mod geometry;
mod program;
pub(crate) mod raster;
pub(crate) mod sort;
mod target;

pub use buffer::{FBuffer, Groups};
pub use drawing::Drawing;
pub use error::FBufferError;
pub use framebuffer::Framebuffer;
pub use program::{Content, Program};
pub use sort::sort_keys;
pub use target::Target;

use crate::shaders;

/// Where intermediate results are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Keeping {
    /// One for each fragment, in its slot.
    Slots,
    /// One for each of so many pixels.
    Pixels {
        /// Of the picture.
        count: u64,
    },
}

impl Keeping {
    /// What passes know of it.
    fn module(self) -> &'static str {
        match self {
            Self::Slots => shaders::FBUFFER_MODULE,
            Self::Pixels { .. } => shaders::FRAMEBUFFER_MODULE,
        }
    }
}

/// Invocations of a workgroup in passes over fragments and runs: `LANES` of the shaders.
pub(crate) const LANES: u64 = 64;
