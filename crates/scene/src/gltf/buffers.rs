//! The bytes behind buffers, buffer views and URIs.

use std::borrow::Cow;
use std::collections::HashMap;
use std::rc::Rc;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD_PAD_INDIFFERENT;
use percent_encoding::percent_decode_str;

use super::document::Document;
use super::malformed;
use crate::{Assets, LoadError};

/// Reads what a URI means: data in itself, or a file beside the scene's own. Each file is read once.
pub(super) struct Uris<'a> {
    assets: &'a dyn Assets,
    files: HashMap<String, Rc<[u8]>>,
    /// All bytes that files and data URIs gave so far, each file once.
    pub(super) bytes_read: u64,
}

impl<'a> Uris<'a> {
    pub(super) fn new(assets: &'a dyn Assets) -> Self {
        Self { assets, files: HashMap::new(), bytes_read: 0 }
    }

    /// The bytes of `uri`.
    ///
    /// # Errors
    /// [`LoadError::OutsideFolder`] for an address elsewhere, [`LoadError::Asset`] for what cannot be read.
    pub(super) fn read(&mut self, uri: &str) -> Result<Rc<[u8]>, LoadError> {
        if let Some(data) = strip_scheme(uri, "data") {
            let bytes = decode_data(data).map_err(|detail| LoadError::Asset { uri: shown(uri), detail })?;
            self.bytes_read += bytes.len() as u64;
            return Ok(bytes.into());
        }
        if has_scheme(uri) {
            return Err(LoadError::OutsideFolder { uri: shown(uri), detail: "" });
        }
        let unreadable = |detail: &str| LoadError::Asset { uri: shown(uri), detail: detail.into() };
        let name = percent_decode_str(uri).decode_utf8().map_err(|_| unreadable("is not UTF-8 once decoded"))?;
        if name.is_empty() {
            return Err(unreadable("an empty name"));
        }
        // Different spellings of a name must not be a way to have a large file read many times.
        let plain_parts: Vec<&str> = name.split(['/', '\\']).filter(|part| !matches!(*part, "" | ".")).collect();
        let key = plain_parts.join("/");
        // An absolute name keeps its slash, so that it is refused and not mistaken for a relative one.
        let key = if name.starts_with(['/', '\\']) { format!("/{key}") } else { key };
        if let Some(bytes) = self.files.get(&key) {
            return Ok(bytes.clone());
        }
        let bytes: Rc<[u8]> = self.assets.read(&name)?.into();
        self.bytes_read += bytes.len() as u64;
        self.files.insert(key, bytes.clone());
        Ok(bytes)
    }
}

/// All buffers of a document.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    contents: Vec<Content<'a>>,
}

enum Content<'a> {
    Chunk(&'a [u8]),
    File(Rc<[u8]>),
}

impl<'a> Buffers<'a> {
    /// Reads all buffers; `binary` is the second chunk of a GLB.
    pub(super) fn read(
        document: &'a Document,
        binary: Option<&'a [u8]>,
        uris: &mut Uris<'_>,
    ) -> Result<Self, LoadError> {
        let mut contents = Vec::with_capacity(document.buffers.len());
        for (index, buffer) in document.buffers.iter().enumerate() {
            let content = match (&buffer.uri, binary) {
                (Some(uri), _) => Content::File(uris.read(uri)?),
                (None, Some(chunk)) if index == 0 => Content::Chunk(chunk),
                (None, _) => return Err(malformed(format!("buffer {index} has neither a URI nor a GLB chunk"))),
            };
            let there = content.bytes().len();
            if there < buffer.byte_length {
                let stated = buffer.byte_length;
                return Err(malformed(format!("buffer {index} should have {stated} bytes but has only {there}")));
            }
            contents.push(content);
        }
        Ok(Self { document, contents })
    }

    /// The bytes of a buffer view, and its stride if it has one; `place` says who asks.
    pub(super) fn view(&self, index: usize, place: &str) -> Result<(&[u8], Option<usize>), LoadError> {
        let Some(view) = self.document.buffer_views.get(index) else {
            let count = self.document.buffer_views.len();
            return Err(malformed(format!("{place}: buffer view {index} does not exist; there are {count}")));
        };
        let (Some(content), Some(buffer)) = (self.contents.get(view.buffer), self.document.buffers.get(view.buffer))
        else {
            let (buffer, count) = (view.buffer, self.document.buffers.len());
            return Err(malformed(format!("buffer view {index}: buffer {buffer} does not exist; there are {count}")));
        };
        let end = view.byte_offset.checked_add(view.byte_length).filter(|&end| end <= buffer.byte_length);
        let Some(bytes) = end.and_then(|end| content.bytes().get(view.byte_offset..end)) else {
            return Err(malformed(format!(
                "buffer view {index}: {} bytes from byte {} on, but buffer {} has only {}",
                view.byte_length, view.byte_offset, view.buffer, buffer.byte_length
            )));
        };
        // Old exporters write 0 for "none".
        Ok((bytes, view.byte_stride.filter(|&stride| stride != 0)))
    }
}

impl Content<'_> {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Chunk(bytes) => bytes,
            Self::File(bytes) => bytes,
        }
    }
}

fn strip_scheme<'a>(uri: &'a str, scheme: &str) -> Option<&'a str> {
    let (found, rest) = uri.split_once(':')?;
    found.eq_ignore_ascii_case(scheme).then_some(rest)
}

/// Whether a URI starts with a scheme (RFC 3986, section 3.1), which a Windows drive also looks like.
fn has_scheme(uri: &str) -> bool {
    uri.split_once(':').is_some_and(|(scheme, _)| {
        scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.'))
    })
}

/// The data of `[media type][;base64],data` (RFC 2397).
fn decode_data(data: &str) -> Result<Vec<u8>, String> {
    let (kind, data) = data.split_once(',').ok_or("a data URI without a comma")?;
    let bytes = percent_decode_str(data);
    if kind.to_ascii_lowercase().ends_with(";base64") {
        let text = Cow::from(bytes);
        STANDARD_PAD_INDIFFERENT.decode(text).map_err(|error| format!("is not valid Base64: {error}"))
    } else {
        Ok(bytes.collect())
    }
}

/// A URI or name, short enough for a message.
pub(super) fn shown(text: &str) -> String {
    const MAX_CHARS: usize = 60;
    match text.char_indices().nth(MAX_CHARS) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NoAssets;

    #[test]
    fn data_uris() {
        for (uri, expected) in [
            ("data:application/octet-stream;base64,AAEC", [0, 1, 2].as_slice()),
            ("DATA:;Base64,AAECAw==", &[0, 1, 2, 3]),
            ("data:;base64,AAECAw", &[0, 1, 2, 3]),
            ("data:;base64,AAECAw%3D%3d", &[0, 1, 2, 3]),
            ("data:,a%00b", b"a\0b"),
            ("data:,", b""),
        ] {
            assert_eq!(&*Uris::new(&NoAssets).read(uri).unwrap(), expected, "{uri}");
        }
        for uri in ["data:;base64,A", "data:;base64,AA!A", "data:base64"] {
            assert!(matches!(Uris::new(&NoAssets).read(uri), Err(LoadError::Asset { .. })), "{uri}");
        }
    }

    #[test]
    fn addresses_elsewhere_are_refused() {
        for uri in ["http://a.example/b.bin", "file:///etc/passwd", "C:\\b.bin", "c:b.bin"] {
            assert!(matches!(Uris::new(&NoAssets).read(uri), Err(LoadError::OutsideFolder { .. })), "{uri}");
        }
    }

    #[test]
    fn a_file_is_read_once_whatever_its_spelling() {
        use std::cell::Cell;
        struct Counting(Cell<u32>);
        impl Assets for Counting {
            fn read(&self, _: &str) -> Result<Vec<u8>, LoadError> {
                self.0.set(self.0.get() + 1);
                Ok(vec![1])
            }
        }
        let assets = Counting(Cell::new(0));
        let mut uris = Uris::new(&assets);
        for uri in ["a/b c.bin", "./a/b%20c.bin", "a//b c.bin", "a\\b c.bin", "%61/b c.bin"] {
            uris.read(uri).unwrap();
        }
        assert_eq!(assets.0.get(), 1);
        uris.read("/a/b c.bin").unwrap();
        assert_eq!(assets.0.get(), 2);
    }
}
