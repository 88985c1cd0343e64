//! Group 0 of passes over the pixels of a window: frame, opaque surfaces, picture and figures. Twin:
//! `shaders/shared/picture.wesl`.

use bytemuck::{Pod, Zeroable};
use wgpu::{BindGroup, BindGroupLayout, BindingType, BufferUsages, ShaderStages};

use crate::frame::Targets;
use crate::surface::storage_entry;
use crate::{Context, GpuError};

/// Pixels along a side of a workgroup, in passes over pixels.
pub(crate) const GROUP_PX: u32 = 8;

/// Figures of a frame. Twin: `Totals` in `shaders/shared/picture.wesl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct Totals {
    /// Pixels with a fragment.
    pub covered_pixels: u32,
    /// Most fragments at one pixel.
    pub greatest_count: u32,
    /// Fragments, low word.
    pub fragments_low: u32,
    /// Fragments, high word.
    pub fragments_high: u32,
}

impl Totals {
    /// All fragments.
    pub fn fragments(&self) -> u64 {
        u64::from(self.fragments_high) << 32 | u64::from(self.fragments_low)
    }
}

/// The group, and the figures in it.
#[derive(Debug)]
pub(crate) struct PictureGroup {
    pub(crate) bind_group: BindGroup,
    pub(crate) totals: wgpu::Buffer,
}

pub(crate) fn layout(gpu: &Context) -> BindGroupLayout {
    let entry =
        |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility: ShaderStages::COMPUTE, ty, count: None };
    let texture = |sample_type| BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("picture"),
        entries: &[
            entry(
                0,
                BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
            ),
            entry(1, texture(wgpu::TextureSampleType::Float { filterable: false })),
            entry(2, texture(wgpu::TextureSampleType::Depth)),
            entry(
                3,
                BindingType::StorageTexture {
                    access: wgpu::StorageTextureAccess::WriteOnly,
                    format: wgpu::TextureFormat::Rgba32Float,
                    view_dimension: wgpu::TextureViewDimension::D2,
                },
            ),
            storage_entry(4, ShaderStages::COMPUTE, false),
        ],
    })
}

impl PictureGroup {
    pub(crate) fn new(
        gpu: &Context,
        layout: &BindGroupLayout,
        targets: &Targets,
        frame_data: &wgpu::Buffer,
    ) -> Result<Self, GpuError> {
        let totals = gpu.buffer(
            "the figures",
            size_of::<Totals>() as u64,
            BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
        )?;
        let view = wgpu::BindingResource::TextureView;
        let resources = [
            frame_data.as_entire_binding(),
            view(&targets.opaque_color_view),
            view(&targets.opaque_depth_view),
            view(&targets.picture_view),
            totals.as_entire_binding(),
        ];
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("picture"),
            layout,
            entries: &entries,
        });
        Ok(Self { bind_group, totals })
    }
}
