//! What renders: the CPU renderer at the numbers of threads asked for, and the GPU.

use std::collections::BTreeMap;

use pellucid::core::fbuffer::Size;
use pellucid::gpu::{Context, ContextOptions, GpuError, GpuRenderer, Storage};
use pellucid::multi_pass::{self, GpuMultiPass, Through};
use pellucid::{Canvas, Error, Renderer, Resolve, Scene, Stats, Technique, View};
use serde::{Deserialize, Serialize};
use sysinfo::{CpuRefreshKind, RefreshKind, System};

use super::results::Timed;
use super::suite::{Shaded, Suite};
use super::variant::{Passes, Variant};
use crate::args::Backend;
use crate::plan::BenchPlan;
use crate::words::{memory, plural};

/// Renderers, kept from frame to frame.
pub(super) struct Machine {
    backend: Backend,
    threads: usize,
    budget_bytes: Option<u64>,
    cpu: BTreeMap<usize, (Renderer, Canvas)>,
    /// Or why there is none.
    gpu: Result<Gpu, String>,
}

/// One device, opened once for each storage that is used, as pipelines differ, and once for shaders of several passes.
struct Gpu {
    buffers: Option<GpuRenderer>,
    textures: Option<GpuRenderer>,
    passes: Option<GpuMultiPass>,
    name: String,
    is_software: bool,
}

/// The hardware in words; results of one are not continued on another.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Hardware {
    /// The processor's own name.
    pub(super) cpu: String,
    pub(super) cores: usize,
    pub(super) memory_bytes: u64,
    /// `None` if there is none that may be used.
    pub(super) gpu: Option<String>,
    pub(super) gpu_is_software: bool,
    pub(super) system: String,
}

impl Machine {
    /// Opens what the plan needs.
    pub(super) fn open(plan: &BenchPlan) -> anyhow::Result<Self> {
        let wants_software = plan.suites.iter().any(|suite| suite.wants_software_gpu);
        let gpu = match plan.backend {
            Backend::Cpu => Err("--backend cpu leaves the GPU out".to_owned()),
            backend => match open_gpu(plan.budget_bytes, Storage::Buffer, backend == Backend::Gpu || wants_software) {
                Ok(buffers) => Ok(Gpu::new(buffers)),
                // Asked for by name, it has to be there.
                Err(error) if backend == Backend::Gpu => return Err(error.into()),
                Err(error) => Err(error.to_string()),
            },
        };
        let (backend, threads, budget_bytes) = (plan.backend, plan.threads, plan.budget_bytes);
        Ok(Self { backend, threads, budget_bytes, cpu: BTreeMap::new(), gpu })
    }

    /// Why a suite cannot have a variant here, if it cannot.
    pub(super) fn refuses(&self, suite: &Suite, variant: Variant) -> Option<String> {
        if !variant.is_on_gpu() {
            return None;
        }
        match &self.gpu {
            Err(reason) => Some(reason.clone()),
            Ok(gpu) if gpu.is_software && self.backend != Backend::Gpu && !suite.wants_software_gpu => {
                Some(GpuError::OnlySoftware { name: gpu.name.clone() }.to_string())
            }
            Ok(_) => None,
        }
    }

    /// Renders a frame.
    pub(super) fn render(
        &mut self,
        variant: Variant,
        shaded: Option<Shaded>,
        scene: &Scene,
        view: &View,
    ) -> Result<Timed, Error> {
        if let (Some(passes), Some(shaded)) = (variant.passes, shaded) {
            return self.run_passes(passes, shaded, scene, view);
        }
        if variant.is_on_gpu() {
            return Ok(self.gpu_for(variant)?.render(scene, view, Resolve::Blend, variant.technique)?.stats.into());
        }
        let threads = variant.threads.unwrap_or(self.threads);
        let fresh = || (Renderer::new().threads(threads), Canvas::new());
        let (cpu, canvas) = self.cpu.entry(threads).or_insert_with(fresh);
        Ok(cpu.render_into(scene, view, Resolve::Blend, canvas)?.into())
    }

    /// Pixels at which a depth filter leaves the finished picture other than one of fragments that are all sorted; `None`
    /// without a depth filter.
    pub(super) fn wrong_pixels(&mut self, variant: Variant, scene: &Scene, view: &View) -> Result<Option<u64>, Error> {
        if variant.technique != Technique::Lucid {
            return Ok(None);
        }
        let sorted = Variant::presorted(Technique::Lucid);
        let expected = self.gpu_for(sorted)?.render(scene, view, Resolve::Blend, sorted.technique)?.image;
        let image = self.gpu_for(variant)?.render(scene, view, Resolve::Blend, variant.technique)?.image;
        let differing = image.pixels().iter().zip(expected.pixels()).filter(|(a, b)| a != b).count();
        Ok(Some(differing as u64))
    }

    /// A frame by a shader of several passes, without reading it back.
    fn run_passes(&mut self, passes: Passes, shaded: Shaded, scene: &Scene, view: &View) -> Result<Timed, Error> {
        let through = match passes.is_through_fbuffer {
            true => Through::FBuffer(Size::square(shaded.side)?),
            false => Through::Framebuffer,
        };
        let (picture, device) = if passes.is_on_gpu {
            let Ok(gpu) = &mut self.gpu else { return Err(GpuError::NoAdapter.into()) };
            let renderer = match gpu.passes.take() {
                Some(renderer) => renderer,
                None => GpuMultiPass::new(Context::new(&options(true))?),
            };
            let renderer = gpu.passes.insert(renderer);
            let picture = renderer.render(scene, view, shaded.shader, through)?;
            (picture, renderer.context().name().to_owned())
        } else {
            // Its passes run one after the other, on one core.
            (multi_pass::render(scene, view, shaded.shader, through)?, "CPU, 1 thread".to_owned())
        };
        let triangles = scene.instances().iter().map(|instance| scene.mesh(instance.mesh).triangles().len() as u64);
        let stats = Stats {
            triangles: triangles.sum(),
            fragments: picture.drawn.fragments,
            total_ms: picture.total_ms(),
            peak_bytes: picture.bytes,
            slot_windows: picture.drawn.windows,
            steps: picture.steps,
            ..Stats::new(Technique::FBuffer, device, view.width, view.height)
        };
        Ok(Timed { stats, drawn: Some(picture.drawn), is_exact: passes.is_through_fbuffer })
    }

    /// Gives back what renderers hold on to from frame to frame. A device that failed is opened anew.
    pub(super) fn forget(&mut self, gpu_too: bool) {
        self.cpu.clear();
        if let Ok(gpu) = &mut self.gpu
            && gpu_too
        {
            (gpu.buffers, gpu.textures, gpu.passes) = (None, None, None);
        }
    }

    pub(super) fn hardware(&self) -> Hardware {
        let system = System::new_with_specifics(
            RefreshKind::nothing()
                .with_cpu(CpuRefreshKind::nothing())
                .with_memory(sysinfo::MemoryRefreshKind::nothing().with_ram()),
        );
        let gpu = self.gpu.as_ref().ok();
        Hardware {
            cpu: system.cpus().first().map_or("unknown", |cpu| cpu.brand().trim()).to_owned(),
            cores: cores(),
            memory_bytes: system.total_memory(),
            gpu: gpu.map(|gpu| gpu.name.clone()),
            gpu_is_software: gpu.is_some_and(|gpu| gpu.is_software),
            system: System::long_os_version().unwrap_or_else(|| std::env::consts::OS.to_owned()),
        }
    }

    fn gpu_for(&mut self, variant: Variant) -> Result<&GpuRenderer, Error> {
        let budget_bytes = self.budget_bytes;
        let Ok(gpu) = &mut self.gpu else { return Err(GpuError::NoAdapter.into()) };
        let kept = match variant.storage {
            Storage::Buffer => &mut gpu.buffers,
            Storage::Texture => &mut gpu.textures,
        };
        let renderer = match kept.take() {
            Some(renderer) => renderer,
            None => open_gpu(budget_bytes, variant.storage, true)?,
        };
        let renderer = renderer.max_layers(variant.max_layers).presort(variant.presort);
        Ok(kept.insert(renderer.depth_filter(variant.depth_filter())))
    }
}

impl Hardware {
    /// Whether times are comparable; a system may have been updated.
    pub(super) fn is_same_device(&self, other: &Self) -> bool {
        (&self.cpu, self.cores, &self.gpu) == (&other.cpu, other.cores, &other.gpu)
    }

    /// `AMD EPYC 9B45, 2 cores, 24.0 GiB; llvmpipe (software GPU); Debian 12`.
    pub(super) fn in_words(&self) -> String {
        let gpu = match &self.gpu {
            Some(gpu) if self.gpu_is_software => format!("{gpu}, a software GPU"),
            Some(gpu) => gpu.clone(),
            None => "no GPU".to_owned(),
        };
        let (cores, ram) = (plural(self.cores as u64, "core"), memory(self.memory_bytes));
        format!("{}, {cores}, {ram}; {gpu}; {}", self.cpu, self.system)
    }
}

impl Gpu {
    fn new(buffers: GpuRenderer) -> Self {
        let (name, is_software) = (buffers.context().name().to_owned(), buffers.context().is_software());
        Self { buffers: Some(buffers), textures: None, passes: None, name, is_software }
    }
}

/// How many threads can run at once.
pub(super) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn open_gpu(budget_bytes: Option<u64>, storage: Storage, allow_software: bool) -> Result<GpuRenderer, GpuError> {
    let gpu = GpuRenderer::new(&options(allow_software))?.storage(storage);
    Ok(match budget_bytes {
        Some(budget_bytes) => gpu.budget_bytes(budget_bytes),
        None => gpu,
    })
}

fn options(allow_software: bool) -> ContextOptions {
    ContextOptions { allow_software, ..ContextOptions::default() }
}
