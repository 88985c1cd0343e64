//! Where each fragment has its slot: runs of pixels are measured, summed up and placed. Twin:
//! `shaders/fbuffer/raster.wesl`.

use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, ShaderStages};

use super::LANES;
use crate::pass::grid::dispatch;
use crate::pass::ordered::compute_pipeline;
use crate::surface::{shader, storage_entry};
use crate::{Context, shaders};

/// Bytes of a run in the table.
pub(crate) const RUN_BYTES: u64 = 16;

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct Raster {
    /// Geometry, runs, and two more buffers that a pass brings.
    pub(crate) layout: BindGroupLayout,
    count: ComputePipeline,
    place: ComputePipeline,
}

impl Raster {
    pub(crate) fn new(gpu: &Context) -> Self {
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("rasterization"),
            entries: &[0, 1, 2, 3].map(|binding| storage_entry(binding, ShaderStages::COMPUTE, binding == 0)),
        });
        let module = shader(gpu, "rasterization", shaders::FBUFFER_RASTER);
        let layouts = [None, None, None, Some(&layout)];
        let pipeline = |entry| compute_pipeline(gpu, "rasterization", &module, entry, &layouts, &[]);
        Self { count: pipeline("count_runs"), place: pipeline("place_runs"), layout }
    }

    /// The group of passes that find fragments in the table: geometry and runs, and what the pass brings.
    pub(crate) fn group(&self, gpu: &Context, buffers: [&wgpu::Buffer; 4]) -> BindGroup {
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("rasterization"),
            layout: &self.layout,
            entries: &entries,
        })
    }

    /// Measures runs. The group has their lengths and the draws' first slots after geometry and runs.
    pub(crate) fn count(&self, pass: &mut wgpu::ComputePass<'_>, group: &BindGroup, runs: u64) {
        pass.set_pipeline(&self.count);
        pass.set_bind_group(3, group, &[]);
        dispatch(pass, (runs + 1).div_ceil(LANES));
    }

    /// Gives runs and draws their first slots, once the lengths have been summed up.
    pub(crate) fn place(&self, pass: &mut wgpu::ComputePass<'_>, group: &BindGroup, runs: u64, draws: u64) {
        pass.set_pipeline(&self.place);
        pass.set_bind_group(3, group, &[]);
        dispatch(pass, (runs.max(draws) + 1).div_ceil(LANES));
    }
}
