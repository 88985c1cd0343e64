//! One renderer for every technique.

#[cfg(feature = "gpu")]
use std::sync::OnceLock;

use pellucid_core::{Frame, Layers, Resolve, Scene, Stats, Technique, View, oracle};
use pellucid_cpu::{Canvas, CpuRenderer};
#[cfg(feature = "gpu")]
use pellucid_gpu::{ContextOptions, GpuRenderer, Storage};

use crate::Error;

/// Renders scenes with a chosen technique. Make one and keep it: it holds on to threads, devices and memory between frames.
#[derive(Debug)]
pub struct Renderer {
    technique: Technique,
    budget_bytes: Option<u64>,
    cpu: CpuRenderer,
    #[cfg(feature = "gpu")]
    storage: Storage,
    /// Opened with the first frame that needs it.
    #[cfg(feature = "gpu")]
    gpu: OnceLock<GpuRenderer>,
}

impl Default for Renderer {
    fn default() -> Self {
        Self::new()
    }
}

impl Renderer {
    /// The CPU renderer on all cores.
    pub fn new() -> Self {
        Self {
            technique: Technique::Cpu,
            budget_bytes: None,
            cpu: CpuRenderer::new(0),
            #[cfg(feature = "gpu")]
            storage: Storage::default(),
            #[cfg(feature = "gpu")]
            gpu: OnceLock::new(),
        }
    }

    /// The same renderer with another technique. One of the GPU opens the best device there is, a software one too, with
    /// the first frame.
    #[must_use]
    pub fn technique(mut self, technique: Technique) -> Self {
        self.technique = technique;
        self
    }

    /// The same renderer on so many threads; 0: one for each core. The picture is the same on any number.
    #[must_use]
    pub fn threads(mut self, threads: usize) -> Self {
        self.cpu = CpuRenderer::new(threads);
        if let Some(budget_bytes) = self.budget_bytes {
            self.cpu = self.cpu.budget_bytes(budget_bytes);
        }
        self
    }

    /// The same renderer with a budget: bytes that a capture may hold, on the GPU or before the tiles of the CPU. The
    /// picture is the same at any.
    #[must_use]
    pub fn budget_bytes(mut self, budget_bytes: u64) -> Self {
        self.budget_bytes = Some(budget_bytes);
        self.cpu = self.cpu.budget_bytes(budget_bytes);
        #[cfg(feature = "gpu")]
        if let Some(gpu) = self.gpu.take() {
            self.gpu = OnceLock::from(gpu.budget_bytes(budget_bytes));
        }
        self
    }

    /// The same renderer with another storage for the A-buffer's fragments. The picture is the same in either.
    #[cfg(feature = "gpu")]
    #[must_use]
    pub fn storage(mut self, storage: Storage) -> Self {
        self.storage = storage;
        if let Some(gpu) = self.gpu.take() {
            self.gpu = OnceLock::from(gpu.storage(storage));
        }
        self
    }

    /// The same renderer on a GPU device of one's own choice.
    #[cfg(feature = "gpu")]
    #[must_use]
    pub fn gpu(mut self, gpu: GpuRenderer) -> Self {
        self.gpu = OnceLock::from(gpu);
        self
    }

    /// Renders a picture.
    ///
    /// # Errors
    /// [`Error::Core`] if the view is invalid, `Error::Gpu` if a GPU is needed and cannot do it.
    pub fn render(&self, scene: &Scene, view: &View, resolve: Resolve) -> Result<Frame, Error> {
        Ok(match self.technique {
            Technique::Cpu => self.cpu.render(scene, view, resolve)?,
            Technique::Oracle => oracle::render(scene, view, resolve)?,
            #[cfg(feature = "gpu")]
            technique => self.opened_gpu()?.render(scene, view, resolve, technique)?,
            #[cfg(not(feature = "gpu"))]
            technique => return Err(Error::NoGpu(technique)),
        })
    }

    /// Renders into a picture that is kept from frame to frame, for turntables and windows: the CPU renderer then leaves alone
    /// what was the background and still is.
    ///
    /// # Errors
    /// As [`Self::render`]; the canvas then has the picture it had.
    pub fn render_into(
        &self,
        scene: &Scene,
        view: &View,
        resolve: Resolve,
        canvas: &mut Canvas,
    ) -> Result<Stats, Error> {
        if self.technique == Technique::Cpu {
            return Ok(self.cpu.render_into(scene, view, resolve, canvas)?);
        }
        let frame = self.render(scene, view, resolve)?;
        canvas.put(frame.image);
        Ok(frame.stats)
    }

    /// Hands out the ordered layers behind every pixel, one rectangle of the picture at a time, for a resolve of one's
    /// own. Rectangles do not overlap and cover the whole picture; they come from several threads in any order, and each
    /// is gone after the call.
    ///
    /// # Errors
    /// As [`Self::render`].
    pub fn layers(&self, scene: &Scene, view: &View, visit: impl Fn(&Layers) + Sync) -> Result<Stats, Error> {
        Ok(match self.technique {
            Technique::Cpu => self.cpu.layers(scene, view, visit)?,
            Technique::Oracle => {
                let capture = oracle::capture(scene, view)?;
                visit(&capture.layers);
                oracle::resolve_capture(&capture, scene, view, Resolve::Blend).1
            }
            #[cfg(feature = "gpu")]
            technique => self.opened_gpu()?.layers(scene, view, technique, visit)?,
            #[cfg(not(feature = "gpu"))]
            technique => return Err(Error::NoGpu(technique)),
        })
    }

    #[cfg(feature = "gpu")]
    fn opened_gpu(&self) -> Result<&GpuRenderer, Error> {
        if let Some(gpu) = self.gpu.get() {
            return Ok(gpu);
        }
        let mut gpu = GpuRenderer::new(&ContextOptions { allow_software: true, ..ContextOptions::default() })?
            .storage(self.storage);
        if let Some(budget_bytes) = self.budget_bytes {
            gpu = gpu.budget_bytes(budget_bytes);
        }
        Ok(self.gpu.get_or_init(|| gpu))
    }
}
