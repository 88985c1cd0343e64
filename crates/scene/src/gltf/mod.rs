//! glTF.

use crate::{Assets, LoadError, Loaded};

/// Parses a glTF file.
///
/// # Errors
/// [`LoadError`] if it is not valid.
pub fn parse(bytes: &[u8], assets: &dyn Assets) -> Result<Loaded, LoadError> {
    let _ = (bytes, assets);
    Err(LoadError::Unsupported { format: "glTF", detail: "being written".into() })
}
