//! The example itself, apart from files and devices.

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Vec2, Vec3, Vec4};
use pellucid_core::fbuffer::order::Geometry;
use pellucid_core::fbuffer::{Drawn, Output, Size};
use pellucid_core::primitive::Pass;
use pellucid_core::{Image, Instance, Material, Mesh, Scene, View};
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

/// Draws a ring of pitted glass: linear light, premultiplied.
pub(crate) fn render(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    [width, height]: [u32; 2],
    side: u32,
) -> Result<(Image, Drawn), FBufferError> {
    // A mesh, and a camera that looks at it. Blending is in draw order: what is farther comes first.
    let eye = Vec3::new(0.0, 3.7, 4.8);
    let (vertices, mut triangles) = ring();
    let distance = |triangle: &[u32; 3]| {
        triangle.map(|i| vertices[i as usize].position.truncate().distance(eye)).iter().sum::<f32>()
    };
    triangles.sort_by(|a, b| distance(b).total_cmp(&distance(a)));
    let mut scene = Scene::new();
    let positions = vertices.iter().map(|vertex| vertex.position.truncate()).collect();
    let mesh = scene.add_mesh(Mesh::new(positions, triangles.clone())?)?;
    let material = scene.add_material(Material { double_sided: true, ..Material::translucent("glass", Vec4::ONE) })?;
    scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY })?;
    let mut view = View::of(&scene).size(width, height);
    (view.camera.eye, view.camera.target) = (eye, Vec3::ZERO);

    // What the passes need to know of it is theirs: bind group 0.
    let buffer = |contents: &[u8]| {
        let usage = wgpu::BufferUsages::STORAGE;
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
    };
    let mut first_vertex = vec![Vertex { position: eye.extend(1.0), normal: Vec4::ZERO }];
    first_vertex.extend(&vertices);
    let buffers = [buffer(bytemuck::cast_slice(&first_vertex)), buffer(bytemuck::cast_slice(triangles.as_flattened()))];
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
    let drawing = fbuffer.drawing(Geometry::new(&scene, &view, Pass::Transparent)?)?;
    let target = fbuffer.target(width, height, Vec4::new(0.02, 0.022, 0.03, 1.0))?;
    let drawn = fbuffer.draw(&drawing, &program, [Some(&group), None, None], Output::default(), &target)?;
    Ok((fbuffer.read(&target)?, drawn))
}

/// A torus: 128 x 64 vertices.
fn ring() -> (Vec<Vertex>, Vec<[u32; 3]>) {
    const AROUND: u32 = 128;
    const ACROSS: u32 = 64;
    let angle = |i: u32, count: u32| Vec2::from_angle(i as f32 / count as f32 * std::f32::consts::TAU);
    let vertices = (0..AROUND * ACROSS).map(|i| {
        let (around, across) = (angle(i / ACROSS, AROUND), angle(i % ACROSS, ACROSS));
        let outward = Vec3::new(around.x, 0.0, around.y);
        let normal = outward * across.x + Vec3::Y * across.y;
        Vertex { position: (outward + normal * 0.45).extend(1.0), normal: normal.extend(0.0) }
    });
    let at = |around: u32, across: u32| around % AROUND * ACROSS + across % ACROSS;
    let triangles = (0..AROUND * ACROSS).flat_map(|i| {
        let (u, v) = (i / ACROSS, i % ACROSS);
        let [a, b, c, d] = [at(u, v), at(u, v + 1), at(u + 1, v + 1), at(u + 1, v)];
        [[a, b, c], [a, c, d]]
    });
    (vertices.collect(), triangles.collect())
}
