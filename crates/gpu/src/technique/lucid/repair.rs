//! Pixels that left the depth filter out of order. Twins: `shaders/technique/lucid/{repair,sweep}.wesl`.

use std::collections::HashMap;

use wgpu::{BindGroupLayout, ComputePipeline, ShaderModule};

use super::work::{Dispatch, VARIES};
use super::{OwnLayouts, Stage, buffer_group, buffers_layout};
use crate::frame::Frame;
use crate::pass::ordered::{compute_pipeline, resolve_code};
use crate::surface::shader;
use crate::{Context, GpuError, shaders};

/// Long-lived half.
#[derive(Debug)]
pub(super) struct Repair {
    buffers: BindGroupLayout,
    module: ShaderModule,
    /// By resolve, and whether colours vary.
    pipelines: HashMap<(u32, bool), ComputePipeline>,
}

impl Repair {
    pub(super) fn new(gpu: &Context) -> Self {
        Self {
            buffers: buffers_layout(gpu, &[(0, false), (1, true), (2, true), (5, true)]),
            module: shader(gpu, "repair", shaders::LUCID_REPAIR),
            pipelines: HashMap::new(),
        }
    }

    pub(super) fn record(
        &mut self,
        frame: &mut Frame<'_>,
        stage: &Stage<'_>,
        layouts: &OwnLayouts,
    ) -> Result<(), GpuError> {
        let (gpu, buffers) = (frame.gpu, stage.buffers);
        let bindings = [(0, &buffers.work), (1, &buffers.records), (2, &buffers.parts), (5, &buffers.lists)];
        let group = buffer_group(gpu, &self.buffers, &bindings);
        let code = resolve_code(frame.resolve);
        let pipeline = self.pipelines.entry((code, stage.varies)).or_insert_with(|| {
            let layouts = [Some(&layouts.picture), Some(&layouts.scene), None, Some(&self.buffers)];
            let constants = [("resolve", f64::from(code)), (VARIES, f64::from(u8::from(stage.varies)))];
            compute_pipeline(gpu, "repair", &self.module, "main", &layouts, &constants)
        });
        let mut pass = frame.compute_pass("repair")?;
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &stage.picture, &[]);
        pass.set_bind_group(1, &stage.scene, &[]);
        pass.set_bind_group(3, &group, &[]);
        pass.dispatch_workgroups_indirect(&buffers.dispatches, Dispatch::Repair.offset());
        Ok(())
    }
}
