//! The fragments of an LFB on the CPU.

/// One fragment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LfbFragment<'a> {
    /// As it was added.
    pub payload: &'a [u32],
    /// As it was added, but for the sign of zero.
    pub depth: f32,
    /// As it was added.
    pub order: u32,
}

/// All fragments, read back from the GPU.
#[derive(Debug, Clone, PartialEq)]
pub struct LfbContent {
    pub(super) width: u32,
    pub(super) payload_words: u32,
    pub(super) depth_flip: u32,
    /// One entry more than there are pixels.
    pub(super) starts: Vec<u32>,
    pub(super) words: Vec<u32>,
}

impl LfbContent {
    /// The fragments of a pixel; in order, if the LFB sorts. None outside.
    pub fn pixel(&self, x: u32, y: u32) -> impl ExactSizeIterator<Item = LfbFragment<'_>> {
        let words_each = self.payload_words as usize + 2;
        let index = y as usize * self.width as usize + x as usize;
        let words = match self.starts.get(index..).unwrap_or_default() {
            [start, end, ..] if x < self.width => &self.words[*start as usize * words_each..*end as usize * words_each],
            _ => &[],
        };
        words.chunks_exact(words_each).map(move |words| {
            let (payload, rest) = words.split_at(words_each - 2);
            LfbFragment { payload, depth: self.depth(rest[0]), order: rest[1] }
        })
    }

    /// Fragments of all pixels.
    pub fn total(&self) -> u32 {
        self.starts.last().copied().unwrap_or(0)
    }

    /// Twin: `lfb_depth` in `shaders/lfb/module.wesl`.
    fn depth(&self, key: u32) -> f32 {
        let bits = key ^ self.depth_flip;
        f32::from_bits(if bits >= 0x8000_0000 { bits & 0x7fff_ffff } else { !bits })
    }
}
