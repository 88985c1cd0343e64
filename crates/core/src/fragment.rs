//! One primitive at one pixel, and *the* order of the fragments of a pixel.

use glam::Vec4;

/// A fragment: one primitive at one pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fragment {
    /// Linear light, premultiplied alpha.
    pub color: Vec4,
    /// Reverse-Z depth in 0..=1; greater is nearer.
    pub depth: f32,
    /// Number of the primitive in draw order.
    pub primitive: u32,
}

/// A fragment's place in the order, as one number: **greater is in front**.
///
/// Nearer depths come first; at equal depths the later drawn primitive is in front. As a primitive has at most one
/// fragment at a pixel this is a total order, and layers do not depend on timing, threads or the way they were captured.
/// Depths in 0..=1 order like their bits.
#[inline]
pub fn order_key(depth: f32, primitive: u32) -> u64 {
    (u64::from(depth.to_bits()) << 32) | u64::from(primitive)
}

impl Fragment {
    /// [`order_key`] of this fragment.
    #[inline]
    pub fn order_key(&self) -> u64 {
        order_key(self.depth, self.primitive)
    }
}

/// Puts the fragments of a pixel in order, nearest first.
pub fn sort(fragments: &mut [Fragment]) {
    fragments.sort_unstable_by_key(|fragment| std::cmp::Reverse(fragment.order_key()));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearer_first_then_later_drawn_first() {
        let fragment = |depth, primitive| Fragment { color: Vec4::ZERO, depth, primitive };
        let mut fragments = [
            fragment(0.0, 9),
            fragment(0.25, 1),
            fragment(1.0, 0),
            fragment(0.25, 2),
            fragment(f32::MIN_POSITIVE / 2.0, 3),
        ];
        sort(&mut fragments);
        assert_eq!(fragments.map(|f| f.primitive), [0, 2, 1, 3, 9]);
    }
}
