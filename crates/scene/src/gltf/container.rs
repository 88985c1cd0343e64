//! Takes a file apart into its JSON text and, of a GLB, its binary chunk (glTF 2.0, section 4.4).

use super::{malformed, unsupported};
use crate::LoadError;

const MAGIC: &[u8; 4] = b"glTF";
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
const CHUNK_JSON: &[u8; 4] = b"JSON";
const CHUNK_BIN: &[u8; 4] = b"BIN\0";

#[derive(Debug)]
pub(super) struct Container<'a> {
    pub(super) json: &'a [u8],
    pub(super) binary: Option<&'a [u8]>,
    /// Bytes behind the end that the header states.
    pub(super) excess_bytes: usize,
}

/// Splits a file; one that does not begin as a GLB is all JSON.
pub(super) fn split(bytes: &[u8]) -> Result<Container<'_>, LoadError> {
    if bytes.is_empty() {
        return Err(malformed("the file is empty"));
    }
    if !bytes.starts_with(MAGIC) {
        let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        return Ok(Container { json, binary: None, excess_bytes: 0 });
    }
    let version = u32_at(bytes, 4);
    if let Some(version) = version
        && version != 2
    {
        return Err(unsupported(format!("GLB container version {version}; only version 2 can be read")));
    }
    let (Some(_), Some(length)) = (version, u32_at(bytes, 8)) else {
        return Err(malformed(format!(
            "a GLB header has {HEADER_BYTES} bytes, but the file ends after {}",
            bytes.len()
        )));
    };
    let length = length as usize;
    if length < HEADER_BYTES {
        return Err(malformed(format!(
            "the GLB header states a length of {length} bytes, less than the header itself"
        )));
    }
    if length > bytes.len() {
        return Err(malformed(format!(
            "the GLB header states a length of {length} bytes, but the file ends after {}",
            bytes.len()
        )));
    }
    let mut rest = &bytes[HEADER_BYTES..length];
    let mut chunks = Vec::with_capacity(2);
    // Chunks behind the second are for extensions that are not read here.
    while chunks.len() < 2 && !rest.is_empty() {
        let number = chunks.len();
        let Some((header, body)) = rest.split_at_checked(CHUNK_HEADER_BYTES) else {
            return Err(malformed(format!("GLB chunk {number} ends within its header")));
        };
        let size = u32_at(header, 0).unwrap_or_default() as usize;
        let Some((data, next)) = body.split_at_checked(size) else {
            return Err(malformed(format!("GLB chunk {number} states {size} bytes, but only {} are left", body.len())));
        };
        chunks.push((&header[4..], data));
        rest = next;
    }
    let json = match chunks.first() {
        Some((kind, data)) if *kind == CHUNK_JSON => *data,
        _ => return Err(malformed("the first GLB chunk is not JSON")),
    };
    let binary = chunks.get(1).filter(|(kind, _)| *kind == CHUNK_BIN).map(|(_, data)| *data);
    Ok(Container { json, binary, excess_bytes: bytes.len() - length })
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(version: u32, length: u32, chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut bytes = [MAGIC.as_slice(), &version.to_le_bytes(), &length.to_le_bytes()].concat();
        for (kind, data) in chunks {
            bytes.extend([&(data.len() as u32).to_le_bytes(), kind.as_slice(), data].concat());
        }
        bytes
    }

    #[test]
    fn splits_json_and_binary() {
        let bytes = glb(2, 12 + 8 + 4 + 8 + 4, &[(CHUNK_JSON, b"{}  "), (CHUNK_BIN, &[1, 2, 3, 4])]);
        let container = split(&bytes).unwrap();
        assert_eq!(container.json, b"{}  ");
        assert_eq!(container.binary, Some([1, 2, 3, 4].as_slice()));
        assert_eq!(split(b"\xef\xbb\xbf{}").unwrap().json, b"{}");
    }

    #[test]
    fn wrong_containers_are_named() {
        let cases: [(Vec<u8>, &str); 7] = [
            (Vec::new(), "empty"),
            (glb(1, 12, &[]), "version 1"),
            (glb(2, 11, &[]), "less than the header"),
            (glb(2, 13, &[]), "ends after 12"),
            (glb(2, 12, &[]), "not JSON"),
            (glb(2, 24, &[(CHUNK_BIN, b"{}  ")]), "not JSON"),
            ([glb(2, 20, &[]), 9_u32.to_le_bytes().to_vec(), CHUNK_JSON.to_vec()].concat(), "states 9 bytes"),
        ];
        for (bytes, expected) in cases {
            let error = split(&bytes).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
