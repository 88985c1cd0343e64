//! With what a picture is rendered.

use pellucid::gpu::{DepthFilter, Storage};
use pellucid::{Renderer, Technique};

use super::multi_pass::side;
use super::{optional, usage};
use crate::args::{CaptureArgs, StorageArg};
use crate::devices::{DevicePlan, GpuOptions};
use crate::values;

/// What renders.
#[derive(Debug)]
pub(crate) struct CapturePlan {
    /// The one named; `None` for the best of the backend.
    technique: Option<Technique>,
    device: DevicePlan,
}

/// A renderer, ready.
pub(crate) struct Opened {
    pub(crate) renderer: Renderer,
    /// Whether a GPU would have been taken, had there been one.
    pub(crate) misses_gpu: bool,
}

/// Techniques taken where none is named, the best last.
const BEST: [Technique; 2] = [Technique::Cpu, Technique::Linear];

impl CapturePlan {
    /// `is_multi_pass`: an F-Buffer's size is that of a shader of several passes.
    pub(super) fn new(args: &CaptureArgs, is_multi_pass: bool) -> anyhow::Result<Self> {
        let technique = args.technique.as_ref().map(|name| name.parse().map_err(|error| usage(format!("{error}"))));
        let technique: Option<Technique> = technique.transpose()?;
        let max_layers = optional("--layers", args.layers.as_ref(), |text| values::whole(text, 1, u32::MAX))?;
        let lists = [Technique::Linear, Technique::List, Technique::ABuffer, Technique::Pages];
        only_for("--layers", max_layers.is_some(), technique, &[Technique::Peel])?;
        only_for("--storage", args.storage.is_some(), technique, &[Technique::ABuffer])?;
        let fbuffer_size = optional("--fbuffer", args.fbuffer.as_ref(), side)?;
        only_for("--fbuffer", fbuffer_size.is_some() && !is_multi_pass, technique, &[Technique::FBuffer])?;
        let filter_sizes = |text: &str| values::whole(text, 1, DepthFilter::GREATEST_SIZE);
        let filter_size = optional("--filter-size", args.filter_size.as_ref(), filter_sizes)?;
        let threshold = optional("--alpha-threshold", args.alpha_threshold.as_ref(), values::share)?;
        only_for("--filter-size", filter_size.is_some(), technique, &[Technique::Lucid])?;
        only_for("--alpha-threshold", threshold.is_some(), technique, &[Technique::Lucid])?;
        let usual = DepthFilter::default();
        let depth_filter =
            DepthFilter { size: filter_size.unwrap_or(usual.size), threshold: threshold.unwrap_or(usual.threshold) };
        only_for("--presort", args.presort, technique, &lists)?;
        let storage = match args.storage {
            None | Some(StorageArg::Buffer) => Storage::Buffer,
            Some(StorageArg::Texture) => Storage::Texture,
        };
        let device = DevicePlan::new(&args.device)?.with(GpuOptions {
            storage,
            max_layers,
            presort: args.presort,
            fbuffer_size,
            depth_filter,
        });
        device.check("--technique", technique.as_slice())?;
        Ok(Self { technique, device })
    }

    /// Opens what is needed.
    pub(crate) fn open(&self) -> anyhow::Result<Opened> {
        let devices = self.device.open(self.technique.as_slice(), |technique| BEST.contains(&technique))?;
        let technique = devices.techniques.last().copied().unwrap_or(Technique::Cpu);
        Ok(Opened { renderer: devices.renderer.technique(technique), misses_gpu: devices.without_gpu.is_some() })
    }
}

/// An option that some techniques alone understand.
fn only_for(name: &str, is_given: bool, technique: Option<Technique>, those: &[Technique]) -> anyhow::Result<()> {
    if is_given && !technique.is_some_and(|technique| those.contains(&technique)) {
        let those: Vec<_> = those.iter().map(|technique| format!("`--technique {technique}`")).collect();
        return Err(usage(format!("{name} goes with {}", those.join(" or "))));
    }
    Ok(())
}
