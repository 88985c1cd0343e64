//! One technique: its picture, what it took, and how far it is from the reference.

use std::time::{Duration, Instant};

use pellucid::{Error, Frame, Image, Renderer, Resolve, Scene, Stats, View};
use pellucid_conformance::images::{self, Comparison};
use pellucid_conformance::metrics::{self, Shown};

use super::observation::Observation;
use super::reference::Reference;
use crate::plan::Compared;

/// Frames are repeated until there are so many of them, or so much time has gone.
const REPEATS: usize = 5;
const PATIENCE: Duration = Duration::from_secs(2);

/// A picture and its figures.
pub(super) struct Measured {
    pub(super) compared: Compared,
    pub(super) image: Image,
    /// Of the frame of median time; `None` for what no device rendered.
    pub(super) stats: Option<Stats>,
    /// Steps of 1/255 by which each pixel differs at most.
    pub(super) differences: Vec<u8>,
    /// Without knowledge of ambiguous pixels, all that differ count as unexplained.
    pub(super) comparison: Comparison,
    pub(super) psnr: f64,
    pub(super) ssim: Option<f64>,
    pub(super) flip: f64,
}

pub(super) fn measure(
    compared: Compared,
    renderer: &Renderer,
    (scene, view, resolve): (&Scene, &View, Resolve),
    reference: &Reference,
    observation: &Observation,
) -> Result<Measured, Error> {
    let (image, stats) = match compared {
        Compared::Unsorted => (observation.unsorted.clone(), None),
        Compared::Technique(_) => {
            let Frame { image, stats } = median(renderer, scene, view, resolve)?;
            (image, Some(stats))
        }
    };
    let expected = reference.image();
    let unknown;
    let ambiguous = match reference.ambiguous() {
        Some(ambiguous) => ambiguous,
        None => {
            unknown = vec![false; expected.pixels().len()];
            &unknown
        }
    };
    let is_covered = |x, y| expected.pixel(x, y) != view.background;
    let comparison = images::compare(expected, ambiguous, is_covered, &image);
    let [before, after] = [expected, &image].map(Shown::from);
    Ok(Measured {
        differences: metrics::differences(expected, &image),
        psnr: metrics::psnr(&before, &after),
        ssim: metrics::ssim(&before, &after),
        flip: metrics::flip(&before, &after),
        compared,
        image,
        stats,
        comparison,
    })
}

/// The frame of median time. The first one, which also makes what later ones keep, counts only if it is slow.
fn median(renderer: &Renderer, scene: &Scene, view: &View, resolve: Resolve) -> Result<Frame, Error> {
    let start = Instant::now();
    let first = renderer.render(scene, view, resolve)?;
    let mut frames = Vec::new();
    while frames.len() < REPEATS && start.elapsed() < PATIENCE {
        frames.push(renderer.render(scene, view, resolve)?);
    }
    frames.sort_by(|a, b| a.stats.total_ms.total_cmp(&b.stats.total_ms));
    let middle = frames.len() / 2;
    Ok(frames.into_iter().nth(middle).unwrap_or(first))
}

impl Measured {
    /// Greatest difference in steps of 1/255.
    pub(super) fn max_error(&self) -> u8 {
        self.differences.iter().copied().max().unwrap_or(0)
    }

    /// Pixels that differ by at least one step.
    pub(super) fn differing(&self) -> u64 {
        self.differences.iter().filter(|&&difference| difference > 0).count() as u64
    }

    /// The pixel that differs most, if any does by a step.
    pub(super) fn worst(&self) -> Option<(u32, u32)> {
        self.comparison.worst.filter(|_| self.max_error() > 0).map(|(x, y, _)| (x, y))
    }
}
