//! Puts each peeled layer under those before it. Twin: `shaders/technique/peel_under.wesl`.
//!
//! The article blends with fixed-function under-blending. Here it is compute: sums are kept in full floats, which not
//! every device can blend, and resolves that look at pairs of layers keep more than a colour between passes.

use std::collections::HashMap;

use pellucid_core::Resolve;
use wgpu::{BindGroup, BindGroupLayout, BindingResource, ComputePipeline, ShaderStages, TextureView};

use super::attached::LayerViews;
use super::windowed::PEELED_WORDS;
use crate::frame::Frame;
use crate::memory::Window;
use crate::pass::ordered::{compute_pipeline, dispatch_window, resolve_code};
use crate::readback::read_buffer;
use crate::surface::{shader, storage_entry};
use crate::{Context, GpuError, shaders};

const PEELED: &str = "the peeled layer";
const BLENDED: &str = "layers so far";
const COUNTS: &str = "numbers of layers";
const ENTRIES: &str = "entries";
const PROGRESS: &str = "progress";
const PROGRESS_BYTES: u64 = 8;

/// Long-lived half.
#[derive(Debug)]
pub(super) struct Under {
    layouts: [BindGroupLayout; 2],
    module: wgpu::ShaderModule,
    pipelines: HashMap<(&'static str, Variant), ComputePipeline>,
    /// Stand in for attachments where there are none.
    no_words: TextureView,
    no_depth: TextureView,
}

/// Constants of the shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Variant {
    /// What layers become.
    pub(super) resolve: Resolve,
    /// Whether this is the first layer.
    pub(super) is_first: bool,
    /// Whether layers are in the buffer rather than in attachments.
    pub(super) is_windowed: bool,
    /// Whether layers are handed out.
    pub(super) is_wanted: bool,
}

/// State of a window between passes.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub(super) peeled: wgpu::Buffer,
    blended: wgpu::Buffer,
    counts: wgpu::Buffer,
    pub(super) entries: wgpu::Buffer,
    pub(super) progress: wgpu::Buffer,
}

/// How far a window is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Progress {
    /// Most layers at a pixel so far.
    pub(super) layers: u32,
    /// Pixels with a layer too many.
    pub(super) cut_pixels: u32,
}

impl Variant {
    fn keeps_entries(self) -> bool {
        self.is_wanted || matches!(self.resolve, Resolve::Gelly | Resolve::BlendCorrected)
    }

    /// All buffers of a window with so many pixels.
    pub(super) fn needs(self, pixels: u64) -> Vec<(&'static str, u64)> {
        let if_so = |condition, bytes| if condition { bytes } else { 0 };
        vec![
            (PEELED, if_so(self.is_windowed, pixels * PEELED_WORDS * 4)),
            (BLENDED, pixels * 16),
            (COUNTS, pixels * 4),
            (ENTRIES, if_so(self.keeps_entries(), pixels * 16)),
            (PROGRESS, PROGRESS_BYTES),
        ]
    }

    /// They themselves.
    pub(super) fn state(self, frame: &mut Frame<'_>, pixels: u64) -> Result<State, GpuError> {
        let buffers: Vec<_> = self
            .needs(pixels)
            .into_iter()
            .map(|(name, bytes)| frame.memory.buffer(frame.gpu, name, bytes))
            .collect::<Result<_, _>>()?;
        let Ok([peeled, blended, counts, entries, progress]) = <[wgpu::Buffer; 5]>::try_from(buffers) else {
            unreachable!("as many as are needed")
        };
        Ok(State { peeled, blended, counts, entries, progress })
    }
}

impl State {
    /// Waits for everything recorded so far.
    pub(super) fn progress(&self, frame: &mut Frame<'_>) -> Result<Progress, GpuError> {
        let words: Vec<u32> = read_buffer(frame, &self.progress, 0, 2)?;
        Ok(Progress { layers: words[0], cut_pixels: words[1] })
    }
}

impl Under {
    pub(super) fn new(gpu: &Context, picture: &BindGroupLayout) -> Self {
        let texture = |binding, sample_type| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Texture {
                sample_type,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let storage = |binding| storage_entry(binding, ShaderStages::COMPUTE, false);
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("under"),
            entries: &[
                texture(0, wgpu::TextureSampleType::Uint),
                texture(1, wgpu::TextureSampleType::Uint),
                texture(2, wgpu::TextureSampleType::Depth),
                storage(3),
                storage(4),
                storage(5),
                storage(6),
                storage(7),
            ],
        });
        let none = |format| {
            let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("none"),
                size: wgpu::Extent3d::default(),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        Self {
            layouts: [picture.clone(), layout],
            module: shader(gpu, "under", shaders::PEEL_UNDER),
            pipelines: HashMap::new(),
            no_words: none(wgpu::TextureFormat::R32Uint),
            no_depth: none(wgpu::TextureFormat::Depth32Float),
        }
    }

    pub(super) fn bind_group(&self, gpu: &Context, state: &State, layer: Option<&LayerViews>) -> BindGroup {
        let textures = match layer {
            Some(layer) => [&layer.color, &layer.primitive, &layer.depth],
            None => [&self.no_words, &self.no_words, &self.no_depth],
        };
        let buffers = [&state.peeled, &state.blended, &state.counts, &state.entries, &state.progress];
        let resources = (textures.into_iter().map(BindingResource::TextureView))
            .chain(buffers.into_iter().map(|buffer| buffer.as_entire_binding()));
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("under"),
            layout: &self.layouts[1],
            entries: &entries,
        })
    }

    /// Records an entry point of the shader over a window.
    pub(super) fn record(
        &mut self,
        frame: &mut Frame<'_>,
        window: Window,
        (step, entry): (&'static str, &'static str),
        variant: Variant,
        group: &BindGroup,
    ) -> Result<(), GpuError> {
        let flag = f64::from;
        let pipeline = self.pipelines.entry((entry, variant)).or_insert_with(|| {
            let [picture, own] = &self.layouts;
            let constants = [
                ("resolve", f64::from(resolve_code(variant.resolve))),
                ("is_first", flag(u8::from(variant.is_first))),
                ("is_windowed", flag(u8::from(variant.is_windowed))),
                ("is_wanted", flag(u8::from(variant.is_wanted))),
            ];
            let layouts = [Some(picture), None, None, Some(own)];
            compute_pipeline(frame.gpu, step, &self.module, entry, &layouts, &constants)
        });
        let mut pass = frame.compute_pass(step)?;
        pass.set_pipeline(pipeline);
        dispatch_window(&mut pass, frame, window, group);
        Ok(())
    }
}
