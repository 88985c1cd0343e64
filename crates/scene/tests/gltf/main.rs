//! The glTF loader, on documents built here and on real ones.

mod build;
mod geometry;
mod hostile;
mod materials;
mod placement;
mod real_files;
