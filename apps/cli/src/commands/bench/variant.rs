//! A technique with its settings: what is compared at a point.

use pellucid::Technique;
use pellucid::gpu::{DepthFilter, Storage};

/// A technique with its settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Variant {
    pub(super) technique: Technique,
    /// In place of a technique, the shader of several passes that a point has.
    pub(super) passes: Option<Passes>,
    /// Of the CPU renderer; `None`: as many as the plan says.
    pub(super) threads: Option<usize>,
    /// Of the A-buffer.
    pub(super) storage: Storage,
    /// After which peeling stops.
    pub(super) max_layers: Option<u32>,
    /// Whether fragments are sorted in a step of their own, rather than where they are read.
    pub(super) presort: bool,
    /// Of `lucid`: fragments that its depth filter holds; `None`: as many as usual.
    pub(super) filter_size: Option<u32>,
    /// Of `lucid`: whether it leaves pixels through which next to no light gets.
    pub(super) leaves_early: bool,
}

/// Share of light below which the paper leaves a pixel.
const THRESHOLD: f32 = 1.0 / 128.0;

/// How a shader of several passes is run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Passes {
    /// Whether intermediate results are kept for each fragment, rather than for each pixel.
    pub(super) is_through_fbuffer: bool,
    pub(super) is_on_gpu: bool,
}

impl Passes {
    pub(super) fn backend(self) -> &'static str {
        if self.is_on_gpu { "gpu" } else { "cpu" }
    }

    /// Where intermediate results are kept, as `--through` has it.
    pub(super) fn through(self) -> &'static str {
        if self.is_through_fbuffer { "fbuffer" } else { "framebuffer" }
    }
}

impl Variant {
    /// A technique as it usually is.
    pub(super) fn of(technique: Technique) -> Self {
        Self {
            technique,
            passes: None,
            threads: None,
            storage: Storage::Buffer,
            max_layers: None,
            presort: false,
            filter_size: None,
            leaves_early: false,
        }
    }

    pub(super) fn threads(threads: usize) -> Self {
        Self { threads: Some(threads), ..Self::of(Technique::Cpu) }
    }

    pub(super) fn in_textures() -> Self {
        Self { storage: Storage::Texture, ..Self::of(Technique::ABuffer) }
    }

    /// Peeling that stops after so many layers, exact or not.
    pub(super) fn layers(max_layers: u32) -> Self {
        Self { max_layers: Some(max_layers), ..Self::of(Technique::Peel) }
    }

    /// An LFB that is sorted in a step of its own.
    pub(super) fn presorted(technique: Technique) -> Self {
        Self { presort: true, ..Self::of(technique) }
    }

    /// LucidRaster with another depth filter.
    pub(super) fn filter(size: u32) -> Self {
        Self { filter_size: Some(size), ..Self::of(Technique::Lucid) }
    }

    /// LucidRaster, not exact: pixels are left when little is seen of what lies behind.
    pub(super) fn leaving_early() -> Self {
        Self { leaves_early: true, ..Self::of(Technique::Lucid) }
    }

    /// How `lucid` blends.
    pub(super) fn depth_filter(self) -> DepthFilter {
        let usual = DepthFilter::default();
        DepthFilter {
            size: self.filter_size.unwrap_or(usual.size),
            threshold: if self.leaves_early { THRESHOLD } else { usual.threshold },
        }
    }

    /// A shader of several passes.
    pub(super) fn passes(passes: Passes) -> Self {
        Self { passes: Some(passes), ..Self::of(Technique::FBuffer) }
    }

    pub(super) fn backend(self) -> &'static str {
        self.passes.map_or(self.technique.backend(), Passes::backend)
    }

    pub(super) fn is_on_gpu(self) -> bool {
        self.backend() == "gpu"
    }

    /// As in tables: `peel (4 layers)`.
    pub(super) fn name(self) -> String {
        let name = self.technique.name();
        match self {
            Self { passes: Some(passes), .. } => format!("{} {}", passes.backend(), passes.through()),
            Self { max_layers: Some(layers), .. } => format!("{name} ({layers} layers)"),
            Self { threads: Some(1), .. } => format!("{name} (1 thread)"),
            Self { threads: Some(threads), .. } => format!("{name} ({threads} threads)"),
            Self { filter_size: Some(size), .. } => format!("{name} (filter {size})"),
            Self { leaves_early: true, .. } => format!("{name} (threshold)"),
            Self { presort: true, .. } => format!("{name} (presort)"),
            Self { storage: Storage::Texture, .. } => format!("{name} (textures)"),
            _ => name.to_owned(),
        }
    }
}
