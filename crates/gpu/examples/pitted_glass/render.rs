//! The example itself, apart from files and devices.

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Vec2, Vec3, Vec4};
use pellucid_core::fbuffer::order::Geometry;
use pellucid_core::fbuffer::{Drawn, Output, Size};
use pellucid_core::primitive::Pass;
use pellucid_core::{Error, Image, Instance, Material, Mesh, Scene, View};
use pellucid_gpu::fbuffer::{Content, FBuffer, FBufferError};
use pellucid_gpu::wgpu;
use wgpu::util::DeviceExt as _;

/// Twin: `Vertex` in `glass.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Vertex {
    position: Vec4,
    normal: Vec4,
}

/// A mesh of one's own: a ring, and a camera that looks at it.
pub(crate) fn scene([width, height]: [u32; 2]) -> Result<(Scene, View), Error> {
    let eye = Vec3::new(0.0, 3.7, 4.8);
    let mut scene = Scene::new();
    let mesh = scene.add_mesh(ring(eye)?)?;
    let material = scene.add_material(Material { double_sided: true, ..Material::translucent("glass", Vec4::ONE) })?;
    scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY })?;
    let mut view = View::of(&scene).size(width, height).background(Vec4::new(0.02, 0.022, 0.03, 1.0));
    (view.camera.eye, view.camera.target) = (eye, Vec3::ZERO);
    Ok((scene, view))
}

/// Draws a scene's first mesh, which has normals and is placed where it is, as pitted glass: linear light, premultiplied.
pub(crate) fn render(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    (scene, view): (&Scene, &View),
    side: u32,
) -> Result<(Image, Drawn), FBufferError> {
    // What the passes need to know of the mesh is theirs: bind group 0.
    let mesh = &scene.meshes()[0];
    let corners = mesh.positions().iter().zip(mesh.normals().unwrap_or_default());
    let vertices = corners.map(|(at, normal)| Vertex { position: at.extend(1.0), normal: normal.extend(0.0) });
    let eye = Vertex { position: view.camera.eye.extend(1.0), normal: Vec4::ZERO };
    let vertices: Vec<Vertex> = std::iter::once(eye).chain(vertices).collect();
    let buffer = |contents: &[u8]| {
        let usage = wgpu::BufferUsages::STORAGE;
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
    };
    let buffers = [bytemuck::cast_slice(&vertices), bytemuck::cast_slice(mesh.triangles())].map(buffer);
    let entry = |binding| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let layout = device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &[entry(0), entry(1)] });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layout,
        entries: &[0, 1].map(|binding: u32| wgpu::BindGroupEntry {
            binding,
            resource: buffers[binding as usize].as_entire_binding(),
        }),
    });

    // Two F-Buffers: one for the surface, one with two targets for light.
    let contents = [("surface", Content::Targets(1)), ("light", Content::Targets(2))];
    let mut fbuffer = FBuffer::new(device, queue, Size::square(side)?, &contents)?;
    let passes = [include_str!("bump.wgsl"), include_str!("refract.wgsl"), include_str!("show.wgsl")];
    let passes = passes.map(|pass| format!("{}{pass}", include_str!("glass.wgsl")));
    let program = fbuffer.program(&passes.each_ref().map(String::as_str), [Some(&layout), None, None])?;
    let drawing = fbuffer.drawing(Geometry::new(scene, view, Pass::Transparent)?)?;
    let target = fbuffer.target(view.width, view.height, view.background)?;
    let drawn = fbuffer.draw(&drawing, &program, [Some(&group), None, None], Output::default(), &target)?;
    Ok((fbuffer.read(&target)?, drawn))
}

/// A torus of 128 x 64 vertices. Blending is in draw order, so its triangles come from far to near.
fn ring(eye: Vec3) -> Result<Mesh, Error> {
    const AROUND: u32 = 128;
    const ACROSS: u32 = 64;
    let angle = |i: u32, count: u32| Vec2::from_angle(i as f32 / count as f32 * std::f32::consts::TAU);
    let (positions, normals): (Vec<Vec3>, Vec<Vec3>) = (0..AROUND * ACROSS)
        .map(|i| {
            let (around, across) = (angle(i / ACROSS, AROUND), angle(i % ACROSS, ACROSS));
            let outward = Vec3::new(around.x, 0.0, around.y);
            let normal = outward * across.x + Vec3::Y * across.y;
            (outward + normal * 0.45, normal)
        })
        .unzip();
    let at = |around: u32, across: u32| around % AROUND * ACROSS + across % ACROSS;
    let mut triangles: Vec<[u32; 3]> = (0..AROUND * ACROSS)
        .flat_map(|i| {
            let (u, v) = (i / ACROSS, i % ACROSS);
            let [a, b, c, d] = [at(u, v), at(u, v + 1), at(u + 1, v + 1), at(u + 1, v)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let distance = |triangle: &[u32; 3]| -> f32 { triangle.map(|i| positions[i as usize].distance(eye)).iter().sum() };
    triangles.sort_by(|a, b| distance(b).total_cmp(&distance(a)));
    Mesh::new(positions, triangles)?.with_normals(normals)
}
