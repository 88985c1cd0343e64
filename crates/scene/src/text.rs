//! Lines, words and numbers of the text formats, each error with its line.

use std::borrow::Cow;

use crate::LoadError;

/// The lines of a text, numbered from 1; LF, CR and CR LF all end one.
pub(crate) struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> Lines<'a> {
    /// The lines of `bytes`, less a byte order mark, the first one having number `first`.
    pub(crate) fn new(bytes: &'a [u8], first: usize) -> Self {
        let rest = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Self { rest, number: first - 1 }
    }

    /// What has not been read yet.
    pub(crate) fn rest(&self) -> &'a [u8] {
        self.rest
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(self.rest.len());
        let (line, rest) = self.rest.split_at(end);
        self.rest = rest.strip_prefix(b"\r\n").or(rest.get(1..)).unwrap_or_default();
        self.number += 1;
        Some((self.number, line))
    }
}

/// The words of a line: what white space separates. The rest of the line can be had at any point, as names of files
/// and materials may contain spaces.
#[derive(Clone)]
pub(crate) struct Words<'a> {
    rest: &'a [u8],
}

impl<'a> Words<'a> {
    pub(crate) fn new(line: &'a [u8]) -> Self {
        Self { rest: line.trim_ascii() }
    }

    /// Everything after the last word read, without white space around it.
    pub(crate) fn rest(&self) -> &'a [u8] {
        self.rest
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest.trim_ascii_start();
        Some(word)
    }
}

/// Where an error is: the format and the line.
#[derive(Clone, Copy)]
pub(crate) struct At {
    pub(crate) format: &'static str,
    pub(crate) line: usize,
}

impl At {
    /// The error that `what` is at this line.
    pub(crate) fn error(self, what: impl std::fmt::Display) -> LoadError {
        LoadError::Malformed { format: self.format, detail: format!("line {}: {what}", self.line) }
    }

    /// The next word as a number; NaN and infinities are numbers.
    pub(crate) fn number(self, words: &mut Words<'_>, what: &str) -> Result<f32, LoadError> {
        let word = words.next().ok_or_else(|| self.error(format_args!("a number is missing in {what}")))?;
        parse(word).ok_or_else(|| self.error(format_args!("'{}' in {what} is no number", shown(word))))
    }

    /// The next three words as numbers.
    pub(crate) fn numbers<const N: usize>(self, words: &mut Words<'_>, what: &str) -> Result<[f32; N], LoadError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.number(words, what)?;
        }
        Ok(values)
    }
}

/// A word as a number: whole, or a decimal one, NaN or infinity, as the type has it; `None` for anything else.
pub(crate) fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Text of a file, short enough for a message.
pub(crate) fn shown(text: &[u8]) -> Cow<'_, str> {
    const LIMIT: usize = 40;
    if text.len() <= LIMIT {
        return String::from_utf8_lossy(text);
    }
    let mut short = String::from_utf8_lossy(&text[..LIMIT]).into_owned();
    short.push('…');
    short.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_end_counts_once() {
        let lines: Vec<_> = Lines::new(b"\xef\xbb\xbfa\nb\r\n\rc\n\nd", 1).collect();
        let expected: [(usize, &[u8]); 6] = [(1, b"a"), (2, b"b"), (3, b""), (4, b"c"), (5, b""), (6, b"d")];
        assert_eq!(lines, expected);
    }

    #[test]
    fn the_rest_of_a_line_keeps_its_inner_spaces() {
        let mut words = Words::new(b"  map_Kd   my  file.png \t");
        assert_eq!(words.next(), Some(&b"map_Kd"[..]));
        assert_eq!(words.rest(), b"my  file.png");
    }

    #[test]
    fn numbers_are_whole_words() {
        for good in ["1", "-1.5e3", ".5", "5.", "+2", "nan", "-inf"] {
            assert!(parse::<f32>(good.as_bytes()).is_some(), "{good}");
        }
        for bad in ["", "1,5", "1.0f", "0x10", "--1", "1e", "one"] {
            assert!(parse::<f32>(bad.as_bytes()).is_none(), "{bad}");
        }
    }

    #[test]
    fn long_text_is_cut() {
        assert_eq!(shown(b"short"), "short");
        assert!(shown(&[0xff; 1000]).chars().count() <= 41);
    }
}
