//! Set-up of quads, and clipping of those triangles that need it. Twin: `shaders/technique/lucid/setup.wesl`.

use glam::{Vec3, Vec4};
use pellucid_core::pixel_grid::Viewport;
use pellucid_core::primitive::draws;
use pellucid_core::{Mesh, Scene};
use wgpu::{BindGroupLayout, ComputePipeline, Features};

use super::layouts::Bound::{ReadWrite, Stored, Table};
use super::record::Clipped;
use super::work::{self, Counts, Header};
use super::{LoadedScene, Stage, quads, stage_group, stage_layout};
use crate::frame::Frame;
use crate::pass::grid::dispatch;
use crate::pass::ordered::compute_pipeline;
use crate::readback::read_buffer;
use crate::surface::{SurfaceLayouts, shader};
use crate::upload::MeshUpload;
use crate::{Context, GpuError, shaders, table};

/// Invocations of a workgroup.
const LANES: u64 = 64;

/// Long-lived half.
#[derive(Debug)]
pub(super) struct Setup {
    vertices: BindGroupLayout,
    quads: BindGroupLayout,
    buffers: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl Setup {
    pub(super) fn new(gpu: &Context, surfaces: &SurfaceLayouts) -> Self {
        let (vertices, quads) = (stage_layout(gpu, &[(0, Table)]), stage_layout(gpu, &[(0, Table)]));
        let buffers = stage_layout(
            gpu,
            &[(0, ReadWrite), (1, Stored(table::GROUPS)), (2, ReadWrite), (3, ReadWrite), (4, ReadWrite)],
        );
        let has_subgroups = gpu.has(Features::SUBGROUP);
        let wgsl = if has_subgroups { shaders::LUCID_SETUP_SUBGROUPS } else { shaders::LUCID_SETUP };
        let module = shader(gpu, "set-up", wgsl);
        let layouts = [&surfaces.frame, &vertices, &quads, &buffers].map(Some);
        let pipeline = compute_pipeline(gpu, "set-up", &module, "main", &layouts, &[]);
        Self { vertices, quads, buffers, pipeline }
    }

    /// Sets up all transparent surfaces, draw by draw.
    pub(super) fn record(&self, frame: &mut Frame<'_>, stage: &Stage<'_>, scene: &LoadedScene) -> Result<(), GpuError> {
        let (gpu, buffers) = (frame.gpu, stage.buffers);
        let vertices = stage_group(gpu, &self.vertices, &[(0, &scene.vertices[0])], &[]);
        let bindings = [(0, &buffers.work), (2, &buffers.parts), (3, &buffers.places), (4, &buffers.block_parts)];
        let group = stage_group(gpu, &self.buffers, &[(1, &buffers.records)], &bindings);
        let mut pass = frame.compute_pass("set-up")?;
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &vertices, &[]);
        pass.set_bind_group(3, &group, &[]);
        for draw in frame.surfaces.compute_draws() {
            let MeshQuads { table: Some(quads), count, .. } = &scene.quads[draw.mesh] else { continue };
            pass.set_bind_group(0, draw.frame_group, &[]);
            pass.set_bind_group(2, &stage_group(gpu, &self.quads, &[(0, quads)], &[]), &[]);
            dispatch(&mut pass, (*count as u64).div_ceil(LANES));
        }
        Ok(())
    }
}

/// The quads of a mesh.
#[derive(Debug)]
pub(super) struct MeshQuads {
    /// A table; none if there are none.
    pub(super) table: Option<wgpu::TextureView>,
    pub(super) count: usize,
    /// Those with one triangle only.
    pub(super) lone: usize,
}

pub(super) fn upload(gpu: &Context, mesh: &Mesh, uploaded: &MeshUpload) -> Result<MeshQuads, GpuError> {
    let quads = quads::quads(mesh, uploaded.places.first_vertex);
    let (count, lone) = (quads.len(), quads::lone(&quads));
    if quads.is_empty() {
        return Ok(MeshQuads { table: None, count, lone });
    }
    let groups = quads.iter().flat_map(|quad| {
        let [a, b] = quad.triangles;
        [quad.vertices, [a, b, count as u32, 0]]
    });
    let quads = table::upload(gpu, "a mesh's quads", 2 * count as u64, groups)?;
    Ok(MeshQuads { table: Some(table::view(&quads)), count, lone })
}

/// Tables of a group a vertex: positions and u, normals and v, colours. The last is empty where no mesh has any.
pub(super) fn upload_vertices(gpu: &Context, scene: &Scene) -> Result<[wgpu::TextureView; 3], GpuError> {
    let group = |v: Vec4| v.to_array().map(f32::to_bits);
    let count: u64 = scene.meshes().iter().map(|mesh| mesh.positions().len() as u64).sum();
    let with_tex_coord = |mesh: &Mesh, i: usize, vector: Vec3, axis: usize| {
        vector.extend(mesh.tex_coords().map_or(0.0, |tex_coords| tex_coords[i][axis]))
    };
    let meshes = || scene.meshes().iter().flat_map(|mesh| (0..mesh.positions().len()).map(move |i| (mesh, i)));
    let positions = meshes().map(|(mesh, i)| with_tex_coord(mesh, i, mesh.positions()[i], 0));
    let normals = meshes().map(|(mesh, i)| {
        let normal = mesh.normals().map_or(Vec3::ZERO, |normals| normals[i]);
        with_tex_coord(mesh, i, normal, 1)
    });
    let color_count = if scene.meshes().iter().any(|mesh| mesh.colors().is_some()) { count } else { 0 };
    let colors = meshes().map(|(mesh, i)| mesh.colors().map_or(Vec4::ZERO, |colors| colors[i]));
    let tables = [
        table::upload(gpu, "the scene's positions", count, positions.map(group))?,
        table::upload(gpu, "the scene's normals", count, normals.map(group))?,
        table::upload(gpu, "the scene's colours", color_count, colors.take(color_count as usize).map(group))?,
    ];
    Ok(tables.each_ref().map(table::view))
}

/// Clips what set-up listed, and adds its pieces to the large triangles. Whether there was room for them.
pub(super) fn clip(frame: &mut Frame<'_>, stage: &Stage<'_>, header: &Header) -> Result<bool, GpuError> {
    let (gpu, work) = (frame.gpu, &stage.buffers.work);
    let Header { counts, room, first, .. } = header;
    let words: Vec<u32> = read_buffer(frame, work, first.clipped.into(), u64::from(counts.clipped) * 2)?;
    let mut listed: Vec<[u32; 2]> = words.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
    // They come in any order.
    listed.sort_unstable();
    let draws = draws(frame.scene, frame.view)?;
    let draws = (&draws[..], &frame.surfaces.data[..]);
    let clipped = Clipped::new(draws, &Viewport::of(frame.view), &listed, counts.records);
    let with_clipped = Counts {
        records: counts.records + clipped.records(),
        large: counts.large + clipped.triangles.len() as u32,
        ..*counts
    };
    if !with_clipped.fits(room) {
        return Ok(false);
    }
    let queue = &gpu.queue;
    table::write_from(gpu, stage.buffers.records.texture(), work::record_groups(counts), &clipped.groups);
    let after = u64::from(first.large + counts.large) * 4;
    queue.write_buffer(work, after, bytemuck::cast_slice(&clipped.triangles));
    queue.write_buffer(work, 0, bytemuck::bytes_of(&with_clipped));
    Ok(true)
}
