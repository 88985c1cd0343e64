//! Order-independent blending (section 5.1): final colours and places go to two buffers, which are sorted by pixel and
//! depth; the windows of a draw that overflowed are merged.

use glam::Vec4;
use pellucid_core::fbuffer::sort::{Key, merge_runs, sort};
use pellucid_core::fbuffer::{Overflow, RasterOrder, Windows};
use pellucid_core::layers::OpaqueSurface;
use pellucid_core::{Fragment, Layers};

use super::{Drawn, FBuffer, Program, Target, rasterize};

impl<S: Copy + Default> FBuffer<S> {
    /// The ordered layers of a draw in front of what `opaque` holds: for each pixel all fragments, nearest first, whatever
    /// the order in which they were drawn. A pixel of `opaque` without alpha has no opaque surface.
    ///
    /// Layers hold all fragments of the draw, unlike the buffer itself.
    ///
    /// # Errors
    /// [`Overflow`] if keys cannot number that many fragments: 2^32 or more.
    ///
    /// # Panics
    /// If `opaque` is not of the picture's size.
    pub fn layers(
        &mut self,
        order: &RasterOrder<'_>,
        program: &Program<'_, S>,
        opaque: &Target,
    ) -> Result<(Layers, Drawn), Overflow> {
        opaque.check(order);
        let (needed, slots) = (order.fragments(), u64::from(u32::MAX));
        let total = u32::try_from(needed).map_err(|_| Overflow { needed, slots })?;
        let windows = Windows::new(order.fragments(), self.size());
        let (mut keys, mut fragments) = (Vec::with_capacity(total as usize), Vec::with_capacity(total as usize));
        let mut drawn = Drawn::default();
        for window in 0..windows.count() {
            let slots = windows.slots(window);
            let first = slots.start;
            drawn = drawn + Drawn { windows: 1, submissions: program.pass_count(), fragments: slots.end - first };
            self.passes(order, program, slots.clone());
            rasterize(order, slots, |fragment| {
                let color = self.color(program, fragment, first);
                let pixel = fragment.y * opaque.color.width() + fragment.x;
                let is_seen = color.is_some() && fragment.depth >= opaque.depth[pixel as usize];
                keys.push(Key {
                    pixel: if is_seen { pixel } else { Key::DEAD },
                    depth: fragment.depth.to_bits(),
                    slot: fragment.slot as u32,
                });
                let (color, depth) = (color.unwrap_or(Vec4::ZERO), fragment.depth);
                fragments.push(Fragment { color, depth, primitive: fragment.primitive() });
            });
            sort(&mut keys[first as usize..]);
        }
        merge_runs(&mut keys, self.size().slots() as usize);
        Ok((gather(&keys, &fragments, opaque), drawn))
    }
}

/// Sorted back to front, layers stand front to back.
fn gather(keys: &[Key], fragments: &[Fragment], opaque: &Target) -> Layers {
    let (width, height) = (opaque.color.width(), opaque.color.height());
    let mut layers = Layers { width, height, ..Layers::default() };
    let mut runs = keys.chunk_by(|a, b| a.pixel == b.pixel).peekable();
    for (pixel, (&color, &depth)) in (0..).zip(opaque.color.pixels().iter().zip(&opaque.depth)) {
        if let Some(run) = runs.next_if(|run| run[0].pixel == pixel) {
            layers.fragments.extend(run.iter().rev().map(|key| fragments[key.slot as usize]));
        }
        layers.ends.push(layers.fragments.len() as u32);
        layers.opaque.push((color.w > 0.0).then_some(OpaqueSurface { color, depth }));
    }
    layers
}
