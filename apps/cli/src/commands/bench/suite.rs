//! What a suite is: series of points at which techniques are measured, and how the results are shown.

use std::path::{Path, PathBuf};

use glam::Vec3;
use pellucid::multi_pass::Shader;
use serde::Serialize;

use super::pace::Work;
use super::variant::Variant;
use crate::args::Side;
use crate::camera::CameraPlan;

/// Measurements that belong together, under the name of `--suite`.
#[derive(Debug)]
pub(crate) struct Suite {
    pub(crate) name: &'static str,
    /// One line on what it measures.
    pub(crate) summary: &'static str,
    /// Whether a software GPU is what it is about.
    pub(super) wants_software_gpu: bool,
    /// The series on a machine with so many cores.
    pub(super) series: fn(cores: usize) -> Vec<Series>,
}

/// Points that differ in one thing, at which the same variants are measured: one table or figure.
#[derive(Debug)]
pub(super) struct Series {
    pub(super) name: &'static str,
    pub(super) title: &'static str,
    /// What is measured and why, in a sentence or two.
    pub(super) about: &'static str,
    /// What [`Point::x`] counts, if points lie along an axis.
    pub(super) axis: Option<Axis>,
    pub(super) variants: Vec<Variant>,
    /// The cheapest first, so that what the dear ones take can be told before.
    pub(super) points: Vec<Point>,
    pub(super) shows: &'static [Show],
    pub(super) published: Option<Published>,
}

/// Along what points lie.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Axis {
    /// In the plural, as in "total fragments".
    pub(super) name: &'static str,
    /// One of them, as in "fragment".
    pub(super) unit: &'static str,
    /// Whether it spans powers of ten rather than a range.
    pub(super) is_log: bool,
}

/// A way to show the results of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Show {
    /// Median times with their spread.
    Times,
    /// Times over the time of `alpha`.
    Ratios,
    /// Frames a second.
    Rates,
    /// The timed parts of a frame, for each point.
    Steps,
    /// Share of sorting in the timed parts.
    SortShares,
    /// Most bytes held.
    Memory,
    /// Time for each unit of the axis.
    UnitCosts,
    /// Pixels at which layers were cut off.
    Cuts,
    /// Samples of a triangle in a half-block of pixels.
    HalfBlocks,
    /// Pixels that a depth filter leaves out of order, and those wrong in the picture.
    Wrong,
    /// Exponents of power laws through the times.
    Exponents,
    /// How much faster than one thread.
    Speedups,
    /// How much faster the CPU renderer is than techniques on the GPU, with geometric means.
    Peers,
    /// Windows of F-Buffers, and how often geometry is drawn for them.
    Submissions,
    /// Times through F-Buffers over those through framebuffers.
    Through,
}

/// A scene from a view.
#[derive(Debug, Clone)]
pub(super) struct Point {
    /// Short, as in "n = 100".
    pub(super) label: String,
    pub(super) source: Source,
    pub(super) look: CameraPlan,
    pub(super) size: (u32, u32),
    pub(super) opacity: f32,
    /// What is run there by variants that are no technique.
    pub(super) shaded: Option<Shaded>,
    /// Where it lies on the axis of its series.
    pub(super) x: Option<f64>,
    /// About how much there is to do.
    pub(super) work: Work,
}

/// A shader of several passes, and the slots along each side of its F-Buffer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shaded {
    pub(super) shader: Shader,
    pub(super) side: u32,
}

/// Where a scene comes from.
#[derive(Debug, Clone)]
pub(super) enum Source {
    BuiltIn(String),
    /// A file in the folder of the real scenes, or a built-in one of like size.
    File {
        path: &'static str,
        stand_in: &'static str,
    },
}

/// Figures that others published, shown beside those of this device and never mixed with them.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Published {
    /// Who and where.
    pub(super) source: &'static str,
    /// On what.
    pub(super) hardware: &'static str,
    pub(super) heading: &'static [&'static str],
    pub(super) rows: &'static [&'static [&'static str]],
    /// What is said of them in words.
    pub(super) remarks: &'static [&'static str],
}

/// Side of a `--quick` picture over that of a whole one.
const QUICK_SCALE: u32 = 8;
/// Points of a series in a `--quick` run.
const QUICK_POINTS: usize = 2;

impl Series {
    /// The same series with its first points alone, small.
    pub(super) fn quick(mut self) -> Self {
        self.points.truncate(QUICK_POINTS);
        for point in &mut self.points {
            let (width, height) = point.size;
            point.size = ((width / QUICK_SCALE).max(1), (height / QUICK_SCALE).max(1));
            point.work.fragments /= f64::from(QUICK_SCALE * QUICK_SCALE);
            // A point that lies along its pixels moves with them; one that lies along anything else stays.
            if let Some(x) = &mut point.x
                && self.axis.is_some_and(|axis| axis.counts_pixels())
            {
                *x /= f64::from(QUICK_SCALE * QUICK_SCALE);
            }
        }
        self
    }
}

impl Axis {
    pub(super) const FRAGMENTS: Self = Self { name: "total fragments", unit: "fragment", is_log: true };
    pub(super) const PIXELS: Self = Self { name: "pixels", unit: "pixel", is_log: true };

    fn counts_pixels(self) -> bool {
        self.unit == Self::FRAGMENTS.unit || self.unit == Self::PIXELS.unit
    }
}

impl Point {
    /// A scene as it is, seen as a whole, at 1280 x 720 pixels.
    pub(super) fn new(label: impl Into<String>, source: Source, work: Work) -> Self {
        let (look, size) = (CameraPlan::default(), (1280, 720));
        Self { label: label.into(), source, look, size, opacity: 1.0, shaded: None, x: None, work }
    }

    pub(super) fn size(mut self, width: u32, height: u32) -> Self {
        self.size = (width, height);
        self
    }

    pub(super) fn opacity(mut self, opacity: f32) -> Self {
        self.opacity = opacity;
        self
    }

    pub(super) fn shaded(mut self, shader: Shader, side: u32) -> Self {
        self.shaded = Some(Shaded { shader, side });
        self
    }

    pub(super) fn at(mut self, x: f64) -> Self {
        self.x = Some(x);
        self
    }

    pub(super) fn seen_from(mut self, side: Side) -> Self {
        self.look = CameraPlan { side: Some(side), ..CameraPlan::default() };
        self
    }

    pub(super) fn between(mut self, eye: [f32; 3], target: [f32; 3]) -> Self {
        self.look =
            CameraPlan { eye: Some(Vec3::from(eye)), target: Some(Vec3::from(target)), ..CameraPlan::default() };
        self
    }

    pub(super) fn pixels(&self) -> f64 {
        f64::from(self.size.0) * f64::from(self.size.1)
    }
}

impl Source {
    /// What is loaded, and whether it stands in for a file that is not there.
    pub(super) fn resolve(&self, scenes: Option<&Path>) -> (PathBuf, bool) {
        match self {
            Self::BuiltIn(name) => (name.into(), false),
            Self::File { path, stand_in } => {
                match scenes.map(|folder| folder.join(path)).filter(|file| file.exists()) {
                    Some(file) => (file, false),
                    None => (stand_in.into(), true),
                }
            }
        }
    }
}
