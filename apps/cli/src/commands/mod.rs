//! What each command does.

pub(crate) mod bench;
pub(crate) mod compare;
mod folder;
pub(crate) mod info;
pub(crate) mod multi_pass;
pub(crate) mod render;
pub(crate) mod scenes;
pub(crate) mod techniques;
pub(crate) mod verify;

use pellucid::Stats;

use crate::terminal;
use crate::words::plural;

/// Says what a loader left out.
fn warn_about(warnings: &[String]) {
    for warning in warnings {
        terminal::warn(warning);
    }
}

/// Says which triangles a renderer left out.
fn warn_about_cut(stats: &Stats) {
    if stats.cut_pixels > 0 {
        let pixels = plural(stats.cut_pixels, "pixel");
        terminal::warn(&format!("not exact: {pixels} with more layers than --layers allows"));
    }
}

fn warn_about_dropped(stats: &Stats) {
    if stats.dropped_triangles > 0 {
        let triangles = plural(stats.dropped_triangles, "triangle");
        terminal::warn(&format!("{triangles} left out: a vertex is not a number, infinite, or too far away"));
    }
}
