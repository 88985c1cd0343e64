//! From large triangles to blocks, and lists of every block's parts. Twins: `shaders/technique/lucid/{bin,scatter}.wesl`.

use wgpu::{BindGroupLayout, ComputePipeline};

use super::work::Dispatch;
use super::{OwnLayouts, Stage, buffer_group, buffers_layout};
use crate::frame::Frame;
use crate::pass::ordered::compute_pipeline;
use crate::surface::shader;
use crate::{Context, GpuError, shaders};

/// Long-lived half.
#[derive(Debug)]
pub(super) struct Bin {
    buffers: BindGroupLayout,
    find_bins: ComputePipeline,
    cover_blocks: ComputePipeline,
    list_buffers: BindGroupLayout,
    list_parts: ComputePipeline,
}

impl Bin {
    pub(super) fn new(gpu: &Context, layouts: &OwnLayouts) -> Self {
        let buffers = buffers_layout(gpu, &[0, 1, 2, 3, 4].map(|binding| (binding, false)));
        let list_buffers = buffers_layout(gpu, &[0, 3, 4, 5].map(|binding| (binding, false)));
        let pipeline = |label, module: &_, entry, buffers: &BindGroupLayout| {
            let layouts = [Some(&layouts.picture), None, None, Some(buffers)];
            compute_pipeline(gpu, label, module, entry, &layouts, &[])
        };
        let bin = shader(gpu, "bins", shaders::LUCID_BIN);
        let scatter = shader(gpu, "lists", shaders::LUCID_SCATTER);
        Self {
            find_bins: pipeline("bins", &bin, "find_bins", &buffers),
            cover_blocks: pipeline("bins", &bin, "cover_blocks", &buffers),
            list_parts: pipeline("lists", &scatter, "main", &list_buffers),
            buffers,
            list_buffers,
        }
    }

    /// Pairs of large triangles and bins.
    pub(super) fn find_bins(&self, frame: &mut Frame<'_>, stage: &Stage<'_>) -> Result<(), GpuError> {
        self.record_bins(frame, stage, &self.find_bins, Dispatch::Bins)
    }

    /// What they cover of the bins' blocks.
    pub(super) fn cover_blocks(&self, frame: &mut Frame<'_>, stage: &Stage<'_>) -> Result<(), GpuError> {
        self.record_bins(frame, stage, &self.cover_blocks, Dispatch::Blocks)
    }

    fn record_bins(
        &self,
        frame: &mut Frame<'_>,
        stage: &Stage<'_>,
        pipeline: &ComputePipeline,
        dispatch: Dispatch,
    ) -> Result<(), GpuError> {
        let buffers = stage.buffers;
        let all = [&buffers.work, &buffers.records, &buffers.parts, &buffers.places, &buffers.block_parts];
        let bindings: Vec<_> = (0..).zip(all).collect();
        let group = buffer_group(frame.gpu, &self.buffers, &bindings);
        let mut pass = frame.compute_pass("bins")?;
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &stage.picture, &[]);
        pass.set_bind_group(3, &group, &[]);
        pass.dispatch_workgroups_indirect(&buffers.dispatches, dispatch.offset());
        Ok(())
    }

    /// Lists of every block's parts, once it is known how many come before each.
    pub(super) fn list_parts(&self, frame: &mut Frame<'_>, stage: &Stage<'_>) -> Result<(), GpuError> {
        let buffers = stage.buffers;
        let bindings =
            [(0, &buffers.work), (3, &buffers.places), (4, &buffers.block_parts), (5, &buffers.lists)];
        let group = buffer_group(frame.gpu, &self.list_buffers, &bindings);
        let mut pass = frame.compute_pass("lists")?;
        pass.set_pipeline(&self.list_parts);
        pass.set_bind_group(0, &stage.picture, &[]);
        pass.set_bind_group(3, &group, &[]);
        pass.dispatch_workgroups_indirect(&buffers.dispatches, Dispatch::Lists.offset());
        Ok(())
    }
}
