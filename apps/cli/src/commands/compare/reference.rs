//! What techniques are held against.

use pellucid::core::oracle::{self, Capture};
use pellucid::{Image, Layers, Renderer, Resolve, Scene, Stats, Technique, View};

/// Triangles times pixels that the oracle takes some ten seconds for.
const ORACLE_REACH: u64 = 300_000_000;

/// A picture with the layers it was made of.
pub(super) struct Reference {
    image: Image,
    stats: Stats,
    source: Source,
}

/// Where layers come from when they are looked at.
enum Source {
    /// The oracle's memory.
    Oracle(Capture),
    /// Another run of the CPU renderer, which needs no memory for all of them at once.
    Cpu(Box<Renderer>),
}

/// The oracle where it takes seconds, else the CPU renderer.
pub(super) fn usual(scene: &Scene, view: &View) -> Technique {
    if oracle_work(scene, view) <= ORACLE_REACH { Technique::Oracle } else { Technique::Cpu }
}

/// About how many minutes the oracle takes.
pub(super) fn oracle_minutes(scene: &Scene, view: &View) -> u64 {
    oracle_work(scene, view) / (6 * ORACLE_REACH)
}

/// Triangles times pixels.
fn oracle_work(scene: &Scene, view: &View) -> u64 {
    u64::from(scene.primitive_count()) * u64::from(view.width) * u64::from(view.height)
}

impl Reference {
    /// Renders a view with the oracle, or else with `cpu`.
    pub(super) fn capture(
        technique: Technique,
        cpu: Renderer,
        scene: &Scene,
        view: &View,
        resolve: Resolve,
    ) -> anyhow::Result<Self> {
        if technique == Technique::Oracle {
            let capture = oracle::capture(scene, view).map_err(pellucid::Error::from)?;
            let (image, stats) = oracle::resolve_capture(&capture, scene, view, resolve);
            return Ok(Self { image, stats, source: Source::Oracle(capture) });
        }
        let cpu = cpu.technique(Technique::Cpu);
        let frame = cpu.render(scene, view, resolve)?;
        Ok(Self { image: frame.image, stats: frame.stats, source: Source::Cpu(Box::new(cpu)) })
    }

    pub(super) fn image(&self) -> &Image {
        &self.image
    }

    pub(super) fn stats(&self) -> &Stats {
        &self.stats
    }

    pub(super) fn technique(&self) -> Technique {
        self.stats.technique
    }

    /// For each pixel, whether another device's rounding may give another result, if that is known.
    pub(super) fn ambiguous(&self) -> Option<&[bool]> {
        match &self.source {
            Source::Oracle(capture) => Some(&capture.ambiguous),
            Source::Cpu(_) => None,
        }
    }

    /// Hands out all layers, as [`Renderer::layers`] does.
    pub(super) fn layers(&self, scene: &Scene, view: &View, visit: impl Fn(&Layers) + Sync) -> anyhow::Result<()> {
        match &self.source {
            Source::Oracle(capture) => visit(&capture.layers),
            Source::Cpu(renderer) => drop(renderer.layers(scene, view, visit)?),
        }
        Ok(())
    }
}
