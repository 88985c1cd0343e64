//! Peeling into a buffer, for budgets that do not hold the attachments, which are as large as the picture: three passes a
//! layer instead of one, but in windows as small as they have to be. Twin: `shaders/technique/peel_windowed.wesl`.

use pellucid_core::primitive::Pass;
use wgpu::{BindGroupLayout, ShaderStages};

use super::super::Layouts;
use crate::frame::Frame;
use crate::memory::Window;
use crate::surface::{SurfacePass, SurfacePipelines, depth_state, storage_entry};
use crate::{Context, GpuError, shaders};

/// Words of a pixel in the buffer.
pub(super) const PEELED_WORDS: u64 = 6;

/// Long-lived half.
#[derive(Debug)]
pub(super) struct Windowed {
    layout: BindGroupLayout,
    /// Depth, primitive, colour.
    passes: [SurfacePipelines; 3],
}

impl Windowed {
    pub(super) fn new(gpu: &Context, layouts: Layouts<'_>) -> Self {
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("peel in windows"),
            entries: &[storage_entry(0, ShaderStages::FRAGMENT, false)],
        });
        let entries = [
            ("find_depth", "find_depth_varied"),
            ("find_primitive", "find_primitive_varied"),
            ("take_color", "take_color_varied"),
        ];
        let passes = entries.map(|(plain, varied)| {
            let pass = SurfacePass {
                label: "peel",
                wgsl: shaders::PEEL_WINDOWED,
                plain,
                varied,
                ignores_color: false,
                targets: &[],
                depth_stencil: depth_state(false, false),
                own_layout: Some(&layout),
            };
            SurfacePipelines::new(gpu, layouts.surfaces, &pass)
        });
        Self { layout, passes }
    }

    /// Peels the next layer.
    pub(super) fn peel(
        &mut self,
        frame: &mut Frame<'_>,
        window: Window,
        peeled: &wgpu::Buffer,
    ) -> Result<(), GpuError> {
        let gpu = frame.gpu;
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("peel in windows"),
            layout: &self.layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: peeled.as_entire_binding() }],
        });
        for pipelines in &mut self.passes {
            let mut pass = frame.capture_pass("peel", window)?;
            pass.set_bind_group(3, &group, &[]);
            frame.surfaces.draw(gpu, &mut pass, Pass::Transparent, pipelines);
        }
        Ok(())
    }
}
