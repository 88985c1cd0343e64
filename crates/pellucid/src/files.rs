//! Files that get their name only when they are whole: written under a temporary name in the same folder, then renamed,
//! so that an error leaves nothing behind and a reader never sees half a file.
//!
//! A name that is already taken by something other than a file (a pipe, a device) is written to directly, as renaming
//! would put a file in its place.

use std::fmt::Display;
use std::fs::{self, File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::Error;

/// Where content goes until the file is whole.
pub type Writer<'a> = BufWriter<&'a mut File>;

/// Checks that a file of this name could be written, before long work that ends in writing it.
///
/// # Errors
/// [`Error::Save`] if its folder is missing or may not be written to, or the name is a folder's.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    match Target::of(path)? {
        // Made to see whether it can be, and gone at the end of this line.
        Target::File(path) => temporary_file(&path).map(drop),
        Target::Special => Ok(()),
    }
}

/// Writes a file through `write`; it appears under its name when `write` is done.
///
/// # Errors
/// [`Error::Save`] as from [`check_writable`], if `write` fails, or if the disk is full; then nothing is left behind.
pub fn write_whole<E: Display>(path: &Path, write: impl FnOnce(&mut Writer<'_>) -> Result<(), E>) -> Result<(), Error> {
    match Target::of(path)? {
        Target::File(target) => {
            let mut file = temporary_file(&target)?;
            fill(path, file.as_file_mut(), write)?;
            file.persist(&target).map_err(|error| Error::save(path, error.error))?;
            Ok(())
        }
        Target::Special => {
            let mut file = OpenOptions::new().write(true).open(path).map_err(|error| Error::save(path, error))?;
            fill(path, &mut file, write)
        }
    }
}

fn fill<E: Display>(
    path: &Path,
    file: &mut File,
    write: impl FnOnce(&mut Writer<'_>) -> Result<(), E>,
) -> Result<(), Error> {
    let mut writer = BufWriter::new(file);
    write(&mut writer).map_err(|error| Error::save(path, error))?;
    writer.flush().map_err(|error| Error::save(path, error))
}

/// What a name stands for.
enum Target {
    /// A file, there or not, behind all links.
    File(PathBuf),
    /// A pipe or device.
    Special,
}

impl Target {
    fn of(path: &Path) -> Result<Self, Error> {
        if path.file_name().is_none() {
            return Err(Error::save(path, "it names no file"));
        }
        let Ok(metadata) = fs::metadata(path) else {
            return Ok(Self::File(path.to_owned()));
        };
        if metadata.is_dir() {
            return Err(Error::save(path, "it is a folder; name a file in it"));
        }
        if !metadata.is_file() {
            return Ok(Self::Special);
        }
        // The file that a link leads to is replaced, not the link.
        Ok(Self::File(fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())))
    }
}

fn temporary_file(target: &Path) -> Result<NamedTempFile, Error> {
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match fs::metadata(folder) {
        Ok(metadata) if !metadata.is_dir() => {
            return Err(Error::save(target, format!("'{}' is a file, not a folder", folder.display())));
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(Error::save(target, format!("there is no folder '{}'; make it first", folder.display())));
        }
        _ => {}
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".pellucid-");
    // A temporary file is its owner's alone; this one becomes a file like any other, as the umask allows.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder).map_err(|error| {
        // By kind, as the whole message names the temporary file, which means nothing to a reader.
        Error::save(target, format!("its folder cannot be written to: {}", error.kind()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_in(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_alone_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_whole(&path, |writer| writer.write_all(b"old")).unwrap();
        let result = write_whole(&path, |writer| {
            writer.write_all(b"new")?;
            Err(std::io::Error::other("enough"))
        });
        assert!(result.unwrap_err().to_string().ends_with("enough"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names_in(folder.path()), ["a.txt"]);
    }

    #[test]
    fn what_cannot_be_written_is_known_before() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        check_writable(&path).unwrap();
        assert!(names_in(folder.path()).is_empty());
        fs::write(&path, "").unwrap();
        for (bad, reason) in [
            (folder.path().to_owned(), "is a folder"),
            (folder.path().join("missing/a.txt"), "there is no folder"),
            (path.join("b.txt"), "not a folder"),
            (PathBuf::from(""), "names no file"),
        ] {
            let message = check_writable(&bad).unwrap_err().to_string();
            assert!(message.contains(reason), "{message}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_permissions_are_those_of_any_file() {
        use std::os::unix::fs::MetadataExt;

        let folder = tempfile::tempdir().unwrap();
        let [real, link, other] = ["real", "link", "other"].map(|name| folder.path().join(name));
        fs::write(&real, "old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_whole(&link, |writer| writer.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&real).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        fs::write(&other, "").unwrap();
        assert_eq!(fs::metadata(&real).unwrap().mode(), fs::metadata(&other).unwrap().mode());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_is_written_to_and_a_full_one_is_an_error() {
        write_whole(Path::new("/dev/null"), |writer| writer.write_all(b"text")).unwrap();
        let error = write_whole(Path::new("/dev/full"), |writer| writer.write_all(b"text")).unwrap_err();
        assert!(error.to_string().contains("/dev/full"), "{error}");
        assert!(!fs::metadata("/dev/full").unwrap().is_file());
    }
}
