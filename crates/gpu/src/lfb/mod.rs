//! The layered fragment buffer for a renderer of your own: your device, your pipelines, your shaders (LFB chapter,
//! section 20.4.1). Twins: `shaders/lfb`.
//!
//! An LFB keeps every fragment of every pixel, in order. It is the chapter's linearized one: what you draw is drawn
//! twice, first counted, then captured into exactly as much memory as the counts add up to:
//!
//! ```text
//! chapter            here
//! lfb.init()         lfb.begin(&mut encoder)      zero the counters
//! render()           draw with lfb.bind_group()   your shader calls lfb_add: fragments are counted
//! lfb.count()        lfb.sum(&mut encoder)        parallel prefix sums
//!                    lfb.allocate()               waits for the total, makes room
//! render()           draw with lfb.bind_group()   the same pipeline again: fragments are stored
//! lfb.end()          lfb.end(&mut encoder)        checks, sorts
//!                    lfb.check()                  waits: was everything captured?
//! ```
//!
//! [`Lfb::capture`] takes all of those steps around one closure. Your shaders see it through the text of an
//! [`LfbModule`], plain WGSL to put in front of your own. Whether a pass counts or captures is a flag in the bind group, so
//! that one pipeline serves both. Names, group and first binding are yours to choose: any number of LFBs can be bound at
//! once, as far as the device has bindings. Everything runs within WebGPU's default limits and without features.
//!
//! Nothing is dropped in silence. Counts that do not fit are an error before anything is captured; fragments outside of
//! the LFB, or others in the capturing than in the counting pass, are an error after it; and no pixel ever writes over
//! another's fragments, as each is checked against its count. That takes a table of counters besides the chapter's one
//! table of offsets, which the renderer's own `linear` does without: there, both passes are ours.
//!
//! ```no_run
//! use pellucid_gpu::lfb::{Access, Lfb, LfbError, LfbOptions};
//! # fn f(device: &wgpu::Device, queue: &wgpu::Queue, pipeline: &wgpu::RenderPipeline) -> Result<(), LfbError> {
//! let mut lfb = Lfb::new(device, queue, &LfbOptions::new(1280, 720))?;
//! let shader = lfb.module("lfb", 0, Access::Capture).wgsl()?
//!     + "@fragment fn glass(@builtin(position) at: vec4<f32>) {
//!            lfb_add_color(vec2<u32>(at.xy), vec4(0.1, 0.3, 0.2, 0.5), at.z, 0u);
//!        }";
//! // A pipeline of that shader, with `lfb.layout(Access::Capture)` as group 0; then every frame:
//! lfb.capture(|encoder, group| {
//!     let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor::default());
//!     pass.set_pipeline(pipeline);
//!     pass.set_bind_group(0, group, &[]);
//!     pass.draw(0..6, 0..100);
//! })?;
//! // Draw or dispatch what reads it, with `lfb.layout(Access::Read)` and `lfb.read_group()?`.
//! # Ok(())
//! # }
//! ```

mod buffers;
mod content;
mod error;
mod module;
mod options;

use wgpu::{BindGroup, BindGroupLayout, CommandEncoder, ComputePipeline, ShaderStages};

use self::buffers::{Buffers, layout_entries};
use crate::pass::ordered::compute_pipeline;
use crate::pass::prefix_sum::PrefixSum;
use crate::readback::mapped;
use crate::surface::shader;
use crate::{Context, shaders};

pub use buffers::LfbData;
pub use content::{LfbContent, LfbFragment};
pub use error::LfbError;
pub use module::{Access, LfbModule};
pub use options::{LfbOptions, Nearest};

/// How far a capture has come, with where its outcome will be read from.
#[derive(Debug)]
enum Step {
    /// There is nothing to read.
    Empty,
    Counting,
    Summed(wgpu::Buffer),
    Capturing,
    Ended(wgpu::Buffer),
    /// All fragments are there.
    Done,
}

/// A layered fragment buffer: see the [module](self).
#[derive(Debug)]
pub struct Lfb {
    gpu: Context,
    options: LfbOptions,
    capture_layout: BindGroupLayout,
    read_layout: BindGroupLayout,
    prefix_sum: PrefixSum,
    check: ComputePipeline,
    sort: ComputePipeline,
    buffers: Buffers,
    step: Step,
}

impl Lfb {
    /// An empty LFB on a device of yours. Devices and queues are handles: it keeps copies.
    ///
    /// # Errors
    /// [`LfbError::ZeroSize`], [`LfbError::Payload`], [`LfbError::Limit`], [`LfbError::OutOfMemory`].
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, options: &LfbOptions) -> Result<Self, LfbError> {
        let sort = match options.payload_words {
            1 => shaders::LFB_SORT_1,
            2 => shaders::LFB_SORT_2,
            3 => shaders::LFB_SORT_3,
            4 => shaders::LFB_SORT_4,
            words => return Err(LfbError::Payload(words)),
        };
        let gpu = Context::adopt(device.clone(), queue.clone());
        let layout = |label, access| {
            let entries = layout_entries(access, 0, ShaderStages::FRAGMENT | ShaderStages::COMPUTE);
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
        };
        let (capture_layout, read_layout) =
            (layout("LFB, capture", Access::Capture), layout("LFB, read", Access::Read));
        let prefix_sum = PrefixSum::new(&gpu);
        let buffers = Buffers::new(&gpu, options, &prefix_sum, &capture_layout)?;
        let pipeline = |label, wgsl| {
            compute_pipeline(&gpu, label, &shader(&gpu, label, wgsl), "main", &[Some(&capture_layout)], &[])
        };
        Ok(Self {
            check: pipeline("LFB check", shaders::LFB_CHECK),
            sort: pipeline("LFB sort", sort),
            options: options.clone(),
            step: Step::Empty,
            capture_layout,
            read_layout,
            prefix_sum,
            buffers,
            gpu,
        })
    }

    /// Gives it another size, and empties it. On an error it keeps its size.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), if nobody has asked it about the capture before; [`LfbError::ZeroSize`], [`LfbError::Limit`], [`LfbError::OutOfMemory`].
    pub fn resize(&mut self, width: u32, height: u32) -> Result<(), LfbError> {
        if matches!(self.step, Step::Ended(_)) {
            self.check()?;
        }
        let options = LfbOptions { width, height, ..self.options.clone() };
        self.buffers = Buffers::new(&self.gpu, &options, &self.prefix_sum, &self.capture_layout)?;
        (self.options, self.step) = (options, Step::Empty);
        Ok(())
    }

    /// What it is like.
    pub fn options(&self) -> &LfbOptions {
        &self.options
    }

    /// The module for its payload, its bindings numbered from 0.
    pub fn module<'a>(&self, name: &'a str, group: u32, access: Access) -> LfbModule<'a> {
        LfbModule { name, group, first_binding: 0, payload_words: self.options.payload_words, access }
    }

    /// The layout for pipelines, visible to fragment and compute shaders. All LFBs of a device have the same.
    pub fn layout(&self, access: Access) -> &BindGroupLayout {
        match access {
            Access::Capture => &self.capture_layout,
            Access::Read => &self.read_layout,
        }
    }

    /// Entries of a layout of yours, to have an LFB in one group with other things.
    pub fn layout_entries(
        access: Access,
        first_binding: u32,
        visibility: ShaderStages,
    ) -> Vec<wgpu::BindGroupLayoutEntry> {
        layout_entries(access, first_binding, visibility)
    }

    /// Entries of a bind group of yours, for such a layout. They are out of date after the next step.
    ///
    /// # Errors
    /// [`LfbError::OutOfTurn`].
    pub fn entries(&self, access: Access, first_binding: u32) -> Result<Vec<wgpu::BindGroupEntry<'_>>, LfbError> {
        match access {
            Access::Capture => self.bind_group().map(drop)?,
            Access::Read => self.read_group().map(drop)?,
        }
        Ok(self.buffers.entries(access, matches!(self.step, Step::Counting), first_binding))
    }

    /// Draws with every step around it. `render` is called twice and must draw the same both times, with the bind group
    /// it is given as the one of the module. Waits for the total, and for the end.
    ///
    /// # Errors
    /// [`LfbError::Overflow`], [`LfbError::Outside`], [`LfbError::Disagree`], [`LfbError::OutOfMemory`],
    /// [`LfbError::Device`].
    pub fn capture(&mut self, mut render: impl FnMut(&mut CommandEncoder, &BindGroup)) -> Result<(), LfbError> {
        let device = self.gpu.device.clone();
        let encoder = |label| device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) });
        let mut counting = encoder("LFB, counting");
        self.begin(&mut counting)?;
        render(&mut counting, self.bind_group()?);
        self.sum(&mut counting)?;
        self.gpu.queue.submit([counting.finish()]);
        self.allocate()?;
        let mut capturing = encoder("LFB, capturing");
        render(&mut capturing, self.bind_group()?);
        self.end(&mut capturing)?;
        self.gpu.queue.submit([capturing.finish()]);
        self.check()
    }

    /// Step 1: zeroes the counters. What you draw next with [`bind_group`](Self::bind_group) is counted.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), if nobody has asked it about the capture before.
    pub fn begin(&mut self, encoder: &mut CommandEncoder) -> Result<(), LfbError> {
        if matches!(self.step, Step::Ended(_)) {
            self.check()?;
        }
        encoder.clear_buffer(&self.buffers.counters, 0, None);
        self.step = Step::Counting;
        Ok(())
    }

    /// What [`Access::Capture`] binds, in the counting and then in the capturing pass: ask for it before each.
    ///
    /// # Errors
    /// [`LfbError::OutOfTurn`] before [`begin`](Self::begin), and between [`sum`](Self::sum) and
    /// [`allocate`](Self::allocate).
    pub fn bind_group(&self) -> Result<&BindGroup, LfbError> {
        let (group, after) = match &self.step {
            Step::Counting => (self.buffers.counting_group.as_ref(), "begin"),
            Step::Capturing => (self.buffers.capturing_group.as_ref(), "allocate"),
            Step::Summed(_) => (None, "allocate"),
            _ => (None, "begin"),
        };
        group.ok_or(LfbError::OutOfTurn { step: "bind_group", after })
    }

    /// Step 2, after the counting pass: where each pixel's fragments will start, and how many there are.
    ///
    /// # Errors
    /// [`LfbError::OutOfTurn`], [`LfbError::OutOfMemory`].
    pub fn sum(&mut self, encoder: &mut CommandEncoder) -> Result<(), LfbError> {
        if !matches!(self.step, Step::Counting) {
            return Err(LfbError::OutOfTurn { step: "sum", after: "begin" });
        }
        let (buffers, pixels) = (&self.buffers, self.buffers.pixels);
        encoder.copy_buffer_to_buffer(&buffers.counters, 0, &buffers.starts, 0, (pixels + 1) * 4);
        let descriptor = wgpu::ComputePassDescriptor { label: Some("LFB prefix sums"), timestamp_writes: None };
        self.prefix_sum.run(&mut encoder.begin_compute_pass(&descriptor), &buffers.prefix_sum_groups);
        let outcome =
            buffers.outcome(&self.gpu, encoder, &[(&buffers.starts, pixels, 1), (&buffers.counters, pixels, 1)])?;
        encoder.clear_buffer(&buffers.counters, 0, None);
        self.step = Step::Summed(outcome);
        Ok(())
    }

    /// Step 3, after that was submitted: waits for the total and makes room for exactly as many. What you draw next with
    /// [`bind_group`](Self::bind_group) is captured.
    ///
    /// # Errors
    /// [`LfbError::Overflow`], [`LfbError::Outside`], [`LfbError::OutOfTurn`], [`LfbError::NotSubmitted`],
    /// [`LfbError::OutOfMemory`], [`LfbError::Device`].
    pub fn allocate(&mut self) -> Result<(), LfbError> {
        let [fragments, outside] = match std::mem::replace(&mut self.step, Step::Empty) {
            Step::Summed(outcome) => self.wait(&outcome, "sum")?,
            _ => return Err(LfbError::OutOfTurn { step: "allocate", after: "sum" }),
        };
        self.check_outside(outside)?;
        self.buffers.make_room(&self.gpu, &self.options, fragments, [&self.capture_layout, &self.read_layout])?;
        self.step = Step::Capturing;
        Ok(())
    }

    /// Step 4, after the capturing pass: checks it, and puts the fragments in order.
    ///
    /// # Errors
    /// [`LfbError::OutOfTurn`], [`LfbError::OutOfMemory`].
    pub fn end(&mut self, encoder: &mut CommandEncoder) -> Result<(), LfbError> {
        let (Step::Capturing, Some(group)) = (&self.step, &self.buffers.capturing_group) else {
            return Err(LfbError::OutOfTurn { step: "end", after: "allocate" });
        };
        let mut run = |label, pipeline| {
            let descriptor = wgpu::ComputePassDescriptor { label: Some(label), timestamp_writes: None };
            let mut pass = encoder.begin_compute_pass(&descriptor);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(self.options.width.div_ceil(8), self.options.height.div_ceil(8), 1);
        };
        run("LFB check", &self.check);
        if self.options.sorts {
            run("LFB sort", &self.sort);
        }
        let faults = (&self.buffers.counters, self.buffers.pixels, 3);
        self.step = Step::Ended(self.buffers.outcome(&self.gpu, encoder, &[faults])?);
        Ok(())
    }

    /// Whether everything was captured: waits for what [`end`](Self::end) recorded. Left out, the next
    /// [`begin`](Self::begin) does it, so that a frame need not wait for its own end.
    ///
    /// # Errors
    /// [`LfbError::Disagree`], [`LfbError::Outside`], [`LfbError::OutOfTurn`], [`LfbError::NotSubmitted`],
    /// [`LfbError::Device`].
    pub fn check(&mut self) -> Result<(), LfbError> {
        let [outside, beyond, pixels] = match std::mem::replace(&mut self.step, Step::Empty) {
            Step::Ended(outcome) => self.wait(&outcome, "end")?,
            _ => return Err(LfbError::OutOfTurn { step: "check", after: "end" }),
        };
        self.check_outside(outside)?;
        if pixels > 0 {
            return Err(LfbError::Disagree { pixels, beyond });
        }
        self.step = Step::Done;
        Ok(())
    }

    /// What [`Access::Read`] binds; good until the next [`begin`](Self::begin) or [`resize`](Self::resize).
    ///
    /// # Errors
    /// [`LfbError::OutOfTurn`] before [`end`](Self::end).
    pub fn read_group(&self) -> Result<&BindGroup, LfbError> {
        match (&self.step, &self.buffers.read_group) {
            (Step::Ended(_) | Step::Done, Some(group)) => Ok(group),
            _ => Err(LfbError::OutOfTurn { step: "read_group", after: "end" }),
        }
    }

    /// Copies all fragments to the CPU. Checks them first, if nobody has.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), and [`LfbError::OutOfMemory`].
    pub fn read(&mut self) -> Result<LfbContent, LfbError> {
        if !matches!(self.step, Step::Done) {
            self.check()?;
        }
        self.buffers.read(&self.gpu, &self.options)
    }

    /// Fragments captured.
    pub fn fragments(&self) -> u32 {
        self.buffers.fragments
    }

    /// Bytes that its buffers hold.
    pub fn bytes(&self) -> u64 {
        self.buffers.bytes()
    }

    fn check_outside(&self, fragments: u32) -> Result<(), LfbError> {
        let LfbOptions { width, height, .. } = self.options;
        if fragments == 0 { Ok(()) } else { Err(LfbError::Outside { fragments, width, height }) }
    }

    /// The words of an outcome, after the one that tells that its commands ran.
    fn wait<const N: usize>(&self, outcome: &wgpu::Buffer, step: &'static str) -> Result<[u32; N], LfbError> {
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&mapped(&self.gpu, outcome)?);
        if words[0] != self.options.width {
            return Err(LfbError::NotSubmitted(step));
        }
        Ok(std::array::from_fn(|i| words[i + 1]))
    }
}
