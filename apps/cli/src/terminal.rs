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
    note(&format!("error: {}", one_line(&format!("{error:#}"))));
}

/// Whether the reader of stdout went away.
pub(crate) fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

/// The text without line breaks and other control characters, which a file name or a file's content may bring in.
fn one_line(text: &str) -> String {
    text.split(char::is_control).filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_one_line() {
        assert_eq!(one_line("a\n\tb\x1b[31mc"), "a b [31mc");
    }
}
