//! stub
use pellucid_core::{Error, Frame, Layers, Resolve, Scene, Stats, Technique, View, oracle};

/// Renders on all cores.
#[derive(Debug)]
pub struct CpuRenderer {
    threads: usize,
}

impl CpuRenderer {
    /// A renderer on this many threads; 0: one for each core.
    pub fn new(threads: usize) -> Self {
        Self { threads }
    }

    /// Renders a view.
    ///
    /// # Errors
    /// If the view is invalid.
    pub fn render(&self, scene: &Scene, view: &View, resolve: Resolve) -> Result<Frame, Error> {
        let _ = self.threads;
        let mut frame = oracle::render(scene, view, resolve)?;
        frame.stats.technique = Technique::Cpu;
        Ok(frame)
    }

    /// Hands out the ordered layers of a view, tile by tile.
    ///
    /// # Errors
    /// If the view is invalid.
    pub fn layers(&self, scene: &Scene, view: &View, visit: impl Fn(&Layers) + Sync) -> Result<Stats, Error> {
        visit(&oracle::capture(scene, view)?.layers);
        Ok(self.render(scene, view, Resolve::Blend)?.stats)
    }
}
