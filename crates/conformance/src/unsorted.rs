//! Blending in the order of drawing, as every renderer does that sorts nothing: the yardstick beside exact pictures.
//!
//! Made from ordered layers by putting them back in the order of their primitives, so that it needs no device and gives
//! the same picture everywhere. Hardware blending of the same scene gives it too, but for its own rounding.

use glam::Vec4;
use pellucid::Fragment;
use pellucid::core::composite::Composite;
use pellucid::core::layers::OpaqueSurface;

/// The pixel that drawing these fragments over each other makes, the lowest primitive first, before `background` or the
/// opaque surface: linear light, premultiplied. `scratch` is overwritten.
pub fn pixel(
    fragments: &[Fragment],
    opaque: Option<OpaqueSurface>,
    background: Vec4,
    scratch: &mut Vec<Fragment>,
) -> Vec4 {
    scratch.clear();
    scratch.extend_from_slice(fragments);
    // What is drawn last lies in front, wherever it is.
    scratch.sort_unstable_by_key(|fragment| std::cmp::Reverse(fragment.primitive));
    let mut composite = Composite::default();
    for fragment in &*scratch {
        composite.under(fragment.color);
    }
    composite.over(opaque.map_or(background, |surface| surface.color))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_drawn_is_in_front_wherever_it_is() {
        let red = Fragment { color: Vec4::new(1.0, 0.0, 0.0, 1.0), depth: 0.1, primitive: 7 };
        let green = Fragment { color: Vec4::new(0.0, 0.5, 0.0, 0.5), depth: 0.9, primitive: 3 };
        let mut scratch = Vec::new();
        assert_eq!(pixel(&[green, red], None, Vec4::ONE, &mut scratch), red.color);
        let drawn_later = Fragment { primitive: 8, ..green };
        assert_eq!(pixel(&[drawn_later, red], None, Vec4::ONE, &mut scratch), Vec4::new(0.5, 0.5, 0.0, 1.0));
        assert_eq!(pixel(&[], None, Vec4::ONE, &mut scratch), Vec4::ONE);
    }
}
