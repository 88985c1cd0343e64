//! How long each step of a frame took.
//!
//! With timestamps, every pass carries a pair of them, and a step's time is the sum over its passes. Without, the frame
//! waits for the GPU wherever one step ends and another begins: slower, but honest figures.

use std::time::Instant;

use pellucid_core::stats::Step;
use wgpu::{BufferUsages, Features, QUERY_SIZE};

use crate::readback::mapped;
use crate::{Context, GpuError};

/// Pairs of timestamps between two read-backs.
const PAIRS: u32 = 1024;

/// Times of a frame's steps.
#[derive(Debug)]
pub(crate) struct Steps {
    steps: Vec<Step>,
    queries: Option<Queries>,
    /// The step that is being timed by waiting, and since when.
    current: Option<(&'static str, Instant)>,
}

#[derive(Debug)]
struct Queries {
    set: wgpu::QuerySet,
    names: Vec<&'static str>,
}

impl Steps {
    pub(crate) fn new(gpu: &Context) -> Self {
        let queries = gpu.has(Features::TIMESTAMP_QUERY).then(|| Queries {
            set: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("steps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * PAIRS,
            }),
            names: Vec::new(),
        });
        Self { steps: Vec::new(), queries, current: None }
    }

    /// Whether what was recorded has to be submitted and [`Self::collect`]ed before a pass of this step begins.
    pub(crate) fn must_collect_before(&self, name: &'static str) -> bool {
        match &self.queries {
            Some(queries) => queries.names.len() as u32 == PAIRS,
            None => self.current.is_some_and(|(current, _)| current != name),
        }
    }

    /// Takes note of a pass of this step, and gives the timestamps it writes.
    pub(crate) fn begin_pass(&mut self, name: &'static str) -> Option<(wgpu::QuerySet, u32, u32)> {
        self.add(name, 0.0);
        match &mut self.queries {
            Some(queries) => {
                let first = 2 * queries.names.len() as u32;
                queries.names.push(name);
                Some((queries.set.clone(), first, first + 1))
            }
            None => {
                self.current.get_or_insert_with(|| (name, Instant::now()));
                None
            }
        }
    }

    /// Adds up what was timed, after everything recorded has been submitted. Waits for it.
    pub(crate) fn collect(&mut self, gpu: &Context) -> Result<(), GpuError> {
        if let Some((name, since)) = self.current.take() {
            gpu.wait()?;
            self.add(name, since.elapsed().as_secs_f64() * 1e3);
        }
        let Some(queries) = &mut self.queries else { return Ok(()) };
        let names = std::mem::take(&mut queries.names);
        if names.is_empty() {
            return Ok(());
        }
        let count = 2 * names.len() as u32;
        let bytes = u64::from(count) * u64::from(QUERY_SIZE);
        let resolved = gpu.buffer("timestamps", bytes, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC)?;
        let staging = gpu.buffer("timestamps", bytes, BufferUsages::COPY_DST | BufferUsages::MAP_READ)?;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.resolve_query_set(&queries.set, 0..count, &resolved, 0);
        encoder.copy_buffer_to_buffer(&resolved, 0, &staging, 0, bytes);
        gpu.queue.submit([encoder.finish()]);
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&mapped(gpu, &staging)?);
        let ms_per_tick = f64::from(gpu.queue.get_timestamp_period()) * 1e-6;
        for (name, pair) in names.into_iter().zip(ticks.chunks_exact(2)) {
            self.add(name, pair[1].saturating_sub(pair[0]) as f64 * ms_per_tick);
        }
        Ok(())
    }

    /// The steps in the order in which they first began.
    pub(crate) fn finish(self) -> Vec<Step> {
        self.steps
    }

    fn add(&mut self, name: &'static str, ms: f64) {
        match self.steps.iter_mut().find(|step| step.name == name) {
            Some(step) => step.ms += ms,
            None => self.steps.push(Step { name, ms }),
        }
    }
}
