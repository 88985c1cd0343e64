//! Types and maths of Pellucid: what is drawn, from where, in which order its fragments lie behind a pixel, and what
//! ordered layers become. No files, no GPU, no threads.
//!
//! The flow of a frame, by module:
//!
//! [`scene`] + [`view`] → [`primitive`] (transform, clip, snap to the [`pixel_grid`]) → [`fragment`] (one primitive at
//! one pixel, shaded by [`shading`]) → [`layers`] (ordered) → [`resolve`] (through [`composite`]) → [`image`].
//!
//! [`oracle`] walks that flow in the most obvious way; every technique is compared with it.
#![forbid(unsafe_code)]

pub mod camera;
pub mod clip;
pub mod color;
pub mod composite;
pub mod error;
pub mod fbuffer;
pub mod fragment;
pub mod heat_map;
pub mod image;
pub mod layers;
pub mod meshlets;
pub mod oracle;
pub mod pixel_grid;
pub mod primitive;
pub mod resolve;
pub mod scene;
pub mod shading;
pub mod stats;
pub mod technique;
pub mod texture;
pub mod view;

pub use camera::{Camera, Projection};
pub use error::Error;
pub use fragment::Fragment;
pub use image::Image;
pub use layers::Layers;
pub use resolve::Resolve;
pub use scene::{AlphaMode, Instance, Material, MaterialId, Mesh, MeshId, Scene, TextureId};
pub use stats::{Frame, Stats};
pub use technique::Technique;
pub use texture::Texture;
pub use view::{Shading, View};
