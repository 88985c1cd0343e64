//! Opaque and alpha-tested surfaces through the depth buffer, before anything transparent. Twin:
//! `shaders/pass/opaque.wesl`.

use pellucid_core::primitive::Pass;

use crate::frame::Frame;
use crate::memory::Window;
use crate::surface::{SurfaceLayouts, SurfacePass, SurfacePipelines, depth_state};
use crate::{Context, GpuError, shaders};

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct OpaquePass {
    pipelines: SurfacePipelines,
}

impl OpaquePass {
    pub(crate) fn new(gpu: &Context, layouts: &SurfaceLayouts) -> Self {
        let target = wgpu::ColorTargetState {
            format: wgpu::TextureFormat::Rgba16Float,
            blend: None,
            write_mask: wgpu::ColorWrites::ALL,
        };
        let pipelines = SurfacePipelines::new(
            gpu,
            layouts,
            &SurfacePass {
                label: "opaque",
                wgsl: shaders::OPAQUE,
                plain: "plain",
                varied: "varied",
                ignores_color: false,
                targets: &[Some(target)],
                depth_stencil: depth_state(true, true),
                own_layout: None,
            },
        );
        Self { pipelines }
    }

    /// Draws them, after clearing colour and depth, which is all there is to do for a scene without any; and not even that,
    /// if nothing was drawn since they were cleared last.
    pub(crate) fn record(&mut self, frame: &mut Frame<'_>) -> Result<(), GpuError> {
        let draws_any = frame.surfaces.has_opaque;
        if frame.targets.opaque_is_clear.replace(!draws_any) && !draws_any {
            return Ok(());
        }
        let view = &frame.targets.opaque_color_view;
        let color = wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
        };
        let depth_ops = wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store };
        let window = Window { left: 0, top: 0, width: frame.view.width, height: frame.view.height };
        let mut pass = frame.render_pass("opaque", window, Some(color), Some(depth_ops))?;
        frame.surfaces.draw(frame.gpu, &mut pass, Pass::Opaque, &mut self.pipelines);
        Ok(())
    }
}
