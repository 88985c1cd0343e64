//! Order-independent blending with an F-Buffer (Houston, Preetham and Segal 2005, section 5.1): final colours and places
//! of fragments go to two buffers, in rasterization order; a stable bitonic sort brings them into blending order. Twins:
//! `shaders/fbuffer/{shade,collect}.wesl`, `shaders/technique/fbuffer.wesl`.
//!
//! An F-Buffer that is too small for all fragments slides over the order as a window; each window is sorted and kept in 16
//! bytes a fragment, and at last the sorted windows are merged. The buffer is as large as the budget allows, up to 2048 x
//! 2048 slots.

use bytemuck::{Pod, Zeroable};
use pellucid_core::View;
use pellucid_core::fbuffer::order::{Bounds, Geometry};
use pellucid_core::fbuffer::{Size, Windows};
use pellucid_core::primitive::Pass;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, ShaderStages};

use super::{Capture, Layouts, Outcome};
use crate::fbuffer::LANES;
use crate::fbuffer::geometry::{GridGeometry, SentGeometry};
use crate::fbuffer::raster::{RUN_BYTES, Raster};
use crate::fbuffer::sort::{KEY_BYTES, Sort, Step, merge_steps, sort_steps};
use crate::frame::Frame;
use crate::memory::Window;
use crate::pass::grid::dispatch;
use crate::pass::ordered::{LfbShaders, OrderedPasses, compute_pipeline};
use crate::pass::prefix_sum::PrefixSum;
use crate::readback::read_buffer;
use crate::surface::{shader, storage_entry};
use crate::{Context, GpuError, shaders};

const GEOMETRY: &str = "geometry";
const RUNS: &str = "runs";
const COUNTS: &str = "lengths of runs";
const DRAW_SLOTS: &str = "draws' first slots";
const RANGES: &str = "pixels' ranges";
const COLORS: &str = "final colours";
const POSITIONS: &str = "places";
const FRAGMENTS: &str = "fragments";
const KEYS: &str = "keys";
const MERGED: &str = "merged keys";
const COLLECTED: &str = "window of slots";
const STAGES: &str = "stages of the sort";

/// Bytes of a slot in each of the two F-Buffers, and of a stored fragment.
const SLOT_BYTES: u64 = 16;

/// Twin: `Collected` in `shaders/fbuffer/collect.wesl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct Collected {
    first_slot: u32,
    end_slot: u32,
    total: u32,
    padding: u32,
}

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct FBuffer {
    raster: Raster,
    prefix_sum: PrefixSum,
    shade_plain: ComputePipeline,
    shade_varied: ComputePipeline,
    collect_layout: BindGroupLayout,
    collect: ComputePipeline,
    find_ranges: ComputePipeline,
    sort: Sort,
    lfb_layout: BindGroupLayout,
    ordered: OrderedPasses,
    /// Of the last frame: scene, view, and what they became.
    geometry: Option<(u64, View, GridGeometry)>,
}

/// The order of a window of the picture.
struct Order {
    sent: SentGeometry,
    geometry: wgpu::Buffer,
    runs: wgpu::Buffer,
    /// First slot of each draw, and at last the total.
    draw_slots: Vec<u32>,
}

impl FBuffer {
    pub(crate) fn new(gpu: &Context, layouts: Layouts<'_>) -> Self {
        let raster = Raster::new(gpu);
        let surfaces = layouts.surfaces;
        let shade_layouts = [&surfaces.frame, &surfaces.scene, &surfaces.texture, &raster.layout].map(Some);
        let shade_module = shader(gpu, "shade", shaders::FBUFFER_SHADE);
        let shade = |entry| compute_pipeline(gpu, "shade", &shade_module, entry, &shade_layouts, &[]);
        let layout = |label, read_only: &[bool]| {
            let entries = (0..).zip(read_only);
            let entries: Vec<_> =
                entries.map(|(binding, &read_only)| storage_entry(binding, ShaderStages::COMPUTE, read_only)).collect();
            gpu.device
                .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
        };
        let collect_layout = layout("collect", &[true, false, false, false, false, false]);
        let collect_module = shader(gpu, "collect", shaders::FBUFFER_COLLECT);
        let collect_layouts = [Some(layouts.picture), None, None, Some(&collect_layout)];
        let collect = |entry| compute_pipeline(gpu, "collect", &collect_module, entry, &collect_layouts, &[]);
        let lfb_layout = layout("sorted F-Buffer", &[false; 3]);
        let ordered_shaders = LfbShaders {
            classify: shaders::CLASSIFY_FBUFFER,
            sort: None,
            resolve: shaders::RESOLVE_FBUFFER,
            gather: shaders::GATHER_FBUFFER,
            by_reference: false,
        };
        Self {
            prefix_sum: PrefixSum::new(gpu),
            shade_plain: shade("plain"),
            shade_varied: shade("varied"),
            collect: collect("collect"),
            find_ranges: collect("find_ranges"),
            collect_layout,
            sort: Sort::new(gpu),
            ordered: OrderedPasses::new(gpu, ordered_shaders, layouts.picture, &lfb_layout),
            lfb_layout,
            raster,
            geometry: None,
        }
    }

    /// What of the scene lies in a window, set up by the host once a view.
    fn geometry(&mut self, frame: &Frame<'_>, window: Window) -> Result<SentGeometry, GpuError> {
        let (scene, view) = (frame.scene, frame.view);
        let is_kept = |(revision, kept, _): &(u64, View, _)| *revision == scene.revision() && kept == view;
        if !self.geometry.as_ref().is_some_and(is_kept) {
            let geometry = GridGeometry::new(Geometry::new(scene, view, Pass::Transparent)?);
            self.geometry = Some((scene.revision(), view.clone(), geometry));
        }
        let Some((_, _, geometry)) = &self.geometry else { unreachable!("it has just been made") };
        let bounds = Bounds {
            left: window.left as i32,
            top: window.top as i32,
            right: (window.left + window.width) as i32 - 1,
            bottom: (window.top + window.height) as i32 - 1,
        };
        Ok(geometry.within(bounds))
    }

    fn draw_count(&self) -> u64 {
        self.geometry.as_ref().map_or(0, |(_, _, geometry)| geometry.draw_count())
    }

    /// Buffers that the order takes.
    fn order_needs(&self, pixels: u64, sent: &SentGeometry) -> Vec<(&'static str, u64)> {
        let mut needs = vec![
            (RANGES, pixels * 8),
            (GEOMETRY, sent.bytes()),
            (RUNS, (sent.runs + 1) * RUN_BYTES),
            (COUNTS, (sent.runs + 1) * 4),
            (DRAW_SLOTS, (self.draw_count() + 1) * 4),
        ];
        needs.extend(PrefixSum::needs(sent.runs + 1));
        needs.extend(OrderedPasses::needs(pixels));
        needs
    }

    /// Measures, sums up and places all runs of a window.
    fn order(
        &mut self,
        frame: &mut Frame<'_>,
        sent: SentGeometry,
        needs: &[(&'static str, u64)],
    ) -> Result<Order, GpuError> {
        let (gpu, runs) = (frame.gpu, sent.runs);
        frame.memory.make_room(needs);
        let mut buffer = |name| {
            let bytes = needs.iter().find(|&&(other, _)| other == name).map_or(0, |&(_, bytes)| bytes);
            frame.memory.buffer(gpu, name, bytes)
        };
        let (geometry, run_table, counts) = (buffer(GEOMETRY)?, buffer(RUNS)?, buffer(COUNTS)?);
        let draw_slots = buffer(DRAW_SLOTS)?;
        gpu.queue.write_buffer(&geometry, 0, bytemuck::cast_slice(&sent.words));
        let group = self.raster.group(gpu, [&geometry, &run_table, &counts, &draw_slots]);
        self.raster.count(&mut frame.compute_pass("count")?, &group, runs);
        self.prefix_sum.record(frame, "prefix sums", &counts, runs + 1)?;
        let draws = self.draw_count();
        self.raster.place(&mut frame.compute_pass("place")?, &group, runs, draws);
        let draw_slots = read_buffer(frame, &draw_slots, 0, draws + 1)?;
        Ok(Order { sent, geometry, runs: run_table, draw_slots })
    }

    /// Buffers that fragments take, beside those of the order, in an F-Buffer of a size.
    fn fragment_needs(gpu: &Context, total: u64, size: Size) -> Vec<(&'static str, u64)> {
        let slots = size.slots().min(total);
        let (sorting, merging) = steps(total, size);
        let mut needs = vec![
            (COLLECTED, size_of::<Collected>() as u64),
            (COLORS, slots * SLOT_BYTES),
            (POSITIONS, slots * SLOT_BYTES),
            (FRAGMENTS, total * SLOT_BYTES),
            (KEYS, total * KEY_BYTES),
            (STAGES, Sort::stage_bytes(gpu, sorting.iter().map(Vec::len).sum::<usize>() + merging.len())),
        ];
        needs.push((MERGED, if merging.is_empty() { 0 } else { total * KEY_BYTES }));
        needs
    }

    /// Shades all draws within a window of slots.
    fn shade(
        &self,
        frame: &mut Frame<'_>,
        order: &Order,
        slots: &std::ops::Range<u64>,
        group: &BindGroup,
    ) -> Result<(), GpuError> {
        let mut pass = frame.compute_pass("shade")?;
        pass.set_bind_group(1, frame.surfaces.scene_group(), &[]);
        pass.set_bind_group(3, group, &[]);
        for draw in frame.surfaces.compute_draws() {
            let [first, end] = [draw.instance, draw.instance + 1].map(|i| u64::from(order.draw_slots[i]));
            let fragments = end.min(slots.end).saturating_sub(first.max(slots.start));
            if fragments > 0 {
                pass.set_pipeline(if draw.varies { &self.shade_varied } else { &self.shade_plain });
                pass.set_bind_group(0, draw.frame_group, &[]);
                pass.set_bind_group(2, draw.texture, &[]);
                dispatch(&mut pass, fragments.div_ceil(LANES));
            }
        }
        Ok(())
    }
}

/// The dispatches that sort each window, and those that merge them.
fn steps(total: u64, size: Size) -> (Vec<Vec<Step>>, Vec<Step>) {
    let windows = Windows::new(total, size);
    let sorting = (0..windows.count()).map(|window| sort_steps(&windows.slots(window))).collect();
    (sorting, merge_steps(total, size.slots()))
}

impl Capture for FBuffer {
    fn window(&mut self, frame: &mut Frame<'_>, window: Window) -> Result<Outcome, GpuError> {
        let (gpu, pixels) = (frame.gpu, window.pixels());

        // The geometry stage, and where every fragment has its slot.
        let sent = self.geometry(frame, window)?;
        let order_needs = self.order_needs(pixels, &sent);
        if sent.runs >= u64::from(u32::MAX) || !frame.memory.fits(gpu, &order_needs) {
            return frame.memory.halves(gpu, window, &order_needs);
        }
        let order = self.order(frame, sent, &order_needs)?;
        let total = u64::from(order.draw_slots.last().copied().unwrap_or(0));

        // An F-Buffer for all fragments, or the largest that fits the budget.
        let needs_of = |size| [order_needs.clone(), Self::fragment_needs(gpu, total, size)].concat();
        let largest = frame.fbuffer_size.filter(|size| size.slots() < total).unwrap_or(Size::holding(total));
        let sizes = std::iter::successors(Some(largest), |size| size.smaller());
        let fits = |size: &Size| total < u64::from(u32::MAX) && frame.memory.fits(gpu, &needs_of(*size));
        let Some(size) = sizes.clone().find(fits) else {
            let least = sizes.last().unwrap_or(Size::holding(0));
            return frame.memory.halves(gpu, window, &needs_of(least));
        };
        let needs = needs_of(size);
        let order = match frame.memory.make_room(&needs) {
            false => order,
            // Everything was given back, the order too.
            true => self.order(frame, order.sent, &order_needs)?,
        };
        let mut buffer = |name| {
            let bytes = needs.iter().find(|&&(other, _)| other == name).map_or(0, |&(_, bytes)| bytes);
            frame.memory.buffer(gpu, name, bytes)
        };
        let (colors, positions, fragments) = (buffer(COLORS)?, buffer(POSITIONS)?, buffer(FRAGMENTS)?);
        let (ranges, mut keys, stages) = (buffer(RANGES)?, buffer(KEYS)?, buffer(STAGES)?);
        let (mut merged, collected) = (buffer(MERGED)?, buffer(COLLECTED)?);

        let (sorting, merging) = steps(total, size);
        let all_steps: Vec<Step> = sorting.iter().flatten().chain(&merging).copied().collect();
        gpu.queue.write_buffer(&stages, 0, &Sort::stages(gpu, &all_steps));
        let collect_group = |keys: &wgpu::Buffer| {
            let buffers = [&collected, &colors, &positions, keys, &fragments, &ranges];
            group(gpu, &self.collect_layout, &buffers)
        };
        let shade_group = self.raster.group(gpu, [&order.geometry, &order.runs, &colors, &positions]);
        let windows = Windows::new(total, size);
        frame.slot_windows += windows.count();
        let mut number = 0;
        for (slots, steps) in (0..windows.count()).map(|window| windows.slots(window)).zip(&sorting) {
            frame.submit()?;
            gpu.queue.write_buffer(&order.geometry, 0, bytemuck::bytes_of(&order.sent.window(&slots)));
            let data = Collected {
                first_slot: slots.start as u32,
                end_slot: slots.end as u32,
                total: total as u32,
                padding: 0,
            };
            gpu.queue.write_buffer(&collected, 0, bytemuck::bytes_of(&data));
            self.shade(frame, &order, &slots, &shade_group)?;
            let mut pass = frame.compute_pass("collect")?;
            pass.set_pipeline(&self.collect);
            pass.set_bind_group(0, &frame.picture.bind_group, &[]);
            pass.set_bind_group(3, &collect_group(&keys), &[]);
            dispatch(&mut pass, (slots.end - slots.start).div_ceil(LANES));
            drop(pass);
            let sort_group = self.sort.group(gpu, &keys, &merged, &stages);
            let mut pass = frame.compute_pass("sort")?;
            for step in steps {
                self.sort.record(gpu, &mut pass, &sort_group, step, number);
                number += 1;
            }
        }
        for step in &merging {
            let sort_group = self.sort.group(gpu, &keys, &merged, &stages);
            self.sort.record(gpu, &mut frame.compute_pass("merge")?, &sort_group, step, number);
            number += 1;
            std::mem::swap(&mut keys, &mut merged);
        }

        // Where each pixel's fragments are; then they are read as those of any LFB.
        frame.zero("zero", &ranges, pixels * 8)?;
        let mut pass = frame.compute_pass("find pixels")?;
        pass.set_pipeline(&self.find_ranges);
        pass.set_bind_group(0, &frame.picture.bind_group, &[]);
        pass.set_bind_group(3, &collect_group(&keys), &[]);
        dispatch(&mut pass, total.div_ceil(LANES));
        drop(pass);
        let lfb = group(gpu, &self.lfb_layout, &[&ranges, &keys, &fragments]);
        self.ordered.record(frame, window, &lfb, total)?;
        Ok(Outcome::Done)
    }
}

fn group(gpu: &Context, layout: &BindGroupLayout, buffers: &[&wgpu::Buffer]) -> BindGroup {
    let entries: Vec<_> = (0..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("F-Buffer"), layout, entries: &entries })
}
