//! Room for captures that have to allocate before they know how much: `list`, `pages` and `abuffer`.
//!
//! A capture is tried with a guess. Its shader counts on beyond what there is room for, so that one look at the counters
//! tells what is needed; then the capture is repeated with exactly that, or in parts that fit. Nothing is dropped.

use crate::memory::Window;

/// Counters of nodes stay about here, so that they never come round to few. Twin: `STUCK` in
/// `shaders/technique/list.wesl` and `pages.wesl`.
pub(crate) const STUCK: u32 = 0xf000_0000;

/// Windows that were split, with what their parts need: what the next frame starts from, which is likely to need as much.
/// Without, it would capture each in vain before it splits it again.
#[derive(Debug, Default)]
pub(crate) struct Splits(Vec<Split>);

#[derive(Debug)]
struct Split {
    whole: Window,
    parts: Vec<(Window, u64)>,
}

impl Splits {
    /// More than a frame has: those of pictures of other sizes are forgotten.
    const MOST: usize = 4096;

    /// What a part needed last.
    pub(crate) fn need(&self, part: Window) -> Option<u64> {
        self.parts().find(|(window, _)| *window == part).map(|&(_, need)| need)
    }

    /// Takes note of what a part needed, if it is one.
    pub(crate) fn learn(&mut self, part: Window, need: u64) {
        let parts = self.0.iter_mut().flat_map(|split| &mut split.parts);
        parts.filter(|(window, _)| *window == part).for_each(|(_, last)| *last = need);
    }

    /// The parts that a window was split into last, unless what they needed fits by now.
    pub(crate) fn parts_of(
        &mut self,
        whole: Window,
        join: fn(u64, u64) -> u64,
        fits: impl Fn(u64) -> bool,
    ) -> Option<Vec<Window>> {
        let place = self.0.iter().position(|split| split.whole == whole)?;
        let parts = &self.0[place].parts;
        if fits(parts.iter().map(|&(_, need)| need).fold(0, join)) {
            self.0.swap_remove(place);
            return None;
        }
        Some(parts.iter().map(|&(window, _)| window).collect())
    }

    /// Takes note of the parts of a window. `need` sums up the counters of a part's pixels.
    pub(crate) fn split(&mut self, whole: Window, counts: &[u32], parts: &[Window], need: impl Fn(&[u32]) -> u64) {
        if self.0.len() >= Self::MOST {
            self.0.clear();
        }
        let counts_of = |part: &Window| -> Vec<u32> {
            let rows = (part.top - whole.top..part.top - whole.top + part.height).map(|row| row as usize);
            let left = (part.left - whole.left) as usize;
            rows.flat_map(|row| &counts[row * whole.width as usize + left..][..part.width as usize]).copied().collect()
        };
        let parts = parts.iter().map(|part| (*part, need(&counts_of(part)))).collect();
        self.0.retain(|split| split.whole != whole);
        self.0.push(Split { whole, parts });
    }

    fn parts(&self) -> impl Iterator<Item = &(Window, u64)> {
        self.0.iter().flat_map(|split| &split.parts)
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
    fn windows_are_split_as_before_until_they_fit() {
        let whole = Window { left: 2, top: 1, width: 3, height: 2 };
        let parts = [Window { height: 1, ..whole }, Window { left: 3, top: 2, width: 2, height: 1 }];
        let mut splits = Splits::default();
        let sum = |a, b| a + b;
        assert_eq!(splits.parts_of(whole, sum, |_| false), None);
        splits.split(whole, &[1, 2, 3, 4, 5, 6], &parts, |counts| counts.iter().copied().map(u64::from).sum());
        assert_eq!(parts.map(|part| splits.need(part)), [Some(6), Some(11)]);
        assert_eq!(splits.need(whole), None);
        assert_eq!(splits.parts_of(whole, sum, |need| need < 17), Some(parts.to_vec()));
        splits.learn(parts[1], 1);
        assert_eq!(splits.parts_of(whole, sum, |need| need <= 7), None);
        assert_eq!(splits.need(parts[0]), None);
    }
}
