//! What can be wrong with a request, in words a user can act on.

/// An error of the core: a scene, view or option that has no meaning.
///
/// Loaders and backends wrap it in errors of their own; every message says what is wrong, where, and what would help.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A mesh whose parts do not fit together.
    #[error("invalid mesh: {0}")]
    Mesh(String),
    /// A texture whose size and data do not fit together.
    #[error("invalid texture: {0}")]
    Texture(String),
    /// A reference to a mesh, material or texture that the scene does not have, or a scene beyond the format's limits.
    #[error("invalid scene: {0}")]
    Scene(String),
    /// A camera that looks nowhere.
    #[error("invalid camera: {0}")]
    Camera(String),
    /// A size, opacity or other setting of the view out of range.
    #[error("invalid view: {0}")]
    View(String),
    /// An F-Buffer of a size that there is not.
    #[error("invalid F-Buffer: {0}")]
    FBuffer(String),
    /// Threads that cannot be had.
    #[error("cannot start {threads} threads: {detail}; ask for fewer")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the system says.
        detail: String,
    },
    /// A name that nothing has.
    #[error("unknown {kind} '{name}'; known are: {known}")]
    UnknownName {
        /// What kind of thing was named: "resolve", "technique".
        kind: &'static str,
        /// The name as given.
        name: String,
        /// The names there are, joined by commas.
        known: String,
    },
}
