//! The F-Buffer: a first-in first-out buffer in which every rasterized fragment has a slot of its own (Mark and Proudfoot
//! 2001; Houston, Preetham and Segal 2005).
//!
//! A framebuffer keeps one intermediate result a pixel, so a shader of several passes loses those of every surface but the
//! last drawn. An F-Buffer keeps one a fragment: its slot is the fragment's position in [`order`], which is the same in
//! every pass. This module is the arithmetic of slots; renderers do the shading.
//!
//! A buffer may be smaller than what is drawn. Either the draw is split into [batches](order::RasterOrder::batches) that
//! fit, after an [`Overflow`] said what is needed (the first generation of hardware), or a [window](Windows) slides over
//! the order and geometry is drawn again for each of its places (the second).

pub mod order;
pub mod sort;

use std::fmt;
use std::ops::Range;

pub use order::{Place, RasterOrder};

use crate::Error;

/// Least and greatest side of a square buffer, in slots (section 3.1).
pub const SIDES: [u32; 2] = [32, 2048];

/// How many slots a buffer has, laid out row by row as the texture that it was in hardware.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    width: u32,
    height: u32,
}

impl Size {
    /// A square one: a power of two from 32 to 2048 along each side.
    ///
    /// # Errors
    /// [`Error::FBuffer`] if there is no such size.
    pub fn square(side: u32) -> Result<Self, Error> {
        Self::check(side)?;
        Ok(Self { width: side, height: side })
    }

    /// A single row of a square one.
    ///
    /// # Errors
    /// As [`Self::square`].
    pub fn row(side: u32) -> Result<Self, Error> {
        Self::check(side)?;
        Ok(Self { width: side, height: 1 })
    }

    /// The least square one that holds so many fragments, or the greatest there is.
    pub fn holding(fragments: u64) -> Self {
        let sides = (SIDES[0].ilog2()..=SIDES[1].ilog2()).map(|log| 1 << log);
        let side = sides.filter(|&side| u64::from(side).pow(2) >= fragments).min().unwrap_or(SIDES[1]);
        Self { width: side, height: side }
    }

    /// The next smaller square one.
    #[must_use]
    pub fn smaller(self) -> Option<Self> {
        let side = self.width / 2;
        (side >= SIDES[0]).then_some(Self { width: side, height: side })
    }

    fn check(side: u32) -> Result<(), Error> {
        let [least, greatest] = SIDES;
        if side.is_power_of_two() && (least..=greatest).contains(&side) {
            return Ok(());
        }
        Err(Error::FBuffer(format!("a side of {side} slots; it must be a power of two from {least} to {greatest}")))
    }

    /// Slots in a row.
    pub fn width(self) -> u32 {
        self.width
    }

    /// Rows of slots.
    pub fn height(self) -> u32 {
        self.height
    }

    /// All slots.
    pub fn slots(self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// More fragments than a buffer has slots (section 3.2, the first generation).
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{needed} fragments overflow an F-Buffer of {slots} slots; draw in smaller batches, or in windows")]
pub struct Overflow {
    /// Fragments that were rasterized.
    pub needed: u64,
    /// Slots there are.
    pub slots: u64,
}

/// The windows of slots that slide over the order until every fragment was in one (section 3.2, the second generation).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Windows {
    fragments: u64,
    slots: u64,
}

impl Windows {
    /// Windows of a buffer's size over so many fragments.
    pub fn new(fragments: u64, size: Size) -> Self {
        Self { fragments, slots: size.slots() }
    }

    /// How many windows: one even for nothing, as only its first pass tells that there is nothing.
    pub fn count(&self) -> u64 {
        self.fragments.div_ceil(self.slots).max(1)
    }

    /// The slots of a window, in the order of all fragments.
    pub fn slots(&self, window: u64) -> Range<u64> {
        let first = (window * self.slots).min(self.fragments);
        first..(first + self.slots).min(self.fragments)
    }

    /// Windows still to be drawn after this one, which hardware returns after the first pass of the first (appendix A).
    pub fn remaining(&self, window: u64) -> u64 {
        self.count().saturating_sub(window + 1)
    }

    /// How often geometry is drawn by a shader of so many passes: each pass in each window.
    pub fn submissions(&self, passes: u64) -> u64 {
        self.count() * passes
    }
}

/// What became of a draw.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Drawn {
    /// Windows, or batches, it took.
    pub windows: u64,
    /// How often geometry was drawn: each pass of each window.
    pub submissions: u64,
    /// Fragments rasterized. Each is shaded once by every pass, until one kills it.
    pub fragments: u64,
}

impl std::ops::Add for Drawn {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            windows: self.windows + other.windows,
            submissions: self.submissions + other.submissions,
            fragments: self.fragments + other.fragments,
        }
    }
}

/// What happens to a fragment after the last pass. The default blends everything and looks at no depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// Whether fragments behind the target's depth are left out; level with it they are drawn.
    pub depth_test: bool,
    /// Whether fragments that are drawn leave their depth.
    pub depth_write: bool,
    /// Fragments of an alpha below this are left out.
    pub alpha_test: Option<f32>,
    /// Whether colours are blended over what is there, in place of it otherwise.
    pub blend: bool,
}

impl Default for Output {
    fn default() -> Self {
        Self { depth_test: false, depth_write: false, alpha_test: None, blend: true }
    }
}

impl Output {
    /// Nothing is blended, and what is nearest stays.
    pub const OPAQUE: Self = Self { depth_test: true, depth_write: true, alpha_test: None, blend: false };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_powers_of_two_in_the_hardware_range() {
        for side in [32, 64, 2048] {
            assert_eq!(Size::square(side).unwrap().slots(), u64::from(side * side));
            assert_eq!(Size::row(side).unwrap().slots(), u64::from(side));
        }
        for side in [0, 1, 16, 33, 4096, u32::MAX] {
            assert!(Size::square(side).is_err() && Size::row(side).is_err(), "{side}");
        }
        assert_eq!(Size::holding(0), Size::square(32).unwrap());
        assert_eq!(Size::holding(1025), Size::square(64).unwrap());
        assert_eq!(Size::holding(u64::MAX), Size::square(2048).unwrap());
        assert_eq!(Size::square(64).unwrap().smaller(), Size::square(32).ok());
        assert_eq!(Size::square(32).unwrap().smaller(), None);
    }

    #[test]
    fn windows_cover_the_order_once() {
        for fragments in [0, 1, 1023, 1024, 1025, 2048, 5000] {
            let windows = Windows::new(fragments, Size::square(32).unwrap());
            let slots: Vec<u64> = (0..windows.count()).flat_map(|window| windows.slots(window)).collect();
            assert!(slots.iter().copied().eq(0..fragments), "{fragments}");
            assert_eq!(windows.remaining(0), windows.count() - 1);
            assert_eq!(windows.remaining(windows.count() - 1), 0);
        }
    }

    /// Section 3.2: 2048 fragments overflow a 32 x 32 buffer exactly one time. Figure 3: 23 windows, 69 passes. Figure 4:
    /// 162 overflows of a 64 x 64 buffer and 489 submissions, 10 and 33 at 256 x 256: one sphere can have both.
    #[test]
    fn the_papers_figures_follow() {
        let at = |side, fragments| Windows::new(fragments, Size::square(side).unwrap());
        assert_eq!(at(32, 2048).remaining(0), 1);
        assert_eq!(at(128, 23 * 128 * 128).submissions(3), 69);
        let sphere = 163 * 64 * 64;
        assert_eq!((at(64, sphere).remaining(0), at(64, sphere).submissions(3)), (162, 489));
        assert_eq!((at(256, sphere).remaining(0), at(256, sphere).submissions(3)), (10, 33));
    }
}
