//! What the stages have in common: layouts of bind groups, and the groups of a frame.

use wgpu::{BindGroup, BindGroupLayout, BindingType, ShaderStages, TextureView};

use super::LoadedScene;
use crate::Context;
use crate::frame::Frame;
use crate::surface::storage_entry;
use crate::table;

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
        let own = |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility: compute, ty, count: None };
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
        let table = |binding| entry(binding, Bound::Table);
        let (flat, pages) = (wgpu::TextureViewDimension::D2, wgpu::TextureViewDimension::D2Array);
        let texels = wgpu::TextureSampleType::Float { filterable: false };
        Self {
            picture: layout(
                "picture",
                &[
                    own(0, uniform),
                    own(1, texture(texels, flat)),
                    own(2, texture(wgpu::TextureSampleType::Depth, flat)),
                    own(3, stored),
                ],
            ),
            scene: layout("scene and draws", &[table(0), table(1), table(2), table(3), own(4, texture(texels, pages))]),
            dispatches: layout("dispatches", &[storage_entry(0, compute, false)]),
            work: stage_layout(gpu, &[(0, Bound::ReadWrite)]),
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

/// What is bound in group 3, and what a stage does with it.
#[derive(Debug, Clone, Copy)]
pub(super) enum Bound {
    /// A table that is read.
    Table,
    /// A table of a format that is stored into, which excludes that it is read.
    Stored(wgpu::TextureFormat),
    Read,
    ReadWrite,
}

/// A layout of tables and buffers by their bindings.
pub(super) fn stage_layout(gpu: &Context, bindings: &[(u32, Bound)]) -> BindGroupLayout {
    let entries: Vec<_> = bindings.iter().map(|&(binding, bound)| entry(binding, bound)).collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("lucid"), entries: &entries })
}

fn entry(binding: u32, bound: Bound) -> wgpu::BindGroupLayoutEntry {
    let compute = ShaderStages::COMPUTE;
    match bound {
        Bound::Read => storage_entry(binding, compute, true),
        Bound::ReadWrite => storage_entry(binding, compute, false),
        Bound::Table => table::read_entry(binding, compute),
        Bound::Stored(format) => table::stored_entry(binding, compute, format),
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
    let entries: Vec<_> = resources.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("lucid"), layout, entries: &entries })
}
