//! Tables of groups of four words, in textures: what shaders read most, as llvmpipe fetches texels whole, and words of buffers
//! lane by lane. Twin: `shaders/shared/table.wesl`.

use std::ops::Range;

use wgpu::{
    BindGroupLayoutEntry, BindingType, Extent3d, Origin3d, ShaderStages, StorageTextureAccess, TextureFormat,
    TextureSampleType, TextureUsages, TextureViewDimension,
};

use crate::{Context, GpuError};

/// Four words.
pub(crate) type Group = [u32; 4];

pub(crate) const GROUP_BYTES: u64 = size_of::<Group>() as u64;

/// What a table has: groups of four words, or pairs.
pub(crate) const GROUPS: TextureFormat = TextureFormat::Rgba32Uint;
pub(crate) const PAIRS: TextureFormat = TextureFormat::Rg32Uint;

/// Groups in a row, and rows in a layer, as many as every device has. Above 8.4 million groups a table is whole layers.
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

/// Less than a row is as wide as it has to be.
fn size(count: u64) -> Extent3d {
    let count = count.max(1);
    let rows = count.div_ceil(WIDTH);
    let (width, height) = (count.min(WIDTH), rows.min(HEIGHT));
    Extent3d { width: width as u32, height: height as u32, depth_or_array_layers: rows.div_ceil(HEIGHT) as u32 }
}

/// Bytes of a table with room for so many.
pub(crate) fn bytes(format: TextureFormat, count: u64) -> u64 {
    let Extent3d { width, height, depth_or_array_layers } = size(count);
    let texels = u64::from(width) * u64::from(height) * u64::from(depth_or_array_layers);
    texels * if format == PAIRS { GROUP_BYTES / 2 } else { GROUP_BYTES }
}

/// As shaders see it, or any other array of textures, if it has one layer alone.
pub(crate) fn view(table: &wgpu::Texture) -> wgpu::TextureView {
    table.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(TextureViewDimension::D2Array),
        ..wgpu::TextureViewDescriptor::default()
    })
}

/// The binding of one that shaders read.
pub(crate) fn read_entry(binding: u32, visibility: ShaderStages) -> BindGroupLayoutEntry {
    let ty = BindingType::Texture {
        sample_type: TextureSampleType::Uint,
        view_dimension: TextureViewDimension::D2Array,
        multisampled: false,
    };
    BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

/// The binding of one that shaders write, which excludes that they read it.
pub(crate) fn stored_entry(binding: u32, visibility: ShaderStages, format: TextureFormat) -> BindGroupLayoutEntry {
    let ty = BindingType::StorageTexture {
        access: StorageTextureAccess::WriteOnly,
        format,
        view_dimension: TextureViewDimension::D2Array,
    };
    BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

/// A new table of so many groups.
pub(crate) fn upload(
    gpu: &Context,
    label: &str,
    count: u64,
    groups: impl IntoIterator<Item = Group>,
) -> Result<wgpu::Texture, GpuError> {
    let table = gpu.texture(&descriptor(label, GROUPS, count))?;
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
    for Piece { groups: range, origin, extent } in pieces(first, groups.len() as u64) {
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo { texture: table, mip_level: 0, origin, aspect: wgpu::TextureAspect::All },
            bytemuck::cast_slice(&groups[range]),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some((u64::from(extent.width) * GROUP_BYTES) as u32),
                rows_per_image: None,
            },
            extent,
        );
    }
}

/// Groups that are a rectangle of a table: a piece of a row, or whole rows of one layer.
#[derive(Debug)]
struct Piece {
    groups: Range<usize>,
    origin: Origin3d,
    extent: Extent3d,
}

/// So many groups from number `first` on: to the end of its row, whole rows layer by layer, and what is left.
fn pieces(first: u64, count: u64) -> impl Iterator<Item = Piece> {
    let end = first + count;
    let mut next = first;
    std::iter::from_fn(move || {
        let (left, row) = (end - next, next / WIDTH);
        let (column, rows_of_layer) = (next % WIDTH, HEIGHT - row % HEIGHT);
        let (width, height) = match (column, left / WIDTH) {
            (0, rows @ 1..) => (WIDTH, rows.min(rows_of_layer)),
            _ => (left.min(WIDTH - column), 1),
        };
        let start = (next - first) as usize;
        next += width * height;
        (left > 0).then(|| Piece {
            groups: start..start + (width * height) as usize,
            origin: Origin3d { x: column as u32, y: (row % HEIGHT) as u32, z: (row / HEIGHT) as u32 },
            extent: Extent3d { width: width as u32, height: height as u32, depth_or_array_layers: 1 },
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where a shader looks for a group, as `texel_of` in `shaders/shared/table.wesl`.
    fn texel_of(number: u64) -> [u64; 3] {
        [number & 1023, (number >> 10) & 8191, number >> 23]
    }

    #[test]
    fn every_group_is_written_where_shaders_look_for_it() {
        let layer = WIDTH * HEIGHT;
        for (first, count) in
            [(0, 0), (0, 1), (5, 1000), (5, 1019), (5, 1020), (1000, 5000), (layer - 1500, 4000), (layer, 2048)]
        {
            let mut next = 0;
            for Piece { groups, origin, extent } in pieces(first, count) {
                assert_eq!((groups.start, extent.depth_or_array_layers), (next, 1));
                next = groups.end;
                let texels = (0..extent.height).flat_map(|y| (0..extent.width).map(move |x| (x, y)));
                let places = texels.map(|(x, y)| [origin.x + x, origin.y + y, origin.z].map(u64::from));
                assert!(places.eq(groups.map(|group| texel_of(first + group as u64))), "{first}, {count}");
            }
            assert_eq!(next as u64, count);
        }
    }

    #[test]
    fn tables_have_room_for_what_they_are_made_for() {
        for count in [0, 1, 700, 1024, 1025, WIDTH * HEIGHT, WIDTH * HEIGHT + 1] {
            let [x, y, z] = texel_of(count.max(1) - 1);
            let Extent3d { width, height, depth_or_array_layers } = size(count);
            assert!(x < width.into() && y < height.into() && z < depth_or_array_layers.into(), "{count}");
            assert!(bytes(GROUPS, count) >= count * 16 && bytes(PAIRS, count) * 2 == bytes(GROUPS, count));
        }
    }
}
