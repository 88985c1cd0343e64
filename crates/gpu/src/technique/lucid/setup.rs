//! Set-up of quads, and clipping of those triangles that need it. Twin: `shaders/technique/lucid/setup.wesl`.

use pellucid_core::Mesh;
use pellucid_core::pixel_grid::Viewport;
use pellucid_core::primitive::draws;
use wgpu::{BindGroupLayout, BufferUsages, ComputePipeline, Features};

use super::record::Clipped;
use super::work::{Counts, Header, RECORD_BYTES};
use super::{Stage, buffer_group, buffers_layout, quads};
use crate::fbuffer::dispatch;
use crate::frame::Frame;
use crate::pass::ordered::compute_pipeline;
use crate::readback::read_buffer;
use crate::surface::{SurfaceLayouts, shader};
use crate::upload::MeshUpload;
use crate::{Context, GpuError, shaders};

/// Invocations of a workgroup.
const LANES: u64 = 64;

/// Long-lived half.
#[derive(Debug)]
pub(super) struct Setup {
    positions: BindGroupLayout,
    quads: BindGroupLayout,
    buffers: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl Setup {
    pub(super) fn new(gpu: &Context, surfaces: &SurfaceLayouts) -> Self {
        let (positions, quads) = (buffers_layout(gpu, &[(0, true)]), buffers_layout(gpu, &[(0, true)]));
        let buffers = buffers_layout(gpu, &[0, 1, 2, 3, 4].map(|binding| (binding, false)));
        let has_subgroups = gpu.has(Features::SUBGROUP);
        let wgsl = if has_subgroups { shaders::LUCID_SETUP_SUBGROUPS } else { shaders::LUCID_SETUP };
        let module = shader(gpu, "set-up", wgsl);
        let layouts = [&surfaces.frame, &positions, &quads, &buffers].map(Some);
        let pipeline = compute_pipeline(gpu, "set-up", &module, "main", &layouts, &[]);
        Self { positions, quads, buffers, pipeline }
    }

    /// Sets up all transparent surfaces, draw by draw.
    pub(super) fn record(&self, frame: &mut Frame<'_>, stage: &Stage<'_>, quads: &[MeshQuads]) -> Result<(), GpuError> {
        let (gpu, buffers) = (frame.gpu, stage.buffers);
        let [positions, ..] = &frame.surfaces.scene().buffers;
        let positions = buffer_group(gpu, &self.positions, &[(0, positions)]);
        let all = [&buffers.work, &buffers.records, &buffers.parts, &buffers.places, &buffers.block_parts];
        let bindings: Vec<_> = (0..).zip(all).collect();
        let group = buffer_group(gpu, &self.buffers, &bindings);
        let mut pass = frame.compute_pass("set-up")?;
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &positions, &[]);
        pass.set_bind_group(3, &group, &[]);
        for draw in frame.surfaces.compute_draws() {
            let Some(quads) = &quads[draw.mesh].buffer else { continue };
            pass.set_bind_group(0, draw.frame_group, &[]);
            pass.set_bind_group(2, &buffer_group(gpu, &self.quads, &[(0, quads)]), &[]);
            dispatch(&mut pass, (quads.size() / size_of::<quads::Quad>() as u64).div_ceil(LANES));
        }
        Ok(())
    }
}

/// The quads of a mesh.
#[derive(Debug)]
pub(super) struct MeshQuads {
    /// None if there are none.
    pub(super) buffer: Option<wgpu::Buffer>,
    pub(super) count: usize,
    /// Those with one triangle only.
    pub(super) lone: usize,
}

pub(super) fn upload(gpu: &Context, mesh: &Mesh, uploaded: &MeshUpload) -> Result<MeshQuads, GpuError> {
    if mesh.triangles().len() >= quads::MOST_TRIANGLES {
        return Err(GpuError::Limit {
            what: "a mesh's triangles".into(),
            size: mesh.triangles().len() as u64,
            limit: quads::MOST_TRIANGLES as u64,
            limit_name: "triangles that can be paired",
        });
    }
    let quads = quads::quads(mesh, uploaded.places.first_vertex);
    let (count, lone) = (quads.len(), quads::lone(&quads));
    if quads.is_empty() {
        return Ok(MeshQuads { buffer: None, count, lone });
    }
    let bytes: &[u8] = bytemuck::cast_slice(&quads);
    let buffer = gpu.buffer("a mesh's quads", bytes.len() as u64, BufferUsages::STORAGE | BufferUsages::COPY_DST)?;
    gpu.queue.write_buffer(&buffer, 0, bytes);
    Ok(MeshQuads { buffer: Some(buffer), count, lone })
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
    let clipped = Clipped::new(&draws, &Viewport::of(frame.view), &listed, counts.records);
    let with_clipped = Counts {
        records: counts.records + clipped.records(),
        large: counts.large + clipped.triangles.len() as u32,
        ..*counts
    };
    if !with_clipped.fits(room) {
        return Ok(false);
    }
    let queue = &gpu.queue;
    let after = u64::from(counts.records) * RECORD_BYTES;
    queue.write_buffer(&stage.buffers.records, after, bytemuck::cast_slice(&clipped.words));
    let after = u64::from(first.large + counts.large) * 4;
    queue.write_buffer(work, after, bytemuck::cast_slice(&clipped.triangles));
    queue.write_buffer(work, 0, bytemuck::bytes_of(&with_clipped));
    Ok(true)
}
