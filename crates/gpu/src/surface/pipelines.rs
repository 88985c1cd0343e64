//! The pipelines that draw surfaces: one vertex half, and the fragment half of each technique's passes.

use std::collections::HashMap;

use wgpu::BindGroupLayout;

use super::{SurfaceLayouts, shader};
use crate::Context;
use crate::frame::HAS_OPAQUE;
use crate::upload::corners::Corner;

/// Which faces are left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Cull {
    None,
    Back,
    /// Front faces run clockwise.
    BackMirrored,
}

/// What draws have to have in common to be drawn by one pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct PipelineKey {
    pub(super) cull: Cull,
    pub(super) varied: bool,
    pub(super) is_apart: bool,
    /// Whether fragments may lie behind something opaque.
    pub(super) has_opaque: bool,
}

/// What a pass does with surfaces.
#[derive(Debug, Clone)]
pub(crate) struct SurfacePass<'a> {
    pub(crate) label: &'static str,
    /// The linked shader with the fragment entry points.
    pub(crate) wgsl: &'static str,
    /// Entry point where colour does not vary; takes `Plain`, or `Position` if `ignores_color`.
    pub(crate) plain: &'static str,
    /// Entry point where it does; takes `Varied`.
    pub(crate) varied: &'static str,
    /// Whether only the alpha test needs to know colours.
    pub(crate) ignores_color: bool,
    /// None where it captures: then its shader has to look for what is hidden.
    pub(crate) targets: &'a [Option<wgpu::ColorTargetState>],
    pub(crate) depth_stencil: wgpu::DepthStencilState,
    /// Group 3.
    pub(crate) own_layout: Option<&'a BindGroupLayout>,
}

/// Long-lived: the pipelines of a pass, made as they are needed.
#[derive(Debug)]
pub(crate) struct SurfacePipelines {
    label: &'static str,
    plain: &'static str,
    varied: &'static str,
    pub(super) ignores_color: bool,
    targets: Vec<Option<wgpu::ColorTargetState>>,
    depth_stencil: wgpu::DepthStencilState,
    layout: wgpu::PipelineLayout,
    fragment: wgpu::ShaderModule,
    pub(super) pipelines: HashMap<PipelineKey, wgpu::RenderPipeline>,
}

impl SurfacePipelines {
    pub(crate) fn new(gpu: &Context, layouts: &SurfaceLayouts, pass: &SurfacePass<'_>) -> Self {
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(pass.label),
            bind_group_layouts: &[Some(&layouts.frame), Some(&layouts.scene), Some(&layouts.texture), pass.own_layout],
            immediate_size: 0,
        });
        Self {
            label: pass.label,
            plain: pass.plain,
            varied: pass.varied,
            ignores_color: pass.ignores_color,
            targets: pass.targets.to_vec(),
            depth_stencil: pass.depth_stencil.clone(),
            layout,
            fragment: shader(gpu, pass.label, pass.wgsl),
            pipelines: HashMap::new(),
        }
    }

    /// Whether it only writes to storage, behind no depth test: then the shader looks for what is hidden.
    pub(super) fn captures(&self) -> bool {
        self.targets.is_empty()
    }

    pub(super) fn make(&mut self, gpu: &Context, layouts: &SurfaceLayouts, key: PipelineKey) {
        let captures = self.captures();
        self.pipelines.entry(key).or_insert_with(|| {
            let PipelineKey { cull, varied, is_apart, has_opaque } = key;
            let (vertex_entries, fragment_entry) = match (varied, self.ignores_color) {
                (true, _) => (["varied", "varied_apart"], self.varied),
                (false, true) => (["position", "position_apart"], self.plain),
                (false, false) => (["plain", "plain_apart"], self.plain),
            };
            let looks = [(HAS_OPAQUE, f64::from(u8::from(has_opaque)))];
            let constants = if captures { &looks[..] } else { &[] };
            let corners = [Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Corner>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &Corner::ATTRIBUTES,
            })];
            gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(self.label),
                layout: Some(&self.layout),
                vertex: wgpu::VertexState {
                    module: &layouts.vertex,
                    entry_point: Some(vertex_entries[usize::from(is_apart)]),
                    compilation_options: Default::default(),
                    buffers: if is_apart { &[] } else { &corners },
                },
                primitive: wgpu::PrimitiveState {
                    cull_mode: (cull != Cull::None).then_some(wgpu::Face::Back),
                    front_face: match cull {
                        Cull::BackMirrored => wgpu::FrontFace::Cw,
                        _ => wgpu::FrontFace::Ccw,
                    },
                    ..Default::default()
                },
                depth_stencil: Some(self.depth_stencil.clone()),
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &self.fragment,
                    entry_point: Some(fragment_entry),
                    compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
                    targets: &self.targets,
                }),
                multiview_mask: None,
                cache: None,
            })
        });
    }
}

/// The depth attachment's state: nearer or equal passes, so that of equals the later drawn stays.
pub(crate) fn depth_state(writes: bool, tests: bool) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: wgpu::TextureFormat::Depth32Float,
        depth_write_enabled: Some(writes),
        depth_compare: Some(if tests { wgpu::CompareFunction::GreaterEqual } else { wgpu::CompareFunction::Always }),
        stencil: Default::default(),
        bias: Default::default(),
    }
}
