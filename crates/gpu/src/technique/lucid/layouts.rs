//! What the stages have in common: layouts of bind groups, and the groups of a frame.

use wgpu::{BindGroup, BindGroupLayout, BindingType, ShaderStages, TextureView};

use super::LoadedScene;
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
                    table_entry(0),
                    table_entry(1),
                    table_entry(2),
                    table_entry(3),
                    entry(4, texture(texels, pages)),
                ],
            ),
            dispatches: layout("dispatches", &[storage_entry(0, compute, false)]),
            work: stage_layout(gpu, &[], &[(0, false)]),
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
        group(frame.gpu, &self.picture, (0..).zip(resources))
    }

    pub(super) fn scene_group(&self, gpu: &Context, scene: &LoadedScene, draws: &TextureView) -> BindGroup {
        let [positions, normals, colors] = &scene.vertices;
        let textures = [positions, normals, colors, draws, &scene.atlas];
        stage_group(gpu, &self.scene, &std::array::from_fn::<_, 5, _>(|i| (i as u32, textures[i])), &[])
    }
}

/// A layout of tables and buffers by their bindings; buffers are read only or not.
pub(super) fn stage_layout(gpu: &Context, tables: &[u32], buffers: &[(u32, bool)]) -> BindGroupLayout {
    let mut entries: Vec<_> = tables.iter().map(|&binding| table_entry(binding)).collect();
    let buffer = |&(binding, read_only): &(u32, bool)| storage_entry(binding, ShaderStages::COMPUTE, read_only);
    entries.extend(buffers.iter().map(buffer));
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("lucid"), entries: &entries })
}

/// The same with a table that is stored into, as far as such an access is allowed: without reading it.
pub(super) fn stored_table_layout(gpu: &Context, table: u32, buffers: &[(u32, bool)]) -> BindGroupLayout {
    let mut entries = vec![wgpu::BindGroupLayoutEntry {
        ty: BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: wgpu::TextureFormat::Rgba32Uint,
            view_dimension: wgpu::TextureViewDimension::D2Array,
        },
        ..table_entry(table)
    }];
    entries.extend(buffers.iter().map(|&(binding, only)| storage_entry(binding, ShaderStages::COMPUTE, only)));
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("lucid"), entries: &entries })
}

fn table_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::COMPUTE,
        ty: BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D2Array,
            multisampled: false,
        },
        count: None,
    }
}

pub(super) fn stage_group(
    gpu: &Context,
    layout: &BindGroupLayout,
    tables: &[(u32, &TextureView)],
    buffers: &[(u32, &wgpu::Buffer)],
) -> BindGroup {
    let tables = tables.iter().map(|&(binding, table)| (binding, wgpu::BindingResource::TextureView(table)));
    let buffers = buffers.iter().map(|&(binding, buffer)| (binding, buffer.as_entire_binding()));
    group(gpu, layout, tables.chain(buffers))
}

fn group<'a>(
    gpu: &Context,
    layout: &BindGroupLayout,
    resources: impl Iterator<Item = (u32, wgpu::BindingResource<'a>)>,
) -> BindGroup {
    let entries: Vec<_> =
        resources.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("lucid"), layout, entries: &entries })
}
