//! The files that a scene file names: buffers, textures, material libraries.

use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::LoadError;

/// Where a loader finds the files that its own file names.
pub trait Assets {
    /// The content of the file that `name` means: a relative path with `/` or `\`, already percent-decoded.
    ///
    /// # Errors
    /// [`LoadError::Asset`] if there is no such file or it cannot be read, [`LoadError::OutsideFolder`] if it must not be
    /// read.
    fn read(&self, name: &str) -> Result<Vec<u8>, LoadError>;
}

/// Files in one folder and the folders in it; nothing outside is ever read.
#[derive(Debug, Clone)]
pub struct Folder {
    root: PathBuf,
}

impl Folder {
    /// The files below `root`; an empty path is the current folder.
    pub fn new(root: &Path) -> Self {
        let root = if root.as_os_str().is_empty() { Path::new(".") } else { root };
        Self { root: root.to_owned() }
    }
}

impl Assets for Folder {
    fn read(&self, name: &str) -> Result<Vec<u8>, LoadError> {
        let refused = |detail| LoadError::OutsideFolder { uri: shown(name), detail };
        let portable = name.replace('\\', "/");
        let has_drive = portable.as_bytes().get(1) == Some(&b':');
        let path = Path::new(&portable);
        let stays_inside = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        if has_drive || !stays_inside {
            return Err(refused(""));
        }
        let full = self.root.join(path);
        let unreadable = |error| LoadError::Asset { uri: shown(name), detail: format!("cannot be read: {error}") };
        // A link may lead out although the name does not.
        let root = fs::canonicalize(&self.root).map_err(unreadable)?;
        let full = fs::canonicalize(&full).map_err(unreadable)?;
        if !full.starts_with(&root) {
            return Err(refused(" through a link"));
        }
        fs::read(full).map_err(unreadable)
    }
}

/// No files at all.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoAssets;

impl Assets for NoAssets {
    fn read(&self, name: &str) -> Result<Vec<u8>, LoadError> {
        Err(LoadError::Asset { uri: shown(name), detail: "there are no other files here".into() })
    }
}

/// The name, short enough for a message.
fn shown(name: &str) -> String {
    let mut short: String = name.chars().take(120).collect();
    if short.len() < name.len() {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_leave_the_folder_are_refused() {
        let outer = tempfile::tempdir().unwrap();
        let inner = outer.path().join("inner");
        fs::create_dir_all(inner.join("sub")).unwrap();
        fs::write(outer.path().join("secret"), "s").unwrap();
        fs::write(inner.join("sub/file"), "f").unwrap();
        let folder = Folder::new(&inner);
        assert_eq!(folder.read("sub/file").unwrap(), b"f");
        assert_eq!(folder.read("./sub\\file").unwrap(), b"f");
        let absolute = outer.path().join("secret").display().to_string();
        for name in ["../secret", "sub/../../secret", "..\\secret", "/etc/passwd", &absolute, "C:\\secret", "a\0b", ""]
        {
            assert!(folder.read(name).is_err(), "{name:?} was read");
        }
        for name in ["../secret", "/etc/passwd", "C:\\secret"] {
            assert!(matches!(folder.read(name), Err(LoadError::OutsideFolder { .. })), "{name:?}");
        }
        assert!(matches!(folder.read("missing"), Err(LoadError::Asset { .. })));
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(outer.path().join("secret"), inner.join("link")).unwrap();
            assert!(folder.read("link").unwrap_err().to_string().contains("link"));
        }
    }
}
