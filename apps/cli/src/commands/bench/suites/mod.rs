//! The suites, one file each. To add one, add a file and its entry in [`SUITES`].

mod abuffer;
mod fbuffer;
mod lfb;
mod lucid;
mod peel;
mod peers;
mod scale;

use super::suite::Suite;

/// All there are, in the order in which they are measured.
pub(crate) const SUITES: &[Suite] =
    &[lfb::SUITE, peel::SUITE, abuffer::SUITE, fbuffer::SUITE, lucid::SUITE, scale::SUITE, peers::SUITE];

/// The dragon of the LFB chapter's figure 20.7, or as many triangles.
const DRAGON: super::suite::Source =
    super::suite::Source::File { path: "stanford_dragon/dragon_871k.ply", stand_in: "@spheres:n=680" };
/// The atrium of the LFB chapter's figure 20.8, or as many triangles.
const ATRIUM: super::suite::Source =
    super::suite::Source::File { path: "crytek_sponza/crytek_sponza.glb", stand_in: "@boxes:n=28" };

/// A scene made by a rule.
fn built_in(name: impl Into<String>) -> super::suite::Source {
    super::suite::Source::BuiltIn(name.into())
}
