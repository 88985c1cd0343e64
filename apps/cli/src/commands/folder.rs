//! The folder that a report goes to.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use pellucid::Image;
use pellucid::files::{check_writable, write_whole};

/// A folder that can be written to. If it was made for this run and nothing was written, it is gone in the end.
pub(crate) struct Folder {
    path: PathBuf,
    is_new: bool,
}

impl Folder {
    /// The folder of that name, made if only it is missing.
    pub(crate) fn open(path: &Path) -> anyhow::Result<Self> {
        let is_new = match fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => false,
            Ok(_) => bail!("cannot write into '{}': it is a file, not a folder", path.display()),
            Err(_) => {
                make(path)?;
                true
            }
        };
        let folder = Self { path: path.to_owned(), is_new };
        // What cannot be written is better known before all the rendering than after.
        check_writable(&folder.path("index.html"))?;
        Ok(folder)
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    pub(crate) fn save(&self, name: &str, image: &Image) -> anyhow::Result<()> {
        Ok(pellucid::save(image, self.path(name))?)
    }

    pub(crate) fn write(&self, name: &str, content: &[u8]) -> anyhow::Result<()> {
        Ok(write_whole(&self.path(name), |writer| writer.write_all(content))?)
    }

    pub(crate) fn read(&self, name: &str) -> anyhow::Result<Vec<u8>> {
        let path = self.path(name);
        fs::read(&path).with_context(|| format!("cannot read '{}', just written", path.display()))
    }
}

fn make(path: &Path) -> anyhow::Result<()> {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match fs::create_dir(path) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            bail!("cannot make folder '{}': there is no folder '{}'; make it first", path.display(), parent.display())
        }
        Err(error) => bail!("cannot make folder '{}': {}", path.display(), error.kind()),
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if self.is_new {
            // Refused if anything is in it.
            let _ = fs::remove_dir(&self.path);
        }
    }
}
