//! The stable bitonic sort of an F-Buffer's fragments, and the merge of sorted windows (section 5.1).
//!
//! Fragments sort by pixel, then depth, the farthest first. Bitonic sorting is not stable by itself; with the slot as the
//! last key it is, and then fragments of one depth stay in rasterization order: the later drawn comes after, and is
//! blended in front. So the stable order *is* the contract's.
//!
//! The network compares each place with its mirror image in a block first, then with places at halving distances (the
//! variant of Batcher's network in which every comparison puts the lesser first). Places beyond the end then act as if
//! they held the greatest key, and any length sorts without padding.

/// What a fragment sorts by: lesser keys are blended first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Key {
    /// Number of its pixel; [`Key::DEAD`] for a fragment that is blended nowhere.
    pub pixel: u32,
    /// Bits of its reverse-Z depth in 0..=1, which order like it: the farthest first.
    pub depth: u32,
    /// Its slot, which makes the order total and stable.
    pub slot: u32,
}

impl Key {
    /// Pixel of fragments that were killed: behind all others.
    pub const DEAD: u32 = u32::MAX;
}

/// One pass of the network: every place compares with one other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// With its mirror image in blocks of this power of two.
    Flip(u64),
    /// With the place at half the length of blocks of this power of two.
    Halve(u64),
}

impl Stage {
    /// The pair of places that comparison number `i` of this stage compares, the lesser first.
    pub fn pair(self, i: u64) -> [u64; 2] {
        let (Self::Flip(block) | Self::Halve(block)) = self;
        let half = block / 2;
        let (start, within) = (i / half * block, i % half);
        match self {
            Self::Flip(_) => [start + within, start + block - 1 - within],
            Self::Halve(_) => [start + within, start + half + within],
        }
    }
}

/// The stages for so many keys: `m (m + 1) / 2` of them for 2^m.
pub fn stages(length: u64) -> impl Iterator<Item = Stage> {
    let blocks = (1..=u64::from(length.next_power_of_two().ilog2())).map(|log| 1 << log);
    blocks.flat_map(|block: u64| {
        let halves = (1..block.ilog2()).rev().map(|log| Stage::Halve(1 << log));
        std::iter::once(Stage::Flip(block)).chain(halves)
    })
}

/// Sorts keys by the network.
pub fn sort(keys: &mut [Key]) {
    let length = keys.len() as u64;
    for stage in stages(length) {
        for i in 0..length.next_power_of_two() / 2 {
            let [low, high] = stage.pair(i);
            if high < length && keys[high as usize] < keys[low as usize] {
                keys.swap(low as usize, high as usize);
            }
        }
    }
}

/// Merges sorted runs of so many keys, the last of which may be shorter, two by two until one is left: how the windows of
/// a buffer that overflowed become one order.
///
/// Every key finds its place in the merged run by itself: its place in its own run, and how many keys of the other run go
/// before it.
pub fn merge_runs(keys: &mut Vec<Key>, run: usize) {
    let mut merged = keys.clone();
    let mut run = run.max(1);
    while run < keys.len() {
        for (i, &key) in keys.iter().enumerate() {
            let start = i / (2 * run) * (2 * run);
            let middle = (start + run).min(keys.len());
            let other = if i < middle { middle..(middle + run).min(keys.len()) } else { start..middle };
            let own_start = if i < middle { start } else { middle };
            let before = keys[other].partition_point(|&other| other < key);
            merged[start + (i - own_start) + before] = key;
        }
        std::mem::swap(keys, &mut merged);
        run *= 2;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn shuffled(length: u32, pixels: u32, depths: u32) -> Vec<Key> {
        let mix =
            |slot: u32, salt: u32| (slot ^ salt).wrapping_mul(0x9e37_79b9).rotate_left(13).wrapping_mul(0x85eb_ca6b);
        (0..length).map(|slot| Key { pixel: mix(slot, 1) % pixels, depth: mix(slot, 2) % depths, slot }).collect()
    }

    /// What a stable sort without a look at slots makes of it.
    fn stably_sorted(mut keys: Vec<Key>) -> Vec<Key> {
        keys.sort_by_key(|key| (key.pixel, key.depth));
        keys
    }

    #[test]
    fn powers_of_two_and_their_neighbours_sort_stably() {
        for length in (0..12).flat_map(|log| [(1 << log) - 1, 1 << log, (1 << log) + 1]) {
            for (pixels, depths) in [(1, 1), (1, 7), (97, 1), (97, 7), (u32::MAX, u32::MAX)] {
                let keys = shuffled(length, pixels, depths);
                let mut sorted = keys.clone();
                sort(&mut sorted);
                assert_eq!(sorted, stably_sorted(keys), "{length} keys");
            }
        }
    }

    #[test]
    fn the_network_has_log_squared_stages() {
        for log in 0..20 {
            assert_eq!(stages(1 << log).count() as u64, log * (log + 1) / 2);
        }
        assert_eq!((stages(0).count(), stages(1).count()), (0, 0));
    }

    proptest! {
        #[test]
        fn merged_windows_are_the_sorted_whole(length in 0u32..700, run in 1usize..300) {
            let keys = shuffled(length, 31, 3);
            let mut merged = keys.clone();
            merged.chunks_mut(run).for_each(sort);
            merge_runs(&mut merged, run);
            prop_assert_eq!(merged, stably_sorted(keys));
        }
    }
}
