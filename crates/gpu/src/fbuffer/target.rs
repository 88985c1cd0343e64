//! Where the last pass draws to. Twin: `shaders/fbuffer/output.wesl`.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::Vec4;
use pellucid_core::Image;
use pellucid_core::fbuffer::Output;
use wgpu::{BindGroupLayout, BufferUsages, ComputePipeline, ShaderStages};

use super::{FBuffer, FBufferError, LANES};
use crate::pass::grid::dispatch;
use crate::pass::ordered::compute_pipeline;
use crate::readback::mapped;
use crate::surface::{shader, storage_entry};
use crate::{Context, shaders};

/// Twin: `OutputData` in `shaders/fbuffer/output.wesl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct OutputData {
    width: u32,
    first: u32,
    end: u32,
    flags: u32,
    least_alpha: f32,
}

/// Slots that are sorted and blended at once. Fewer take more dispatches, more take more stages of the sort.
pub(super) const RUN: u64 = 16_384;

impl OutputData {
    pub(super) fn new(output: Output, width: u32, slots: &Range<u64>) -> Self {
        let bit = |condition: bool, bit: u32| if condition { bit } else { 0 };
        Self {
            width,
            first: slots.start as u32,
            end: slots.end as u32,
            flags: bit(output.depth_test, 1) | bit(output.depth_write, 2) | bit(output.blend, 4),
            least_alpha: output.alpha_test.unwrap_or(f32::MIN),
        }
    }
}

/// A picture with a depth for each of its pixels, on the device.
#[derive(Debug)]
pub struct Target {
    pub(super) width: u32,
    pub(super) height: u32,
    /// RGBA in 32-bit floats, row by row: linear light, premultiplied alpha.
    pub colors: wgpu::Buffer,
    /// Reverse-Z in 32-bit floats, row by row; 0 is infinitely far.
    pub depths: wgpu::Buffer,
}

impl FBuffer {
    /// A target of one colour, infinitely deep.
    ///
    /// # Errors
    /// If it does not fit the device.
    pub fn target(&self, width: u32, height: u32, color: Vec4) -> Result<Target, FBufferError> {
        let pixels = width as usize * height as usize;
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        let colors = self.gpu.buffer("F-Buffer target", (pixels as u64 * 16).max(16), usage)?;
        let depths = self.gpu.buffer("F-Buffer target's depth", (pixels as u64 * 4).max(16), usage)?;
        self.gpu.queue.write_buffer(&colors, 0, bytemuck::cast_slice(&vec![color; pixels]));
        Ok(Target { width, height, colors, depths })
    }

    /// The colours of a target. Waits for everything drawn so far.
    ///
    /// # Errors
    /// If the device fails.
    pub fn read(&self, target: &Target) -> Result<Image, FBufferError> {
        let colors: Vec<Vec4> = read(&self.gpu, &target.colors, 0, u64::from(target.width) * u64::from(target.height))?;
        let mut image = Image::filled(target.width, target.height, Vec4::ZERO);
        image.pixels_mut().copy_from_slice(&colors);
        Ok(image)
    }
}

/// Values of a buffer.
pub(super) fn read<T: Pod>(
    gpu: &Context,
    buffer: &wgpu::Buffer,
    first: u64,
    count: u64,
) -> Result<Vec<T>, FBufferError> {
    let item_bytes = size_of::<T>() as u64;
    if count == 0 {
        return Ok(Vec::new());
    }
    let staging = gpu.buffer("read-back", count * item_bytes, BufferUsages::COPY_DST | BufferUsages::MAP_READ)?;
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, first * item_bytes, &staging, 0, count * item_bytes);
    gpu.queue.submit([encoder.finish()]);
    Ok(bytemuck::pod_collect_to_vec(&mapped(gpu, &staging)?))
}

/// All slots, then those of each run.
fn parts(fragments: u64) -> impl Iterator<Item = Range<u64>> {
    let runs = (0..fragments).step_by(RUN as usize).map(move |first| first..(first + RUN).min(fragments));
    std::iter::once(0..fragments).chain(runs)
}

/// Bytes from one part's data to the next.
fn stride(gpu: &Context) -> usize {
    size_of::<OutputData>().next_multiple_of(gpu.limits.min_storage_buffer_offset_alignment as usize)
}

/// Long-lived half of tests and blending.
#[derive(Debug)]
pub(super) struct OutputPass {
    layout: BindGroupLayout,
    make_keys: ComputePipeline,
    blend: ComputePipeline,
}

impl OutputPass {
    pub(super) fn new(gpu: &Context) -> Self {
        let mut entries = [0, 1, 2, 3, 4, 5].map(|binding| storage_entry(binding, ShaderStages::COMPUTE, binding == 0));
        entries[0].ty = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: true,
            min_binding_size: None,
        };
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("F-Buffer output"),
            entries: &entries,
        });
        let module = shader(gpu, "F-Buffer output", shaders::FBUFFER_OUTPUT);
        let pipeline = |entry| compute_pipeline(gpu, "F-Buffer output", &module, entry, &[Some(&layout)], &[]);
        Self { make_keys: pipeline("make_keys"), blend: pipeline("blend"), layout }
    }

    /// Bytes of the data for so many fragments.
    pub(super) fn data_bytes(gpu: &Context, fragments: u64) -> u64 {
        (stride(gpu) * parts(fragments).count()) as u64
    }

    /// The data, as it is sent.
    pub(super) fn data(gpu: &Context, output: Output, width: u32, fragments: u64) -> Vec<u8> {
        let mut bytes = vec![0; stride(gpu) * parts(fragments).count()];
        for (place, slots) in bytes.chunks_exact_mut(stride(gpu)).zip(parts(fragments)) {
            let data = OutputData::new(output, width, &slots);
            place[..size_of::<OutputData>()].copy_from_slice(bytemuck::bytes_of(&data));
        }
        bytes
    }

    /// `buffers`: data, places, colours, keys.
    pub(super) fn group(&self, gpu: &Context, buffers: [&wgpu::Buffer; 4], target: &Target) -> wgpu::BindGroup {
        let [data, places, colors, keys] = buffers;
        let mut entries: Vec<_> = (0..)
            .zip([data, places, colors, keys, &target.colors, &target.depths])
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        entries[0].resource = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: data,
            offset: 0,
            size: std::num::NonZeroU64::new(size_of::<OutputData>() as u64),
        });
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("F-Buffer output"),
            layout: &self.layout,
            entries: &entries,
        })
    }

    /// Before the sort.
    pub(super) fn make_keys(&self, pass: &mut wgpu::ComputePass<'_>, group: &wgpu::BindGroup, fragments: u64) {
        pass.set_pipeline(&self.make_keys);
        pass.set_bind_group(0, group, &[0]);
        dispatch(pass, fragments.div_ceil(LANES));
    }

    /// After it, run by run.
    pub(super) fn blend(
        &self,
        gpu: &Context,
        pass: &mut wgpu::ComputePass<'_>,
        group: &wgpu::BindGroup,
        fragments: u64,
    ) {
        pass.set_pipeline(&self.blend);
        for (number, slots) in parts(fragments).enumerate().skip(1) {
            pass.set_bind_group(0, group, &[(stride(gpu) * number) as u32]);
            dispatch(pass, (slots.end - slots.start).div_ceil(LANES));
        }
    }
}
