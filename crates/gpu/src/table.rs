//! Tables of groups of four words, in textures: what shaders read most, as llvmpipe fetches texels whole, and words of buffers
//! lane by lane. Twin: `shaders/shared/table.wesl`.

use wgpu::{Extent3d, TextureFormat, TextureUsages};

use crate::{Context, GpuError};

/// Four words.
pub(crate) type Group = [u32; 4];

pub(crate) const GROUP_BYTES: u64 = size_of::<Group>() as u64;

/// What a table has: groups of four words, or pairs.
pub(crate) const GROUPS: TextureFormat = TextureFormat::Rgba32Uint;
pub(crate) const PAIRS: TextureFormat = TextureFormat::Rg32Uint;

/// Groups in a row, and rows in a layer: as many as every device has.
const WIDTH: u64 = 1024;
const HEIGHT: u64 = 8192;

/// Groups that are written at once: whole rows, of which a layer is a multiple.
const WRITTEN: usize = 256 * WIDTH as usize;

/// A table with room for so many groups or pairs.
pub(crate) fn descriptor(label: &str, format: TextureFormat, count: u64) -> wgpu::TextureDescriptor<'_> {
    wgpu::TextureDescriptor {
        label: Some(label),
        size: size(count),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    }
}

fn size(count: u64) -> Extent3d {
    let rows = count.div_ceil(WIDTH).max(1);
    let layers = rows.div_ceil(HEIGHT);
    let height = if layers > 1 { HEIGHT } else { rows };
    Extent3d { width: WIDTH as u32, height: height as u32, depth_or_array_layers: layers as u32 }
}

/// Bytes of a table with room for so many.
pub(crate) fn bytes(format: TextureFormat, count: u64) -> u64 {
    let Extent3d { width, height, depth_or_array_layers } = size(count);
    let texels = u64::from(width) * u64::from(height) * u64::from(depth_or_array_layers);
    texels * if format == PAIRS { GROUP_BYTES / 2 } else { GROUP_BYTES }
}

/// As shaders see it.
pub(crate) fn view(table: &wgpu::Texture) -> wgpu::TextureView {
    table.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..wgpu::TextureViewDescriptor::default()
    })
}

/// A new table of so many groups.
pub(crate) fn upload(
    gpu: &Context,
    label: &str,
    count: u64,
    groups: impl IntoIterator<Item = Group>,
) -> Result<wgpu::Texture, GpuError> {
    let descriptor = descriptor(label, GROUPS, count);
    let (layers, limit) = (descriptor.size.depth_or_array_layers, gpu.limits.max_texture_array_layers);
    if layers > limit {
        return Err(GpuError::Limit {
            what: format!("a table of {label}"),
            size: layers.into(),
            limit: limit.into(),
            limit_name: "maxTextureArrayLayers",
        });
    }
    let table = gpu.texture(&descriptor)?;
    write(gpu, &table, groups);
    Ok(table)
}

/// Writes groups from the first on.
pub(crate) fn write(gpu: &Context, table: &wgpu::Texture, groups: impl IntoIterator<Item = Group>) {
    let mut groups = groups.into_iter();
    let mut written: Vec<Group> = Vec::new();
    for first in (0..).step_by(WRITTEN) {
        written.clear();
        written.extend(groups.by_ref().take(WRITTEN));
        write_from(gpu, table, first, &written);
        if written.len() < WRITTEN {
            return;
        }
    }
}

/// Writes groups from number `first` on.
pub(crate) fn write_from(gpu: &Context, table: &wgpu::Texture, first: u64, groups: &[Group]) {
    let (row, column) = (first / WIDTH, first % WIDTH);
    let begun = if column > 0 { groups.len().min((WIDTH - column) as usize) } else { 0 };
    let (begun, rest) = groups.split_at(begun);
    let (rows, left) = rest.split_at(rest.len() - rest.len() % WIDTH as usize);
    let next_row = row + u64::from(!begun.is_empty());
    write_rows(gpu, table, [column, row], begun);
    for (part, rows) in (0..).zip(rows.chunks(WRITTEN)) {
        write_rows(gpu, table, [0, next_row + part * (WRITTEN as u64 / WIDTH)], rows);
    }
    write_rows(gpu, table, [0, next_row + rows.len() as u64 / WIDTH], left);
}

/// Writes a piece of a row, or whole rows of one layer.
fn write_rows(gpu: &Context, table: &wgpu::Texture, [column, row]: [u64; 2], groups: &[Group]) {
    if groups.is_empty() {
        return;
    }
    let width = groups.len().min(WIDTH as usize);
    let height = groups.len() / width;
    gpu.queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture: table,
            mip_level: 0,
            origin: wgpu::Origin3d { x: column as u32, y: (row % HEIGHT) as u32, z: (row / HEIGHT) as u32 },
            aspect: wgpu::TextureAspect::All,
        },
        bytemuck::cast_slice(groups),
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some((width as u64 * GROUP_BYTES) as u32),
            rows_per_image: None,
        },
        Extent3d { width: width as u32, height: height as u32, depth_or_array_layers: 1 },
    );
}
