//! Built-in scenes.

use pellucid_core::Scene;

use crate::LoadError;

/// Makes the scene that `description` means: `name` or `name:key=value,...`, without the `@`.
///
/// # Errors
/// [`LoadError::BuiltIn`].
pub fn make(description: &str) -> Result<Scene, LoadError> {
    Err(LoadError::BuiltIn(description.into()))
}
