//! One frame in the making: the per-frame half of everything.

use std::cell::Cell;

use glam::Vec4;
use pellucid_core::fbuffer::Size;
use pellucid_core::{Layers, Resolve, Scene, View};
use wgpu::{TextureFormat, TextureUsages, TextureView};

use crate::gpu_data::FrameData;
use crate::memory::{Memory, Window};
use crate::pass::picture::PictureGroup;
use crate::steps::Steps;
use crate::surface::Surfaces;
use crate::technique::DepthFilter;
use crate::{Context, GpuError};

/// The number of a constant in `shaders/shared/frame.wesl`.
pub(crate) const HAS_OPAQUE: &str = "5";

/// Format of [`Targets::picture`].
pub(crate) const PICTURE_FORMAT: TextureFormat = TextureFormat::Rgba32Float;

/// Textures of the picture's size, kept between frames.
#[derive(Debug)]
pub(crate) struct Targets {
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Colour of the nearest opaque surface; alpha 0 where there is none.
    pub(crate) opaque_color: wgpu::Texture,
    pub(crate) opaque_color_view: TextureView,
    /// Depth of the nearest opaque surface, 0 where there is none.
    pub(crate) opaque_depth: wgpu::Texture,
    pub(crate) opaque_depth_view: TextureView,
    /// Whether nothing was drawn into both since they were cleared.
    pub(crate) opaque_is_clear: Cell<bool>,
    /// The finished picture, linear light, premultiplied.
    pub(crate) picture: wgpu::Texture,
    pub(crate) picture_view: TextureView,
}

impl Targets {
    pub(crate) fn new(gpu: &Context, width: u32, height: u32) -> Result<Self, GpuError> {
        let texture = |label, format, usage| {
            gpu.texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | TextureUsages::COPY_SRC | TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        };
        let attachment = TextureUsages::RENDER_ATTACHMENT;
        let opaque_color = texture("the opaque surfaces", TextureFormat::Rgba16Float, attachment)?;
        let opaque_depth = texture("the opaque depth", TextureFormat::Depth32Float, attachment)?;
        let picture = texture("the picture", PICTURE_FORMAT, TextureUsages::STORAGE_BINDING | attachment)?;
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        Ok(Self {
            width,
            height,
            opaque_color_view: view(&opaque_color),
            opaque_color,
            opaque_depth_view: view(&opaque_depth),
            opaque_depth,
            opaque_is_clear: Cell::new(false),
            picture_view: view(&picture),
            picture,
        })
    }
}

/// What a frame is for.
#[derive(Debug)]
pub(crate) enum Goal {
    /// The picture, in [`Targets::picture`].
    Picture,
    /// The ordered layers, one rectangle for each window.
    Layers(Vec<Layers>),
}

/// One frame in the making.
pub(crate) struct Frame<'a> {
    pub(crate) gpu: &'a Context,
    pub(crate) scene: &'a Scene,
    pub(crate) view: &'a View,
    pub(crate) resolve: Resolve,
    pub(crate) surfaces: Surfaces<'a>,
    pub(crate) targets: &'a Targets,
    pub(crate) memory: &'a mut Memory,
    pub(crate) steps: Steps,
    /// Group 0 of passes over pixels.
    pub(crate) picture: PictureGroup,
    pub(crate) goal: Goal,
    /// Captures repeated because an estimate was too small.
    pub(crate) rerenders: u32,
    /// Layers after which peeling stops.
    pub(crate) max_layers: Option<u32>,
    /// Whether all fragments are put in order in memory before the resolve.
    pub(crate) presort: bool,
    /// Pixels that had more.
    pub(crate) cut_pixels: u64,
    /// Largest F-Buffer.
    pub(crate) fbuffer_size: Option<Size>,
    /// Windows of slots so far.
    pub(crate) slot_windows: u64,
    /// How the rasterizer in compute blends.
    pub(crate) depth_filter: DepthFilter,
    /// Pixels that its depth filter left out of order, and that were sorted after it.
    pub(crate) repaired_pixels: u64,
    /// Parts of triangles in half-blocks.
    pub(crate) half_block_parts: u64,
    /// Share of quads with one triangle.
    pub(crate) lone_share: f64,
    pub(crate) frame_data: wgpu::Buffer,
    /// Whether [`Self::clear_picture`] has been recorded.
    picture_is_clear: bool,
    encoder: Option<wgpu::CommandEncoder>,
}

/// What a frame starts from.
pub(crate) struct FrameParts<'a> {
    pub(crate) gpu: &'a Context,
    pub(crate) scene: &'a Scene,
    pub(crate) view: &'a View,
    pub(crate) resolve: Resolve,
    pub(crate) surfaces: Surfaces<'a>,
    pub(crate) targets: &'a Targets,
    pub(crate) memory: &'a mut Memory,
    pub(crate) picture: PictureGroup,
    pub(crate) goal: Goal,
    pub(crate) frame_data: wgpu::Buffer,
}

impl<'a> Frame<'a> {
    pub(crate) fn new(parts: FrameParts<'a>) -> Self {
        let FrameParts { gpu, scene, view, resolve, surfaces, targets, memory, picture, goal, frame_data } = parts;
        let steps = Steps::new(gpu);
        Self {
            gpu,
            scene,
            view,
            resolve,
            surfaces,
            targets,
            memory,
            steps,
            picture,
            goal,
            rerenders: 0,
            max_layers: None,
            presort: false,
            cut_pixels: 0,
            fbuffer_size: None,
            slot_windows: 0,
            depth_filter: DepthFilter::default(),
            repaired_pixels: 0,
            half_block_parts: 0,
            lone_share: 0.0,
            frame_data,
            picture_is_clear: false,
            encoder: None,
        }
    }

    /// Aims everything recorded from now on at a window. Submits what was recorded for another.
    pub(crate) fn set_window(&mut self, window: Window) -> Result<(), GpuError> {
        self.submit()?;
        let data = FrameData::new(self.view, self.resolve, window, self.viewport());
        self.gpu.queue.write_buffer(&self.frame_data, 0, bytemuck::bytes_of(&data));
        Ok(())
    }

    /// Width and height of the hardware's viewport in pixels.
    fn viewport(&self) -> f32 {
        self.gpu.limits.max_texture_dimension_2d as f32
    }

    /// What commands go to.
    pub(crate) fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        let device = &self.gpu.device;
        self.encoder.get_or_insert_with(|| device.create_command_encoder(&Default::default()))
    }

    /// Begins a compute pass of a step. It must be dropped before anything else is recorded.
    pub(crate) fn compute_pass(&mut self, step: &'static str) -> Result<wgpu::ComputePass<'static>, GpuError> {
        let stamps = self.begin_step(step)?;
        let timestamp_writes = stamps.as_ref().map(|(query_set, begin, end)| wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(*begin),
            end_of_pass_write_index: Some(*end),
        });
        let descriptor = wgpu::ComputePassDescriptor { label: Some(step), timestamp_writes };
        Ok(self.encoder().begin_compute_pass(&descriptor).forget_lifetime())
    }

    /// Begins a render pass of a step over a window. It must be dropped before anything else is recorded.
    pub(crate) fn render_pass(
        &mut self,
        step: &'static str,
        window: Window,
        color: Option<wgpu::RenderPassColorAttachment<'_>>,
        depth_ops: Option<wgpu::Operations<f32>>,
    ) -> Result<wgpu::RenderPass<'static>, GpuError> {
        let depth = (&self.targets.opaque_depth_view, depth_ops);
        match color {
            Some(_) => self.render_pass_into(step, window, &[color], depth),
            None => self.render_pass_into(step, window, &[], depth),
        }
    }

    /// As [`Self::render_pass`], with a technique's own attachments, of the picture's size.
    pub(crate) fn render_pass_into(
        &mut self,
        step: &'static str,
        window: Window,
        color_attachments: &[Option<wgpu::RenderPassColorAttachment<'_>>],
        (view, depth_ops): (&TextureView, Option<wgpu::Operations<f32>>),
    ) -> Result<wgpu::RenderPass<'static>, GpuError> {
        let depth = wgpu::RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None };
        let mut pass = self.begin_render_pass(step, window, color_attachments, Some(depth))?;
        // As large as can be around the picture, so that no triangle has to be clipped at its sides: llvmpipe does that, and
        // the new corners it snaps to the grid move the edges between them.
        let side = self.viewport();
        let start = |pixels: u32| (pixels as f32 - side) / 2.0;
        pass.set_viewport(start(self.view.width), start(self.view.height), side, side, 0.0, 1.0);
        Ok(pass)
    }

    /// Begins a render pass of a step into a window of the picture, over what is there.
    pub(crate) fn picture_pass(
        &mut self,
        step: &'static str,
        window: Window,
    ) -> Result<wgpu::RenderPass<'static>, GpuError> {
        self.pass_into_picture(step, window, wgpu::LoadOp::Load)
    }

    /// Clears the picture as a step of its own: once, before anything is in a window of it.
    pub(crate) fn clear_picture(&mut self, step: &'static str, value: Vec4) -> Result<(), GpuError> {
        if std::mem::replace(&mut self.picture_is_clear, true) {
            return Ok(());
        }
        let [r, g, b, a] = value.to_array().map(f64::from);
        let whole = Window { left: 0, top: 0, width: self.view.width, height: self.view.height };
        self.pass_into_picture(step, whole, wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a })).map(drop)
    }

    fn pass_into_picture(
        &mut self,
        step: &'static str,
        window: Window,
        load: wgpu::LoadOp<wgpu::Color>,
    ) -> Result<wgpu::RenderPass<'static>, GpuError> {
        let color = wgpu::RenderPassColorAttachment {
            view: &self.targets.picture_view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        };
        self.begin_render_pass(step, window, &[Some(color)], None)
    }

    fn begin_render_pass(
        &mut self,
        step: &'static str,
        window: Window,
        color_attachments: &[Option<wgpu::RenderPassColorAttachment<'_>>],
        depth_stencil_attachment: Option<wgpu::RenderPassDepthStencilAttachment<'_>>,
    ) -> Result<wgpu::RenderPass<'static>, GpuError> {
        let stamps = self.begin_step(step)?;
        let descriptor = wgpu::RenderPassDescriptor {
            label: Some(step),
            color_attachments,
            depth_stencil_attachment,
            timestamp_writes: stamps.as_ref().map(|(query_set, begin, end)| wgpu::RenderPassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: Some(*begin),
                end_of_pass_write_index: Some(*end),
            }),
            occlusion_query_set: None,
            multiview_mask: None,
        };
        let mut pass = self.encoder().begin_render_pass(&descriptor).forget_lifetime();
        pass.set_scissor_rect(window.left, window.top, window.width, window.height);
        Ok(pass)
    }

    /// A pass over transparent surfaces that only writes to storage: the opaque depth is attached because WebGPU wants an
    /// attachment, and is neither tested nor written.
    pub(crate) fn capture_pass(
        &mut self,
        step: &'static str,
        window: Window,
    ) -> Result<wgpu::RenderPass<'static>, GpuError> {
        self.render_pass(step, window, None, None)
    }

    /// Zeroes the first bytes of a buffer as a step of its own.
    pub(crate) fn zero(&mut self, step: &'static str, buffer: &wgpu::Buffer, bytes: u64) -> Result<(), GpuError> {
        // Clears carry no timestamps: empty passes before and after do.
        let stamps = self.begin_step(step)?;
        let empty_pass = |encoder: &mut wgpu::CommandEncoder, begin: bool| {
            let Some((query_set, first, second)) = &stamps else { return };
            let timestamp_writes = Some(wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: begin.then_some(*first),
                end_of_pass_write_index: (!begin).then_some(*second),
            });
            drop(encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some(step), timestamp_writes }));
        };
        empty_pass(self.encoder(), true);
        self.encoder().clear_buffer(buffer, 0, Some(bytes));
        empty_pass(self.encoder(), false);
        Ok(())
    }

    /// Submits what was recorded. Does not wait.
    pub(crate) fn submit(&mut self) -> Result<(), GpuError> {
        if let Some(encoder) = self.encoder.take() {
            self.gpu.queue.submit([encoder.finish()]);
        }
        self.gpu.check()
    }

    /// Submits, waits, and reports what went wrong on the way.
    pub(crate) fn finish(&mut self) -> Result<(), GpuError> {
        self.submit()?;
        self.steps.collect(self.gpu)?;
        self.gpu.wait()
    }

    fn begin_step(&mut self, step: &'static str) -> Result<Option<(wgpu::QuerySet, u32, u32)>, GpuError> {
        if self.steps.must_collect_before(step) {
            self.submit()?;
            self.steps.collect(self.gpu)?;
        }
        Ok(self.steps.begin_pass(step))
    }
}
