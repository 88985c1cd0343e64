//! Room for captures that have to allocate before they know how much: `list`, `pages` and `abuffer`.
//!
//! A capture is tried with a guess. Its shader counts on beyond what there is room for, so that one look at the counters
//! tells what is needed; then the capture is repeated with exactly that, or in parts that fit. Nothing is dropped.

use crate::memory::Window;

/// Counters of nodes stay about here, so that they never come round to few. Twin: `STUCK` in
/// `shaders/technique/list.wesl` and `pages.wesl`.
pub(crate) const STUCK: u32 = 0xf000_0000;

/// Needs of windows that are still to come, known from the larger window that was split into them.
#[derive(Debug, Default)]
pub(crate) struct KnownNeeds(Vec<(Window, u64)>);

impl KnownNeeds {
    /// What a window needs, if it is known.
    pub(crate) fn take(&mut self, window: Window) -> Option<u64> {
        match self.0.iter().position(|&(known, _)| known == window) {
            Some(i) => Some(self.0.swap_remove(i).1),
            None => {
                // Whatever is left over from a frame that failed.
                self.0.clear();
                None
            }
        }
    }

    /// Takes note of what the parts of a window need. `need` sums up the counters of a part's pixels.
    pub(crate) fn learn(&mut self, whole: Window, counts: &[u32], parts: &[Window], need: impl Fn(&[u32]) -> u64) {
        for part in parts {
            let rows = (part.top - whole.top..part.top - whole.top + part.height).map(|row| row as usize);
            let left = (part.left - whole.left) as usize;
            let of_part: Vec<u32> = rows
                .flat_map(|row| &counts[row * whole.width as usize + left..][..part.width as usize])
                .copied()
                .collect();
            self.0.push((*part, need(&of_part)));
        }
    }
}

/// The greatest number from 1 to `wanted` that fits, if 1 does.
pub(crate) fn most_that_fits(wanted: u64, fits: impl Fn(u64) -> bool) -> Option<u64> {
    let wanted = wanted.max(1);
    if fits(wanted) {
        return Some(wanted);
    }
    if !fits(1) {
        return None;
    }
    let (mut fitting, mut too_many) = (1, wanted);
    while too_many - fitting > 1 {
        let middle = fitting.midpoint(too_many);
        if fits(middle) {
            fitting = middle;
        } else {
            too_many = middle;
        }
    }
    Some(fitting)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_that_fits_is_found() {
        assert_eq!(most_that_fits(100, |n| n <= 100), Some(100));
        assert_eq!(most_that_fits(100, |n| n <= 37), Some(37));
        assert_eq!(most_that_fits(0, |n| n <= 1), Some(1));
        assert_eq!(most_that_fits(100, |_| false), None);
    }

    #[test]
    fn needs_of_parts_are_kept_until_they_are_asked_for() {
        let whole = Window { left: 2, top: 1, width: 3, height: 2 };
        let parts = [Window { height: 1, ..whole }, Window { left: 3, top: 2, width: 2, height: 1 }];
        let mut known = KnownNeeds::default();
        known.learn(whole, &[1, 2, 3, 4, 5, 6], &parts, |counts| counts.iter().map(|&count| u64::from(count)).sum());
        assert_eq!(known.take(parts[1]), Some(11));
        assert_eq!(known.take(parts[0]), Some(6));
        assert_eq!(known.take(parts[0]), None);
    }
}
