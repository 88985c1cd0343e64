//! What an LFB is like.

/// Which depths are near.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Nearest {
    /// Reverse-Z.
    Greatest,
    /// The usual depth, or a distance.
    Smallest,
}

/// What an LFB is like.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LfbOptions {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Words of 32 bits that each fragment carries besides depth and order, 1 to 4. A stored fragment takes two words
    /// more: 16 bytes with a payload of two, such as a colour in halves.
    pub payload_words: u32,
    /// Which depths are near. Depths can be any numbers.
    pub nearest: Nearest,
    /// Whether fragments are put in order; without, they are read in any order, which is quicker.
    pub sorts: bool,
    /// Most bytes of fragments; the device's limits apply besides.
    pub max_bytes: u64,
}

impl LfbOptions {
    /// Payloads of two words, the smallest depth nearest, in order, as many bytes as the device allows.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, payload_words: 2, nearest: Nearest::Smallest, sorts: true, max_bytes: u64::MAX }
    }
}
