//! What can go wrong while loading.

use std::io;
use std::path::PathBuf;

/// Why a scene could not be loaded: what is wrong, where, and what would help.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// A file cannot be read.
    #[error("cannot read '{}': {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file name without a known extension.
    #[error("'{}' is in no known format; known are .gltf, .glb, .obj, .ply and .stl", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// An error with the file it is in.
    #[error("'{}': {source}", path.display())]
    InFile {
        /// The file.
        path: PathBuf,
        /// What is wrong in it.
        source: Box<LoadError>,
    },
    /// Content that breaks the rules of its format.
    #[error("not a valid {format} file: {detail}")]
    Malformed {
        /// Name of the format.
        format: &'static str,
        /// What is wrong and where: line, byte, accessor.
        detail: String,
    },
    /// Valid content that this loader cannot show without lying.
    #[error("unsupported {format} content: {detail}")]
    Unsupported {
        /// Name of the format.
        format: &'static str,
        /// What, and where.
        detail: String,
    },
    /// A file named inside a scene file that cannot be read.
    #[error("'{uri}', named in the file: {detail}")]
    Asset {
        /// The name as it stands in the file.
        uri: String,
        /// Why it was not read.
        detail: String,
    },
    /// A file named inside a scene file that lies outside the scene's folder.
    #[error("'{uri}', named in the file, leads out of the scene's folder{detail}, and is not read")]
    OutsideFolder {
        /// The name as it stands in the file.
        uri: String,
        /// Empty, or by which way if the name does not show it.
        detail: &'static str,
    },
    /// A built-in scene that does not exist, or a parameter it does not have or cannot take.
    #[error("{0}")]
    BuiltIn(String),
    /// Parts that do not fit together.
    #[error(transparent)]
    Scene(#[from] pellucid_core::Error),
}
