//! Text to the user: results to stdout, diagnostics to stderr.

use std::io::{self, Write};

/// Writes a result to stdout, whole: a full disk behind it is an error, not a shorter result.
pub(crate) fn print(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()
}

/// Writes a line to stderr. If nobody can read it, nobody can be told.
pub(crate) fn note(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// Writes a warning to stderr.
pub(crate) fn warn(sentence: &str) {
    note(&format!("warning: {}", one_line(sentence)));
}

/// Writes an error to stderr, its causes behind it.
pub(crate) fn report_error(error: &anyhow::Error) {
    note(&format!("error: {}", one_line(&with_causes(error))));
}

/// Whether the reader of stdout went away.
pub(crate) fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

/// What went wrong and why, each said once: some errors repeat their cause in their own words.
fn with_causes(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            text += ": ";
            text += &cause;
        }
    }
    text
}

/// The text without line breaks and other control characters, which a file name or a file's content may bring in.
fn one_line(text: &str) -> String {
    text.split(char::is_control).filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn causes_are_told_once() {
        let error = anyhow::Error::new(io::Error::other("disk full")).context("cannot write 'a': disk full");
        assert_eq!(with_causes(&error), "cannot write 'a': disk full");
        assert_eq!(with_causes(&error.context("stopped")), "stopped: cannot write 'a': disk full");
    }

    #[test]
    fn messages_are_one_line() {
        assert_eq!(one_line("a\n\tb\x1b[31mc"), "a b [31mc");
    }
}
