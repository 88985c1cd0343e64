//! The header: which elements follow, and what each row of them holds.

use super::FORMAT;
use crate::LoadError;
use crate::text::{At, Lines, Words, shown};

/// How the rows are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Little,
    Big,
}

/// Type of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn parse(word: &[u8]) -> Option<Self> {
        Some(match word {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    pub(super) fn size_bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// A number in each row of an element, or a list of numbers.
#[derive(Debug)]
pub(super) struct Property {
    pub(super) name: String,
    /// Type of the number, or of the numbers in the list.
    pub(super) value: Kind,
    /// Type of the list's length; `None`: not a list.
    pub(super) count: Option<Kind>,
}

/// Rows of one kind.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

#[derive(Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Lines of the header.
    pub(super) line_count: usize,
    /// Position of the first byte after the header.
    pub(super) body_start: usize,
}

impl Header {
    pub(super) fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|e| e.name == name)
    }
}

pub(super) fn parse(bytes: &[u8]) -> Result<Header, LoadError> {
    let invalid = |detail: &str| LoadError::Malformed { format: FORMAT, detail: detail.into() };
    if bytes.is_empty() {
        return Err(invalid("the file is empty"));
    }
    if !bytes.starts_with(b"ply") || !bytes.get(3).is_some_and(u8::is_ascii_whitespace) {
        return Err(invalid("it does not begin with a line 'ply'"));
    }
    let mut lines = Lines::new(bytes, 1);
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    lines.next();
    while let Some((line, text)) = lines.next() {
        let at = At { format: FORMAT, line };
        let mut words = Words::new(text);
        match words.next() {
            Some(b"format") => encoding = Some(parse_encoding(at, words)?),
            Some(b"element") => {
                let element = parse_element(at, words)?;
                if elements.iter().any(|e| e.name == element.name) {
                    return Err(at.error(format_args!("element '{}' is there twice", element.name)));
                }
                elements.push(element);
            }
            Some(b"property") => {
                let element = elements.last_mut().ok_or_else(|| at.error("a property before the first element"))?;
                element.properties.push(parse_property(at, words)?);
            }
            Some(b"end_header") => {
                let rest = rest_after_header(bytes, lines.rest());
                return Ok(Header {
                    encoding: encoding.ok_or_else(|| invalid("its header has no line 'format'"))?,
                    elements,
                    line_count: line,
                    body_start: bytes.len() - rest.len(),
                });
            }
            Some(b"comment" | b"obj_info") | None => {}
            Some(word) => return Err(at.error(format_args!("'{}' is no PLY statement", shown(word)))),
        }
    }
    Err(invalid("its header has no line 'end_header'"))
}

/// What follows the header. In a file whose lines end in CR alone, a byte like LF after the last of them is data.
fn rest_after_header<'a>(bytes: &'a [u8], rest: &'a [u8]) -> &'a [u8] {
    let start = bytes.len() - rest.len();
    let first_line_ends = bytes.get(3..5).unwrap_or_default();
    let took_data = first_line_ends[0] == b'\r' && first_line_ends[1] != b'\n' && bytes[..start].ends_with(b"\r\n");
    &bytes[start - usize::from(took_data)..]
}

fn parse_encoding(at: At, mut words: Words<'_>) -> Result<Encoding, LoadError> {
    let encoding = match words.next() {
        Some(b"ascii") => Encoding::Ascii,
        Some(b"binary_little_endian") => Encoding::Little,
        Some(b"binary_big_endian") => Encoding::Big,
        other => return Err(at.error(format_args!("unknown encoding '{}'", shown(other.unwrap_or_default())))),
    };
    if words.rest() != b"1.0" {
        return Err(at.error(format_args!("version '{}'; 1.0 is the only one there is", shown(words.rest()))));
    }
    Ok(encoding)
}

fn parse_element(at: At, mut words: Words<'_>) -> Result<Element, LoadError> {
    let (Some(name), Some(count), None) = (words.next(), words.next(), words.next()) else {
        return Err(at.error("an element wants a name and a count"));
    };
    let count = crate::text::parse(count)
        .ok_or_else(|| at.error(format_args!("'{}' is no count of elements", shown(count))))?;
    Ok(Element { name: String::from_utf8_lossy(name).into_owned(), count, properties: Vec::new() })
}

fn parse_property(at: At, mut words: Words<'_>) -> Result<Property, LoadError> {
    let kind = |words: &mut Words<'_>| {
        let word = words.next().unwrap_or_default();
        Kind::parse(word).ok_or_else(|| at.error(format_args!("unknown type '{}'", shown(word))))
    };
    let is_list = words.clone().next() == Some(b"list");
    let count = if is_list {
        words.next();
        let count = kind(&mut words)?;
        if matches!(count, Kind::F32 | Kind::F64) {
            return Err(at.error("the length of a list cannot be a float"));
        }
        Some(count)
    } else {
        None
    };
    let value = kind(&mut words)?;
    let (Some(name), None) = (words.next(), words.next()) else {
        return Err(at.error("a property wants a type and a name"));
    };
    Ok(Property { name: String::from_utf8_lossy(name).into_owned(), value, count })
}
