//! What was measured, as it is kept in the folder and written out.

use pellucid::core::fbuffer::Drawn;
use pellucid::gpu::Storage;
use pellucid::{Stats, Technique};
use serde::{Deserialize, Serialize};

use super::samples::Samples;
use super::suite::Point;
use super::variant::Variant;

/// The figures of a frame.
#[derive(Debug, Clone)]
pub(super) struct Timed {
    pub(super) stats: Stats,
    /// Of a shader of several passes.
    pub(super) drawn: Option<Drawn>,
    pub(super) is_exact: bool,
}

impl From<Stats> for Timed {
    fn from(stats: Stats) -> Self {
        Self { drawn: None, is_exact: stats.is_exact(), stats }
    }
}

/// A point with all that was measured there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct PointResult {
    pub(super) label: String,
    /// Where it lies on the axis of its series.
    pub(super) x: Option<f64>,
    pub(super) scene: String,
    /// Whether the scene is there instead of a file that is missing.
    pub(super) stands_in: bool,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) opacity: f32,
    /// Of several passes, and the slots along each side of its F-Buffer, where results are not of techniques.
    pub(super) shader: Option<String>,
    pub(super) fbuffer: Option<u32>,
    /// `None` if nothing was rendered.
    pub(super) triangles: Option<u64>,
    /// `None` if no exact technique was measured.
    pub(super) fragments: Option<u64>,
    pub(super) max_depth_complexity: Option<u32>,
    pub(super) mean_depth_complexity: Option<f64>,
    pub(super) results: Vec<Measurement>,
}

/// A variant at a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Measurement {
    pub(super) name: String,
    pub(super) technique: String,
    pub(super) backend: String,
    /// Of the CPU renderer, where the series varies them.
    pub(super) threads: Option<usize>,
    /// Of the A-buffer.
    pub(super) storage: Option<String>,
    /// After which peeling stops.
    pub(super) max_layers: Option<u32>,
    /// Whether an LFB is sorted in a step of its own.
    pub(super) presort: bool,
    /// Fragments that a depth filter holds, and the share of light below which a pixel is left.
    pub(super) filter_size: Option<u32>,
    pub(super) alpha_threshold: Option<f32>,
    #[serde(flatten)]
    pub(super) outcome: Outcome,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "outcome", rename_all = "lowercase")]
pub(super) enum Outcome {
    Measured(Box<Figures>),
    /// It was not tried, or not to the end.
    Skipped {
        reason: String,
    },
    /// It could not be done.
    Failed {
        reason: String,
    },
}

/// Times in milliseconds, memory in bytes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Figures {
    pub(super) device: String,
    /// Whether every fragment was captured and ordered.
    pub(super) exact: bool,
    pub(super) frames: usize,
    pub(super) median_ms: f64,
    /// Quartiles: half of all frames lie between them.
    pub(super) lower_ms: f64,
    pub(super) upper_ms: f64,
    pub(super) least_ms: f64,
    pub(super) greatest_ms: f64,
    /// Median over that of `alpha` at this point.
    pub(super) alpha_ratio: Option<f64>,
    /// Medians of the timed parts.
    pub(super) steps: Vec<StepTime>,
    pub(super) peak_bytes: u64,
    pub(super) windows: u32,
    pub(super) rerenders: u32,
    /// Pixels with more layers than were peeled.
    pub(super) cut_pixels: u64,
    /// Pixels that a depth filter left out of order; `None` for techniques without, as the next two are.
    pub(super) repaired_pixels: Option<u64>,
    /// Pixels of the finished picture that differ from one of fragments that are all sorted.
    pub(super) wrong_pixels: Option<u64>,
    /// Parts of triangles in half-blocks of pixels.
    pub(super) half_block_parts: Option<u64>,
    /// Windows of slots, of shaders of several passes.
    pub(super) slot_windows: Option<u64>,
    /// How often they drew the geometry.
    pub(super) submissions: Option<u64>,
    /// Each frame, in the order of measuring.
    pub(super) samples_ms: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct StepTime {
    pub(super) name: String,
    pub(super) ms: f64,
}

impl PointResult {
    /// With nothing measured yet.
    pub(super) fn new(point: &Point, scene: String, stands_in: bool) -> Self {
        let (width, height) = point.size;
        Self {
            label: point.label.clone(),
            x: point.x,
            scene,
            stands_in,
            width,
            height,
            opacity: point.opacity,
            shader: point.shaded.map(|shaded| shaded.shader.to_string()),
            fbuffer: point.shaded.map(|shaded| shaded.side),
            triangles: None,
            fragments: None,
            max_depth_complexity: None,
            mean_depth_complexity: None,
            results: Vec::new(),
        }
    }

    /// Takes over what any frame tells of the scene: fragments only if all were captured.
    pub(super) fn learn(&mut self, frame: &Timed) {
        let stats = &frame.stats;
        self.triangles = Some(stats.triangles);
        if frame.drawn.is_some() {
            self.fragments = Some(stats.fragments);
        } else if stats.is_exact() {
            self.fragments = Some(stats.fragments);
            self.max_depth_complexity = Some(stats.max_depth_complexity);
            self.mean_depth_complexity = Some(stats.mean_depth_complexity);
        }
    }

    /// Puts times in proportion to those of `alpha`.
    pub(super) fn compare_with_alpha(&mut self) {
        let alpha_ms = self.figures("alpha").map(|alpha| alpha.median_ms);
        for result in &mut self.results {
            if let Outcome::Measured(figures) = &mut result.outcome {
                figures.alpha_ratio = alpha_ms.map(|alpha_ms| figures.median_ms / alpha_ms);
            }
        }
    }

    /// What was measured of a variant, by its name.
    pub(super) fn figures(&self, name: &str) -> Option<&Figures> {
        self.results.iter().find(|result| result.name == name)?.figures()
    }

    /// Whether nothing failed, so that measuring it again would tell no more.
    pub(super) fn is_final(&self) -> bool {
        !self.results.iter().any(|result| matches!(result.outcome, Outcome::Failed { .. }))
    }
}

impl Measurement {
    pub(super) fn new(variant: Variant, outcome: Outcome) -> Self {
        let is_textures = variant.storage == Storage::Texture;
        let has_filter = variant.technique == Technique::Lucid;
        Self {
            name: variant.name(),
            technique: variant.passes.map_or(variant.technique.name(), |passes| passes.through()).to_owned(),
            backend: variant.backend().to_owned(),
            threads: variant.threads,
            storage: (variant.technique == Technique::ABuffer)
                .then(|| if is_textures { "texture" } else { "buffer" }.to_owned()),
            max_layers: variant.max_layers,
            presort: variant.presort,
            filter_size: has_filter.then_some(variant.depth_filter().size),
            alpha_threshold: has_filter.then_some(variant.depth_filter().threshold),
            outcome,
        }
    }

    pub(super) fn figures(&self) -> Option<&Figures> {
        match &self.outcome {
            Outcome::Measured(figures) => Some(figures),
            Outcome::Skipped { .. } | Outcome::Failed { .. } => None,
        }
    }

    /// Why there are no figures.
    pub(super) fn reason(&self) -> Option<&str> {
        match &self.outcome {
            Outcome::Measured(_) => None,
            Outcome::Skipped { reason } | Outcome::Failed { reason } => Some(reason),
        }
    }
}

impl Figures {
    /// Of one frame or more.
    pub(super) fn new(frames: &[Timed], wrong_pixels: Option<u64>) -> Option<Self> {
        let Timed { stats: last, drawn, is_exact } = frames.last()?;
        let frames: Vec<&Stats> = frames.iter().map(|frame| &frame.stats).collect();
        // Nanoseconds are finer than any clock that matters here.
        let samples_ms: Vec<f64> = frames.iter().map(|stats| (stats.total_ms * 1e6).round() / 1e6).collect();
        let times = Samples::new(samples_ms.clone())?;
        // A frame that had to be repeated has steps that others have not.
        let median_of = |name: &str| {
            let of_frame =
                |stats: &&Stats| stats.steps.iter().filter(|step| step.name == name).map(|step| step.ms).sum();
            Samples::new(frames.iter().map(of_frame).collect()).map_or(0.0, |samples| samples.median())
        };
        Some(Self {
            device: last.device.clone(),
            exact: *is_exact,
            frames: frames.len(),
            median_ms: times.median(),
            lower_ms: times.quantile(0.25),
            upper_ms: times.quantile(0.75),
            least_ms: times.quantile(0.0),
            greatest_ms: times.quantile(1.0),
            alpha_ratio: None,
            steps: last
                .steps
                .iter()
                .map(|step| StepTime { name: step.name.to_owned(), ms: median_of(step.name) })
                .collect(),
            peak_bytes: frames.iter().map(|stats| stats.peak_bytes).max().unwrap_or(0),
            windows: last.windows,
            rerenders: last.rerenders,
            cut_pixels: last.cut_pixels,
            repaired_pixels: (last.technique == Technique::Lucid).then_some(last.repaired_pixels),
            wrong_pixels,
            half_block_parts: (last.technique == Technique::Lucid).then_some(last.half_block_parts),
            slot_windows: drawn.map(|drawn| drawn.windows),
            submissions: drawn.map(|drawn| drawn.submissions),
            samples_ms,
        })
    }

    /// Half the distance of the quartiles over the median: how far frames lie apart.
    pub(super) fn spread(&self) -> f64 {
        0.5 * (self.upper_ms - self.lower_ms) / self.median_ms
    }
}
