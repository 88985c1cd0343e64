//! The same passes with intermediate results in a framebuffer, one for each pixel. Twins: `shaders/fbuffer/last.wesl`, and
//! `shaders/fbuffer/module.wesl` with `per_pixel`.
//!
//! A framebuffer keeps what the last drawn fragment of a pixel writes. Fragments are shaded here in any order, so which one
//! that is follows from the order of slots, once for a drawing; left to chance, pictures would differ from run to run.

use pellucid_core::fbuffer::order::Geometry;
use pellucid_core::fbuffer::{Drawn, Output, Size, Windows};
use wgpu::{BindGroupLayout, BufferUsages, ComputePipeline, ShaderStages};

use super::{Content, Drawing, FBuffer, FBufferError, Groups, Keeping, LANES, Program, Target};
use crate::pass::grid::dispatch;
use crate::pass::ordered::compute_pipeline;
use crate::surface::{shader, storage_entry};
use crate::{Context, shaders};

/// What an F-Buffer is better than, and what it is measured against: where surfaces overlap, every fragment finds what the
/// last drawn one left (figure 1).
///
/// Passes are the same as for an [`FBuffer`], and so are tests and blending after them. A pass finds what the one before
/// left, not what another fragment does meanwhile; and the last one leaves nothing.
#[derive(Debug)]
pub struct Framebuffer {
    fbuffer: FBuffer,
    size: [u32; 2],
    layout: BindGroupLayout,
    find_last: ComputePipeline,
    keep_last: ComputePipeline,
}

impl Framebuffer {
    /// A framebuffer for pictures of one size, with something at each pixel for each of the names. Final colours are tested
    /// and blended in windows of `window` slots.
    ///
    /// # Errors
    /// As [`FBuffer::new`].
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        size: [u32; 2],
        window: Size,
        contents: &[(&str, Content<'_>)],
    ) -> Result<Self, FBufferError> {
        let gpu = Context::adopt(device.clone(), queue.clone());
        let entries = [0, 1, 2].map(|binding| storage_entry(binding, ShaderStages::COMPUTE, binding == 0));
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("framebuffer"),
            entries: &entries,
        });
        let module = shader(&gpu, "framebuffer", shaders::FBUFFER_LAST);
        let layouts = [None, None, None, Some(&layout)];
        let pipeline = |entry| compute_pipeline(&gpu, "framebuffer", &module, entry, &layouts, &[]);
        let (find_last, keep_last) = (pipeline("find_last"), pipeline("keep_last"));
        let count = u64::from(size[0]) * u64::from(size[1]);
        let fbuffer = FBuffer::keeping(gpu, window, contents, Keeping::Pixels { count })?;
        Ok(Self { fbuffer, size, layout, find_last, keep_last })
    }

    /// Bytes it holds: for each pixel its contents and 16 bytes on whether its fragment was killed, for each slot of a
    /// window what an [`FBuffer`] holds besides contents.
    pub fn bytes(&self) -> u64 {
        self.fbuffer.bytes()
    }

    /// As [`FBuffer::program`].
    ///
    /// # Errors
    /// As there.
    pub fn program(
        &self,
        passes: &[&str],
        own_layouts: [Option<&BindGroupLayout>; 3],
    ) -> Result<Program, FBufferError> {
        self.fbuffer.program(passes, own_layouts)
    }

    /// As [`FBuffer::target`].
    ///
    /// # Errors
    /// As there.
    pub fn target(&self, color: glam::Vec4) -> Result<Target, FBufferError> {
        let [width, height] = self.size;
        self.fbuffer.target(width, height, color)
    }

    /// As [`FBuffer::read`].
    ///
    /// # Errors
    /// As there.
    pub fn read(&self, target: &Target) -> Result<pellucid_core::Image, FBufferError> {
        self.fbuffer.read(target)
    }

    /// As [`FBuffer::drawing`], and finds the last drawn fragment of each pixel.
    ///
    /// # Errors
    /// As there, or [`FBufferError::TargetSize`].
    pub fn drawing(&self, geometry: Geometry<'_>) -> Result<Drawing, FBufferError> {
        let need = [geometry.viewport.width, geometry.viewport.height];
        if need != self.size {
            return Err(FBufferError::TargetSize { have: self.size, need });
        }
        let (gpu, drawing) = (&self.fbuffer.gpu, self.fbuffer.drawing(geometry)?);
        let pixels = u64::from(need[0]) * u64::from(need[1]);
        let last = gpu.buffer("last drawn fragments", (pixels * 4).max(16), BufferUsages::STORAGE)?;
        let entries: Vec<_> = (0..)
            .zip([&drawing.geometry, &drawing.runs, &last])
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("framebuffer"),
            layout: &self.layout,
            entries: &entries,
        });
        self.fbuffer.send(&drawing, &(0..drawing.fragments()));
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_bind_group(3, &group, &[]);
        for (pipeline, invocations) in [(&self.find_last, drawing.fragments()), (&self.keep_last, pixels)] {
            pass.set_pipeline(pipeline);
            dispatch(&mut pass, invocations.div_ceil(LANES));
        }
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        gpu.check()?;
        Ok(drawing)
    }

    /// Draws everything: all passes but the last over all fragments, then the last one window by window.
    ///
    /// # Errors
    /// [`FBufferError::Mixed`], [`FBufferError::TargetSize`], or if the device fails.
    pub fn draw(
        &self,
        drawing: &Drawing,
        program: &Program,
        groups: Groups<'_>,
        output: Output,
        target: &Target,
    ) -> Result<Drawn, FBufferError> {
        let fbuffer = &self.fbuffer;
        fbuffer.check(drawing, program, target)?;
        let Some((last, early)) = program.pipelines.split_last() else { return Err(FBufferError::NoPasses) };
        let fragments = drawing.fragments();
        let windows = Windows::new(fragments, fbuffer.size());
        let group = fbuffer.group(drawing);
        fbuffer.send(drawing, &(0..fragments));
        let mut encoder = fbuffer.begin(fragments);
        for pipeline in early {
            fbuffer.pass(&mut encoder, pipeline, (groups, &group), fragments);
        }
        for window in 0..windows.count() {
            let slots = windows.slots(window);
            if slots.end - slots.start < fragments {
                // What is told to the device holds for all that is submitted after it.
                let before = std::mem::replace(&mut encoder, fbuffer.go_on());
                fbuffer.gpu.queue.submit([before.finish()]);
                fbuffer.send(drawing, &slots);
            }
            fbuffer.pass(&mut encoder, last, (groups, &group), slots.end - slots.start);
            fbuffer.finish(&mut encoder, slots.end - slots.start, output, target);
        }
        fbuffer.gpu.queue.submit([encoder.finish()]);
        fbuffer.gpu.check()?;
        let submissions = early.len() as u64 + windows.count();
        Ok(Drawn { windows: windows.count(), submissions, fragments })
    }
}
