//! One renderer for every technique.

use pellucid_core::{Frame, Layers, Resolve, Scene, Stats, Technique, View, oracle};
use pellucid_cpu::CpuRenderer;

use crate::Error;

/// Renders scenes with a chosen technique. Make one and keep it: it holds on to threads and memory between frames.
#[derive(Debug)]
pub struct Renderer {
    technique: Technique,
    cpu: CpuRenderer,
}

impl Default for Renderer {
    fn default() -> Self {
        Self::new()
    }
}

impl Renderer {
    /// The CPU renderer on all cores.
    pub fn new() -> Self {
        Self { technique: Technique::Cpu, cpu: CpuRenderer::new(0) }
    }

    /// The same renderer with another technique.
    #[must_use]
    pub fn technique(mut self, technique: Technique) -> Self {
        self.technique = technique;
        self
    }

    /// The same renderer on so many threads; 0: one for each core. The picture is the same on any number.
    #[must_use]
    pub fn threads(mut self, threads: usize) -> Self {
        self.cpu = CpuRenderer::new(threads);
        self
    }

    /// Renders a picture.
    ///
    /// # Errors
    /// [`Error::Core`] if the view is invalid.
    pub fn render(&self, scene: &Scene, view: &View, resolve: Resolve) -> Result<Frame, Error> {
        Ok(match self.technique {
            Technique::Cpu => self.cpu.render(scene, view, resolve)?,
            Technique::Oracle => oracle::render(scene, view, resolve)?,
        })
    }

    /// Hands out the ordered layers behind every pixel, one rectangle of the picture at a time, for a resolve of one's
    /// own. Rectangles do not overlap and cover the whole picture; they come from several threads in any order, and each
    /// is gone after the call.
    ///
    /// # Errors
    /// [`Error::Core`] if the view is invalid.
    pub fn layers(&self, scene: &Scene, view: &View, visit: impl Fn(&Layers) + Sync) -> Result<Stats, Error> {
        Ok(match self.technique {
            Technique::Cpu => self.cpu.layers(scene, view, visit)?,
            Technique::Oracle => {
                let capture = oracle::capture(scene, view)?;
                visit(&capture.layers);
                oracle::resolve_capture(&capture, scene, view, Resolve::Blend).1
            }
        })
    }
}
