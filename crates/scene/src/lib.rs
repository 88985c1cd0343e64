//! Scenes for Pellucid: files in glTF 2.0, OBJ, PLY and STL, and built-in procedural scenes.
//!
//! Every loader takes bytes and an [`Assets`] through which it reaches the files its own file names, so that it can be
//! tested and fuzzed without a file system. Whatever the bytes are, a loader returns a scene or one clear error; it never
//! panics and never allocates for more than the bytes can hold.
#![forbid(unsafe_code)]

mod assets;
pub mod builtin;
mod error;
pub mod gltf;
mod mesh_parts;
pub mod obj;
pub mod ply;
mod polygon;
pub mod stl;
mod text;
mod texture_image;
mod warnings;

use std::path::Path;

use pellucid_core::Scene;

pub use assets::{Assets, Folder, NoAssets};
pub use error::LoadError;

/// A scene and what was left out of it.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// What the file asked for that could not be given, one sentence each, for the user to read.
    pub warnings: Vec<String>,
}

/// Loads a scene: `@name` or `@name:key=value,...` for a built-in one, otherwise the path of a `.gltf`, `.glb`, `.obj`,
/// `.ply` or `.stl` file.
///
/// # Errors
/// [`LoadError`] if there is no such scene or file, or the file is not what its name says.
pub fn load(source: &str) -> Result<Loaded, LoadError> {
    match source.strip_prefix('@') {
        Some(description) => Ok(Loaded { scene: builtin::make(description)?, warnings: Vec::new() }),
        None => load_file(Path::new(source)),
    }
}

/// Loads a scene file; its extension says which format it is in. Files it names are looked for in its own folder.
///
/// # Errors
/// As [`load`].
pub fn load_file(path: &Path) -> Result<Loaded, LoadError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let parse = match extension.as_str() {
        "gltf" | "glb" => gltf::parse,
        "obj" => obj::parse,
        "ply" => ply::parse,
        "stl" => stl::parse,
        _ => return Err(LoadError::UnknownFormat { path: path.to_owned() }),
    };
    let bytes = std::fs::read(path).map_err(|source| LoadError::Read { path: path.to_owned(), source })?;
    let folder = Folder::new(path.parent().unwrap_or(Path::new("")));
    parse(&bytes, &folder).map_err(|error| LoadError::InFile { path: path.to_owned(), source: Box::new(error) })
}
