//! Plain blending in draw order: wrong on purpose wherever that is not back to front; the yardstick that all sources
//! compare with. Twin: `shaders/technique/alpha.wesl`.
//!
//! Layers are blended over each other by the hardware into a texture of halves, and the whole over what is behind.

use pellucid_core::Resolve;
use pellucid_core::primitive::Pass;
use wgpu::{BindGroupLayout, RenderPipeline, ShaderStages};

use super::{Capture, Layouts, Outcome};
use crate::frame::{Frame, Goal};
use crate::memory::Window;
use crate::pass::whole_window::WholeWindow;
use crate::surface::{SurfacePass, SurfacePipelines, depth_state};
use crate::{Context, GpuError, shaders};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct Alpha {
    blend: SurfacePipelines,
    layout: BindGroupLayout,
    compose: WholeWindow,
    compose_pipeline: RenderPipeline,
    blended: Option<wgpu::Texture>,
}

impl Alpha {
    pub(crate) fn new(gpu: &Context, layouts: Layouts<'_>) -> Self {
        let target = wgpu::ColorTargetState {
            format: FORMAT,
            blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            write_mask: wgpu::ColorWrites::ALL,
        };
        let blend = SurfacePipelines::new(
            gpu,
            layouts.surfaces,
            &SurfacePass {
                label: "blend",
                wgsl: shaders::ALPHA,
                plain: "plain",
                varied: "varied",
                ignores_color: false,
                targets: &[Some(target)],
                depth_stencil: depth_state(false, true),
                own_layout: None,
            },
        );
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("alpha"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: ShaderStages::FRAGMENT,
                ty: wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: false },
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
                count: None,
            }],
        });
        let compose = WholeWindow::new(gpu, "compose", shaders::COMPOSE, Some(&layout));
        let compose_pipeline = compose.pipeline(gpu, &[]);
        Self { blend, layout, compose, compose_pipeline, blended: None }
    }

    /// The texture that layers are blended into: kept while the picture's size stays the same.
    fn target(&mut self, frame: &Frame<'_>) -> Result<wgpu::Texture, GpuError> {
        let size = frame.targets.picture.size();
        if let Some(texture) = self.blended.as_ref().filter(|texture| texture.size() == size) {
            return Ok(texture.clone());
        }
        let texture = frame.gpu.texture(&wgpu::TextureDescriptor {
            label: Some("blended layers"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        })?;
        Ok(self.blended.insert(texture).clone())
    }
}

impl Capture for Alpha {
    fn window(&mut self, frame: &mut Frame<'_>, window: Window) -> Result<Outcome, GpuError> {
        if frame.resolve != Resolve::Blend || matches!(frame.goal, Goal::Layers(_)) {
            return Err(GpuError::Unordered { technique: pellucid_core::Technique::Alpha, resolve: frame.resolve });
        }
        let gpu = frame.gpu;
        let view = self.target(frame)?.create_view(&Default::default());
        let color = wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
        };
        let mut pass = frame.render_pass("blend", window, Some(color), None)?;
        frame.surfaces.draw(gpu, &mut pass, Pass::Transparent, &mut self.blend);
        drop(pass);
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("alpha"),
            layout: &self.layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) }],
        });
        self.compose.record(frame, window, &self.compose_pipeline, Some(&group))?;
        Ok(Outcome::Done)
    }
}
