//! The CPU renderer of Pellucid: exact transparency, tile by tile, on all cores, no GPU needed.
//!
//! A frame, by module: `renderer` runs it top to bottom; `transform` brings vertices to the pixel grid; `setup` turns
//! triangles into records and `bin` hands them to tiles; `tile` captures, orders and resolves one tile through `raster`.
//!
//! Fragments live only while their tile is resolved, and hold 8 bytes each until then: depth and the number of their
//! surface, together one sort key. Colour is computed after sorting, front to back.
#![forbid(unsafe_code)]

mod bin;
pub mod fbuffer;
mod raster;
mod renderer;
mod setup;
pub mod simd;
mod tile;
mod transform;

pub use renderer::CpuRenderer;
