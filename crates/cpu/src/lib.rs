//! The CPU renderer of Pellucid: exact transparency tile by tile on all cores, no GPU needed.
#![forbid(unsafe_code)]

mod renderer;

pub use renderer::CpuRenderer;
