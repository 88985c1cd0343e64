//! The GPU renderer: every technique that captures with the hardware rasterizer, on wgpu.
//!
//! The flow of a frame, by module:
//!
//! scene → `upload` (kept while the scene is the same) → `surface` (instances in the view) → `pass::opaque` →
//! `technique` (captures a `memory::Window` of the picture at a time) → `pass::ordered` (sorts, reads and blends) →
//! `readback`. `renderer` walks that flow from top to bottom; `frame` is everything that lives as long as one frame.
//!
//! What a device has to offer is WebGPU's defaults; see `context` for what is used beyond them where it is there.
//! `lfb` and `fbuffer` are apart from that flow: the layered fragment buffer and shaders of several passes for renderers of
//! other people, on the same shaders.
//! Shaders are linked at build time from `shaders/`, by the same names as the modules here.
#![forbid(unsafe_code)]

mod context;
mod error;
pub mod fbuffer;
mod frame;
pub mod gpu_data;
pub mod lfb;
pub mod memory;
mod pass;
mod readback;
mod renderer;
pub mod shaders;
mod steps;
mod surface;
mod table;
mod technique;
mod upload;

pub use context::{AdapterSummary, Context, ContextOptions, adapter_summaries};
pub use error::GpuError;
pub use pass::picture::Totals;
pub use pass::prefix_sum::PrefixSumData;
pub use renderer::{DEFAULT_BUDGET_BYTES, GpuRenderer};
pub use technique::{DepthFilter, Storage};
pub use wgpu;
