//! A shader of several passes.

use std::fmt;

use glam::Vec4;

use super::Fragment;

/// Whether a fragment goes on to the next pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It does.
    Keep,
    /// It ends here. Its slot stays its own.
    Kill,
}

type Pass<'p, S> = Box<dyn Fn(&Fragment<'_>, &mut S) -> Verdict + 'p>;
type Last<'p, S> = Box<dyn Fn(&Fragment<'_>, &S) -> Option<Vec4> + 'p>;

/// A shader: passes that read and write a fragment's slot, and a last one that makes a colour of it.
pub struct Program<'p, S> {
    pub(super) passes: Vec<Pass<'p, S>>,
    pub(super) last: Last<'p, S>,
}

impl<'p, S> Program<'p, S> {
    /// A shader of one pass: a fragment's colour, in linear light with premultiplied alpha, or `None` to kill it.
    pub fn new(last: impl Fn(&Fragment<'_>, &S) -> Option<Vec4> + 'p) -> Self {
        Self { passes: Vec::new(), last: Box::new(last) }
    }

    /// The same shader with one more pass, before the last and after those that it already has.
    #[must_use]
    pub fn pass(mut self, pass: impl Fn(&Fragment<'_>, &mut S) -> Verdict + 'p) -> Self {
        self.passes.push(Box::new(pass));
        self
    }

    /// Its number of passes.
    pub fn pass_count(&self) -> u64 {
        self.passes.len() as u64 + 1
    }
}

impl<S> fmt::Debug for Program<'_, S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Program").field("passes", &self.pass_count()).finish_non_exhaustive()
    }
}
