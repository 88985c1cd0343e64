//! A draw whose fragments have got their slots.

use pellucid_core::fbuffer::order::{Bounds, Geometry};
use wgpu::BufferUsages;

use super::geometry::{GridGeometry, SentGeometry};
use super::raster::RUN_BYTES;
use super::{FBuffer, FBufferError, Keeping};
use crate::pass::prefix_sum::PrefixSum;
use crate::readback::mapped;

const STORAGE: BufferUsages = BufferUsages::STORAGE.union(BufferUsages::COPY_SRC).union(BufferUsages::COPY_DST);

/// Geometry on the device, and the order of its fragments.
#[derive(Debug)]
pub struct Drawing {
    pub(super) size: [u32; 2],
    pub(super) sent: SentGeometry,
    pub(super) geometry: wgpu::Buffer,
    /// And for a framebuffer, the last fragment of each pixel.
    pub(super) runs: wgpu::Buffer,
    /// For what kind of buffer.
    pub(super) keeping: Keeping,
    fragments: u32,
}

impl FBuffer {
    /// Sends geometry to the device and finds the slots of its fragments: the pass that tells whether they fit. Waits for
    /// the number of fragments.
    ///
    /// # Errors
    /// [`FBufferError::TooManyFragments`], or if it does not fit the device.
    pub fn drawing(&self, geometry: Geometry<'_>) -> Result<Drawing, FBufferError> {
        let gpu = &self.gpu;
        let viewport = geometry.viewport;
        let geometry = GridGeometry::new(geometry);
        let draws = geometry.draw_count();
        let sent = geometry.within(Bounds::of(&viewport));
        if sent.runs >= u64::from(u32::MAX) {
            return Err(FBufferError::TooManyFragments);
        }
        let lengths = sent.runs + 1;
        let buffer = |label: &str, bytes: u64| gpu.buffer(label, bytes.max(16), STORAGE);
        let words = buffer("F-Buffer geometry", sent.bytes())?;
        gpu.queue.write_buffer(&words, 0, bytemuck::cast_slice(&sent.words));
        let behind = match self.keeping {
            Keeping::Slots => 0,
            Keeping::Pixels { count } => count,
        };
        let runs = buffer("F-Buffer runs", (lengths + behind) * RUN_BYTES)?;
        let mut sums = vec![buffer("F-Buffer lengths", lengths * 4)?];
        for (name, bytes) in PrefixSum::needs(lengths) {
            sums.push(buffer(name, bytes)?);
        }
        let draw_slots = buffer("F-Buffer draws", (draws + 1) * 4)?;
        let group = self.raster.group(gpu, [&words, &runs, &sums[0], &draw_slots]);
        let sum_groups = self.prefix_sum.groups(gpu, lengths, &sums)?;
        let staging = gpu.buffer("F-Buffer total", 4, BufferUsages::COPY_DST | BufferUsages::MAP_READ)?;

        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        self.raster.count(&mut pass, &group, sent.runs);
        self.prefix_sum.run(&mut pass, &sum_groups);
        self.raster.place(&mut pass, &group, sent.runs, draws);
        drop(pass);
        encoder.copy_buffer_to_buffer(&draw_slots, draws * 4, &staging, 0, 4);
        gpu.queue.submit([encoder.finish()]);
        let total: Vec<u32> = bytemuck::pod_collect_to_vec(&mapped(gpu, &staging)?);
        match total[0] {
            // Sums stick there.
            u32::MAX => Err(FBufferError::TooManyFragments),
            fragments => Ok(Drawing {
                size: [viewport.width, viewport.height],
                sent,
                geometry: words,
                runs,
                keeping: self.keeping,
                fragments,
            }),
        }
    }
}

impl Drawing {
    /// All fragments.
    pub fn fragments(&self) -> u64 {
        self.fragments.into()
    }

    /// Bytes on the device, besides the F-Buffer itself.
    pub fn bytes(&self) -> u64 {
        self.geometry.size() + self.runs.size()
    }
}
