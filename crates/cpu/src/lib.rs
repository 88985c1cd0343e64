//! The CPU renderer of Pellucid: exact transparency, tile by tile, on all cores, no GPU needed.
//!
//! A frame, by module: `renderer` runs it top to bottom; `setup` brings the vertices of a meshlet to the pixel grid
//! (`transform`), looks what is in `sight`, turns `small_blocks` of triangles into `small_fragments` (`small`) and other triangles into records,
//! and hands both to tiles, records through `bin`; `tile` captures `fragments` through `raster`, unless `lit_key`s say it all; `order` sorts and
//! `blend` resolves them, eight pixels at a time, into a `canvas`.
#![forbid(unsafe_code)]

mod bin;
mod blend;
mod canvas;
pub mod fbuffer;
mod fragments;
mod lit_key;
mod networks;
mod order;
mod raster;
mod renderer;
mod sample;
mod setup;
mod shade;
mod sight;
pub mod simd;
mod small;
mod small_blocks;
mod small_fragments;
mod surfaces;
mod tile;
mod transform;
mod window;

pub use canvas::Canvas;
pub use renderer::CpuRenderer;
