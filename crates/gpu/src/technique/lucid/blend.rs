//! Fragments of pixels through the depth filter, and those pixels once more that it left out of order. Twins:
//! `shaders/technique/lucid/{blend,filter}.wesl`, and `shaders/pass/{sort,resolve}.wesl` over pixels instead of runs of them.

use std::collections::HashMap;

use pellucid_core::Resolve;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, ShaderModule};

use super::layouts::Bound;
use super::work::FILTER_SIZE;
use super::{DepthFilter, stage_group, stage_layout};
use crate::frame::Frame;
use crate::memory::Window;
use crate::pass::ordered::{Listed, OrderedPasses, ResolveConstants, compute_pipeline, order_group, set_groups};
use crate::readback::read_buffer;
use crate::surface::shader;
use crate::technique::Layouts;
use crate::{Context, GpuError, shaders};

/// What a pipeline is made for; behind the resolve: size of the filter, bits of the threshold, whether errors are shown.
type Key = (ResolveConstants, u32, u32, bool);

/// Long-lived half.
#[derive(Debug)]
pub(super) struct Blend {
    picture: BindGroupLayout,
    classes: BindGroupLayout,
    /// The list of pixels out of order, and dispatches over it.
    wrong: BindGroupLayout,
    lfb: BindGroupLayout,
    order: BindGroupLayout,
    module: ShaderModule,
    pipelines: HashMap<Key, ComputePipeline>,
    prepare: ComputePipeline,
    sort: ComputePipeline,
    resolve_module: ShaderModule,
    resolves: HashMap<(&'static str, ResolveConstants), ComputePipeline>,
}

impl Blend {
    pub(super) fn new(gpu: &Context, layouts: Layouts<'_>, ordered: &OrderedPasses, lfb: &BindGroupLayout) -> Self {
        let wrong = stage_layout(gpu, &[(0, Bound::ReadWrite), (1, Bound::ReadWrite)]);
        let module = shader(gpu, "blend", shaders::LUCID_BLEND);
        let picture = layouts.picture;
        let [Some(classes), Some(order)] = ordered.list_layouts() else { unreachable!("it sorts by reference") };
        let own = [Some(picture), Some(classes), Some(&wrong), Some(lfb)];
        let listed = [Some(picture), Some(classes), Some(order), Some(lfb)];
        let sort_module = shader(gpu, "repair", shaders::LUCID_SORT_WRONG);
        Self {
            prepare: compute_pipeline(gpu, "repair", &module, "prepare", &own, &[]),
            sort: compute_pipeline(gpu, "repair", &sort_module, "main", &listed, &[]),
            picture: picture.clone(),
            classes: classes.clone(),
            wrong,
            lfb: lfb.clone(),
            order: order.clone(),
            module,
            pipelines: HashMap::new(),
            resolve_module: shader(gpu, "repair", shaders::LUCID_RESOLVE_WRONG),
            resolves: HashMap::new(),
        }
    }

    /// Blends all pixels with fragments, of which the LFB has so many. `wrong` and `dispatches` are its own.
    pub(super) fn record(
        &mut self,
        frame: &mut Frame<'_>,
        window: Window,
        listed: &Listed,
        (lfb, fragments): (&BindGroup, u64),
        [wrong, dispatches]: [&wgpu::Buffer; 2],
    ) -> Result<(), GpuError> {
        let gpu = frame.gpu;
        let DepthFilter { size, threshold } = frame.depth_filter;
        let size = size.clamp(1, DepthFilter::GREATEST_SIZE);
        let resolve = ResolveConstants::of(frame);
        let shows_errors = frame.resolve == Resolve::Errors;
        let layouts = [Some(&self.picture), Some(&self.classes), Some(&self.wrong), Some(&self.lfb)];
        let pipeline = self.pipelines.entry((resolve, size, threshold.to_bits(), shows_errors)).or_insert_with(|| {
            let [resolve, has_opaque] = resolve.by_name();
            let constants = [
                resolve,
                has_opaque,
                (FILTER_SIZE, f64::from(size)),
                ("threshold", f64::from(threshold)),
                ("shows_errors", f64::from(u8::from(shows_errors))),
            ];
            compute_pipeline(gpu, "blend", &self.module, "main", &layouts, &constants)
        });
        let picture = frame.picture.bind_group.clone();
        let group = stage_group(gpu, &self.wrong, &[], &[(0, wrong), (1, dispatches)]);
        frame.encoder().clear_buffer(wrong, 0, Some(8));
        let mut pass = frame.compute_pass("blend")?;
        set_groups(&mut pass, [&picture, &listed.classes, lfb], Some(&group));
        pass.set_pipeline(pipeline);
        pass.dispatch_workgroups_indirect(&listed.dispatches, Listed::MANY);
        pass.set_pipeline(&self.prepare);
        pass.dispatch_workgroups(1, 1, 1);
        drop(pass);
        let [repaired, cut]: [u32; 2] = read_buffer(frame, wrong, 0, 1)?[0];
        if repaired > 0 && !shows_errors {
            self.repair(frame, (lfb, fragments), [wrong, dispatches])?;
        }
        debug_assert!(u64::from(repaired) <= window.pixels(), "a pixel is listed once");
        frame.repaired_pixels += u64::from(repaired);
        frame.cut_pixels += u64::from(cut);
        Ok(())
    }

    /// Sorts and resolves the pixels listed.
    fn repair(
        &mut self,
        frame: &mut Frame<'_>,
        (lfb, fragments): (&BindGroup, u64),
        [wrong, dispatches]: [&wgpu::Buffer; 2],
    ) -> Result<(), GpuError> {
        let gpu = frame.gpu;
        let order = order_group(frame, &self.order, Some(fragments))?;
        let picture = frame.picture.bind_group.clone();
        let constants = ResolveConstants::of(frame);
        let group = stage_group(gpu, &self.classes, &[], &[(0, wrong)]);
        let mut pass = frame.compute_pass("repair")?;
        set_groups(&mut pass, [&picture, &group, lfb], Some(&order));
        pass.set_pipeline(&self.sort);
        pass.dispatch_workgroups_indirect(dispatches, 0);
        let layouts = [Some(&self.picture), Some(&self.classes), Some(&self.order), Some(&self.lfb)];
        for entry in ["blocks", "in_order"] {
            let pipeline = self.resolves.entry((entry, constants)).or_insert_with(|| {
                compute_pipeline(gpu, "repair", &self.resolve_module, entry, &layouts, &constants.by_name())
            });
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups_indirect(dispatches, 0);
        }
        Ok(())
    }
}

/// The layout of an LFB that is linear.
pub(super) fn lfb_layout(gpu: &Context) -> BindGroupLayout {
    stage_layout(gpu, &[(0, Bound::ReadWrite), (1, Bound::Table)])
}
