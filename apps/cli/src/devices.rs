//! Which techniques run here, and the renderer that runs them one after the other.

use pellucid::core::fbuffer::Size;
use pellucid::gpu::{ContextOptions, DepthFilter, GpuError, GpuRenderer, Storage};
use pellucid::{Renderer, Technique};

use crate::UsageError;
use crate::args::{Backend, DeviceArgs};
use crate::plan::{MAX_THREADS, option, optional};
use crate::values;

/// On what several techniques run.
#[derive(Debug)]
pub(crate) struct DevicePlan {
    backend: Backend,
    threads: usize,
    budget_bytes: Option<u64>,
    gpu: GpuOptions,
}

/// What single techniques of the GPU can be told.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct GpuOptions {
    pub(crate) storage: Storage,
    pub(crate) max_layers: Option<u32>,
    pub(crate) presort: bool,
    pub(crate) fbuffer_size: Option<Size>,
    pub(crate) depth_filter: DepthFilter,
}

/// A renderer for all of some techniques.
pub(crate) struct Devices {
    pub(crate) renderer: Renderer,
    pub(crate) techniques: Vec<Technique>,
    /// Why those of the GPU were left out, if they were.
    pub(crate) without_gpu: Option<String>,
}

impl DevicePlan {
    pub(crate) fn new(args: &DeviceArgs) -> anyhow::Result<Self> {
        let threads = option("--threads", &args.threads, |text| values::whole(text, 0, MAX_THREADS))?;
        let budget_bytes = optional("--budget", args.budget.as_ref(), values::bytes)?;
        let gpu = GpuOptions::default();
        Ok(Self { backend: args.backend, threads: threads as usize, budget_bytes, gpu })
    }

    /// The same with options of single techniques.
    pub(crate) fn with(self, gpu: GpuOptions) -> Self {
        Self { gpu, ..self }
    }

    /// Checks that techniques named by an option can run on the backend.
    pub(crate) fn check(&self, option: &str, named: &[Technique]) -> anyhow::Result<()> {
        match named.iter().find(|&&technique| !self.allows(technique)) {
            Some(technique) => {
                let on = technique.backend();
                Err(UsageError(format!("{option}: '{technique}' runs on the {on}; leave out --backend")).into())
            }
            None => Ok(()),
        }
    }

    /// A renderer for the CPU.
    pub(crate) fn cpu(&self) -> Renderer {
        let renderer = Renderer::new().threads(self.threads);
        match self.budget_bytes {
            Some(budget_bytes) => renderer.budget_bytes(budget_bytes),
            None => renderer,
        }
    }

    fn allows(&self, technique: Technique) -> bool {
        match self.backend {
            Backend::Auto => true,
            Backend::Cpu => technique.backend() == "cpu",
            Backend::Gpu => technique.backend() == "gpu",
        }
    }

    /// A renderer for the techniques named, or else for those of `usual` that the backend has. A software GPU is used if
    /// the backend or one of its techniques is asked for by name.
    pub(crate) fn open(&self, named: &[Technique], usual: impl Fn(Technique) -> bool) -> anyhow::Result<Devices> {
        let mut techniques = named.to_vec();
        if named.is_empty() {
            techniques =
                Technique::ALL.into_iter().filter(|&technique| usual(technique) && self.allows(technique)).collect();
        }
        let mut renderer = self.cpu();
        let mut without_gpu = None;
        let on_gpu = |technique: &Technique| technique.backend() == "gpu";
        if techniques.iter().any(on_gpu) {
            let asked_for = self.backend == Backend::Gpu || named.iter().any(on_gpu);
            match GpuRenderer::new(&ContextOptions { allow_software: asked_for, ..ContextOptions::default() }) {
                Ok(mut gpu) => {
                    if let Some(budget_bytes) = self.budget_bytes {
                        gpu = gpu.budget_bytes(budget_bytes);
                    }
                    let GpuOptions { storage, max_layers, presort, fbuffer_size, depth_filter } = self.gpu;
                    let gpu = gpu.storage(storage).max_layers(max_layers).presort(presort);
                    renderer = renderer.gpu(gpu.fbuffer_size(fbuffer_size).depth_filter(depth_filter));
                }
                Err(error @ (GpuError::NoAdapter | GpuError::OnlySoftware { .. })) if !asked_for => {
                    techniques.retain(|technique| !on_gpu(technique));
                    without_gpu = Some(error.to_string());
                }
                Err(error) => return Err(error.into()),
            }
        }
        Ok(Devices { renderer, techniques, without_gpu })
    }
}
