//! The ordered layers of a window, handed out. Twin: `shaders/pass/gather.wesl`.
//!
//! Fragments are copied into one array in the order in which the CPU holds them, whatever structure they were captured
//! in. Their places follow from the counts, which are summed up on the CPU: this path is for those who want the layers
//! themselves, not for pictures.

use glam::Vec4;
use half::f16;
use pellucid_core::layers::OpaqueSurface;
use pellucid_core::{Fragment, Layers};
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, ShaderStages};

use crate::frame::{Frame, Goal};
use crate::memory::Window;
use crate::pass::ordered::compute_pipeline;
use crate::pass::picture::GROUP_PX;
use crate::readback::{read_buffer, read_texture};
use crate::surface::{shader, storage_entry};
use crate::{Context, GpuError};

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct Gather {
    layout: BindGroupLayout,
    count: ComputePipeline,
    copy: ComputePipeline,
}

impl Gather {
    pub(crate) fn new(
        gpu: &Context,
        wgsl: &'static str,
        [picture_layout, lfb_layout]: [&BindGroupLayout; 2],
        order_layout: Option<&BindGroupLayout>,
    ) -> Self {
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("gather"),
            entries: &[0, 1].map(|binding| storage_entry(binding, ShaderStages::COMPUTE, false)),
        });
        let module = shader(gpu, "gather", wgsl);
        let layouts = [Some(picture_layout), Some(&layout), order_layout, Some(lfb_layout)];
        let pipeline = |entry| compute_pipeline(gpu, "gather", &module, entry, &layouts, &[]);
        Self { count: pipeline("count"), copy: pipeline("copy"), layout }
    }

    /// Adds the ordered layers of a window to the frame's goal.
    pub(crate) fn read(
        &self,
        frame: &mut Frame<'_>,
        window: Window,
        lfb: &BindGroup,
        order: Option<&BindGroup>,
    ) -> Result<(), GpuError> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let gpu = frame.gpu;
        let starts = gpu.buffer("the layers' counts", window.pixels() * 4, usage)?;
        let none = gpu.buffer("the layers", 16, usage)?;
        self.dispatch(frame, &self.count, window, [&starts, &none], (lfb, order))?;
        let mut ends: Vec<u32> = read_buffer(frame, &starts, 0, window.pixels())?;
        let mut total = 0u64;
        let firsts: Vec<u32> = ends
            .iter_mut()
            .map(|count| {
                let first = total as u32;
                total += u64::from(*count);
                *count = total as u32;
                first
            })
            .collect();
        gpu.queue.write_buffer(&starts, 0, bytemuck::cast_slice(&firsts));
        let gathered = gpu.buffer("the layers", (total * 16).max(16), usage)?;
        self.dispatch(frame, &self.copy, window, [&starts, &gathered], (lfb, order))?;
        let stored: Vec<[u32; 4]> = read_buffer(frame, &gathered, 0, total)?;
        let fragments = stored.into_iter().map(unpack).collect();
        let opaque = opaque_surfaces(frame, window)?;
        let Window { left, top, width, height } = window;
        if let Goal::Layers(all) = &mut frame.goal {
            all.push(Layers { left, top, width, height, ends, fragments, opaque });
        }
        Ok(())
    }

    fn dispatch(
        &self,
        frame: &mut Frame<'_>,
        pipeline: &ComputePipeline,
        window: Window,
        buffers: [&wgpu::Buffer; 2],
        (lfb, order): (&BindGroup, Option<&BindGroup>),
    ) -> Result<(), GpuError> {
        let group = frame.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("gather"),
            layout: &self.layout,
            entries: &[0, 1].map(|binding: u32| wgpu::BindGroupEntry {
                binding,
                resource: buffers[binding as usize].as_entire_binding(),
            }),
        });
        let mut pass = frame.compute_pass("gather")?;
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &frame.picture.bind_group, &[]);
        pass.set_bind_group(1, &group, &[]);
        pass.set_bind_group(2, order, &[]);
        pass.set_bind_group(3, lfb, &[]);
        pass.dispatch_workgroups(window.width.div_ceil(GROUP_PX), window.height.div_ceil(GROUP_PX), 1);
        Ok(())
    }
}

/// A stored fragment as the core has it. Twin: `unpack` in `shaders/shared/fragment.wesl`.
pub(crate) fn unpack([rg, ba, depth, primitive]: [u32; 4]) -> Fragment {
    let half = |bits: u32| f16::from_bits(bits as u16).to_f32();
    Fragment {
        color: Vec4::new(half(rg), half(rg >> 16), half(ba), half(ba >> 16)),
        depth: f32::from_bits(depth),
        primitive,
    }
}

pub(crate) fn opaque_surfaces(frame: &mut Frame<'_>, window: Window) -> Result<Vec<Option<OpaqueSurface>>, GpuError> {
    let targets = frame.targets;
    let colors: Vec<[f16; 4]> = read_texture(frame, &targets.opaque_color, wgpu::TextureAspect::All)?;
    let depths: Vec<f32> = read_texture(frame, &targets.opaque_depth, wgpu::TextureAspect::DepthOnly)?;
    let rows = window.top..window.top + window.height;
    let columns = window.left..window.left + window.width;
    let pixels = rows.flat_map(|y| columns.clone().map(move |x| (y * targets.width + x) as usize));
    Ok(pixels
        .map(|i| {
            let color = Vec4::from_array(colors[i].map(f16::to_f32));
            (color.w > 0.0).then_some(OpaqueSurface { color, depth: depths[i] })
        })
        .collect())
}
