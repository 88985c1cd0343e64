//! Drawing surfaces: what every pass over the scene's triangles has in common.
//!
//! Bind groups: 0 frame and draw, 1 scene, 2 texture, 3 whatever the technique brings. The fragment half of a pipeline is
//! the technique's, the vertex half is `shaders/pass/vertex.wesl`.

mod pipelines;

use pellucid_core::primitive::{Draw, Pass, draws};
use pellucid_core::{Scene, View};
use wgpu::util::RenderEncoder;
use wgpu::{BindGroup, BindGroupLayout, BindingType, BufferBindingType, ShaderStages};

use self::pipelines::{Cull, PipelineKey};
pub(crate) use self::pipelines::{SurfacePass, SurfacePipelines, depth_state};
use crate::gpu_data::{DrawData, FrameData};
use crate::upload::SceneUpload;
use crate::{Context, GpuError, shaders, table};

/// Long-lived: layouts, the vertex shader, and what stands in for a texture where there is none.
#[derive(Debug)]
pub(crate) struct SurfaceLayouts {
    pub(crate) frame: BindGroupLayout,
    pub(crate) scene: BindGroupLayout,
    pub(crate) texture: BindGroupLayout,
    vertex: wgpu::ShaderModule,
    no_texture: BindGroup,
    /// In place of the opaque depth while that is being drawn, and where nothing is opaque.
    no_depth: wgpu::TextureView,
}

/// One instance, ready to be recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SurfaceDraw {
    pass: Pass,
    corners: u32,
    /// Triangles share no corner, as one that is not finite drops the whole triangle.
    is_apart: bool,
    mesh: usize,
    cull: Cull,
    varies: bool,
    has_cutoff: bool,
    texture: Option<usize>,
    instance: usize,
}

/// Per frame: all instances of the scene in a view.
#[derive(Debug)]
pub(crate) struct Surfaces<'a> {
    draws: Vec<SurfaceDraw>,
    /// Whether any of them is opaque.
    pub(crate) has_opaque: bool,
    scene: &'a SceneUpload,
    layouts: &'a SurfaceLayouts,
    groups: &'a DrawGroups,
    /// Of all instances, as the shaders know them.
    pub(crate) data: Vec<DrawData>,
    pub(crate) dropped_triangles: u64,
}

/// Group 0 of surfaces, and the buffers in it. Kept from frame to frame, so that what was recorded with it can be
/// replayed: a frame only writes into the buffers.
///
/// One group for each instance, as they are kept anyway, rather than one for all with dynamic offsets.
#[derive(Debug)]
pub(crate) struct DrawGroups {
    pub(crate) frame_data: wgpu::Buffer,
    instances: wgpu::Buffer,
    opaque_depth: wgpu::TextureView,
    /// For the instances: in front of opaque surfaces, and of nothing, which a single texel of depth 0 stands for, as there is
    /// no other depth outside of a texture.
    before_opaque: Vec<BindGroup>,
    alone: Vec<BindGroup>,
}

/// Everything that a recording of surfaces depends on: as long as it is equal, the recording can be replayed.
#[derive(Debug, PartialEq)]
pub(crate) struct Structure {
    scene: BindGroup,
    groups: Option<BindGroup>,
    draws: Vec<SurfaceDraw>,
}

/// What records one draw.
struct DrawCommand<'a> {
    pipeline: &'a wgpu::RenderPipeline,
    frame_group: &'a BindGroup,
    texture: &'a BindGroup,
    corners: u32,
    /// Vertex and index buffer; none where triangles share nothing.
    shared: Option<(&'a wgpu::Buffer, &'a wgpu::Buffer)>,
}

/// A draw, for passes in compute over its fragments.
pub(crate) struct ComputeDraw<'a> {
    pub(crate) instance: usize,
    pub(crate) mesh: usize,
    pub(crate) varies: bool,
    /// Groups 0 and 2.
    pub(crate) frame_group: &'a BindGroup,
    pub(crate) texture: &'a BindGroup,
}

impl SurfaceLayouts {
    pub(crate) fn new(gpu: &Context) -> Self {
        let device = &gpu.device;
        let all = ShaderStages::VERTEX_FRAGMENT | ShaderStages::COMPUTE;
        let uniform = |binding| {
            let ty = BindingType::Buffer {
                ty: BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            };
            wgpu::BindGroupLayoutEntry { binding, visibility: all, ty, count: None }
        };
        let texture = |binding, sample_type, view_dimension| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::FRAGMENT | ShaderStages::COMPUTE,
            ty: BindingType::Texture { sample_type, view_dimension, multisampled: false },
            count: None,
        };
        let depth = texture(2, wgpu::TextureSampleType::Depth, wgpu::TextureViewDimension::D2);
        let layout = |label, entries: &[_]| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        let frame = layout("frame and draw", &[uniform(0), uniform(1), depth]);
        let unshaded = ShaderStages::VERTEX | ShaderStages::COMPUTE;
        let scene = layout("scene", &[0, 1, 2].map(|binding| storage_entry(binding, unshaded, true)));
        let texels = wgpu::TextureSampleType::Float { filterable: false };
        let texture_layout = layout("texture", &[texture(0, texels, wgpu::TextureViewDimension::D2Array)]);
        let one_texel = |format| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some("none"),
                size: wgpu::Extent3d::default(),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        };
        let no_depth = one_texel(wgpu::TextureFormat::Depth32Float).create_view(&Default::default());
        let no_texels = one_texel(wgpu::TextureFormat::Rgba8UnormSrgb);
        let no_texture = texture_group(device, &texture_layout, &no_texels);
        Self {
            frame,
            scene,
            texture: texture_layout,
            vertex: shader(gpu, "vertex", shaders::VERTEX),
            no_texture,
            no_depth,
        }
    }

    pub(crate) fn texture_bind_group(&self, gpu: &Context, texture: &wgpu::Texture) -> BindGroup {
        texture_group(&gpu.device, &self.texture, texture)
    }
}

fn texture_group(device: &wgpu::Device, layout: &BindGroupLayout, texture: &wgpu::Texture) -> BindGroup {
    let view = table::view(texture);
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("texture"),
        layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) }],
    })
}

/// The layout entry of a storage buffer.
pub(crate) fn storage_entry(binding: u32, visibility: ShaderStages, read_only: bool) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: BindingType::Buffer {
            ty: BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}

/// A linked shader as a module.
pub(crate) fn shader(gpu: &Context, label: &str, wgsl: &'static str) -> wgpu::ShaderModule {
    gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(wgsl.into()),
    })
}

impl<'a> Surfaces<'a> {
    /// Works out all draws of a view and sends what the shaders need to know of them.
    pub(crate) fn new(
        gpu: &Context,
        layouts: &'a SurfaceLayouts,
        upload: &'a SceneUpload,
        (scene, view): (&Scene, &View),
        groups: &'a DrawGroups,
    ) -> Result<Self, GpuError> {
        let stride = draw_stride(gpu);
        let core_draws = draws(scene, view)?;
        let mut bytes = vec![0; stride * core_draws.len().max(1)];
        let mut dropped_triangles = 0;
        let mut all_data = Vec::with_capacity(core_draws.len());
        let surface_draws = (core_draws.iter().zip(scene.instances()).zip(bytes.chunks_exact_mut(stride)).enumerate())
            .map(|(i, ((draw, instance), bytes))| {
                let mesh = &upload.meshes[instance.mesh.index()];
                let may_overflow = may_overflow(draw, mesh.reach);
                if may_overflow {
                    dropped_triangles += count_dropped(draw);
                }
                let atlas = draw.texture.map(|(_, texture)| upload.atlas.places[texture.texture.index()]);
                let data = DrawData::new(draw, i as u32, &mesh.places, atlas.unwrap_or_default());
                all_data.push(data);
                bytes[..size_of::<DrawData>()].copy_from_slice(bytemuck::bytes_of(&data));
                SurfaceDraw {
                    pass: draw.pass,
                    corners: draw.mesh.triangles().len() as u32 * 3,
                    is_apart: may_overflow,
                    mesh: instance.mesh.index(),
                    cull: match (draw.culls_back_faces, draw.mirrored) {
                        (false, _) => Cull::None,
                        (true, false) => Cull::Back,
                        (true, true) => Cull::BackMirrored,
                    },
                    varies: draw.varies(),
                    has_cutoff: draw.cutoff.is_some(),
                    texture: draw.texture.map(|(_, material)| material.texture.index()),
                    instance: i,
                }
            })
            .collect::<Vec<_>>();
        gpu.queue.write_buffer(&groups.instances, 0, &bytes);
        let has_opaque = surface_draws.iter().any(|draw| draw.pass == Pass::Opaque);
        Ok(Self { draws: surface_draws, has_opaque, scene: upload, layouts, groups, data: all_data, dropped_triangles })
    }

    /// Group 1.
    pub(crate) fn scene_group(&self) -> &BindGroup {
        &self.scene.bind_group
    }

    /// All draws of transparent surfaces, in draw order.
    pub(crate) fn compute_draws(&self) -> impl Iterator<Item = ComputeDraw<'_>> {
        self.draws.iter().filter(|draw| draw.pass == Pass::Transparent).map(|draw| ComputeDraw {
            instance: draw.instance,
            mesh: draw.mesh,
            varies: draw.varies,
            frame_group: &self.groups_of(Pass::Transparent)[draw.instance],
            texture: draw.texture.map_or(&self.layouts.no_texture, |texture| &self.scene.textures[texture]),
        })
    }

    /// Group 0 of all instances. Where nothing is opaque, nothing looks for it in memory.
    fn groups_of(&self, pass: Pass) -> &[BindGroup] {
        match pass {
            Pass::Transparent if self.has_opaque => &self.groups.before_opaque,
            _ => &self.groups.alone,
        }
    }

    /// How many draws there are of transparent surfaces.
    pub(crate) fn count_transparent(&self) -> usize {
        self.draws.iter().filter(|draw| draw.pass == Pass::Transparent).count()
    }

    /// Whether any draw of a part of the frame has to pass an alpha test.
    pub(crate) fn has_cutoff(&self, pass: Pass) -> bool {
        self.draws.iter().any(|draw| draw.pass == pass && draw.has_cutoff)
    }

    /// What a recording of transparent surfaces depends on.
    pub(crate) fn structure(&self) -> Structure {
        Structure {
            scene: self.scene.bind_group.clone(),
            groups: self.groups_of(Pass::Transparent).first().cloned(),
            draws: self.draws.iter().filter(|draw| draw.pass == Pass::Transparent).copied().collect(),
        }
    }

    /// Records all draws of a part of the frame, in draw order, into a pass or a bundle. Group 3 must be set if the
    /// pipelines have one.
    pub(crate) fn draw<'r>(
        &'r self,
        gpu: &Context,
        recording: &mut impl RenderEncoder<'r>,
        pass: Pass,
        pipelines: &'r mut SurfacePipelines,
    ) {
        recording.set_bind_group(1, Some(&self.scene.bind_group), &[]);
        self.for_each_draw(gpu, pass, pipelines, |draw| {
            recording.set_pipeline(draw.pipeline);
            recording.set_bind_group(0, Some(draw.frame_group), &[]);
            recording.set_bind_group(2, Some(draw.texture), &[]);
            match draw.shared {
                None => recording.draw(0..draw.corners, 0..1),
                Some((corners, order)) => {
                    recording.set_vertex_buffer(0, Some(corners.slice(..)));
                    recording.set_index_buffer(order.slice(..), wgpu::IndexFormat::Uint32);
                    recording.draw_indexed(0..draw.corners, 0, 0..1);
                }
            }
        });
    }

    fn for_each_draw<'r>(
        &'r self,
        gpu: &Context,
        pass: Pass,
        pipelines: &'r mut SurfacePipelines,
        visit: impl FnMut(DrawCommand<'r>),
    ) {
        let draws = || self.draws.iter().filter(|draw| draw.pass == pass);
        let ignores_color = pipelines.ignores_color;
        let has_opaque = self.has_opaque && pipelines.captures();
        let key = |draw: &SurfaceDraw| {
            let varied = if ignores_color { draw.has_cutoff } else { draw.varies };
            PipelineKey { cull: draw.cull, varied, is_apart: draw.is_apart, has_opaque }
        };
        draws().for_each(|draw| pipelines.make(gpu, self.layouts, key(draw)));
        let pipelines = &pipelines.pipelines;
        let commands = draws().map(|draw| DrawCommand {
            pipeline: &pipelines[&key(draw)],
            frame_group: &self.groups_of(pass)[draw.instance],
            texture: draw.texture.map_or(&self.layouts.no_texture, |texture| &self.scene.textures[texture]),
            corners: draw.corners,
            shared: (!draw.is_apart).then(|| {
                let mesh = &self.scene.meshes[draw.mesh];
                (&mesh.corners, &mesh.order)
            }),
        });
        commands.for_each(visit);
    }
}

/// Bytes from the data of one draw to the next.
fn draw_stride(gpu: &Context) -> usize {
    size_of::<DrawData>().next_multiple_of(gpu.limits.min_uniform_buffer_offset_alignment as usize)
}

impl DrawGroups {
    /// The groups for so many instances before this opaque depth: those there are if they fit, else new ones.
    pub(crate) fn ensure<'k>(
        kept: &'k mut Option<Self>,
        gpu: &Context,
        layouts: &SurfaceLayouts,
        instances: usize,
        opaque_depth: &wgpu::TextureView,
    ) -> Result<&'k Self, GpuError> {
        let bytes = (draw_stride(gpu) * instances.max(1)) as u64;
        kept.take_if(|kept| kept.instances.size() != bytes || kept.opaque_depth != *opaque_depth);
        Ok(match kept {
            Some(kept) => kept,
            none => none.insert(Self::new(gpu, layouts, bytes, opaque_depth)?),
        })
    }

    fn new(
        gpu: &Context,
        layouts: &SurfaceLayouts,
        bytes: u64,
        opaque_depth: &wgpu::TextureView,
    ) -> Result<Self, GpuError> {
        let uniform = wgpu::BufferUsages::UNIFORM;
        let copied = wgpu::BufferUsages::COPY_DST;
        let frame_data = gpu.buffer("the frame", size_of::<FrameData>() as u64, uniform | copied)?;
        let instances = gpu.buffer("the instances", bytes, uniform | copied)?;
        let draw_data = |offset| {
            wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &instances,
                offset,
                size: std::num::NonZeroU64::new(size_of::<DrawData>() as u64),
            })
        };
        let group = |depth, offset| {
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("frame and draw"),
                layout: &layouts.frame,
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: frame_data.as_entire_binding() },
                    wgpu::BindGroupEntry { binding: 1, resource: draw_data(offset) },
                    wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(depth) },
                ],
            })
        };
        let offsets = || (0..bytes).step_by(draw_stride(gpu));
        let before_opaque = offsets().map(|offset| group(opaque_depth, offset)).collect();
        let alone = offsets().map(|offset| group(&layouts.no_depth, offset)).collect();
        Ok(Self { frame_data, instances, opaque_depth: opaque_depth.clone(), before_opaque, alone })
    }
}

/// Whether clip coordinates of a mesh that reaches so far could leave the range of f32.
fn may_overflow(draw: &Draw<'_>, reach: glam::Vec3) -> bool {
    let bound = draw.clip_from_mesh.to_cols_array_2d().map(|column| column.map(|value| f64::from(value.abs())));
    (0..4).any(|row| {
        let [x, y, z, w] = bound.map(|column| column[row]);
        let greatest = x * f64::from(reach.x) + y * f64::from(reach.y) + z * f64::from(reach.z) + w;
        // Half of it, for rounding.
        greatest.is_nan() || greatest >= f64::from(f32::MAX) * 0.5
    })
}

fn count_dropped(draw: &Draw<'_>) -> u64 {
    let is_finite = |&vertex: &u32| {
        let position = draw.mesh.positions()[vertex as usize];
        pellucid_core::primitive::transform_point(&draw.clip_from_mesh, position).is_finite()
    };
    draw.mesh.triangles().iter().filter(|triangle| !triangle.iter().all(is_finite)).count() as u64
}
