//! What the stages hand on to each other: buffers, how much room is in them, and what was counted. Twins:
//! `shaders/technique/lucid/{work,parts,dispatch}.wesl`.

use bytemuck::{Pod, Zeroable};

use crate::gpu_data::DrawData;
use crate::memory::Window;
use crate::pass::prefix_sum::PrefixSum;

/// Pixels along a side of a block, and of a bin.
pub(super) const BLOCK: u64 = 8;
pub(super) const BIN: u64 = 32;

/// Parts of a block that are sorted in workgroup memory. Twin: `CHUNK`.
pub(super) const CHUNK: u64 = 1024;

/// Constants of shaders by their numbers, as names of imported modules change when they are linked: `varies` in
/// `shaders/technique/lucid/shade.wesl`, `filter_size` in `filter.wesl`.
pub(super) const VARIES: &str = "1";
pub(super) const FILTER_SIZE: &str = "2";

pub(super) const WORK: &str = "work";
pub(super) const RECORDS: &str = "triangles";
pub(super) const PARTS: &str = "parts of triangles";
pub(super) const PLACES: &str = "places of parts";
pub(super) const BLOCK_PARTS: &str = "blocks' parts";
pub(super) const LISTS: &str = "lists of parts";
pub(super) const DISPATCHES: &str = "dispatches";
pub(super) const DRAWS: &str = "all draws";

/// Bytes of a triangle's record: four groups of four words.
pub(super) const RECORD_BYTES: u64 = 64;
const PART_BYTES: u64 = 16;
const PLACE_BYTES: u64 = 12;
const LISTED_BYTES: u64 = 8;

/// Items of each list, or room for as many; in the order of the header's words.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub(super) struct Counts {
    /// Triangles in sight, and weights of clipped ones.
    pub(super) records: u32,
    /// Parts of them in blocks.
    pub(super) parts: u32,
    /// Those that are too large for set-up.
    pub(super) large: u32,
    /// Those that the host clips.
    pub(super) clipped: u32,
    /// Large ones, each with a bin.
    pub(super) pairs: u32,
    /// Blocks with more than [`CHUNK`] parts.
    pub(super) high: u32,
    /// Pixels out of order.
    pub(super) wrong: u32,
    pub(super) unused: u32,
}

/// The first words of the work buffer.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub(super) struct Header {
    pub(super) counts: Counts,
    pub(super) room: Counts,
    /// First word of each list.
    pub(super) first: Counts,
    /// Covered pixels, most fragments of one, all fragments (low and high word).
    pub(super) tally: [u32; 4],
    /// Pixels of blocks that were left early.
    pub(super) cut_pixels: u32,
    pub(super) unused: [u32; 3],
}

const HEADER_WORDS: u64 = size_of::<Header>() as u64 / 4;

/// Indirect dispatches, in the order of `prepare`.
#[derive(Debug, Clone, Copy)]
pub(super) enum Dispatch {
    Bins,
    Blocks,
    Lists,
    Low,
    High,
    Repair,
}

impl Dispatch {
    const COUNT: u64 = 6;

    /// Where its words are.
    pub(super) fn offset(self) -> u64 {
        self as u64 * 12
    }
}

/// Blocks of a window.
pub(super) fn blocks(window: Window) -> u64 {
    u64::from(window.width).div_ceil(BLOCK) * u64::from(window.height).div_ceil(BLOCK)
}

impl Counts {
    /// What is tried where nothing is known: of so many triangles in all, in a part of the picture.
    pub(super) fn guess(triangles: u64, window: Window, share: f64) -> Self {
        let bins = u64::from(window.width).div_ceil(BIN) * u64::from(window.height).div_ceil(BIN);
        let of_triangles = |factor: f64| (triangles as f64 * factor * share) as u64;
        let sizes = [
            triangles.min(of_triangles(1.0) + 1024),
            of_triangles(1.0) + 2 * blocks(window),
            triangles.min(of_triangles(0.25) + 1024),
            0,
            of_triangles(0.25) + 4 * bins,
        ];
        let [records, parts, large, clipped, pairs] = sizes.map(|size| size.min(u64::from(u32::MAX / 2)) as u32);
        Self { records, parts, large, clipped, pairs, ..Self::default() }
    }

    /// All lists that are sized by what is counted.
    fn lists(&self) -> [u32; 5] {
        [self.records, self.parts, self.large, self.clipped, self.pairs]
    }

    fn map(&self, f: impl Fn(u32) -> u32) -> Self {
        let [records, parts, large, clipped, pairs] = self.lists().map(f);
        Self { records, parts, large, clipped, pairs, ..*self }
    }

    /// Somewhat more, so that a moving camera seldom overflows.
    pub(super) fn with_slack(&self) -> Self {
        self.map(|count| count.saturating_add(count / 8))
    }

    /// A part of it, in 1024ths.
    pub(super) fn scaled(&self, share: u64) -> Self {
        self.map(|count| (u64::from(count) * share / 1024) as u32)
    }

    /// The greater of both, list by list.
    pub(super) fn max(&self, other: &Self) -> Self {
        let both: Vec<u32> = self.lists().iter().zip(other.lists()).map(|(&a, b)| a.max(b)).collect();
        Self { records: both[0], parts: both[1], large: both[2], clipped: both[3], pairs: both[4], ..*self }
    }

    /// Of two windows together, at most.
    pub(super) fn plus(&self, other: &Self) -> Self {
        let both: Vec<u32> = self.lists().iter().zip(other.lists()).map(|(&a, b)| a.saturating_add(b)).collect();
        Self { records: both[0], parts: both[1], large: both[2], clipped: both[3], pairs: both[4], ..*self }
    }

    /// Whether there is room for all of it.
    pub(super) fn fits(&self, room: &Self) -> bool {
        self.lists().iter().zip(room.lists()).all(|(&count, room)| count <= room)
    }
}

/// Lists in the work buffer: their first words, and the word after the last.
fn list_places(room: &Counts, window: Window) -> (Counts, Counts, u64) {
    let high = (u64::from(room.parts) / CHUNK).min(blocks(window)) as u32;
    let room = Counts { high, wrong: window.pixels() as u32, ..*room };
    let mut next = HEADER_WORDS;
    let mut list = |words: u64| {
        let first = next;
        next += words;
        first as u32
    };
    let first = Counts {
        records: 0,
        parts: 0,
        large: list(room.large.into()),
        clipped: list(u64::from(room.clipped) * 2),
        pairs: list(u64::from(room.pairs) * 2),
        high: list(room.high.into()),
        wrong: list(room.wrong.into()),
        unused: 0,
    };
    (room, first, next)
}

/// The header for a window.
pub(super) fn header(room: &Counts, window: Window) -> Header {
    let (room, first, _) = list_places(room, window);
    Header { room, first, ..Header::default() }
}

/// All buffers of a window with so much room.
pub(super) fn needs(room: &Counts, window: Window, draws: u64) -> Vec<(&'static str, u64)> {
    let (_, _, words) = list_places(room, window);
    let (parts, starts) = (u64::from(room.parts), blocks(window) + 1);
    let mut needs = vec![
        (WORK, words * 4),
        (RECORDS, u64::from(room.records) * RECORD_BYTES),
        (PARTS, parts * PART_BYTES),
        (PLACES, parts * PLACE_BYTES),
        (BLOCK_PARTS, starts * 4),
        (LISTS, (starts + parts) * LISTED_BYTES),
        (DISPATCHES, Dispatch::COUNT * 12),
        (DRAWS, draws * size_of::<DrawData>() as u64),
    ];
    needs.extend(PrefixSum::needs(starts));
    needs
}
