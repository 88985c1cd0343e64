//! All textures of a scene side by side on the pages of one, for techniques that shade fragments of all draws together: the
//! portability floor has no arrays of bindings. Twin: `shaders/shared/texture.wesl`.
//!
//! Texels are fetched one by one and wrapped in the shader, so neighbours on a page never mix and need no margin.

use pellucid_core::Texture;
use pellucid_core::texture::MipLevel;
use wgpu::TextureUsages;

use crate::gpu_data::AtlasPlace;
use crate::{Context, GpuError};

/// Where everything lies.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AtlasLayout {
    /// Texels along a side of a page.
    side: u32,
    pages: u32,
    /// Of each texture.
    pub(crate) places: Vec<AtlasPlace>,
}

/// Least side of a page where there is more than that.
const USUAL_SIDE: f64 = 2048.0;

impl AtlasLayout {
    /// Packs textures in shelves, the highest first.
    pub(crate) fn of(textures: &[Texture]) -> Self {
        let halves = textures.iter().flat_map(|texture| {
            let (full_size, smaller) = texture.levels().split_at(1);
            [size_of(full_size), size_of(smaller)]
        });
        let sizes: Vec<[u32; 2]> = halves.collect();
        let texels: f64 = sizes.iter().map(|&[width, height]| f64::from(width) * f64::from(height)).sum();
        let longest = sizes.iter().flatten().copied().max().unwrap_or(1);
        let side = longest.max(texels.sqrt().min(USUAL_SIDE).ceil() as u32).next_power_of_two();

        let mut by_height: Vec<usize> = (0..sizes.len()).collect();
        by_height.sort_by_key(|&i| std::cmp::Reverse(sizes[i][1]));
        let (mut page, mut shelf_top, mut shelf_height, mut right) = (0, 0, 0, 0);
        let mut corners = vec![(0, 0); sizes.len()];
        for i in by_height {
            let [width, height] = sizes[i];
            if right + width > side {
                shelf_top += shelf_height;
                (shelf_height, right) = (0, 0);
            }
            if shelf_top + height > side {
                page += 1;
                (shelf_top, shelf_height, right) = (0, 0, 0);
            }
            corners[i] = (page, right | shelf_top << 16);
            right += width;
            shelf_height = shelf_height.max(height);
        }
        let places = corners.chunks_exact(2).map(|corners| AtlasPlace {
            full_size: corners[0].1,
            smaller: corners[1].1,
            pages: corners[0].0 | corners[1].0 << 16,
        });
        Self { side, pages: page + 1, places: places.collect() }
    }

    /// The texture.
    pub(crate) fn upload(&self, gpu: &Context, textures: &[Texture]) -> Result<wgpu::Texture, GpuError> {
        let limit = gpu.limits.max_texture_array_layers;
        if self.pages > limit {
            return Err(GpuError::Limit {
                what: format!("an atlas of textures of {} x {} texels", self.side, self.side),
                size: self.pages.into(),
                limit: limit.into(),
                limit_name: "maxTextureArrayLayers",
            });
        }
        let atlas = gpu.texture(&wgpu::TextureDescriptor {
            label: Some("the atlas of textures"),
            size: wgpu::Extent3d { width: self.side, height: self.side, depth_or_array_layers: self.pages },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8UnormSrgb,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        })?;
        for (place, texture) in self.places.iter().zip(textures) {
            let (full_size, smaller) = texture.levels().split_at(1);
            write(gpu, &atlas, place.full_size, place.pages & 0xffff, texture, full_size);
            write(gpu, &atlas, place.smaller, place.pages >> 16, texture, smaller);
        }
        Ok(atlas)
    }
}

/// Of levels one under the other.
fn size_of(levels: &[MipLevel]) -> [u32; 2] {
    let width = levels.iter().map(|level| level.width).max().unwrap_or(1);
    [width, levels.iter().map(|level| level.height).sum::<u32>().max(1)]
}

/// Writes levels of a texture one under the other from a place on, with x in the lower half of it and y in the upper.
pub(super) fn write(
    gpu: &Context,
    array: &wgpu::Texture,
    place: u32,
    page: u32,
    texture: &Texture,
    levels: &[MipLevel],
) {
    let mut y = place >> 16;
    for level in levels {
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: array,
                mip_level: 0,
                origin: wgpu::Origin3d { x: place & 0xffff, y, z: page },
                aspect: wgpu::TextureAspect::All,
            },
            texture.level_texels(level).as_flattened(),
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(level.width * 4), rows_per_image: None },
            wgpu::Extent3d { width: level.width, height: level.height, depth_or_array_layers: 1 },
        );
        y += level.height;
    }
}

#[cfg(test)]
mod tests {
    use pellucid_core::texture::Sampler;

    use super::*;

    #[test]
    fn nothing_lies_over_anything_else() {
        let sizes = [(2048, 64), (1, 1), (300, 700), (64, 2048), (512, 512), (1024, 1024), (1024, 1024), (5, 3)];
        let texture = |(width, height)| {
            Texture::new(width, height, vec![[0; 4]; (width * height) as usize], Sampler::default()).unwrap()
        };
        let textures: Vec<Texture> = sizes.map(texture).into();
        let layout = AtlasLayout::of(&textures);
        let mut seen = vec![false; (layout.side * layout.side * layout.pages) as usize];
        for (place, texture) in layout.places.iter().zip(&textures) {
            let (full_size, smaller) = texture.levels().split_at(1);
            for (corner, page, levels) in
                [(place.full_size, place.pages & 0xffff, full_size), (place.smaller, place.pages >> 16, smaller)]
            {
                let [width, height] = size_of(levels);
                for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
                    let (column, row) = ((corner & 0xffff) + x, (corner >> 16) + y);
                    assert!(column < layout.side && row < layout.side && page < layout.pages);
                    let texel = (page * layout.side + row) * layout.side + column;
                    assert!(!std::mem::replace(&mut seen[texel as usize], true), "{column} {row} of page {page}");
                }
            }
        }
        assert_eq!(AtlasLayout::of(&[]).pages, 1);
    }
}
