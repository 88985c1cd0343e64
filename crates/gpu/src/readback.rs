//! From the GPU back to the CPU.

use bytemuck::Pod;
use wgpu::{BufferUsages, COPY_BYTES_PER_ROW_ALIGNMENT};

use crate::frame::Frame;
use crate::{Context, GpuError};

/// The first `count` values of a buffer that has `COPY_SRC`. Waits for everything recorded so far.
pub(crate) fn read_buffer<T: Pod>(
    frame: &mut Frame<'_>,
    buffer: &wgpu::Buffer,
    first: u64,
    count: u64,
) -> Result<Vec<T>, GpuError> {
    let item_bytes = size_of::<T>() as u64;
    if count == 0 {
        return Ok(Vec::new());
    }
    let staging = staging(frame.gpu, count * item_bytes)?;
    frame.encoder().copy_buffer_to_buffer(buffer, first * item_bytes, &staging, 0, count * item_bytes);
    frame.submit()?;
    let bytes = mapped(frame.gpu, &staging)?;
    Ok(bytemuck::pod_collect_to_vec(&bytes))
}

/// A texture's texels, row by row. Waits for everything recorded so far.
pub(crate) fn read_texture<T: Pod>(
    frame: &mut Frame<'_>,
    texture: &wgpu::Texture,
    aspect: wgpu::TextureAspect,
) -> Result<Vec<T>, GpuError> {
    let row_bytes = texture.width() * size_of::<T>() as u32;
    let padded_row_bytes = row_bytes.next_multiple_of(COPY_BYTES_PER_ROW_ALIGNMENT);
    let staging = staging(frame.gpu, u64::from(padded_row_bytes) * u64::from(texture.height()))?;
    frame.encoder().copy_texture_to_buffer(
        wgpu::TexelCopyTextureInfo { texture, mip_level: 0, origin: wgpu::Origin3d::ZERO, aspect },
        wgpu::TexelCopyBufferInfo {
            buffer: &staging,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded_row_bytes),
                rows_per_image: None,
            },
        },
        texture.size(),
    );
    frame.submit()?;
    let bytes = mapped(frame.gpu, &staging)?;
    let mut texels = Vec::with_capacity(texture.width() as usize * texture.height() as usize);
    for row in bytes.chunks_exact(padded_row_bytes as usize) {
        texels.extend(bytemuck::pod_collect_to_vec::<u8, T>(&row[..row_bytes as usize]));
    }
    Ok(texels)
}

fn staging(gpu: &Context, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
    gpu.buffer("read-back", bytes, BufferUsages::COPY_DST | BufferUsages::MAP_READ)
}

pub(crate) fn mapped(gpu: &Context, staging: &wgpu::Buffer) -> Result<wgpu::BufferView, GpuError> {
    // The outcome shows when the range is asked for.
    staging.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.wait()?;
    staging.get_mapped_range(..).map_err(|error| GpuError::Lost(error.to_string()))
}
