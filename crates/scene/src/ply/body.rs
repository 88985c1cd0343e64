//! The rows, one number after the other, in each encoding.

use std::fmt::Display;
use std::marker::PhantomData;

use super::FORMAT;
use super::header::{Element, Kind};
use crate::LoadError;
use crate::text::{At, Lines, Words, parse, shown};

/// Gives the numbers of a file in their order. All types of number fit an f64.
pub(super) trait Source {
    /// Begins with the rows of an element.
    ///
    /// # Errors
    /// If the file is too short for that many, however short each is.
    fn start(&mut self, element: &Element) -> Result<(), LoadError>;

    /// Begins with the next row.
    fn row(&mut self) -> Result<(), LoadError>;

    /// The next number.
    fn value(&mut self, kind: Kind) -> Result<f64, LoadError>;

    /// What is left, for numbers of this type.
    fn room(&self, kind: Kind) -> usize;

    /// The error that `what` is where the source is.
    fn error(&self, what: impl Display) -> LoadError;

    /// The length of a list whose numbers follow.
    ///
    /// # Errors
    /// If the file is too short for that many.
    fn list(&mut self, count: Kind, value: Kind) -> Result<usize, LoadError> {
        let length = self.value(count)?;
        if length < 0.0 || length.fract() != 0.0 {
            return Err(self.error(format_args!("a list cannot have {length} items")));
        }
        if length > self.room(value) as f64 {
            return Err(self.error(format_args!("a list of {length} items goes beyond the end")));
        }
        Ok(length as usize)
    }
}

/// Order of the bytes of a number.
pub(super) trait Order {
    const BIG: bool;
}

pub(super) struct Little;
pub(super) struct Big;

impl Order for Little {
    const BIG: bool = false;
}

impl Order for Big {
    const BIG: bool = true;
}

pub(super) struct Binary<'a, O> {
    rest: &'a [u8],
    end: usize,
    element: String,
    rows: usize,
    order: PhantomData<O>,
}

impl<'a, O: Order> Binary<'a, O> {
    /// Rows that begin at byte `start` of their file.
    pub(super) fn new(body: &'a [u8], start: usize) -> Self {
        Self { rest: body, end: start + body.len(), element: String::new(), rows: 0, order: PhantomData }
    }

    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], LoadError> {
        let Some((bytes, rest)) = self.rest.split_first_chunk::<N>() else {
            return Err(self.error("the file ends"));
        };
        self.rest = rest;
        let mut bytes = *bytes;
        if O::BIG {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

impl<O: Order> Source for Binary<'_, O> {
    fn start(&mut self, element: &Element) -> Result<(), LoadError> {
        self.element.clone_from(&element.name);
        self.rows = 0;
        let row_bytes: usize = element.properties.iter().map(|p| p.count.unwrap_or(p.value).size_bytes()).sum();
        if row_bytes.checked_mul(element.count).is_none_or(|bytes| bytes > self.rest.len()) {
            return Err(self.error(format_args!(
                "{} rows of at least {row_bytes} bytes are announced, but only {} bytes are left",
                element.count,
                self.rest.len()
            )));
        }
        Ok(())
    }

    #[inline]
    fn row(&mut self) -> Result<(), LoadError> {
        self.rows += 1;
        Ok(())
    }

    #[inline]
    fn value(&mut self, kind: Kind) -> Result<f64, LoadError> {
        Ok(match kind {
            Kind::I8 => f64::from(i8::from_le_bytes(self.take()?)),
            Kind::U8 => f64::from(u8::from_le_bytes(self.take()?)),
            Kind::I16 => f64::from(i16::from_le_bytes(self.take()?)),
            Kind::U16 => f64::from(u16::from_le_bytes(self.take()?)),
            Kind::I32 => f64::from(i32::from_le_bytes(self.take()?)),
            Kind::U32 => f64::from(u32::from_le_bytes(self.take()?)),
            Kind::F32 => f64::from(f32::from_le_bytes(self.take()?)),
            Kind::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn room(&self, kind: Kind) -> usize {
        self.rest.len() / kind.size_bytes()
    }

    #[cold]
    fn error(&self, what: impl Display) -> LoadError {
        let Self { element, rows, end, .. } = self;
        let byte = end - self.rest.len();
        LoadError::Malformed {
            format: FORMAT,
            detail: format!("byte {byte}, row {rows} of element '{element}': {what}"),
        }
    }
}

pub(super) struct Ascii<'a> {
    lines: Lines<'a>,
    words: Words<'a>,
    at: At,
}

impl<'a> Ascii<'a> {
    /// Rows that follow on `header_lines` lines.
    pub(super) fn new(body: &'a [u8], header_lines: usize) -> Self {
        let at = At { format: FORMAT, line: header_lines };
        Self { lines: Lines::new(body, header_lines + 1), words: Words::new(b""), at }
    }

    /// The row before must have been read to its end.
    fn check_end(&self) -> Result<(), LoadError> {
        match self.words.clone().next() {
            None => Ok(()),
            Some(word) => Err(self.error(format_args!("'{}' is one word too many", shown(word)))),
        }
    }
}

impl Source for Ascii<'_> {
    fn start(&mut self, element: &Element) -> Result<(), LoadError> {
        self.check_end()?;
        // At least a digit and a space each.
        let row_bytes = 2 * element.properties.len();
        let left = self.lines.rest().len();
        if row_bytes.checked_mul(element.count).is_none_or(|bytes| bytes > left + 1) {
            return Err(self.error(format_args!(
                "{} rows of element '{}' are announced, but only {left} bytes are left",
                element.count, element.name
            )));
        }
        Ok(())
    }

    fn row(&mut self) -> Result<(), LoadError> {
        self.check_end()?;
        loop {
            let Some((line, text)) = self.lines.next() else {
                return Err(self.error("the file ends before its last row"));
            };
            self.at.line = line;
            self.words = Words::new(text);
            if !self.words.rest().is_empty() {
                return Ok(());
            }
        }
    }

    fn value(&mut self, kind: Kind) -> Result<f64, LoadError> {
        let Some(word) = self.words.next() else {
            return Err(self.error("the row has too few numbers"));
        };
        let value: f64 = parse(word).ok_or_else(|| self.error(format_args!("'{}' is no number", shown(word))))?;
        if !matches!(kind, Kind::F32 | Kind::F64) && value.fract() != 0.0 {
            return Err(self.error(format_args!("'{}' is no whole number", shown(word))));
        }
        Ok(value)
    }

    fn room(&self, _kind: Kind) -> usize {
        self.words.rest().len().div_ceil(2)
    }

    #[cold]
    fn error(&self, what: impl Display) -> LoadError {
        self.at.error(what)
    }
}
