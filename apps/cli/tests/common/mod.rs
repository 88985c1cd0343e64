//! What the tests of the command line share.
#![allow(dead_code, clippy::allow_attributes, reason = "each test file uses a part of it")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use tempfile::TempDir;

/// A folder in which `pellucid` is run, gone after the test.
pub(crate) struct Workplace(TempDir);

/// What came of a run.
pub(crate) struct Outcome {
    /// Exit code.
    pub code: i32,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

impl Workplace {
    /// An empty folder.
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// The path of a file in it.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file.
    pub(crate) fn write(&self, name: &str, content: &str) {
        fs::write(self.path(name), content).unwrap();
    }

    /// Runs `pellucid` in it with arguments separated by spaces.
    pub(crate) fn run(&self, line: &str) -> Outcome {
        let output = Command::cargo_bin("pellucid")
            .unwrap()
            .current_dir(self.0.path())
            .args(line.split_whitespace())
            .output()
            .unwrap();
        Outcome {
            code: output.status.code().expect("ended by itself"),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Runs `pellucid`, which must succeed.
    pub(crate) fn succeed(&self, line: &str) -> Outcome {
        let outcome = self.run(line);
        assert_eq!(outcome.code, 0, "{line}: {}", outcome.stderr);
        outcome
    }

    /// The names of all files in it.
    pub(crate) fn names(&self) -> Vec<String> {
        names_in(self.0.path())
    }

    /// A PNG in it.
    pub(crate) fn png(&self, name: &str) -> image::DynamicImage {
        image::open(self.path(name)).unwrap()
    }
}

impl Outcome {
    /// The only line on stderr, which must be an error.
    pub(crate) fn error(&self) -> &str {
        let line = self.stderr.trim_end_matches('\n');
        assert!(line.starts_with("error: ") && !line.contains('\n'), "{}", self.stderr);
        line
    }
}

/// The names of all files in a folder, sorted.
pub(crate) fn names_in(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}
