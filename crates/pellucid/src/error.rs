//! What can go wrong between a scene's name and its picture on disk.

use std::path::PathBuf;

/// Any error of the library.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene could not be loaded.
    #[error(transparent)]
    Load(#[from] pellucid_scene::LoadError),
    /// A scene, view or option has no meaning.
    #[error(transparent)]
    Core(#[from] pellucid_core::Error),
    /// The GPU cannot do it.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] pellucid_gpu::GpuError),
    /// An F-Buffer cannot do it.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    FBuffer(#[from] pellucid_gpu::fbuffer::FBufferError),
    /// A scene with textures, for a shader of several passes on a GPU.
    #[cfg(feature = "gpu")]
    #[error("on a GPU, shaders of several passes know no textures, and this scene has some; on the CPU they do")]
    Textures,
    /// A technique of the GPU, in a build without it.
    #[cfg(not(feature = "gpu"))]
    #[error("'{0}' runs on a GPU, and this build has no GPU renderer (feature `gpu`)")]
    NoGpu(pellucid_core::Technique),
    /// A picture could not be written; nothing was left behind.
    #[error("cannot write '{}': {detail}", path.display())]
    Save {
        /// Where it should have gone.
        path: PathBuf,
        /// Why it did not.
        detail: String,
    },
}

impl Error {
    pub(crate) fn save(path: &std::path::Path, detail: impl ToString) -> Self {
        Self::Save { path: path.to_owned(), detail: detail.to_string() }
    }
}
