//! What an LFB holds on the GPU.

use bytemuck::{Pod, Zeroable};
use wgpu::{
    BindGroup, BindGroupEntry, BindGroupLayout, BindGroupLayoutEntry, BufferUsages, CommandEncoder, ShaderStages,
};

use super::{Access, LfbContent, LfbError, LfbOptions, Nearest};
use crate::Context;
use crate::pass::prefix_sum::{PrefixSum, PrefixSumGroup};
use crate::readback::mapped;
use crate::surface::storage_entry;

/// Twin: `LfbData` in `shaders/lfb/module.wesl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct LfbData {
    /// Width, height in pixels.
    pub size: [u32; 2],
    /// 1 in the counting pass, else 0.
    pub is_counting: u32,
    /// All bits where small depths are near, else none.
    pub depth_flip: u32,
}

/// Words after the counters of the pixels: fragments outside, fragments beyond, pixels that differ.
const FAULTS: u64 = 3;

const STORAGE: BufferUsages = BufferUsages::STORAGE.union(BufferUsages::COPY_SRC).union(BufferUsages::COPY_DST);

/// The bindings of a module, in its order.
pub(super) fn layout_entries(
    access: Access,
    first_binding: u32,
    visibility: ShaderStages,
) -> Vec<BindGroupLayoutEntry> {
    let uniform = BindGroupLayoutEntry {
        binding: first_binding,
        visibility,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let read_only: &[bool] = match access {
        Access::Capture => &[false, true, false],
        Access::Read => &[true, true],
    };
    let storage = (first_binding + 1..).zip(read_only);
    std::iter::once(uniform)
        .chain(storage.map(|(binding, &read_only)| storage_entry(binding, visibility, read_only)))
        .collect()
}

fn depth_flip(nearest: Nearest) -> u32 {
    match nearest {
        Nearest::Greatest => 0,
        Nearest::Smallest => u32::MAX,
    }
}

#[derive(Debug)]
pub(super) struct Buffers {
    pub(super) pixels: u64,
    counting_data: wgpu::Buffer,
    capturing_data: wgpu::Buffer,
    /// Fragments added to each pixel so far, then the faults.
    pub(super) counters: wgpu::Buffer,
    /// Where each pixel's fragments start, and the total.
    pub(super) starts: wgpu::Buffer,
    block_sums_bytes: u64,
    pub(super) prefix_sum_groups: Vec<PrefixSumGroup>,
    /// Payload, key of the depth, order, of each fragment.
    words: wgpu::Buffer,
    pub(super) fragments: u32,
    pub(super) counting_group: Option<BindGroup>,
    pub(super) capturing_group: Option<BindGroup>,
    pub(super) read_group: Option<BindGroup>,
}

impl Buffers {
    pub(super) fn new(
        gpu: &Context,
        options: &LfbOptions,
        prefix_sum: &PrefixSum,
        capture_layout: &BindGroupLayout,
    ) -> Result<Self, LfbError> {
        let &LfbOptions { width, height, .. } = options;
        if width == 0 || height == 0 {
            return Err(LfbError::ZeroSize { width, height });
        }
        let (side, limit) = (width.max(height), gpu.limits.max_texture_dimension_2d);
        if side > limit {
            let (size, limit) = (side.into(), limit.into());
            let what = "a side of the LFB".to_owned();
            return Err(LfbError::Limit { what, size, limit, limit_name: "maxTextureDimension2D" });
        }
        let pixels = u64::from(width) * u64::from(height);
        let data = |is_counting| {
            let usage = BufferUsages::UNIFORM | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
            let buffer = gpu.buffer("LFB data", size_of::<LfbData>() as u64, usage)?;
            let data = LfbData { size: [width, height], is_counting, depth_flip: depth_flip(options.nearest) };
            gpu.queue.write_buffer(&buffer, 0, bytemuck::bytes_of(&data));
            Ok::<_, LfbError>(buffer)
        };
        let starts = gpu.buffer("LFB starts", ((pixels + 1) * 4).max(16), STORAGE)?;
        let mut sums = vec![starts.clone()];
        for (name, bytes) in PrefixSum::needs(pixels + 1) {
            sums.push(gpu.buffer(name, bytes, STORAGE)?);
        }
        let mut buffers = Self {
            pixels,
            counting_data: data(1)?,
            capturing_data: data(0)?,
            counters: gpu.buffer("LFB counters", (pixels + FAULTS) * 4, STORAGE)?,
            block_sums_bytes: sums[1..].iter().map(wgpu::Buffer::size).sum(),
            prefix_sum_groups: prefix_sum.groups(gpu, pixels + 1, &sums)?,
            starts,
            words: gpu.buffer("LFB fragments", 16, STORAGE)?,
            fragments: 0,
            counting_group: None,
            capturing_group: None,
            read_group: None,
        };
        buffers.counting_group = Some(buffers.group(gpu, capture_layout, Access::Capture, true));
        Ok(buffers)
    }

    /// Makes room for so many fragments: what there is already, if it is large enough and not twice too large.
    pub(super) fn make_room(
        &mut self,
        gpu: &Context,
        options: &LfbOptions,
        fragments: u32,
        [capture_layout, read_layout]: [&BindGroupLayout; 2],
    ) -> Result<(), LfbError> {
        let bytes = u64::from(fragments) * u64::from(options.payload_words + 2) * 4;
        let limits = [
            (options.max_bytes, "max_bytes"),
            (gpu.limits.max_storage_buffer_binding_size, "maxStorageBufferBindingSize"),
            (gpu.limits.max_buffer_size, "maxBufferSize"),
        ];
        let (limit, limit_name) = limits.into_iter().min_by_key(|&(limit, _)| limit).unwrap_or_default();
        // Sums stick at the greatest number.
        if bytes > limit || fragments == u32::MAX {
            return Err(LfbError::Overflow { fragments, bytes, limit, limit_name });
        }
        self.fragments = fragments;
        let bytes = bytes.max(16);
        let fits = (bytes..=2 * bytes).contains(&self.words.size());
        if !fits {
            // The old ones go first, as there may not be room for both.
            (self.capturing_group, self.read_group) = (None, None);
            self.words = gpu.buffer("LFB fragments", 16, STORAGE)?;
            self.words = gpu.buffer("LFB fragments", bytes, STORAGE)?;
        }
        if self.capturing_group.is_none() {
            self.capturing_group = Some(self.group(gpu, capture_layout, Access::Capture, false));
            self.read_group = Some(self.group(gpu, read_layout, Access::Read, false));
        }
        Ok(())
    }

    pub(super) fn entries(&self, access: Access, is_counting: bool, first_binding: u32) -> Vec<BindGroupEntry<'_>> {
        let data = if is_counting { &self.counting_data } else { &self.capturing_data };
        let buffers: &[&wgpu::Buffer] = match access {
            Access::Capture => &[data, &self.counters, &self.starts, &self.words],
            Access::Read => &[data, &self.starts, &self.words],
        };
        (first_binding..)
            .zip(buffers)
            .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect()
    }

    fn group(&self, gpu: &Context, layout: &BindGroupLayout, access: Access, is_counting: bool) -> BindGroup {
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("LFB"),
            layout,
            entries: &self.entries(access, is_counting, 0),
        })
    }

    /// Records copies of words (buffer, first, count) to where the CPU can read them, after a word that is never 0.
    pub(super) fn outcome(
        &self,
        gpu: &Context,
        encoder: &mut CommandEncoder,
        parts: &[(&wgpu::Buffer, u64, u64)],
    ) -> Result<wgpu::Buffer, LfbError> {
        let words: u64 = 1 + parts.iter().map(|(_, _, count)| count).sum::<u64>();
        let outcome = gpu.buffer("LFB outcome", words * 4, BufferUsages::COPY_DST | BufferUsages::MAP_READ)?;
        encoder.copy_buffer_to_buffer(&self.capturing_data, 0, &outcome, 0, 4);
        let mut place = 1;
        for &(buffer, first, count) in parts {
            encoder.copy_buffer_to_buffer(buffer, first * 4, &outcome, place * 4, count * 4);
            place += count;
        }
        Ok(outcome)
    }

    pub(super) fn read(&self, gpu: &Context, options: &LfbOptions) -> Result<LfbContent, LfbError> {
        let words = u64::from(self.fragments) * u64::from(options.payload_words + 2);
        let copy = |buffer: &wgpu::Buffer, words: u64| {
            if words == 0 {
                return Ok(Vec::new());
            }
            let staging = gpu.buffer("LFB read-back", words * 4, BufferUsages::COPY_DST | BufferUsages::MAP_READ)?;
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, words * 4);
            gpu.queue.submit([encoder.finish()]);
            Ok::<Vec<u32>, LfbError>(bytemuck::pod_collect_to_vec(&mapped(gpu, &staging)?))
        };
        Ok(LfbContent {
            width: options.width,
            payload_words: options.payload_words,
            depth_flip: depth_flip(options.nearest),
            starts: copy(&self.starts, self.pixels + 1)?,
            words: copy(&self.words, words)?,
        })
    }

    pub(super) fn bytes(&self) -> u64 {
        let buffers = [&self.counting_data, &self.capturing_data, &self.counters, &self.starts, &self.words];
        buffers.into_iter().map(wgpu::Buffer::size).sum::<u64>() + self.block_sums_bytes
    }
}
