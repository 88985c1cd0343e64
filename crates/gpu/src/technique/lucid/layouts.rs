//! What the stages have in common: layouts of bind groups, and the groups of a frame.

use wgpu::{BindGroup, BindGroupLayout, BindingType, ShaderStages};

use crate::Context;
use crate::frame::Frame;
use crate::surface::storage_entry;

/// Bind group layouts that stages share. Group 3 of each is the buffers it works on, by the numbers of their bindings.
#[derive(Debug)]
pub(super) struct OwnLayouts {
    /// Group 0: frame, opaque surfaces and picture, without the figures.
    pub(super) picture: BindGroupLayout,
    /// Group 1: the scene with all draws.
    pub(super) scene: BindGroupLayout,
    pub(super) dispatches: BindGroupLayout,
    pub(super) work: BindGroupLayout,
}

impl OwnLayouts {
    pub(super) fn new(gpu: &Context) -> Self {
        let compute = ShaderStages::COMPUTE;
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility: compute, ty, count: None };
        let texture =
            |sample_type, view_dimension| BindingType::Texture { sample_type, view_dimension, multisampled: false };
        let uniform = BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let stored = BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: wgpu::TextureFormat::Rgba32Float,
            view_dimension: wgpu::TextureViewDimension::D2,
        };
        let layout = |label, entries: &[_]| {
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        let (flat, pages) = (wgpu::TextureViewDimension::D2, wgpu::TextureViewDimension::D2Array);
        let texels = wgpu::TextureSampleType::Float { filterable: false };
        Self {
            picture: layout(
                "picture",
                &[
                    entry(0, uniform),
                    entry(1, texture(texels, flat)),
                    entry(2, texture(wgpu::TextureSampleType::Depth, flat)),
                    entry(3, stored),
                ],
            ),
            scene: layout(
                "scene and draws",
                &[
                    storage_entry(0, compute, true),
                    storage_entry(1, compute, true),
                    storage_entry(2, compute, true),
                    storage_entry(3, compute, true),
                    entry(4, texture(texels, pages)),
                ],
            ),
            dispatches: layout("dispatches", &[storage_entry(0, compute, false)]),
            work: buffers_layout(gpu, &[(0, false)]),
        }
    }

    pub(super) fn picture_group(&self, frame: &Frame<'_>) -> BindGroup {
        let (view, targets) = (wgpu::BindingResource::TextureView, frame.targets);
        let resources = [
            frame.frame_data.as_entire_binding(),
            view(&targets.opaque_color_view),
            view(&targets.opaque_depth_view),
            view(&targets.picture_view),
        ];
        group(frame.gpu, &self.picture, resources)
    }

    pub(super) fn scene_group(&self, frame: &Frame<'_>, draws: &wgpu::Buffer, atlas: &wgpu::TextureView) -> BindGroup {
        let [positions, attributes, indices] = &frame.surfaces.scene().buffers;
        let resources = [
            positions.as_entire_binding(),
            attributes.as_entire_binding(),
            indices.as_entire_binding(),
            draws.as_entire_binding(),
            wgpu::BindingResource::TextureView(atlas),
        ];
        group(frame.gpu, &self.scene, resources)
    }
}

/// A layout of buffers by their bindings, each read only or not.
pub(super) fn buffers_layout(gpu: &Context, bindings: &[(u32, bool)]) -> BindGroupLayout {
    let entries: Vec<_> =
        bindings.iter().map(|&(binding, read_only)| storage_entry(binding, ShaderStages::COMPUTE, read_only)).collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("lucid"), entries: &entries })
}

pub(super) fn buffer_group(gpu: &Context, layout: &BindGroupLayout, buffers: &[(u32, &wgpu::Buffer)]) -> BindGroup {
    let entries: Vec<_> = buffers
        .iter()
        .map(|&(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("lucid"), layout, entries: &entries })
}

fn group<const N: usize>(
    gpu: &Context,
    layout: &BindGroupLayout,
    resources: [wgpu::BindingResource<'_>; N],
) -> BindGroup {
    let entries: Vec<_> =
        (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("lucid"), layout, entries: &entries })
}
