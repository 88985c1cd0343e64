//! A scene on the GPU: corners and indices of each mesh to draw it, all meshes in three storage buffers for what shaders
//! have to know of whole triangles, textures with the mip levels of the core. Kept while the scene's revision stays the same.

pub(crate) mod atlas;
pub(crate) mod corners;

use glam::Vec3;
use pellucid_core::texture::MipLevel;
use pellucid_core::{Scene, Texture};
use wgpu::{BindGroup, BufferUsages, TextureUsages};

use self::atlas::AtlasLayout;
use self::corners::Corners;
use crate::gpu_data::MeshPlaces;
use crate::surface::SurfaceLayouts;
use crate::{Context, GpuError};

/// A mesh of the scene, and how far its vertices reach.
#[derive(Debug)]
pub(crate) struct MeshUpload {
    pub(crate) places: MeshPlaces,
    /// Greatest coordinate of a vertex that is used, on each axis; NaN or infinite if there is such a vertex.
    pub(crate) reach: Vec3,
    /// The vertex buffer.
    pub(crate) corners: wgpu::Buffer,
    /// The index buffer.
    pub(crate) order: wgpu::Buffer,
}

/// A scene on the GPU.
#[derive(Debug)]
pub(crate) struct SceneUpload {
    pub(crate) revision: u64,
    pub(crate) meshes: Vec<MeshUpload>,
    pub(crate) bind_group: BindGroup,
    pub(crate) textures: Vec<BindGroup>,
    /// Where textures would lie in an atlas.
    pub(crate) atlas: AtlasLayout,
}

impl SceneUpload {
    pub(crate) fn new(gpu: &Context, layouts: &SurfaceLayouts, scene: &Scene) -> Result<Self, GpuError> {
        let mut positions: Vec<f32> = Vec::new();
        let mut attributes: Vec<f32> = Vec::new();
        let mut indices: Vec<u32> = Vec::new();
        let mut meshes = Vec::with_capacity(scene.meshes().len());
        for mesh in scene.meshes() {
            let mut places = MeshPlaces {
                first_index: place(&indices)?,
                first_vertex: place(&positions)? / 3,
                normals: place(&attributes)?,
                ..MeshPlaces::default()
            };
            attributes.extend_from_slice(bytemuck::cast_slice(mesh.normals().unwrap_or_default()));
            places.tex_coords = place(&attributes)?;
            attributes.extend_from_slice(bytemuck::cast_slice(mesh.tex_coords().unwrap_or_default()));
            places.colors = place(&attributes)?;
            attributes.extend_from_slice(bytemuck::cast_slice(mesh.colors().unwrap_or_default()));
            positions.extend_from_slice(bytemuck::cast_slice(mesh.positions()));
            indices.extend(mesh.triangles().as_flattened().iter().map(|&vertex| places.first_vertex + vertex));
            let Corners { corners, order } = Corners::of(mesh, places.first_vertex);
            meshes.push(MeshUpload {
                places,
                reach: reach(mesh),
                corners: upload(gpu, "a mesh's corners", &corners, BufferUsages::VERTEX)?,
                order: upload(gpu, "a mesh's indices", order.as_flattened(), BufferUsages::INDEX)?,
            });
        }
        let buffers = [
            upload(gpu, "the scene's positions", &positions, BufferUsages::STORAGE)?,
            upload(gpu, "the scene's attributes", &attributes, BufferUsages::STORAGE)?,
            upload(gpu, "the scene's indices", &indices, BufferUsages::STORAGE)?,
        ];
        let entries = [0, 1, 2]
            .map(|binding| wgpu::BindGroupEntry { binding, resource: buffers[binding as usize].as_entire_binding() });
        let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("scene"),
            layout: &layouts.scene,
            entries: &entries,
        });
        let textures = scene
            .textures()
            .iter()
            .map(|texture| Ok(layouts.texture_bind_group(gpu, &upload_texture(gpu, texture)?)))
            .collect::<Result<_, GpuError>>()?;
        gpu.check()?;
        let atlas = AtlasLayout::of(scene.textures());
        Ok(Self { revision: scene.revision(), meshes, bind_group, textures, atlas })
    }
}

fn reach(mesh: &pellucid_core::Mesh) -> Vec3 {
    mesh.triangles().as_flattened().iter().fold(Vec3::ZERO, |reach, &vertex| {
        let position = mesh.positions()[vertex as usize].abs();
        // Unlike `max`, keeps what is not a number.
        Vec3::select(position.cmple(reach), reach, position)
    })
}

/// The place behind everything so far, in numbers.
fn place<T>(so_far: &[T]) -> Result<u32, GpuError> {
    u32::try_from(so_far.len()).map_err(|_| GpuError::Limit {
        what: "the scene".into(),
        size: so_far.len() as u64 * 4,
        limit: u64::from(u32::MAX) * 4,
        limit_name: "32-bit numbers",
    })
}

fn upload<T: bytemuck::Pod>(
    gpu: &Context,
    label: &str,
    data: &[T],
    usage: BufferUsages,
) -> Result<wgpu::Buffer, GpuError> {
    let bytes: &[u8] = bytemuck::cast_slice(data);
    // Bindings may not be empty.
    let size = (bytes.len() as u64).max(16);
    let buffer = gpu.buffer(label, size, usage | BufferUsages::COPY_DST)?;
    gpu.queue.write_buffer(&buffer, 0, bytes);
    Ok(buffer)
}

/// The full size as the first layer, and all smaller levels one under the other as the second; see
/// `shaders/shared/texture.wesl`.
fn upload_texture(gpu: &Context, texture: &Texture) -> Result<wgpu::Texture, GpuError> {
    let (full_size, smaller) = texture.levels().split_at(1);
    let height = |levels: &[MipLevel]| levels.iter().map(|level| level.height).sum::<u32>();
    let uploaded = gpu.texture(&wgpu::TextureDescriptor {
        label: Some("a texture of the scene"),
        size: wgpu::Extent3d {
            width: full_size[0].width,
            height: height(full_size).max(height(smaller)),
            depth_or_array_layers: if smaller.is_empty() { 1 } else { 2 },
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    })?;
    for (layer, levels) in (0..).zip([full_size, smaller]) {
        atlas::write(gpu, &uploaded, 0, layer, texture, levels);
    }
    Ok(uploaded)
}
