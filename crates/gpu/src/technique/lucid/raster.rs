//! From parts of triangles to fragments of pixels. Twins: `shaders/technique/lucid/{sort,cover,raster,shade}.wesl`.

use std::collections::HashMap;

use wgpu::{BindGroupLayout, ComputePipeline, ShaderModule};

use super::layouts::Bound::{Read, ReadWrite, Stored, Table};
use super::work::{Counts, Dispatch, Header, Shading};
use super::{OwnLayouts, Stage, stage_group, stage_layout};
use crate::fbuffer::LANES;
use crate::frame::Frame;
use crate::pass::grid::dispatch;
use crate::pass::ordered::compute_pipeline;
use crate::pass::picture::GROUP_PX;
use crate::surface::shader;
use crate::{Context, GpuError, shaders, table};

/// Invocations of a workgroup in chunks.
const CHUNKS_A_GROUP: u64 = 2;

/// Long-lived half.
#[derive(Debug)]
pub(super) struct Raster {
    sort_buffers: BindGroupLayout,
    sort_chunks: ComputePipeline,
    next_level: ComputePipeline,
    /// From the lists of parts, and to them.
    merge_runs: [ComputePipeline; 2],
    cover_buffers: BindGroupLayout,
    mark: ComputePipeline,
    count_fragments: ComputePipeline,
    place_fragments: ComputePipeline,
    shade_buffers: BindGroupLayout,
    shade_module: ShaderModule,
    shade: HashMap<Shading, ComputePipeline>,
}

impl Raster {
    pub(super) fn new(gpu: &Context, layouts: &OwnLayouts) -> Self {
        let sort_buffers = stage_layout(
            gpu,
            &[(0, ReadWrite), (2, ReadWrite), (3, ReadWrite), (5, ReadWrite), (7, Stored(table::GROUPS)), (10, Table)],
        );
        let cover_buffers = stage_layout(
            gpu,
            &[(6, ReadWrite), (7, Table), (8, ReadWrite), (9, Read), (10, Table), (11, Stored(table::PAIRS))],
        );
        let pipeline = |label, module: &_, entry, buffers: &BindGroupLayout| {
            let layouts = [Some(&layouts.picture), None, None, Some(buffers)];
            compute_pipeline(gpu, label, module, entry, &layouts, &[])
        };
        let sort = shader(gpu, "sort", shaders::LUCID_SORT);
        let cover = shader(gpu, "cover", shaders::LUCID_COVER);
        Self {
            sort_chunks: pipeline("sort", &sort, "sort_chunks", &sort_buffers),
            next_level: pipeline("sort", &sort, "next_level", &sort_buffers),
            merge_runs: [1.0, 0.0].map(|in_lists| {
                let layouts = [Some(&layouts.picture), None, None, Some(&sort_buffers)];
                compute_pipeline(gpu, "sort", &sort, "merge_runs", &layouts, &[("in_lists", in_lists)])
            }),
            sort_buffers,
            mark: pipeline("cover", &cover, "mark", &cover_buffers),
            count_fragments: pipeline("cover", &cover, "count_fragments", &cover_buffers),
            place_fragments: pipeline("places", &cover, "place_fragments", &cover_buffers),
            cover_buffers,
            shade_buffers: stage_layout(
                gpu,
                &[(1, Table), (7, Table), (9, Stored(table::GROUPS)), (10, Table), (11, Table)],
            ),
            shade_module: shader(gpu, "shade", shaders::LUCID_RASTER),
            shade: HashMap::new(),
        }
    }

    /// Parts of each chunk in order. Finds out which merges there are.
    pub(super) fn sort_chunks(&self, frame: &mut Frame<'_>, stage: &Stage<'_>) -> Result<(), GpuError> {
        let mut pass = self.sort_pass(frame, stage)?;
        pass.set_pipeline(&self.sort_chunks);
        pass.dispatch_workgroups_indirect(&stage.buffers.dispatches, Dispatch::Chunks.offset());
        Ok(())
    }

    /// Parts of all blocks in order.
    pub(super) fn merge(&self, frame: &mut Frame<'_>, stage: &Stage<'_>, header: &Header) -> Result<(), GpuError> {
        let merges = header.merges.into_iter().take_while(|&merges| merges > 0);
        let mut pass = self.sort_pass(frame, stage)?;
        for (count, merge_runs) in merges.zip(self.merge_runs.iter().cycle()) {
            pass.set_pipeline(&self.next_level);
            pass.dispatch_workgroups(1, 1, 1);
            pass.set_pipeline(merge_runs);
            dispatch(&mut pass, u64::from(count).div_ceil(LANES));
        }
        Ok(())
    }

    fn sort_pass(&self, frame: &mut Frame<'_>, stage: &Stage<'_>) -> Result<wgpu::ComputePass<'static>, GpuError> {
        let buffers = stage.buffers;
        let bindings = [(0, &buffers.work), (2, &buffers.parts), (3, &buffers.places), (5, &buffers.lists)];
        let tables = [(7, &buffers.ordered), (10, &buffers.chunk_heads)];
        let group = stage_group(frame.gpu, &self.sort_buffers, &tables, &bindings);
        let mut pass = frame.compute_pass("sort")?;
        pass.set_bind_group(0, &stage.picture, &[]);
        pass.set_bind_group(3, &group, &[]);
        Ok(pass)
    }

    /// Which parts cover each pixel, and how many that are.
    pub(super) fn count(&self, frame: &mut Frame<'_>, stage: &Stage<'_>, counts: &Counts) -> Result<(), GpuError> {
        let mut pass = self.cover_pass(frame, stage, "cover")?;
        pass.set_pipeline(&self.mark);
        dispatch(&mut pass, u64::from(counts.chunks).div_ceil(LANES));
        pass.set_pipeline(&self.count_fragments);
        pass.dispatch_workgroups(stage.window.width.div_ceil(GROUP_PX), stage.window.height.div_ceil(GROUP_PX), 1);
        Ok(())
    }

    /// How many fragments come before those of each chunk at each pixel; then the fragments.
    pub(super) fn shade(
        &mut self,
        frame: &mut Frame<'_>,
        stage: &Stage<'_>,
        layouts: &OwnLayouts,
        (counts, fragments): (&Counts, &wgpu::TextureView),
    ) -> Result<(), GpuError> {
        let mut pass = self.cover_pass(frame, stage, "cover")?;
        pass.set_pipeline(&self.place_fragments);
        pass.dispatch_workgroups(stage.window.width.div_ceil(GROUP_PX), stage.window.height.div_ceil(GROUP_PX), 1);
        drop(pass);

        let (gpu, buffers) = (frame.gpu, stage.buffers);
        let tables = [
            (1, &buffers.records),
            (7, &buffers.ordered),
            (9, fragments),
            (10, &buffers.chunk_heads),
            (11, &buffers.covering),
        ];
        let group = stage_group(gpu, &self.shade_buffers, &tables, &[]);
        let pipeline = self.shade.entry(stage.shading).or_insert_with(|| {
            let layouts = [Some(&layouts.picture), Some(&layouts.scene), None, Some(&self.shade_buffers)];
            compute_pipeline(gpu, "shade", &self.shade_module, "main", &layouts, &stage.shading.constants())
        });
        let mut pass = frame.compute_pass("shade")?;
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &stage.picture, &[]);
        pass.set_bind_group(1, &stage.scene, &[]);
        pass.set_bind_group(3, &group, &[]);
        dispatch(&mut pass, u64::from(counts.chunks).div_ceil(CHUNKS_A_GROUP));
        Ok(())
    }

    fn cover_pass(
        &self,
        frame: &mut Frame<'_>,
        stage: &Stage<'_>,
        step: &'static str,
    ) -> Result<wgpu::ComputePass<'static>, GpuError> {
        let buffers = stage.buffers;
        let tables = [(7, &buffers.ordered), (10, &buffers.chunk_heads), (11, &buffers.covering)];
        let bindings = [(6, &buffers.chunks), (8, &buffers.offsets), (9, &buffers.chunk_sums)];
        let group = stage_group(frame.gpu, &self.cover_buffers, &tables, &bindings);
        let mut pass = frame.compute_pass(step)?;
        pass.set_bind_group(0, &stage.picture, &[]);
        pass.set_bind_group(3, &group, &[]);
        Ok(pass)
    }
}
