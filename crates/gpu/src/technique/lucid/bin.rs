//! From large triangles to blocks, lists of every block's parts, and what of them is hidden. Twins:
//! `shaders/technique/lucid/{bin,scatter,hide}.wesl`.

use std::collections::HashMap;

use pellucid_core::primitive::Pass;
use wgpu::{BindGroupLayout, ComputePipeline, Features, ShaderModule};

use super::layouts::Bound::{ReadWrite, Stored, Table};
use super::work::{Dispatch, Shading, blocks};
use super::{OwnLayouts, Stage, stage_group, stage_layout};
use crate::fbuffer::LANES;
use crate::frame::Frame;
use crate::pass::grid::dispatch;
use crate::pass::ordered::compute_pipeline;
use crate::surface::shader;
use crate::{Context, GpuError, shaders, table};

/// Long-lived half.
#[derive(Debug)]
pub(super) struct Bin {
    buffers: BindGroupLayout,
    find_bins: ComputePipeline,
    /// Without and with pieces of clipped triangles.
    cover_blocks: [ComputePipeline; 2],
    list_buffers: BindGroupLayout,
    count_chunks: ComputePipeline,
    list_parts: ComputePipeline,
    hide_buffers: BindGroupLayout,
    hide_module: ShaderModule,
    /// By what shading looks at, whether there are opaque surfaces, and whether there is an alpha test.
    hide: HashMap<(Shading, bool, bool), ComputePipeline>,
}

impl Bin {
    pub(super) fn new(gpu: &Context, layouts: &OwnLayouts) -> Self {
        let buffers = stage_layout(gpu, &[(0, ReadWrite), (1, Table), (2, ReadWrite), (3, ReadWrite), (4, ReadWrite)]);
        let list_buffers = stage_layout(
            gpu,
            &[
                (0, ReadWrite),
                (2, ReadWrite),
                (3, ReadWrite),
                (4, ReadWrite),
                (5, ReadWrite),
                (9, ReadWrite),
                (10, Stored(table::GROUPS)),
            ],
        );
        let pipeline = |label, module: &_, entry, buffers: &BindGroupLayout| {
            let layouts = [Some(&layouts.picture), None, None, Some(buffers)];
            compute_pipeline(gpu, label, module, entry, &layouts, &[])
        };
        let has_subgroups = gpu.has(Features::SUBGROUP);
        let wgsl = if has_subgroups { shaders::LUCID_BIN_SUBGROUPS } else { shaders::LUCID_BIN };
        let bin = shader(gpu, "bins", wgsl);
        let scatter = shader(gpu, "lists", shaders::LUCID_SCATTER);
        Self {
            find_bins: pipeline("bins", &bin, "find_bins", &buffers),
            cover_blocks: [0.0, 1.0].map(|has_folds| {
                let layouts = [Some(&layouts.picture), None, None, Some(&buffers)];
                compute_pipeline(gpu, "bins", &bin, "cover_blocks", &layouts, &[("has_folds", has_folds)])
            }),
            count_chunks: pipeline("lists", &scatter, "count_chunks", &list_buffers),
            list_parts: pipeline("lists", &scatter, "main", &list_buffers),
            buffers,
            list_buffers,
            hide_buffers: stage_layout(gpu, &[(0, ReadWrite), (1, Table), (2, ReadWrite), (3, ReadWrite)]),
            hide_module: shader(gpu, "hide", shaders::LUCID_HIDE),
            hide: HashMap::new(),
        }
    }

    /// Pairs of large triangles and bins.
    pub(super) fn find_bins(&self, frame: &mut Frame<'_>, stage: &Stage<'_>) -> Result<(), GpuError> {
        self.record_bins(frame, stage, &self.find_bins, Dispatch::Bins)
    }

    /// What they cover of the bins' blocks.
    pub(super) fn cover_blocks(
        &self,
        frame: &mut Frame<'_>,
        stage: &Stage<'_>,
        has_folds: bool,
    ) -> Result<(), GpuError> {
        self.record_bins(frame, stage, &self.cover_blocks[usize::from(has_folds)], Dispatch::Blocks)
    }

    fn record_bins(
        &self,
        frame: &mut Frame<'_>,
        stage: &Stage<'_>,
        pipeline: &ComputePipeline,
        dispatch: Dispatch,
    ) -> Result<(), GpuError> {
        let buffers = stage.buffers;
        let bindings = [(0, &buffers.work), (2, &buffers.parts), (3, &buffers.places), (4, &buffers.block_parts)];
        let group = stage_group(frame.gpu, &self.buffers, &[(1, &buffers.records)], &bindings);
        let mut pass = frame.compute_pass("bins")?;
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &stage.picture, &[]);
        pass.set_bind_group(3, &group, &[]);
        pass.dispatch_workgroups_indirect(&buffers.dispatches, dispatch.offset());
        Ok(())
    }

    /// How many chunks each block's parts make, once it is known how many come before each.
    pub(super) fn count_chunks(&self, frame: &mut Frame<'_>, stage: &Stage<'_>) -> Result<(), GpuError> {
        let mut pass = self.list_pass(frame, stage)?;
        pass.set_pipeline(&self.count_chunks);
        dispatch(&mut pass, (blocks(stage.window) + 1).div_ceil(LANES));
        Ok(())
    }

    /// Lists of every block's parts, once it is known how many chunks come before each, too.
    pub(super) fn list_parts(&self, frame: &mut Frame<'_>, stage: &Stage<'_>) -> Result<(), GpuError> {
        let mut pass = self.list_pass(frame, stage)?;
        pass.set_pipeline(&self.list_parts);
        pass.dispatch_workgroups_indirect(&stage.buffers.dispatches, Dispatch::Parts.offset());
        Ok(())
    }

    fn list_pass(&self, frame: &mut Frame<'_>, stage: &Stage<'_>) -> Result<wgpu::ComputePass<'static>, GpuError> {
        let buffers = stage.buffers;
        let bindings = [
            (0, &buffers.work),
            (2, &buffers.parts),
            (3, &buffers.places),
            (4, &buffers.block_parts),
            (5, &buffers.lists),
            (9, &buffers.chunk_sums),
        ];
        let group = stage_group(frame.gpu, &self.list_buffers, &[(10, &buffers.chunk_heads)], &bindings);
        let mut pass = frame.compute_pass("lists")?;
        pass.set_bind_group(0, &stage.picture, &[]);
        pass.set_bind_group(3, &group, &[]);
        Ok(pass)
    }

    /// What lies behind opaque surfaces or fails an alpha test, if there are any.
    pub(super) fn hide(
        &mut self,
        frame: &mut Frame<'_>,
        stage: &Stage<'_>,
        layouts: &OwnLayouts,
    ) -> Result<(), GpuError> {
        let tests_alpha = frame.surfaces.has_cutoff(Pass::Transparent);
        let tests_depth = frame.surfaces.has_opaque;
        if !tests_depth && !tests_alpha {
            return Ok(());
        }
        let (gpu, buffers) = (frame.gpu, stage.buffers);
        let bindings = [(0, &buffers.work), (2, &buffers.parts), (3, &buffers.places)];
        let group = stage_group(gpu, &self.hide_buffers, &[(1, &buffers.records)], &bindings);
        let pipeline = self.hide.entry((stage.shading, tests_depth, tests_alpha)).or_insert_with(|| {
            let layouts = [Some(&layouts.picture), Some(&layouts.scene), None, Some(&self.hide_buffers)];
            let [varies, smooth, flat] = stage.shading.constants();
            let [depth, alpha] = [tests_depth, tests_alpha].map(|tests| f64::from(u8::from(tests)));
            let constants = [varies, smooth, flat, ("tests_depth", depth), ("tests_alpha", alpha)];
            compute_pipeline(gpu, "hide", &self.hide_module, "main", &layouts, &constants)
        });
        let mut pass = frame.compute_pass("hide")?;
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &stage.picture, &[]);
        pass.set_bind_group(1, &stage.scene, &[]);
        pass.set_bind_group(3, &group, &[]);
        pass.dispatch_workgroups_indirect(&buffers.dispatches, Dispatch::Parts.offset());
        Ok(())
    }
}
