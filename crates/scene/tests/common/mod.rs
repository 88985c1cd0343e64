//! What the tests of the loaders share.
#![allow(dead_code, unreachable_pub, reason = "each test file uses its own part of this module")]

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use pellucid_scene::{Assets, LoadError, Loaded};

/// A loader.
pub type Parse = fn(&[u8], &dyn Assets) -> Result<Loaded, LoadError>;

/// Files in memory.
#[derive(Default)]
pub struct Files(pub HashMap<&'static str, Vec<u8>>);

impl Files {
    pub fn of(files: &[(&'static str, &[u8])]) -> Self {
        Self(files.iter().map(|&(name, bytes)| (name, bytes.to_vec())).collect())
    }
}

impl Assets for Files {
    fn read(&self, name: &str) -> Result<Vec<u8>, LoadError> {
        if name.contains("..") {
            return Err(LoadError::OutsideFolder { uri: name.into(), detail: "" });
        }
        let missing = || LoadError::Asset { uri: name.into(), detail: "is not there".into() };
        self.0.get(name).cloned().ok_or_else(missing)
    }
}

/// A PNG picture.
pub fn png(width: u32, height: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let picture = image::RgbaImage::from_raw(width, height, texels.concat()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// A file of the development scenes, if they are there.
pub fn scene_file(name: &str) -> Option<PathBuf> {
    let folder = match std::env::var_os("PELLUCID_SCENES") {
        Some(folder) => Some(PathBuf::from(folder)),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|a| a.join("shared/scenes")).find(|p| p.is_dir()),
    };
    let file = folder.map(|folder| folder.join(name)).filter(|file| file.is_file());
    if file.is_none() {
        eprintln!("skipped: there is no '{name}' here (see PELLUCID_SCENES)");
    }
    file
}

/// Parses every beginning of a file: each is a scene or an error. Returns how many are a scene.
pub fn every_prefix(parse: Parse, bytes: &[u8], assets: &dyn Assets) -> usize {
    (0..bytes.len()).filter(|&length| parse(&bytes[..length], assets).is_ok()).count()
}

/// The file with some bytes changed and perhaps cut off.
pub fn damaged(file: &[u8], changes: &[(usize, u8)], length: usize) -> Vec<u8> {
    let mut bytes = file.to_vec();
    for &(at, value) in changes {
        let at = at % bytes.len();
        bytes[at] = value;
    }
    bytes.truncate(length.max(1));
    bytes
}

/// Tells what is wrong with a file.
pub fn error(parse: Parse, bytes: impl AsRef<[u8]>) -> String {
    match parse(bytes.as_ref(), &pellucid_scene::NoAssets) {
        Ok(_) => panic!("it was loaded"),
        Err(error) => error.to_string(),
    }
}
