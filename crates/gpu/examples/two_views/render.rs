//! The example itself, apart from files and devices.

use bytemuck::{Pod, Zeroable};

use glam::camera::rh::{proj::directx, view::look_at_mat4};
use glam::{Mat4, Vec3, Vec4};
use pellucid_gpu::lfb::{Access, Lfb, LfbError, LfbOptions};
use pellucid_gpu::wgpu;
use wgpu::util::DeviceExt as _;

/// Twin: `View` in `scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct View {
    clip_from_world: Mat4,
    world_from_clip: Mat4,
    eye: Vec4,
    light: Vec4,
}

const TOWARDS_LIGHT: Vec3 = Vec3::new(-0.42, 0.78, -0.46);
/// Floor and panes, then spheres.
const QUADS: u32 = 3;
const THINGS: u32 = 9;
/// Six for each cell of a sphere's grid.
const SPHERE_VERTICES: u32 = 6 * 128 * 64;

/// Draws the picture: RGBA, 8 bits each, sRGB.
pub(crate) fn render(device: &wgpu::Device, queue: &wgpu::Queue, width: u32, height: u32) -> Result<Vec<u8>, LfbError> {
    let light = TOWARDS_LIGHT.normalize();
    let eye = Vec3::new(0.3, 3.6, 7.4);
    let camera_view = view(
        directx::perspective(0.62, width as f32 / height as f32, 0.5, 60.0)
            * look_at_mat4(eye, Vec3::new(0.15, 0.62, 0.0), Vec3::Y),
        eye.extend(1.0),
    );
    let light_view = view(
        directx::orthographic(-4.5, 4.5, -4.5, 4.5, 0.0, 20.0) * look_at_mat4(10.0 * light, Vec3::ZERO, Vec3::Y),
        light.extend(0.0),
    );

    // Twice the picture's size, to smooth edges.
    let mut camera = Lfb::new(device, queue, &LfbOptions::new(2 * width, 2 * height))?;
    let side = width.next_power_of_two().clamp(256, 1024);
    let mut light = Lfb::new(device, queue, &LfbOptions { payload_words: 1, ..LfbOptions::new(side, side) })?;

    let from_camera = Drawing::new(device, &camera, "camera", include_str!("camera.wgsl"), &camera_view)?;
    camera.capture(|encoder, group| from_camera.draw(encoder, group, 0))?;
    // The floor shades nothing.
    let from_light = Drawing::new(device, &light, "light", include_str!("light.wgsl"), &light_view)?;
    light.capture(|encoder, group| from_light.draw(encoder, group, 1))?;
    look(device, queue, &camera, &light, [&camera_view, &light_view], [width, height])
}

fn view(clip_from_world: Mat4, eye: Vec4) -> View {
    let light = TOWARDS_LIGHT.normalize().extend(0.0);
    View { clip_from_world, world_from_clip: clip_from_world.inverse(), eye, light }
}

/// The scene from one side: a pipeline, as any renderer has them, and a target that nothing is drawn to.
struct Drawing {
    pipeline: wgpu::RenderPipeline,
    view_group: wgpu::BindGroup,
    target: wgpu::TextureView,
}

impl Drawing {
    fn new(device: &wgpu::Device, lfb: &Lfb, name: &str, fragment: &str, view: &View) -> Result<Self, LfbError> {
        let text = lfb.module(name, 0, Access::Capture).wgsl()? + include_str!("scene.wgsl") + fragment;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source: wgpu::ShaderSource::Wgsl(text.into()),
        });
        let view_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(name),
            entries: &[uniform(0, wgpu::ShaderStages::VERTEX_FRAGMENT)],
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(name),
            bind_group_layouts: &[Some(lfb.layout(Access::Capture)), Some(&view_layout)],
            immediate_size: 0,
        });
        let format = wgpu::TextureFormat::R8Unorm;
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(name),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(name),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format,
                    blend: None,
                    write_mask: wgpu::ColorWrites::empty(),
                })],
            }),
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            multiview_mask: None,
            cache: None,
        });
        let &LfbOptions { width, height, .. } = lfb.options();
        let target = device.create_texture(&wgpu::TextureDescriptor {
            label: Some(name),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let view_buffer = uniform_buffer(device, view);
        let view_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(name),
            layout: &view_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: view_buffer.as_entire_binding() }],
        });
        Ok(Self { pipeline, view_group, target: target.create_view(&Default::default()) })
    }

    /// Draws everything from `first` on. Called for the counting and for the capturing pass.
    fn draw(&self, encoder: &mut wgpu::CommandEncoder, lfb: &wgpu::BindGroup, first: u32) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.target,
                depth_slice: None,
                resolve_target: None,
                ops: Default::default(),
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, lfb, &[]);
        pass.set_bind_group(1, &self.view_group, &[]);
        pass.draw(0..6, first..QUADS);
        pass.draw(0..SPHERE_VERTICES, QUADS..THINGS);
    }
}

/// Reads both LFBs in one shader, which makes the picture.
fn look(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    camera: &Lfb,
    light: &Lfb,
    views: [&View; 2],
    [width, height]: [u32; 2],
) -> Result<Vec<u8>, LfbError> {
    let text = camera.module("camera", 0, Access::Read).wgsl()?
        + &light.module("light", 1, Access::Read).wgsl()?
        + include_str!("look.wgsl");
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("look"),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let stages = wgpu::ShaderStages::COMPUTE;
    let picture = wgpu::BufferBindingType::Storage { read_only: false };
    let own_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("look"),
        entries: &[uniform(0, stages), uniform(1, stages), buffer_entry(2, stages, picture)],
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("look"),
        bind_group_layouts: &[Some(camera.layout(Access::Read)), Some(light.layout(Access::Read)), Some(&own_layout)],
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("look"),
        layout: Some(&layout),
        module: &module,
        entry_point: Some("look"),
        compilation_options: Default::default(),
        cache: None,
    });
    let bytes = u64::from(width) * u64::from(height) * 4;
    let buffer = |usage| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: bytes,
            usage,
            mapped_at_creation: false,
        })
    };
    let picture = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let staging = buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    let views = views.map(|view| uniform_buffer(device, view));
    let own_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("look"),
        layout: &own_layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: views[0].as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: views[1].as_entire_binding() },
            wgpu::BindGroupEntry { binding: 2, resource: picture.as_entire_binding() },
        ],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, camera.read_group()?, &[]);
    pass.set_bind_group(1, light.read_group()?, &[]);
    pass.set_bind_group(2, &own_group, &[]);
    pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&picture, 0, &staging, 0, bytes);
    queue.submit([encoder.finish()]);
    staging.map_async(wgpu::MapMode::Read, .., |_| {});
    let lost = |error: String| LfbError::Device(error);
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| lost(error.to_string()))?;
    Ok(staging.get_mapped_range(..).map_err(|error| lost(error.to_string()))?.to_vec())
}

fn uniform_buffer(device: &wgpu::Device, view: &View) -> wgpu::Buffer {
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("view"),
        contents: bytemuck::bytes_of(view),
        usage: wgpu::BufferUsages::UNIFORM,
    })
}

fn uniform(binding: u32, visibility: wgpu::ShaderStages) -> wgpu::BindGroupLayoutEntry {
    buffer_entry(binding, visibility, wgpu::BufferBindingType::Uniform)
}

fn buffer_entry(
    binding: u32,
    visibility: wgpu::ShaderStages,
    ty: wgpu::BufferBindingType,
) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}
