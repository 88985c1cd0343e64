//! From a captured LFB to ordered fragments to the picture, the same for every technique that is an LFB. Twins:
//! `shaders/pass/{classify,sort,resolve}.wesl`, linked with the technique's own module.
//!
//! Step "empty pixels" draws what pixels without any become, over the whole window; where nothing is opaque, it clears. Step
//! "classify" lists runs of 64 pixels by the greatest number of fragments at a pixel of theirs. Each class has shaders of its own, dispatched over its list. On
//! the way to the resolve, in "read and blend", up to 8, 16 or 32 fragments are sorted in registers by networks
//! (`build/networks.rs`), and up to 256 in blocks of 32, sorted in place and merged by their heads, as in Knowles, Leach and
//! Zambetta's register-based block sort (2014). More are sorted in place before, in "sort", in O(n log n) and no memory but
//! the capture's own. With `presort` all are sorted in place; of a technique whose fragments come in order, none.
//!
//! Rejected: insertion sort in a local array up to 32 fragments, which the LFB chapter (section 20.4.1) found the fastest,
//! and heap sort of references above. llvmpipe reads and writes local arrays lane by lane and registers all lanes at once:
//! sorting and blending hair took 289 ms with them, and takes 126.

use std::collections::HashMap;

use glam::Vec4;
use pellucid_core::Resolve;
use pellucid_core::primitive::Pass;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, RenderPipeline, ShaderModule, ShaderStages};

use crate::frame::{Frame, Goal};
use crate::memory::Window;
use crate::pass::gather::Gather;
use crate::pass::grid::dispatch;
use crate::pass::picture::GROUP_PX;
use crate::pass::whole_window::WholeWindow;
use crate::surface::{shader, storage_entry};
use crate::{Context, GpuError, shaders};

/// Classes of runs, and pixels of a run. Twins in `shaders/shared/classes.wesl`.
const CLASSES: u64 = 5;
const RUN_PX: u64 = 64;

/// Runs that a workgroup classifies. Twin in `shaders/pass/classify.wesl`.
const GROUP_RUNS: u64 = 64;

/// Bytes of an indirect dispatch.
const DISPATCH_BYTES: u64 = 12;

const RUNS: &str = "runs of pixels";
const DISPATCHES: &str = "dispatches";

/// The passes over an LFB, linked with its technique.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LfbShaders {
    pub(crate) classify: &'static str,
    /// None if fragments come in order.
    pub(crate) sort: Option<&'static str>,
    pub(crate) resolve: &'static str,
    pub(crate) gather: &'static str,
}

/// Runs of pixels with fragments.
pub(crate) struct Listed {
    /// Group 1 of passes over them.
    pub(crate) classes: BindGroup,
    /// One for each class.
    pub(crate) dispatches: wgpu::Buffer,
}

impl Listed {
    /// Where the dispatch of the last class is.
    pub(crate) const MANY: u64 = (CLASSES - 1) * DISPATCH_BYTES;
}

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct OrderedPasses {
    /// Group 1, lists; and for the making of dispatches group 2.
    buffer: BindGroupLayout,
    prepare: ComputePipeline,
    sort: Option<ComputePipeline>,
    classify_module: ShaderModule,
    resolve_module: ShaderModule,
    layouts: [BindGroupLayout; 2],
    empty: WholeWindow,
    /// One for each resolve that was asked for, one for each entry point and resolve, and one for each classification.
    empties: HashMap<u32, RenderPipeline>,
    resolves: HashMap<(&'static str, u32), ComputePipeline>,
    classifies: HashMap<bool, ComputePipeline>,
    gather: Gather,
}

impl OrderedPasses {
    /// `picture_layout` is group 0, `lfb_layout` group 3.
    pub(crate) fn new(
        gpu: &Context,
        lfb: LfbShaders,
        picture_layout: &BindGroupLayout,
        lfb_layout: &BindGroupLayout,
    ) -> Self {
        let buffer = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("classes"),
            entries: &[storage_entry(0, ShaderStages::COMPUTE, false)],
        });
        let layouts = [Some(picture_layout), Some(&buffer), None, Some(lfb_layout)];
        let prepare_layouts = [Some(picture_layout), Some(&buffer), Some(&buffer), Some(lfb_layout)];
        let classify_module = shader(gpu, "classify", lfb.classify);
        Self {
            prepare: compute_pipeline(gpu, "classify", &classify_module, "prepare", &prepare_layouts, &[]),
            sort: lfb.sort.map(|wgsl| compute_pipeline(gpu, "sort", &shader(gpu, "sort", wgsl), "main", &layouts, &[])),
            classify_module,
            resolve_module: shader(gpu, "read and blend", lfb.resolve),
            layouts: [picture_layout.clone(), lfb_layout.clone()],
            buffer,
            empty: WholeWindow::new(gpu, "empty pixels", shaders::EMPTY, None),
            empties: HashMap::new(),
            resolves: HashMap::new(),
            classifies: HashMap::new(),
            gather: Gather::new(gpu, lfb.gather, picture_layout, lfb_layout),
        }
    }

    /// The layout of [`Listed::classes`].
    pub(crate) fn classes_layout(&self) -> &BindGroupLayout {
        &self.buffer
    }

    /// All buffers it takes for so many pixels, with their bytes.
    pub(crate) fn needs(pixels: u64) -> [(&'static str, u64); 2] {
        [(RUNS, CLASSES * (1 + pixels.div_ceil(RUN_PX)) * 4), (DISPATCHES, CLASSES * DISPATCH_BYTES)]
    }

    /// Records everything that comes after the capture of a window: towards the picture, or towards layers.
    pub(crate) fn record(&mut self, frame: &mut Frame<'_>, window: Window, lfb: &BindGroup) -> Result<(), GpuError> {
        let gpu = frame.gpu;
        let code = resolve_code(frame.resolve);
        let wants_layers = matches!(frame.goal, Goal::Layers(_));
        let needs_order = wants_layers || !matches!(frame.resolve, Resolve::Nearest | Resolve::Complexity(_));
        let sorts_all = wants_layers || frame.presort || self.sort.is_none();
        let listed = self.list(frame, window, lfb, sorts_all || !needs_order)?;
        let groups = [&frame.picture.bind_group.clone(), &listed.classes, lfb];
        let dispatches = listed.dispatches;

        let class = |number: u64| number * DISPATCH_BYTES;
        let [few, some, more, blocks, many] = [0, 1, 2, 3, 4].map(class);
        if let Some(sort) = self.sort.as_ref().filter(|_| needs_order) {
            let mut pass = frame.compute_pass("sort")?;
            set_groups(&mut pass, groups);
            pass.set_pipeline(sort);
            pass.dispatch_workgroups_indirect(&dispatches, many);
        }
        let mut pass = frame.compute_pass("read and blend")?;
        set_groups(&mut pass, groups);
        let entries: &[(&'static str, u64)] = match (needs_order, sorts_all) {
            (false, _) => &[("unordered", many)],
            (true, true) => &[("in_order", many)],
            (true, false) => &[("few", few), ("some", some), ("more", more), ("blocks", blocks), ("in_order", many)],
        };
        for &(entry, dispatch) in entries {
            pass.set_pipeline(self.resolve(gpu, entry, code));
            pass.dispatch_workgroups_indirect(&dispatches, dispatch);
        }
        drop(pass);
        if wants_layers {
            self.gather.read(frame, window, lfb)?;
        }
        Ok(())
    }

    /// Fills in what empty pixels become, and lists runs of pixels with fragments: by class, or all in the last.
    pub(crate) fn list(
        &mut self,
        frame: &mut Frame<'_>,
        window: Window,
        lfb: &BindGroup,
        one_class: bool,
    ) -> Result<Listed, GpuError> {
        let gpu = frame.gpu;
        let code = resolve_code(frame.resolve);
        let [(_, runs_bytes), (_, dispatches_bytes)] = Self::needs(window.pixels());
        let runs = frame.memory.buffer(gpu, RUNS, runs_bytes)?;
        let dispatches = frame.memory.buffer(gpu, DISPATCHES, dispatches_bytes)?;
        let bind_group = |buffer: &wgpu::Buffer| {
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("classes"),
                layout: &self.buffer,
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
            })
        };
        let (classes, prepared) = (bind_group(&runs), bind_group(&dispatches));
        let groups = [&frame.picture.bind_group.clone(), &classes, lfb];

        self.fill_empty_pixels(frame, window, code)?;
        frame.encoder().clear_buffer(&runs, 0, Some(CLASSES * 4));
        let mut pass = frame.compute_pass("classify")?;
        set_groups(&mut pass, groups);
        pass.set_pipeline(self.classify(gpu, one_class));
        dispatch(&mut pass, window.pixels().div_ceil(RUN_PX * GROUP_RUNS));
        pass.set_pipeline(&self.prepare);
        pass.set_bind_group(2, &prepared, &[]);
        pass.dispatch_workgroups(1, 1, 1);
        drop(pass);
        Ok(Listed { classes, dispatches })
    }

    fn fill_empty_pixels(&mut self, frame: &mut Frame<'_>, window: Window, code: u32) -> Result<(), GpuError> {
        if frame.surfaces.count(Pass::Opaque) == 0 {
            let counts = matches!(frame.resolve, Resolve::Complexity(_));
            return frame.clear_picture("empty pixels", if counts { Vec4::ZERO } else { frame.view.background });
        }
        let gpu = frame.gpu;
        let pipeline =
            self.empties.entry(code).or_insert_with(|| self.empty.pipeline(gpu, &[("resolve", code.into())]));
        self.empty.record(frame, window, pipeline, None)
    }

    fn classify(&mut self, gpu: &Context, one_class: bool) -> &ComputePipeline {
        let [picture, lfb] = &self.layouts;
        let layouts = [Some(picture), Some(&self.buffer), None, Some(lfb)];
        self.classifies.entry(one_class).or_insert_with(|| {
            let constants = [("one_class", f64::from(u8::from(one_class)))];
            compute_pipeline(gpu, "classify", &self.classify_module, "main", &layouts, &constants)
        })
    }

    fn resolve(&mut self, gpu: &Context, entry: &'static str, code: u32) -> &ComputePipeline {
        let [picture, lfb] = &self.layouts;
        let layouts = [Some(picture), Some(&self.buffer), None, Some(lfb)];
        self.resolves.entry((entry, code)).or_insert_with(|| {
            let constants = [("resolve", f64::from(code))];
            compute_pipeline(gpu, "read and blend", &self.resolve_module, entry, &layouts, &constants)
        })
    }
}

fn set_groups(pass: &mut wgpu::ComputePass<'_>, [picture, classes, lfb]: [&BindGroup; 3]) {
    pass.set_bind_group(0, picture, &[]);
    pass.set_bind_group(1, classes, &[]);
    pass.set_bind_group(3, lfb, &[]);
}

/// Number of a resolve in `shaders/shared/resolve.wesl`.
pub(crate) fn resolve_code(resolve: Resolve) -> u32 {
    match resolve {
        // Only a depth filter makes errors, and shows them itself.
        Resolve::Blend | Resolve::Errors => 0,
        Resolve::BlendCorrected => 1,
        Resolve::Gelly => 2,
        Resolve::Nearest => 3,
        Resolve::Layer(_) => 4,
        Resolve::Complexity(_) => 5,
    }
}

/// Dispatches over the pixels of a window with the picture as group 0 and the LFB as group 3.
pub(crate) fn dispatch_window(pass: &mut wgpu::ComputePass<'_>, frame: &Frame<'_>, window: Window, lfb: &BindGroup) {
    pass.set_bind_group(0, &frame.picture.bind_group, &[]);
    pass.set_bind_group(3, lfb, &[]);
    pass.dispatch_workgroups(window.width.div_ceil(GROUP_PX), window.height.div_ceil(GROUP_PX), 1);
}

/// A compute pipeline with constants of its shader set.
pub(crate) fn compute_pipeline(
    gpu: &Context,
    label: &str,
    module: &ShaderModule,
    entry: &str,
    layouts: &[Option<&BindGroupLayout>],
    constants: &[(&str, f64)],
) -> ComputePipeline {
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: layouts,
        immediate_size: 0,
    });
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(label),
        layout: Some(&layout),
        module,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
        cache: None,
    })
}
