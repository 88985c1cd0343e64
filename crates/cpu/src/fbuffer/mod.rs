//! The F-Buffer on the CPU: shaders of several passes, each fragment with a slot of its own between them.
//!
//! A [`Program`] is a list of passes. Every pass rasterizes the geometry again, in the same order, and finds in a
//! fragment's slot what the passes before left there; the last one hands its colour to a [`Target`], where tests and
//! blending are done. What a slot holds is the user's to define: any `Copy` type, such as `[Vec4; 4]` for the four RGBA
//! targets of the hardware (Houston, Preetham and Segal 2005, section 3.1), or a structure of several of them.
//!
//! A fragment that is killed keeps its slot, so that no later pass is led astray.

mod fragment;
mod ordered;
mod program;
mod target;

use std::ops::Range;

use glam::Vec4;
pub use pellucid_core::fbuffer::{Drawn, Output};
use pellucid_core::fbuffer::{Overflow, Place, RasterOrder, Size, Windows};

pub use fragment::Fragment;
pub use program::{Program, Verdict};
pub use target::Target;

use fragment::Shaded;

/// A buffer of slots that hold an `S` each, and whether their fragment was killed.
#[derive(Debug)]
pub struct FBuffer<S> {
    size: Size,
    /// Of the slots that the window has, within the room there is: first in, first out.
    states: Vec<S>,
    /// Apart, as beside a state they would take as much as what that is aligned to.
    is_killed: Vec<bool>,
}

impl<S: Copy + Default> FBuffer<S> {
    /// A buffer of a size, which is all it will ever hold.
    pub fn new(size: Size) -> Self {
        let slots = size.slots() as usize;
        Self { size, states: Vec::with_capacity(slots), is_killed: Vec::with_capacity(slots) }
    }

    /// How many slots it has.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Bytes it holds.
    pub fn bytes(&self) -> u64 {
        (self.states.capacity() * size_of::<S>() + self.is_killed.capacity()) as u64
    }

    /// What the last window left in a slot of the buffer.
    ///
    /// # Panics
    /// If no fragment had such a slot.
    pub fn state(&self, slot: u64) -> &S {
        &self.states[slot as usize]
    }

    /// Draws everything, however much it is: a window slides over the order, and fragments outside of it are discarded
    /// before they are shaded (the second generation of hardware, section 3.2 and appendix A).
    ///
    /// # Panics
    /// If `target` is not of the picture's size.
    pub fn draw(
        &mut self,
        order: &RasterOrder<'_>,
        program: &Program<'_, S>,
        output: Output,
        target: &mut Target,
    ) -> Drawn {
        let mut drawn = Drawn::default();
        let mut next = Some(0);
        while let Some(window) = next {
            let (remaining, of_window) = self.window(order, program, window, output, target);
            drawn = drawn + of_window;
            next = (remaining > 0).then_some(window + 1);
        }
        drawn
    }

    /// Draws one window, and returns how many windows remain after it, with the window's figures.
    ///
    /// # Panics
    /// If `target` is not of the picture's size.
    pub fn window(
        &mut self,
        order: &RasterOrder<'_>,
        program: &Program<'_, S>,
        window: u64,
        output: Output,
        target: &mut Target,
    ) -> (u64, Drawn) {
        let windows = Windows::new(order.fragments(), self.size);
        let drawn = self.run(order, program, windows.slots(window), output, target);
        (windows.remaining(window), drawn)
    }

    /// Draws everything if it fits; if not, tells so after the first pass, and nothing reaches the target (the first
    /// generation of hardware).
    ///
    /// # Errors
    /// [`Overflow`] with the number of fragments that the draw has.
    ///
    /// # Panics
    /// If `target` is not of the picture's size.
    pub fn query(
        &mut self,
        order: &RasterOrder<'_>,
        program: &Program<'_, S>,
        output: Output,
        target: &mut Target,
    ) -> Result<Drawn, Overflow> {
        let (needed, slots) = (order.fragments(), self.size.slots());
        if needed > slots {
            // The wasted pass: its fragments beyond the buffer are lost.
            self.pass(order, program, 0, 0..slots);
            return Err(Overflow { needed, slots });
        }
        Ok(self.run(order, program, 0..needed, output, target))
    }

    /// Draws in batches of whole primitives that fit, see [`RasterOrder::batches`].
    ///
    /// # Errors
    /// [`Overflow`] if a primitive alone does not fit; nothing reaches the target.
    ///
    /// # Panics
    /// If `target` is not of the picture's size.
    pub fn draw_in_batches(
        &mut self,
        order: &RasterOrder<'_>,
        program: &Program<'_, S>,
        output: Output,
        target: &mut Target,
    ) -> Result<Drawn, Overflow> {
        let mut drawn = Drawn::default();
        for batch in order.batches(self.size)? {
            drawn = drawn + self.run(order, program, order.slots(batch), output, target);
        }
        Ok(drawn)
    }

    /// All passes over a range of slots that fits the buffer.
    fn run(
        &mut self,
        order: &RasterOrder<'_>,
        program: &Program<'_, S>,
        slots: Range<u64>,
        output: Output,
        target: &mut Target,
    ) -> Drawn {
        target.check(order);
        self.passes(order, program, slots.clone());
        let first = slots.start;
        let drawn = Drawn { windows: 1, submissions: program.pass_count(), fragments: slots.end - first };
        rasterize(order, slots, |fragment| {
            let color = self.color(program, fragment, first);
            if let Some(color) = color {
                target.write(fragment, color, output);
            }
        });
        drawn
    }

    /// All passes but the last.
    fn passes(&mut self, order: &RasterOrder<'_>, program: &Program<'_, S>, slots: Range<u64>) {
        // A shader of one pass finds its slots empty.
        let slots_used = if program.passes.is_empty() { slots.end - slots.start } else { 0 };
        self.clear(slots_used as usize);
        for pass in 0..program.passes.len() {
            self.pass(order, program, pass, slots.clone());
        }
    }

    /// One pass but the last. The first finds its slots empty.
    fn pass(&mut self, order: &RasterOrder<'_>, program: &Program<'_, S>, pass: usize, slots: Range<u64>) {
        let Some(shade) = program.passes.get(pass) else { return };
        let first = slots.start;
        if pass == 0 {
            // They come one after the other.
            self.clear(0);
            return rasterize(order, slots, |fragment| {
                let mut state = S::default();
                self.is_killed.push(shade(fragment, &mut state) == Verdict::Kill);
                self.states.push(state);
            });
        }
        rasterize(order, slots, |fragment| {
            let slot = (fragment.slot - first) as usize;
            if !self.is_killed[slot] {
                self.is_killed[slot] = shade(fragment, &mut self.states[slot]) == Verdict::Kill;
            }
        });
    }

    /// What the last pass makes of a fragment, in a window that begins with the slot `first`.
    fn color(&self, program: &Program<'_, S>, fragment: &Fragment<'_>, first: u64) -> Option<Vec4> {
        let slot = (fragment.slot - first) as usize;
        if self.is_killed[slot] { None } else { (program.last)(fragment, &self.states[slot]) }
    }

    /// Leaves so many slots, all of them empty.
    fn clear(&mut self, slots: usize) {
        self.states.clear();
        self.is_killed.clear();
        self.states.resize(slots, S::default());
        self.is_killed.resize(slots, false);
    }
}

/// The same passes with intermediate results in a framebuffer, one for each pixel: what an F-Buffer is better than. Where
/// surfaces overlap, every fragment finds what the last drawn one left (figure 1).
///
/// # Panics
/// If `target` is not of the picture's size.
pub fn draw_through_framebuffer<S: Copy + Default>(
    order: &RasterOrder<'_>,
    program: &Program<'_, S>,
    output: Output,
    target: &mut Target,
) {
    target.check(order);
    let all = 0..order.fragments();
    // And the number of the pass that killed it, from 1.
    let (mut states, mut killed_by) = (vec![S::default(); target.depth.len()], vec![0; target.depth.len()]);
    let width = target.color.width();
    let index = |fragment: &Fragment<'_>| (fragment.y * width + fragment.x) as usize;
    for (number, shade) in (1..).zip(&program.passes) {
        rasterize(order, all.clone(), |fragment| {
            let pixel = index(fragment);
            if [0, number].contains(&killed_by[pixel]) {
                let verdict = shade(fragment, &mut states[pixel]);
                killed_by[pixel] = if verdict == Verdict::Kill { number } else { 0u16 };
            }
        });
    }
    rasterize(order, all, |fragment| {
        let pixel = index(fragment);
        let color = if killed_by[pixel] > 0 { None } else { (program.last)(fragment, &states[pixel]) };
        if let Some(color) = color {
            target.write(fragment, color, output);
        }
    });
}

/// Visits the fragments of a window of slots with what it takes to shade them, which a primitive's have in common.
fn rasterize(order: &RasterOrder<'_>, slots: Range<u64>, mut visit: impl FnMut(&Fragment<'_>)) {
    let geometry = order.geometry();
    let mut shaded: Option<(usize, Vec<Shaded>)> = None;
    order.rasterize(slots, |place: Place| {
        if shaded.as_ref().is_none_or(|(primitive, _)| *primitive != place.primitive) {
            shaded = Some((place.primitive, Shaded::of(geometry, &geometry.primitives[place.primitive])));
        }
        if let Some((_, pieces)) = &shaded {
            visit(&Fragment::new(geometry, &place, &pieces[place.piece]));
        }
    });
}
