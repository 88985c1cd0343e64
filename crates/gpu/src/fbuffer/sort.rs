//! The stable bitonic sort of windows of fragments, and their merge. Twin: `shaders/fbuffer/sort.wesl`.
//!
//! Stages of blocks up to 512 keys run in workgroup memory, all at once; of larger ones each is a dispatch of its own, and
//! there are O(log² n) of them (section 5.1).

use bytemuck::{Pod, Zeroable};
use pellucid_core::fbuffer::sort::{Key, Stage as NetworkStage, stages};
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, ShaderStages};

use super::FBufferError;
use super::target::read;
use crate::pass::grid::dispatch;
use crate::pass::ordered::compute_pipeline;
use crate::surface::{shader, storage_entry};
use crate::{Context, shaders};

/// Bytes of a key. Twin: `Key` in `shaders/fbuffer/key.wesl`.
pub(crate) const KEY_BYTES: u64 = 12;

/// Keys that a workgroup sorts by itself: `BLOCK` of the shader.
const BLOCK: u64 = 512;

/// Invocations of a workgroup: `LANES` of the shader.
const LANES: u64 = 256;

/// What a dispatch sorts or merges. Twin: `Stage` in `shaders/fbuffer/sort.wesl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct Stage {
    /// First key.
    pub first: u32,
    /// How many.
    pub length: u32,
    /// Length of the network's blocks, or of sorted runs.
    pub block: u32,
}

/// Which pipeline runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    SortBlocks,
    FinishBlocks,
    Flip,
    Halve,
    Merge,
}

/// A dispatch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    kind: Kind,
    groups: u64,
    stage: Stage,
}

/// The dispatches that sort a range of keys.
pub(crate) fn sort_steps(keys: &std::ops::Range<u64>) -> Vec<Step> {
    run_steps(keys, u64::MAX)
}

/// The dispatches that sort each run of so many keys, a power of two and [`BLOCK`] at least.
pub(crate) fn run_steps(keys: &std::ops::Range<u64>, run: u64) -> Vec<Step> {
    let length = keys.end - keys.start;
    let step = |kind, groups, block: u64| {
        let stage = Stage { first: keys.start as u32, length: length as u32, block: block as u32 };
        Step { kind, groups, stage }
    };
    let (blocks, pairs) = (length.div_ceil(BLOCK), length.next_power_of_two() / 2);
    let mut steps = Vec::new();
    if length > 1 {
        steps.push(step(Kind::SortBlocks, blocks, BLOCK));
    }
    // Longer runs begin with a flip.
    let stages = stages(length).take_while(|stage| !matches!(stage, NetworkStage::Flip(block) if *block > run));
    for stage in stages {
        match stage {
            NetworkStage::Flip(block) if block > BLOCK => steps.push(step(Kind::Flip, pairs.div_ceil(LANES), block)),
            NetworkStage::Halve(block) if block > BLOCK => steps.push(step(Kind::Halve, pairs.div_ceil(LANES), block)),
            // All that are left of a larger block; those of smaller ones are done.
            NetworkStage::Halve(BLOCK) => steps.push(step(Kind::FinishBlocks, blocks, BLOCK)),
            _ => {}
        }
    }
    steps
}

/// The dispatches that merge sorted runs of so many keys, two by two.
pub(crate) fn merge_steps(total: u64, run: u64) -> Vec<Step> {
    let runs = std::iter::successors(Some(run), |run| Some(run * 2)).take_while(|&run| run < total);
    runs.map(|run| {
        let stage = Stage { first: 0, length: total as u32, block: run as u32 };
        Step { kind: Kind::Merge, groups: total.div_ceil(LANES), stage }
    })
    .collect()
}

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct Sort {
    layout: BindGroupLayout,
    /// In the order of [`Kind`].
    pipelines: [ComputePipeline; 5],
}

impl Sort {
    pub(crate) fn new(gpu: &Context) -> Self {
        let mut stage = storage_entry(2, ShaderStages::COMPUTE, true);
        stage.ty = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: true,
            min_binding_size: None,
        };
        let keys = [0, 1].map(|binding| storage_entry(binding, ShaderStages::COMPUTE, false));
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("bitonic sort"),
            entries: &[keys[0], keys[1], stage],
        });
        let module = shader(gpu, "bitonic sort", shaders::FBUFFER_SORT);
        let entries = ["sort_blocks", "finish_blocks", "flip", "halve", "merge"];
        let pipelines =
            entries.map(|entry| compute_pipeline(gpu, "bitonic sort", &module, entry, &[Some(&layout)], &[]));
        Self { layout, pipelines }
    }

    /// Bytes that stages of so many steps take.
    pub(crate) fn stage_bytes(gpu: &Context, steps: usize) -> u64 {
        (stride(gpu) * steps.max(1)) as u64
    }

    /// The stages of all steps, as they are sent.
    pub(crate) fn stages(gpu: &Context, steps: &[Step]) -> Vec<u8> {
        let mut bytes = vec![0; stride(gpu) * steps.len().max(1)];
        for (place, step) in bytes.chunks_exact_mut(stride(gpu)).zip(steps) {
            place[..size_of::<Stage>()].copy_from_slice(bytemuck::bytes_of(&step.stage));
        }
        bytes
    }

    /// The group in which `keys` are sorted, or merged into `merged`.
    pub(crate) fn group(
        &self,
        gpu: &Context,
        keys: &wgpu::Buffer,
        merged: &wgpu::Buffer,
        stages: &wgpu::Buffer,
    ) -> BindGroup {
        let stage = wgpu::BufferBinding {
            buffer: stages,
            offset: 0,
            size: std::num::NonZeroU64::new(size_of::<Stage>() as u64),
        };
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("bitonic sort"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: keys.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: merged.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Buffer(stage) },
            ],
        })
    }

    /// Records a step, which is number `number` of those that were sent.
    pub(crate) fn record(
        &self,
        gpu: &Context,
        pass: &mut wgpu::ComputePass<'_>,
        group: &BindGroup,
        step: &Step,
        number: usize,
    ) {
        pass.set_pipeline(&self.pipelines[step.kind as usize]);
        pass.set_bind_group(0, group, &[(stride(gpu) * number) as u32]);
        dispatch(pass, step.groups);
    }
}

/// Bytes from one stage to the next.
fn stride(gpu: &Context) -> usize {
    size_of::<Stage>().next_multiple_of(gpu.limits.min_storage_buffer_offset_alignment as usize)
}

/// Sorts keys on a device, in windows of so many, and merges the windows: what the core's `sort` and `merge_runs` do.
///
/// # Errors
/// If they do not fit the device.
pub fn sort_keys(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    keys: &[Key],
    window: u64,
) -> Result<Vec<Key>, FBufferError> {
    let (gpu, total) = (Context::adopt(device.clone(), queue.clone()), keys.len() as u64);
    let starts = (0..total).step_by(window.max(1) as usize);
    let mut steps: Vec<Step> =
        starts.flat_map(|start| sort_steps(&(start..(start + window.max(1)).min(total)))).collect();
    let merging = merge_steps(total, window.max(1));
    let sorting = steps.len();
    steps.extend(merging);
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
    let buffer = |label: &str, bytes: u64| gpu.buffer(label, bytes.max(16).next_multiple_of(4), usage);
    let mut buffers = [buffer("keys", total * KEY_BYTES)?, buffer("merged keys", total * KEY_BYTES)?];
    let stages = buffer("stages", Sort::stage_bytes(&gpu, steps.len()))?;
    gpu.queue.write_buffer(&stages, 0, &Sort::stages(&gpu, &steps));
    let words: Vec<[u32; 3]> = keys.iter().map(|key| [key.pixel, key.depth, key.slot]).collect();
    gpu.queue.write_buffer(&buffers[0], 0, bytemuck::cast_slice(&words));
    let sort = Sort::new(&gpu);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    for (number, step) in steps.iter().enumerate() {
        let group = sort.group(&gpu, &buffers[0], &buffers[1], &stages);
        let mut pass = encoder.begin_compute_pass(&Default::default());
        sort.record(&gpu, &mut pass, &group, step, number);
        if number >= sorting {
            buffers.swap(0, 1);
        }
    }
    gpu.queue.submit([encoder.finish()]);
    let words: Vec<[u32; 3]> = read(&gpu, &buffers[0], 0, total)?;
    Ok(words.into_iter().map(|[pixel, depth, slot]| Key { pixel, depth, slot }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run that is not sorted to its end is blended by several invocations at once, which a software device may happen to
    /// do in the right order: pictures do not show it.
    #[test]
    fn runs_go_through_all_stages_of_their_own_length_and_no_more() {
        let of = |steps: Vec<Step>| steps.iter().map(|step| (step.kind, step.stage.block)).collect::<Vec<_>>();
        for run in [BLOCK, 1024, super::super::target::RUN] {
            let alone = of(sort_steps(&(0..run)));
            for length in [run, run + 1, 3 * run - 7, 8 * run] {
                let steps = run_steps(&(0..length), run);
                assert!(steps.iter().all(|step| u64::from(step.stage.length) == length));
                assert_eq!(of(steps), alone, "runs of {run} in {length} keys");
            }
        }
    }
}
