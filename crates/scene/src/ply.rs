//! PLY.

use crate::{Assets, LoadError, Loaded};

/// Parses a PLY file.
///
/// # Errors
/// [`LoadError`] if it is not valid.
pub fn parse(bytes: &[u8], assets: &dyn Assets) -> Result<Loaded, LoadError> {
    let _ = (bytes, assets);
    Err(LoadError::Unsupported { format: "PLY", detail: "being written".into() })
}
