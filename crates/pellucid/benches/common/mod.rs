//! What the benchmarks share.

use std::path::{Path, PathBuf};

/// Where real scenes are; `None` without any.
pub(crate) fn scene_folder() -> Option<PathBuf> {
    if let Some(folder) = std::env::var_os("PELLUCID_SCENES") {
        return Some(folder.into());
    }
    let mut folder = Some(Path::new(env!("CARGO_MANIFEST_DIR")));
    while let Some(here) = folder {
        let scenes = here.join("shared/scenes");
        if scenes.is_dir() {
            return Some(scenes);
        }
        folder = here.parent();
    }
    None
}
