//! Exclusive prefix sums of any length in compute, in place. Twin: `shaders/pass/prefix_sum.wesl`.

use bytemuck::{Pod, Zeroable};
use wgpu::{BindGroupLayout, BufferUsages, ComputePipeline, ShaderStages};

use crate::frame::Frame;
use crate::pass::grid::dispatch;
use crate::pass::ordered::compute_pipeline;
use crate::surface::{shader, storage_entry};
use crate::{Context, GpuError, shaders};

/// Values summed by one workgroup: `LANES * PER_LANE` of the shader.
pub(crate) const BLOCK: u64 = 2048;

/// Twin: `PrefixSumData` in `shaders/pass/prefix_sum.wesl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct PrefixSumData {
    /// Number of values.
    pub length: u32,
    /// Ends on a multiple of 16 bytes.
    pub padding: [u32; 3],
}

/// Names of the buffers that hold block sums, level by level; 2048^3 values are more than a binding holds.
const LEVELS: [&str; 3] = ["sums of blocks", "sums of sums of blocks", "sum of all blocks"];

/// One level, and its number of blocks.
pub(crate) type PrefixSumGroup = (wgpu::BindGroup, u64);

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct PrefixSum {
    layout: BindGroupLayout,
    sum_blocks: ComputePipeline,
    add_block_sums: ComputePipeline,
}

/// Lengths of the values of each level: the first are the values themselves.
fn lengths(length: u64) -> Vec<u64> {
    let mut lengths = vec![length];
    let mut last = length;
    while last > 1 || lengths.len() == 1 {
        last = last.div_ceil(BLOCK);
        lengths.push(last);
    }
    lengths
}

impl PrefixSum {
    pub(crate) fn new(gpu: &Context) -> Self {
        let uniform = wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("prefix sums"),
            entries: &[
                uniform,
                storage_entry(1, ShaderStages::COMPUTE, false),
                storage_entry(2, ShaderStages::COMPUTE, false),
            ],
        });
        let module = shader(gpu, "prefix sums", shaders::PREFIX_SUM);
        let pipeline = |entry| compute_pipeline(gpu, "prefix sums", &module, entry, &[Some(&layout)], &[]);
        Self { sum_blocks: pipeline("sum_blocks"), add_block_sums: pipeline("add_block_sums"), layout }
    }

    /// The buffers besides the values, with their bytes.
    pub(crate) fn needs(length: u64) -> impl Iterator<Item = (&'static str, u64)> {
        LEVELS.into_iter().zip(lengths(length).into_iter().skip(1)).map(|(name, length)| (name, (length * 4).max(16)))
    }

    /// Records the step: the first `length` values of `values` become the sums of all values before them.
    pub(crate) fn record(
        &self,
        frame: &mut Frame<'_>,
        step: &'static str,
        values: &wgpu::Buffer,
        length: u64,
    ) -> Result<(), GpuError> {
        let gpu = frame.gpu;
        let mut buffers = vec![values.clone()];
        for (name, bytes) in Self::needs(length) {
            buffers.push(frame.memory.buffer(gpu, name, bytes)?);
        }
        let groups = self.groups(gpu, length, &buffers)?;
        self.run(&mut frame.compute_pass(step)?, &groups);
        Ok(())
    }

    /// What it runs on: the values, then the buffers that it [`needs`](Self::needs).
    pub(crate) fn groups(
        &self,
        gpu: &Context,
        length: u64,
        buffers: &[wgpu::Buffer],
    ) -> Result<Vec<PrefixSumGroup>, GpuError> {
        let levels = lengths(length);
        let pairs = levels.windows(2).zip(buffers.windows(2));
        pairs.map(|(lengths, buffers)| Ok((self.bind_group(gpu, lengths[0], buffers)?, lengths[1]))).collect()
    }

    pub(crate) fn run(&self, pass: &mut wgpu::ComputePass<'_>, groups: &[PrefixSumGroup]) {
        pass.set_pipeline(&self.sum_blocks);
        for (group, blocks) in groups {
            pass.set_bind_group(0, group, &[]);
            dispatch(pass, *blocks);
        }
        pass.set_pipeline(&self.add_block_sums);
        for (group, blocks) in groups.iter().rev().skip(1) {
            pass.set_bind_group(0, group, &[]);
            dispatch(pass, *blocks);
        }
    }

    fn bind_group(&self, gpu: &Context, length: u64, buffers: &[wgpu::Buffer]) -> Result<wgpu::BindGroup, GpuError> {
        let data = PrefixSumData { length: length as u32, padding: [0; 3] };
        let uniform =
            gpu.buffer("a length", size_of::<PrefixSumData>() as u64, BufferUsages::UNIFORM | BufferUsages::COPY_DST)?;
        gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&data));
        Ok(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("prefix sums"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: buffers[0].as_entire_binding() },
                wgpu::BindGroupEntry { binding: 2, resource: buffers[1].as_entire_binding() },
            ],
        }))
    }
}
