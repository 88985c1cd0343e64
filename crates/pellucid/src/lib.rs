//! Exact order-independent transparency and layered fragment buffers, no GPU needed.
//!
//! ```
//! use pellucid::{Renderer, Resolve, View};
//!
//! fn main() -> Result<(), pellucid::Error> {
//!     let scene = pellucid::load("@boxes:n=4")?.scene; // or "model.glb"
//!     let view = View::of(&scene).size(320, 180).opacity(0.5);
//!     let frame = Renderer::new().render(&scene, &view, Resolve::Blend)?;
//!     pellucid::save(&frame.image, std::env::temp_dir().join("boxes.png"))?;
//!     println!("{} fragments, at most {} behind a pixel", frame.stats.fragments, frame.stats.max_depth_complexity);
//!     Ok(())
//! }
//! ```
#![forbid(unsafe_code)]

mod error;
pub mod files;
pub mod multi_pass;
mod renderer;
mod save;

pub use error::Error;
pub use pellucid_core as core;
pub use pellucid_core::{
    AlphaMode, Camera, Fragment, Frame, Image, Instance, Layers, Material, Mesh, Projection, Resolve, Scene, Shading,
    Stats, Technique, Texture, View,
};
pub use pellucid_cpu::{Canvas, fbuffer};
#[cfg(feature = "gpu")]
pub use pellucid_gpu as gpu;
pub use pellucid_scene::builtin;
pub use pellucid_scene::{LoadError, Loaded};
pub use renderer::Renderer;
pub use save::{ImageFormat, save};

/// Loads a scene: the path of a `.glb`, `.gltf`, `.obj`, `.ply` or `.stl` file, or `@name:key=value,...` for a built-in one.
///
/// # Errors
/// [`Error::Load`] if there is no such scene, or its file is not valid.
pub fn load(source: &str) -> Result<Loaded, Error> {
    Ok(pellucid_scene::load(source)?)
}

/// Loads a scene file, whatever its name looks like; otherwise as [`load`].
///
/// # Errors
/// As [`load`].
pub fn load_file(path: &std::path::Path) -> Result<Loaded, Error> {
    Ok(pellucid_scene::load_file(path)?)
}

/// The example in the README is compiled and run like the one above.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct ReadmeExample;
