//! Peeling into attachments: two depth buffers alternate, one read in the shader, one written by the fixed-function test.
//! Twin: `shaders/technique/peel.wesl`.
//!
//! As in the article, the draws are recorded once and replayed for every layer, of this frame and of later ones. Its
//! secondary command buffers are bound to a subpass, so that it records one for each layer; a render bundle is only
//! bound to formats and bind groups, so three do: the first layer, layers that read the one half of the attachments and
//! layers that read the other.

use pellucid_core::primitive::Pass;
use wgpu::{BindGroupLayout, ShaderStages, TextureFormat, TextureUsages, TextureView};

use super::super::Layouts;
use crate::frame::Frame;
use crate::memory::Window;
use crate::surface::{Structure, SurfacePass, SurfacePipelines, depth_state};
use crate::{Context, GpuError, shaders};

const COLOR_FORMAT: TextureFormat = TextureFormat::Rg32Uint;
const PRIMITIVE_FORMAT: TextureFormat = TextureFormat::R32Uint;
const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

const COLOR: &str = "peeled colour";
const PRIMITIVES: [&str; 2] = ["peeled primitives", "other peeled primitives"];
const DEPTHS: [&str; 2] = ["peeled depths", "other peeled depths"];

/// Long-lived half.
#[derive(Debug)]
pub(super) struct Attached {
    layout: BindGroupLayout,
    first: SurfacePipelines,
    next: SurfacePipelines,
    recorded: Option<Recorded>,
}

/// What was recorded, and for what.
#[derive(Debug)]
struct Recorded {
    structure: Structure,
    attachments: Attachments,
    first: wgpu::RenderBundle,
    /// For layers that are written to this half of the attachments.
    next: [wgpu::RenderBundle; 2],
}

/// Textures of the picture's size: the hardware rasterizes to the same bits only in the same place of its target, so that
/// smaller ones would make the picture depend on the budget.
#[derive(Debug, Clone, PartialEq)]
struct Attachments {
    color: wgpu::Texture,
    primitives: [wgpu::Texture; 2],
    depths: [wgpu::Texture; 2],
}

/// One layer, as it was peeled.
pub(super) struct LayerViews {
    pub(super) color: TextureView,
    pub(super) primitive: TextureView,
    pub(super) depth: TextureView,
}

/// The textures with their bytes.
pub(super) fn needs(pixels: u64) -> Vec<(&'static str, u64)> {
    let of_words = |names: [&'static str; 2]| names.map(|name| (name, pixels * 4));
    [[(COLOR, pixels * 8)].as_slice(), &of_words(PRIMITIVES), &of_words(DEPTHS)].concat()
}

impl Attachments {
    fn new(frame: &mut Frame<'_>) -> Result<Self, GpuError> {
        let (gpu, size) = (frame.gpu, frame.targets.picture.size());
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
        let mut texture = |name, format, usage| {
            let descriptor = wgpu::TextureDescriptor {
                label: None,
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            };
            frame.memory.texture(gpu, name, &descriptor)
        };
        let depth_usage = usage | TextureUsages::COPY_DST;
        Ok(Self {
            color: texture(COLOR, COLOR_FORMAT, usage)?,
            primitives: [
                texture(PRIMITIVES[0], PRIMITIVE_FORMAT, usage)?,
                texture(PRIMITIVES[1], PRIMITIVE_FORMAT, usage)?,
            ],
            depths: [texture(DEPTHS[0], DEPTH_FORMAT, depth_usage)?, texture(DEPTHS[1], DEPTH_FORMAT, depth_usage)?],
        })
    }

    /// The half that a layer, counted from 0, is written to.
    fn views(&self, layer: u32) -> LayerViews {
        let half = (layer % 2) as usize;
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        LayerViews {
            color: view(&self.color),
            primitive: view(&self.primitives[half]),
            depth: view(&self.depths[half]),
        }
    }
}

impl Attached {
    pub(super) fn new(gpu: &Context, layouts: Layouts<'_>) -> Self {
        let texture = |binding, sample_type| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("the layer before"),
            entries: &[texture(0, wgpu::TextureSampleType::Depth), texture(1, wgpu::TextureSampleType::Uint)],
        });
        let targets = [COLOR_FORMAT, PRIMITIVE_FORMAT].map(|format| Some(format.into()));
        let pipelines = |plain, varied, own_layout| {
            let pass = SurfacePass {
                label: "peel",
                wgsl: shaders::PEEL,
                plain,
                varied,
                ignores_color: false,
                targets: &targets,
                depth_stencil: depth_state(true, true),
                own_layout,
            };
            SurfacePipelines::new(gpu, layouts.surfaces, &pass)
        };
        Self {
            first: pipelines("first", "first_varied", None),
            next: pipelines("next", "next_varied", Some(&layout)),
            layout,
            recorded: None,
        }
    }

    /// Makes sure that there are attachments and that what is recorded fits scene, view and attachments. Tells whether it
    /// had to be recorded anew.
    pub(super) fn prepare(&mut self, frame: &mut Frame<'_>) -> Result<bool, GpuError> {
        let attachments = Attachments::new(frame)?;
        let structure = frame.surfaces.structure();
        let is_same = |recorded: &Recorded| recorded.structure == structure && recorded.attachments == attachments;
        if self.recorded.as_ref().is_some_and(is_same) {
            return Ok(false);
        }
        // Lets go of the old scene first.
        self.recorded = None;
        let first = record(frame, &mut self.first, None);
        let groups = [1, 0].map(|half| {
            let last = attachments.views(half);
            frame.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("the layer before"),
                layout: &self.layout,
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&last.depth) },
                    wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&last.primitive) },
                ],
            })
        });
        let next = groups.map(|group| record(frame, &mut self.next, Some(&group)));
        self.recorded = Some(Recorded { structure, attachments, first, next });
        Ok(true)
    }

    /// Where a layer is once it has been peeled.
    pub(super) fn views(&self, layer: u32) -> LayerViews {
        self.recorded().attachments.views(layer)
    }

    /// Peels a layer, counted from 0, after those before it.
    pub(super) fn peel(&self, frame: &mut Frame<'_>, window: Window, layer: u32) -> Result<(), GpuError> {
        let recorded = self.recorded();
        let views = recorded.attachments.views(layer);
        let color = |view| {
            let ops =
                wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
            Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
        };
        let load = if frame.surfaces.has_opaque {
            let targets = frame.targets;
            let depth = &recorded.attachments.depths[(layer % 2) as usize];
            frame.encoder().copy_texture_to_texture(
                targets.opaque_depth.as_image_copy(),
                depth.as_image_copy(),
                depth.size(),
            );
            wgpu::LoadOp::Load
        } else {
            wgpu::LoadOp::Clear(0.0)
        };
        let depth_ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
        let colors = [color(&views.color), color(&views.primitive)];
        let mut pass = frame.render_pass_into("peel", window, &colors, (&views.depth, Some(depth_ops)))?;
        let bundle = if layer == 0 { &recorded.first } else { &recorded.next[(layer % 2) as usize] };
        pass.execute_bundles([bundle]);
        Ok(())
    }

    fn recorded(&self) -> &Recorded {
        self.recorded.as_ref().expect("layers are peeled after `prepare`")
    }
}

fn record(frame: &Frame<'_>, pipelines: &mut SurfacePipelines, group: Option<&wgpu::BindGroup>) -> wgpu::RenderBundle {
    let mut encoder = frame.gpu.device.create_render_bundle_encoder(&wgpu::RenderBundleEncoderDescriptor {
        label: Some("peel"),
        color_formats: &[Some(COLOR_FORMAT), Some(PRIMITIVE_FORMAT)],
        depth_stencil: Some(wgpu::RenderBundleDepthStencil {
            format: DEPTH_FORMAT,
            depth_read_only: false,
            stencil_read_only: false,
        }),
        sample_count: 1,
        multiview: None,
    });
    if let Some(group) = group {
        encoder.set_bind_group(3, group, &[]);
    }
    frame.surfaces.draw(frame.gpu, &mut encoder, Pass::Transparent, pipelines);
    encoder.finish(&wgpu::RenderBundleDescriptor { label: Some("peel") })
}
