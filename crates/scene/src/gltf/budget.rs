//! How much a file may make the loader build.
//!
//! Accessors may be shared, may hold zeros that take no bytes, and a mesh may be placed by any number of nodes: a few
//! kilobytes can ask for terabytes. So everything that is built is charged here first, against a generous multiple of
//! what the file and its buffers weigh.

use super::unsupported;
use crate::LoadError;

/// Bytes built for one byte read. The most wasteful ordinary content is a triangle strip with 8-bit indices: 12 for 1.
const BUILT_PER_BYTE: u64 = 64;

/// Bytes that any file may have built.
const FREE_BYTES: u64 = 64 << 20;

pub(super) struct Budget {
    limit_bytes: u64,
    left_bytes: u64,
}

impl Budget {
    pub(super) fn new(input_bytes: u64) -> Self {
        let limit_bytes = FREE_BYTES.saturating_add(input_bytes.saturating_mul(BUILT_PER_BYTE));
        Self { limit_bytes, left_bytes: limit_bytes }
    }

    /// Asks for room for `count` parts of `part_bytes` each, named by `place` if they do not fit.
    pub(super) fn charge(
        &mut self,
        count: usize,
        part_bytes: usize,
        place: impl FnOnce() -> String,
    ) -> Result<(), LoadError> {
        let bytes = (count as u64).saturating_mul(part_bytes as u64);
        match self.left_bytes.checked_sub(bytes) {
            Some(left) => {
                self.left_bytes = left;
                Ok(())
            }
            None => Err(unsupported(format!(
                "{}: with this the scene needs over {} MiB, more than a file of this size is trusted with",
                place(),
                self.limit_bytes >> 20
            ))),
        }
    }
}
