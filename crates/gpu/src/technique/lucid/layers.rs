//! The ordered layers of a window. Twin: `shaders/technique/lucid/layers.wesl`.

use std::collections::HashMap;

use pellucid_core::Layers;
use wgpu::{BindGroupLayout, BufferUsages, ComputePipeline, ShaderModule};

use super::work::VARIES;
use super::{OwnLayouts, Stage, buffer_group, buffers_layout};
use crate::frame::{Frame, Goal};
use crate::memory::Window;
use crate::pass::gather::{opaque_surfaces, unpack};
use crate::pass::ordered::compute_pipeline;
use crate::pass::picture::GROUP_PX;
use crate::readback::read_buffer;
use crate::surface::shader;
use crate::{Context, GpuError, shaders};

/// Long-lived half.
#[derive(Debug)]
pub(super) struct GatherLayers {
    buffers: BindGroupLayout,
    module: ShaderModule,
    pipelines: HashMap<(&'static str, bool), ComputePipeline>,
}

impl GatherLayers {
    pub(super) fn new(gpu: &Context) -> Self {
        Self {
            buffers: buffers_layout(gpu, &[(1, true), (2, true), (5, true), (6, false)]),
            module: shader(gpu, "gather", shaders::LUCID_LAYERS),
            pipelines: HashMap::new(),
        }
    }

    /// Adds the ordered layers of a window to the frame's goal.
    pub(super) fn read(
        &mut self,
        frame: &mut Frame<'_>,
        stage: &Stage<'_>,
        layouts: &OwnLayouts,
    ) -> Result<(), GpuError> {
        let (gpu, window) = (frame.gpu, stage.window);
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        let start_groups = window.pixels().div_ceil(4);
        let counted = gpu.buffer("the layers' counts", start_groups * 16, usage)?;
        self.dispatch(frame, stage, layouts, "count", &counted)?;
        let mut ends: Vec<u32> = read_buffer(frame, &counted, 0, window.pixels())?;
        let mut total = 0u64;
        let starts: Vec<u32> = ends
            .iter_mut()
            .map(|count| {
                let start = start_groups + total;
                total += u64::from(*count);
                *count = total as u32;
                start as u32
            })
            .collect();
        let gathered = gpu.buffer("the layers", (start_groups + total) * 16, usage)?;
        gpu.queue.write_buffer(&gathered, 0, bytemuck::cast_slice(&starts));
        self.dispatch(frame, stage, layouts, "gather", &gathered)?;
        let stored: Vec<[u32; 4]> = read_buffer(frame, &gathered, start_groups, total)?;
        let fragments = stored.into_iter().map(unpack).collect();
        let opaque = opaque_surfaces(frame, window)?;
        let Window { left, top, width, height } = window;
        if let Goal::Layers(all) = &mut frame.goal {
            all.push(Layers { left, top, width, height, ends, fragments, opaque });
        }
        Ok(())
    }

    fn dispatch(
        &mut self,
        frame: &mut Frame<'_>,
        stage: &Stage<'_>,
        layouts: &OwnLayouts,
        entry: &'static str,
        layers: &wgpu::Buffer,
    ) -> Result<(), GpuError> {
        let (gpu, buffers) = (frame.gpu, stage.buffers);
        let bindings = [(1, &buffers.records), (2, &buffers.parts), (5, &buffers.lists), (6, layers)];
        let group = buffer_group(gpu, &self.buffers, &bindings);
        let pipeline = self.pipelines.entry((entry, stage.varies)).or_insert_with(|| {
            let layouts = [Some(&layouts.picture), Some(&layouts.scene), None, Some(&self.buffers)];
            let constants = [(VARIES, f64::from(u8::from(stage.varies)))];
            compute_pipeline(gpu, "gather", &self.module, entry, &layouts, &constants)
        });
        let mut pass = frame.compute_pass("gather")?;
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &stage.picture, &[]);
        pass.set_bind_group(1, &stage.scene, &[]);
        pass.set_bind_group(3, &group, &[]);
        pass.dispatch_workgroups(stage.window.width.div_ceil(GROUP_PX), stage.window.height.div_ceil(GROUP_PX), 1);
        Ok(())
    }
}
