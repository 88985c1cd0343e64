//! What the stages hand on to each other: buffers, how much room is in them, and what was counted. Twins:
//! `shaders/technique/lucid/{work,parts,dispatch}.wesl`.

use bytemuck::{Pod, Zeroable};

use super::record;
use crate::gpu_data::{DrawData, flags};
use crate::memory::Window;
use crate::pass::ordered::OrderedPasses;
use crate::pass::prefix_sum::PrefixSum;
use crate::surface::Surfaces;
use crate::table;

/// Pixels along a side of a block, and of a bin.
pub(super) const BLOCK: u64 = 8;
pub(super) const BIN: u64 = 16;

/// Parts of a chunk, as a power of two, and runs that are merged at a time, likewise; levels of merges. Twins:
/// `shaders/technique/lucid/{chunks,sort}.wesl`.
const CHUNK_POWER: u64 = 5;
const FAN: u64 = 3;
pub(super) const LEVELS: usize = 7;

/// Words of a chunk. Twin: `CHUNK_WORDS`.
pub(super) const CHUNK_WORDS: u64 = 64;

/// The constant `filter_size` of `shaders/technique/lucid/filter.wesl` by its number, as names of imported modules change when
/// they are linked.
pub(super) const FILTER_SIZE: &str = "2";

/// What has to be looked at to shade the transparent surfaces of a view. Twins: constants of
/// `shaders/technique/lucid/shade.wesl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(super) struct Shading {
    /// Whether the colour of any varies.
    pub(super) varies: bool,
    /// Whether any has normals at its vertices.
    pub(super) has_smooth: bool,
    /// Whether any has not.
    pub(super) has_flat: bool,
}

impl Shading {
    pub(super) fn of(surfaces: &Surfaces<'_>) -> Self {
        surfaces.compute_draws().fold(Self::default(), |all, draw| {
            let is_smooth = surfaces.data[draw.instance].flags & flags::HAS_NORMALS != 0;
            Self {
                varies: all.varies || draw.varies,
                has_smooth: all.has_smooth || is_smooth,
                has_flat: all.has_flat || !is_smooth,
            }
        })
    }

    /// Constants by their numbers.
    pub(super) fn constants(self) -> [(&'static str, f64); 3] {
        [("1", self.varies), ("3", self.has_smooth), ("4", self.has_flat)].map(|(id, is)| (id, f64::from(u8::from(is))))
    }
}

pub(super) const WORK: &str = "work";
pub(super) const RECORDS: &str = "triangles";
pub(super) const PARTS: &str = "parts of triangles";
pub(super) const PLACES: &str = "places of parts";
pub(super) const BLOCK_PARTS: &str = "blocks' parts";
pub(super) const LISTS: &str = "lists of parts";
pub(super) const CHUNK_HEADS: &str = "chunks of parts";
pub(super) const CHUNKS: &str = "chunks' pixels";
pub(super) const COVERING: &str = "fragments before chunks";
pub(super) const CHUNK_SUMS: &str = "blocks' chunks";
pub(super) const ORDERED: &str = "parts in order";
pub(super) const OFFSETS: &str = "offsets";
pub(super) const FRAGMENTS: &str = "fragments";
pub(super) const WRONG: &str = "pixels out of order";
pub(super) const DISPATCHES: &str = "dispatches of bins and lists";
pub(super) const DRAWS: &str = "all draws";

const PART_BYTES: u64 = 16;
const PLACE_BYTES: u64 = 12;
const LISTED_BYTES: u64 = 12;

/// Groups of a draw in its table.
pub(super) const DRAW_GROUPS: u64 = size_of::<DrawData>() as u64 / table::GROUP_BYTES;

/// Words before the list of pixels out of order. Twin: `CLASSES` in `shaders/shared/classes.wesl`.
const WRONG_HEADER: u64 = 7;

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
    /// Chunks of parts that follow each other in a block.
    pub(super) chunks: u32,
    /// No count; where its list starts, that of merges does.
    pub(super) merge_lists: u32,
    /// Parts in half-blocks.
    pub(super) half_blocks: u32,
}

/// The first words of the work buffer.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub(super) struct Header {
    pub(super) counts: Counts,
    pub(super) room: Counts,
    /// First word of each list.
    pub(super) first: Counts,
    /// At which merges are.
    pub(super) level: u32,
    /// How many merges each level has.
    pub(super) merges: [u32; LEVELS],
}

const HEADER_WORDS: u64 = size_of::<Header>() as u64 / 4;

/// Indirect dispatches, in the order of `prepare`.
#[derive(Debug, Clone, Copy)]
pub(super) enum Dispatch {
    Bins,
    Blocks,
    Parts,
    Chunks,
}

impl Dispatch {
    const COUNT: u64 = 4;

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
fn list_places(room: &Counts) -> (Counts, u64) {
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
        chunks: 0,
        merge_lists: list((0..LEVELS as u64).map(|lower| u64::from(room.parts) >> (CHUNK_POWER + FAN * lower)).sum()),
        half_blocks: 0,
    };
    (first, next)
}

/// The header for a window.
pub(super) fn header(room: &Counts) -> Header {
    let (first, _) = list_places(room);
    Header { room: *room, first, ..Header::default() }
}

/// Groups of words that so much room for records has.
pub(super) fn record_groups(room: &Counts) -> u64 {
    u64::from(room.records) * u64::from(record::GROUPS)
}

/// Chunks that so much room for parts allows: of each block one that is not full, at most.
pub(super) fn chunks(room: &Counts, window: Window) -> u64 {
    (u64::from(room.parts) >> CHUNK_POWER) + blocks(window).min(room.parts.into())
}

/// All buffers of a window with so much room, and so many fragments.
pub(super) fn needs(room: &Counts, fragments: u64, window: Window, draws: u64) -> Vec<(&'static str, u64)> {
    let (_, words) = list_places(room);
    let (parts, starts, pixels) = (u64::from(room.parts), blocks(window) + 1, window.pixels());
    let chunks = chunks(room, window);
    let mut needs = vec![
        (WORK, words * 4),
        (RECORDS, table::bytes(table::GROUPS, record_groups(room))),
        (PARTS, parts * PART_BYTES),
        (PLACES, parts * PLACE_BYTES),
        (BLOCK_PARTS, starts * 4),
        (LISTS, parts * LISTED_BYTES),
        (CHUNK_HEADS, table::bytes(table::GROUPS, chunks + 1)),
        (CHUNKS, chunks * CHUNK_WORDS * 4),
        (COVERING, table::bytes(table::PAIRS, chunks * CHUNK_WORDS)),
        (CHUNK_SUMS, starts * 4),
        (ORDERED, table::bytes(table::GROUPS, parts)),
        (OFFSETS, (pixels + 1) * 4),
        (FRAGMENTS, table::bytes(table::GROUPS, fragments)),
        OrderedPasses::order_need(fragments),
        (WRONG, (WRONG_HEADER + pixels) * 4),
        (DISPATCHES, Dispatch::COUNT * 12),
        (DRAWS, table::bytes(table::GROUPS, draws * DRAW_GROUPS)),
    ];
    // Those of blocks take the same.
    needs.extend(PrefixSum::needs(pixels + 1));
    needs.extend(OrderedPasses::needs(pixels));
    needs
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use super::*;
    use crate::shaders::constant;

    #[test]
    fn the_header_is_what_shaders_take_it_for() {
        const WORK: &str = include_str!("../../../shaders/technique/lucid/work.wesl");
        const CHUNKS: &str = include_str!("../../../shaders/technique/lucid/chunks.wesl");
        const SORT: &str = include_str!("../../../shaders/technique/lucid/sort.wesl");
        for (name, offset) in [
            ("RECORDS", offset_of!(Counts, records)),
            ("PARTS", offset_of!(Counts, parts)),
            ("LARGE", offset_of!(Counts, large)),
            ("CLIPPED", offset_of!(Counts, clipped)),
            ("PAIRS", offset_of!(Counts, pairs)),
            ("CHUNKS", offset_of!(Counts, chunks)),
            ("MERGE_LISTS", offset_of!(Counts, merge_lists)),
            ("HALF_BLOCKS", offset_of!(Counts, half_blocks)),
            ("ROOM", offset_of!(Header, room)),
            ("FIRST", offset_of!(Header, first)),
            ("LEVEL", offset_of!(Header, level)),
            ("MERGES", offset_of!(Header, merges)),
        ] {
            assert_eq!(constant(WORK, name) * 4, offset as u64, "{name}");
        }
        assert_eq!((constant(WORK, "BLOCK"), constant(WORK, "BIN")), (BLOCK, BIN));
        assert_eq!((constant(CHUNKS, "CHUNK"), constant(CHUNKS, "CHUNK_WORDS")), (1 << CHUNK_POWER, CHUNK_WORDS));
        assert_eq!(BLOCK * BLOCK, CHUNK_WORDS);
        assert_eq!((constant(SORT, "FAN"), constant(SORT, "CHUNK_POWER")), (FAN, CHUNK_POWER));
        assert_eq!(constant(SORT, "LEVELS"), LEVELS as u64);
        assert_eq!(constant(include_str!("../../../shaders/shared/classes.wesl"), "CLASSES"), WRONG_HEADER);
    }

    /// As [`pellucid_core::Technique::memory_formula`] says where pixels are repaired, but for what does not grow with anything.
    #[test]
    fn buffers_are_as_large_as_the_formula_says() {
        let window = Window { left: 0, top: 0, width: 1920, height: 1080 };
        let room = Counts { records: 1 << 20, parts: 1 << 21, ..Counts::default() };
        let fragments = 5_000_000;
        let bytes: u64 = needs(&room, fragments, window, 1).iter().map(|&(_, bytes)| bytes).sum();
        let formula = 22.1 * window.pixels() as f64
            + 80.0 * f64::from(room.records)
            + 80.7 * f64::from(room.parts)
            + 20.0 * fragments as f64;
        let share = bytes as f64 / formula;
        assert!((0.99..1.01).contains(&share), "{bytes} bytes, {share} of the formula");
    }
}
