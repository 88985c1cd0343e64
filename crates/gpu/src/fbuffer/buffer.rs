//! The buffer, and how passes run over it.

use std::ops::Range;

use pellucid_core::fbuffer::{Drawn, Output, Overflow, Size, Windows};
use wgpu::{BindGroup, BindGroupLayout, BufferUsages, ShaderStages};

use super::raster::Raster;
use super::sort::{KEY_BYTES, Sort, run_steps};
use super::target::{OutputPass, RUN, read};
use super::{Content, Drawing, FBufferError, Keeping, LANES, Program, Target};
use crate::Context;
use crate::pass::grid::dispatch;
use crate::pass::prefix_sum::PrefixSum;
use crate::surface::storage_entry;

const STORAGE: BufferUsages = BufferUsages::STORAGE.union(BufferUsages::COPY_SRC).union(BufferUsages::COPY_DST);

/// Bind groups 0 to 2 of a program's passes.
pub type Groups<'a> = [Option<&'a BindGroup>; 3];

/// Bindings of group 3 before the program's buffers: geometry, runs, places, final colours.
const OWN_BINDINGS: u32 = 4;

/// A buffer with a slot for each fragment of a window, on a device of yours.
#[derive(Debug)]
pub struct FBuffer {
    pub(super) gpu: Context,
    pub(super) raster: Raster,
    pub(super) prefix_sum: PrefixSum,
    /// Group 3 of a program's passes.
    pub(super) layout: BindGroupLayout,
    size: Size,
    pub(super) keeping: Keeping,
    /// What passes may read and write: in WGSL, and in memory.
    wgsl: String,
    contents: Vec<wgpu::Buffer>,
    places: wgpu::Buffer,
    colors: wgpu::Buffer,
    keys: wgpu::Buffer,
    stages: wgpu::Buffer,
    output_data: wgpu::Buffer,
    sort: Sort,
    output: OutputPass,
}

impl FBuffer {
    /// A buffer of a size, which is all that it will ever hold, with something for each of the names: within WebGPU's
    /// default limits up to four of them, together with the storage buffers of your own bind groups.
    ///
    /// # Errors
    /// [`FBufferError::Buffer`], or if it does not fit the device.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        size: Size,
        contents: &[(&str, Content<'_>)],
    ) -> Result<Self, FBufferError> {
        Self::keeping(Context::adopt(device.clone(), queue.clone()), size, contents, Keeping::Slots)
    }

    pub(super) fn keeping(
        gpu: Context,
        size: Size,
        contents: &[(&str, Content<'_>)],
        keeping: Keeping,
    ) -> Result<Self, FBufferError> {
        for (name, content) in contents {
            content.check(name)?;
        }
        let bindings = OWN_BINDINGS + contents.len() as u32;
        let entries: Vec<_> =
            (0..bindings).map(|binding| storage_entry(binding, ShaderStages::COMPUTE, binding == 0)).collect();
        let layout = gpu
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("F-Buffer"), entries: &entries });
        let slots = size.slots();
        // How many intermediate results there are, and how many of them stand behind the slots.
        let (results, behind) = match keeping {
            Keeping::Slots => (slots, 0),
            Keeping::Pixels { count } => (count, count),
        };
        let buffer = |label: &str, bytes: u64| gpu.buffer(label, bytes, STORAGE);
        let stages = Sort::stage_bytes(&gpu, run_steps(&(0..slots), RUN).len());
        Ok(Self {
            wgsl: (OWN_BINDINGS..)
                .zip(contents)
                .map(|(binding, (name, content))| content.wgsl(name, binding))
                .collect(),
            contents: contents
                .iter()
                .map(|(name, content)| buffer(name, results * content.bytes()))
                .collect::<Result<_, _>>()?,
            places: buffer("F-Buffer places", (slots + behind) * 16)?,
            colors: buffer("F-Buffer colours", slots * 16)?,
            keys: buffer("F-Buffer keys", slots * KEY_BYTES)?,
            stages: buffer("F-Buffer sort", stages)?,
            output_data: buffer("F-Buffer output", OutputPass::data_bytes(&gpu, slots))?,
            raster: Raster::new(&gpu),
            prefix_sum: PrefixSum::new(&gpu),
            sort: Sort::new(&gpu),
            output: OutputPass::new(&gpu),
            layout,
            size,
            keeping,
            gpu,
        })
    }

    /// How many slots it has.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Bytes it holds: for each slot its contents, 32 bytes for place and final colour, and 12 for its key; and a little
    /// for the stages of the sort.
    pub fn bytes(&self) -> u64 {
        let own = [&self.places, &self.colors, &self.keys, &self.stages, &self.output_data];
        self.contents.iter().chain(own).map(wgpu::Buffer::size).sum()
    }

    /// What the last window left in the slots of a buffer, in the order of [`Self::new`]; words of 4 bytes. Slots that it
    /// did not have are left as they were.
    ///
    /// # Errors
    /// If the device fails.
    ///
    /// # Panics
    /// If there is no such buffer.
    pub fn contents(&self, buffer: usize) -> Result<Vec<u32>, FBufferError> {
        let buffer = &self.contents[buffer];
        read(&self.gpu, buffer, 0, buffer.size() / 4)
    }

    /// Draws everything, however much it is: a window slides over the order, and fragments outside of it are discarded
    /// before they are shaded (the second generation of hardware, section 3.2 and appendix A).
    ///
    /// # Errors
    /// [`FBufferError::TargetSize`], or if the device fails.
    pub fn draw(
        &mut self,
        drawing: &Drawing,
        program: &Program,
        groups: Groups<'_>,
        output: Output,
        target: &Target,
    ) -> Result<Drawn, FBufferError> {
        let mut drawn = Drawn::default();
        let mut next = Some(0);
        while let Some(window) = next {
            let (remaining, of_window) = self.window(drawing, program, groups, window, output, target)?;
            drawn = drawn + of_window;
            next = (remaining > 0).then_some(window + 1);
        }
        Ok(drawn)
    }

    /// Draws one window, and returns how many windows remain after it, with the window's figures.
    ///
    /// # Errors
    /// As [`Self::draw`].
    pub fn window(
        &mut self,
        drawing: &Drawing,
        program: &Program,
        groups: Groups<'_>,
        window: u64,
        output: Output,
        target: &Target,
    ) -> Result<(u64, Drawn), FBufferError> {
        let windows = Windows::new(drawing.fragments(), self.size);
        let drawn = self.slots(drawing, program, groups, windows.slots(window), output, target)?;
        Ok((windows.remaining(window), drawn))
    }

    /// Draws everything if it fits; if not, tells so, and nothing reaches the target (the first generation of hardware).
    ///
    /// # Errors
    /// [`FBufferError::Overflow`] with the number of fragments that the draw has; else as [`Self::draw`].
    pub fn query(
        &mut self,
        drawing: &Drawing,
        program: &Program,
        groups: Groups<'_>,
        output: Output,
        target: &Target,
    ) -> Result<Drawn, FBufferError> {
        self.slots(drawing, program, groups, 0..drawing.fragments(), output, target)
    }

    /// Draws a range of slots that fits the buffer: a window, or a batch of
    /// [`RasterOrder::batches`](pellucid_core::fbuffer::RasterOrder::batches).
    ///
    /// # Errors
    /// [`FBufferError::Overflow`] if it does not fit; else as [`Self::draw`].
    pub fn slots(
        &mut self,
        drawing: &Drawing,
        program: &Program,
        groups: Groups<'_>,
        slots: Range<u64>,
        output: Output,
        target: &Target,
    ) -> Result<Drawn, FBufferError> {
        let fragments = slots.end - slots.start;
        if fragments > self.size.slots() {
            return Err(Overflow { needed: fragments, slots: self.size.slots() }.into());
        }
        self.check(drawing, program, target)?;
        self.send(drawing, &slots);
        let mut encoder = self.begin(fragments);
        let group = self.group(drawing);
        for pipeline in &program.pipelines {
            self.pass(&mut encoder, pipeline, (groups, &group), fragments);
        }
        self.finish(&mut encoder, fragments, output, target);
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.check()?;
        Ok(Drawn { windows: 1, submissions: program.pass_count(), fragments })
    }

    /// Whether all of it belongs together.
    pub(super) fn check(&self, drawing: &Drawing, program: &Program, target: &Target) -> Result<(), FBufferError> {
        if [drawing.keeping, program.keeping].iter().any(|&keeping| keeping != self.keeping) {
            return Err(FBufferError::Mixed);
        }
        let have = [target.width, target.height];
        if have != drawing.size {
            return Err(FBufferError::TargetSize { have, need: drawing.size });
        }
        Ok(())
    }

    /// Tells the device which slots are in the window of what is submitted next.
    pub(super) fn send(&self, drawing: &Drawing, slots: &Range<u64>) {
        self.gpu.queue.write_buffer(&drawing.geometry, 0, bytemuck::bytes_of(&drawing.sent.window(slots)));
    }

    /// Commands that begin with everything empty that so many fragments may look at.
    pub(super) fn begin(&self, fragments: u64) -> wgpu::CommandEncoder {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        for buffer in self.contents.iter().chain([&self.places]) {
            let bytes = match self.keeping {
                Keeping::Slots => buffer.size() / self.size.slots() * fragments,
                Keeping::Pixels { .. } => buffer.size(),
            };
            encoder.clear_buffer(buffer, 0, Some(bytes));
        }
        encoder
    }

    /// Commands that leave intermediate results alone, and begin with slots that nothing was drawn to.
    pub(super) fn go_on(&self) -> wgpu::CommandEncoder {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&self.places, 0, Some(self.size.slots() * 16));
        encoder
    }

    /// One pass over the fragments of a window.
    pub(super) fn pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pipeline: &wgpu::ComputePipeline,
        (groups, own): (Groups<'_>, &BindGroup),
        fragments: u64,
    ) {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        for (number, group) in (0..).zip(groups) {
            if let Some(group) = group {
                pass.set_bind_group(number, group, &[]);
            }
        }
        pass.set_bind_group(3, own, &[]);
        dispatch(&mut pass, fragments.div_ceil(LANES));
    }

    /// Tests and blends what the last pass left.
    pub(super) fn finish(&self, encoder: &mut wgpu::CommandEncoder, fragments: u64, output: Output, target: &Target) {
        let gpu = &self.gpu;
        let steps = run_steps(&(0..fragments), RUN);
        gpu.queue.write_buffer(&self.stages, 0, &Sort::stages(gpu, &steps));
        gpu.queue.write_buffer(&self.output_data, 0, &OutputPass::data(gpu, output, target.width, fragments));
        let buffers = [&self.output_data, &self.places, &self.colors, &self.keys];
        let output_group = self.output.group(gpu, buffers, target);
        // Nothing is merged here.
        let sort_group = self.sort.group(gpu, &self.keys, &self.places, &self.stages);
        let mut pass = encoder.begin_compute_pass(&Default::default());
        self.output.make_keys(&mut pass, &output_group, fragments);
        for (number, step) in steps.iter().enumerate() {
            self.sort.record(gpu, &mut pass, &sort_group, step, number);
        }
        self.output.blend(gpu, &mut pass, &output_group, fragments);
    }

    pub(super) fn buffers_wgsl(&self) -> &str {
        &self.wgsl
    }

    pub(super) fn group(&self, drawing: &Drawing) -> BindGroup {
        let own = [&drawing.geometry, &drawing.runs, &self.places, &self.colors];
        let entries: Vec<_> = (0..)
            .zip(own.into_iter().chain(&self.contents))
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("F-Buffer"),
            layout: &self.layout,
            entries: &entries,
        })
    }
}
