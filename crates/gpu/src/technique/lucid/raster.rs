//! Sorting, shading and blending of blocks. Twins: `shaders/technique/lucid/{raster,sort,filter,shade}.wesl`.

use std::collections::HashMap;

use wgpu::{BindGroupLayout, ComputePipeline, ShaderModule};

use super::work::{Dispatch, FILTER_SIZE, VARIES};
use super::{DepthFilter, OwnLayouts, Stage, buffer_group, buffers_layout};
use crate::frame::Frame;
use crate::pass::ordered::{compute_pipeline, resolve_code};
use crate::surface::shader;
use crate::{Context, GpuError, shaders};

/// What a pipeline is made for: resolve, whether colours vary, size of the filter, bits of the threshold.
type Key = (&'static str, u32, bool, u32, u32);

/// Long-lived half.
#[derive(Debug)]
pub(super) struct Raster {
    buffers: BindGroupLayout,
    module: ShaderModule,
    pipelines: HashMap<Key, ComputePipeline>,
    sort_buffers: BindGroupLayout,
    sort: ComputePipeline,
}

impl Raster {
    pub(super) fn new(gpu: &Context, layouts: &OwnLayouts) -> Self {
        let sort_buffers = buffers_layout(gpu, &[0, 2, 3, 5].map(|binding| (binding, false)));
        let sort_module = shader(gpu, "sort", shaders::LUCID_SORT);
        let sort_layouts = [Some(&layouts.picture), None, None, Some(&sort_buffers)];
        Self {
            buffers: buffers_layout(gpu, &[(0, false), (1, true), (2, true), (5, true)]),
            module: shader(gpu, "raster", shaders::LUCID_RASTER),
            pipelines: HashMap::new(),
            sort: compute_pipeline(gpu, "sort", &sort_module, "main", &sort_layouts, &[]),
            sort_buffers,
        }
    }

    /// Blocks with few parts, then those with many, which are sorted before.
    pub(super) fn record(
        &mut self,
        frame: &mut Frame<'_>,
        stage: &Stage<'_>,
        layouts: &OwnLayouts,
    ) -> Result<(), GpuError> {
        let (gpu, buffers) = (frame.gpu, stage.buffers);
        let bindings = [(0, &buffers.work), (2, &buffers.parts), (3, &buffers.places), (5, &buffers.lists)];
        let group = buffer_group(gpu, &self.sort_buffers, &bindings);
        let mut pass = frame.compute_pass("sort")?;
        pass.set_pipeline(&self.sort);
        pass.set_bind_group(0, &stage.picture, &[]);
        pass.set_bind_group(3, &group, &[]);
        pass.dispatch_workgroups_indirect(&buffers.dispatches, Dispatch::High.offset());
        drop(pass);

        let bindings = [(0, &buffers.work), (1, &buffers.records), (2, &buffers.parts), (5, &buffers.lists)];
        let group = buffer_group(gpu, &self.buffers, &bindings);
        let DepthFilter { size, threshold } = frame.depth_filter;
        let size = size.clamp(1, DepthFilter::GREATEST_SIZE);
        let code = resolve_code(frame.resolve);
        for (step, entry, dispatch) in [("raster low", "low", Dispatch::Low), ("raster high", "high", Dispatch::High)] {
            let key = (entry, code, stage.varies, size, threshold.to_bits());
            let pipeline = self.pipelines.entry(key).or_insert_with(|| {
                let layouts = [Some(&layouts.picture), Some(&layouts.scene), None, Some(&self.buffers)];
                let constants = [
                    ("resolve", f64::from(code)),
                    (VARIES, f64::from(u8::from(stage.varies))),
                    (FILTER_SIZE, f64::from(size)),
                    ("threshold", f64::from(threshold)),
                ];
                compute_pipeline(gpu, step, &self.module, entry, &layouts, &constants)
            });
            let mut pass = frame.compute_pass(step)?;
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &stage.picture, &[]);
            pass.set_bind_group(1, &stage.scene, &[]);
            pass.set_bind_group(3, &group, &[]);
            pass.dispatch_workgroups_indirect(&buffers.dispatches, dispatch.offset());
        }
        Ok(())
    }
}
