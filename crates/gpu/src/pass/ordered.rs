//! From a captured LFB to ordered fragments to the picture, the same for every technique that is an LFB. Twins:
//! `shaders/pass/{classify,sort,resolve}.wesl`, linked with the technique's own module.
//!
//! Step "empty pixels" draws what pixels without any become, over the whole window; where nothing is opaque, it clears. Step
//! "classify" lists runs of 16 pixels by the greatest number of fragments at a pixel of theirs. Each class has shaders of its
//! own, dispatched over its list, four runs to a workgroup. On the way to the resolve, in "read and blend", up to 2, 4, 8, 16
//! or 32 fragments are sorted in registers by networks (`build/networks.rs`), and up to 256 in blocks of 32, sorted in place
//! and merged by their heads, as in Knowles, Leach and Zambetta's register-based block sort (2014). More are sorted in place
//! before, in "sort", in O(n log n). With `presort` all are sorted in place; of a technique whose fragments come in order,
//! none.
//!
//! Fragments in a buffer are sorted in no memory but the capture's own. Those in a texture cannot be moved: where any have to
//! be sorted in place, references to them are (`shaders/shared/sorted.wesl`), 4 bytes for each slot of the capture.
//!
//! Rejected: insertion sort in a local array up to 32 fragments, which the LFB chapter (section 20.4.1) found the fastest,
//! and heap sort for all above. llvmpipe reads and writes local arrays lane by lane and registers all lanes at once:
//! sorting and blending hair took 289 ms with them, and 126 without.

use std::collections::HashMap;

use glam::Vec4;
use pellucid_core::Resolve;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, RenderPipeline, ShaderModule, ShaderStages};

use crate::frame::{Frame, Goal, HAS_OPAQUE};
use crate::memory::Window;
use crate::pass::gather::Gather;
use crate::pass::grid::dispatch;
use crate::pass::picture::GROUP_PX;
use crate::pass::whole_window::WholeWindow;
use crate::readback::read_buffer;
use crate::surface::{shader, storage_entry};
use crate::{Context, GpuError, shaders};

/// Classes of runs, and pixels of a run. Twins in `shaders/shared/classes.wesl`.
const CLASSES: u64 = 7;
const BLOCKS: usize = 5;
const MANY: usize = 6;
const RUN_PX: u64 = 16;

/// What resolves each class, if not all pixels have been sorted before.
const BY_CLASS: [(usize, &str); CLASSES as usize] = [
    (0, "up_to_2"),
    (1, "up_to_4"),
    (2, "up_to_8"),
    (3, "up_to_16"),
    (4, "up_to_32"),
    (BLOCKS, "blocks"),
    (MANY, "in_order"),
];

/// Pixels that a workgroup classifies. Twins in `shaders/pass/classify.wesl`.
const CLASSIFIED_PX: u64 = 64 * 64;

/// Bytes of a reference to a fragment.
const REFERENCE_BYTES: u64 = 4;

/// Bytes of an indirect dispatch.
const DISPATCH_BYTES: u64 = 12;

const RUNS: &str = "runs of pixels";
const DISPATCHES: &str = "dispatches";
const ORDER: &str = "order";

/// The passes over an LFB, linked with its technique.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LfbShaders {
    pub(crate) classify: &'static str,
    /// None if fragments come in order.
    pub(crate) sort: Option<&'static str>,
    pub(crate) resolve: &'static str,
    pub(crate) gather: &'static str,
    /// Fragments lie in a texture, where they cannot be moved.
    pub(crate) by_reference: bool,
}

/// Runs of pixels with fragments.
pub(crate) struct Listed {
    /// Group 1 of passes over them.
    pub(crate) classes: BindGroup,
    runs: wgpu::Buffer,
    /// One for each class.
    pub(crate) dispatches: wgpu::Buffer,
}

impl Listed {
    /// Where the dispatch of the last class is.
    pub(crate) const MANY: u64 = MANY as u64 * DISPATCH_BYTES;

    /// How many each class has. Waits for the device.
    fn runs_of_class(&self, frame: &mut Frame<'_>) -> Result<[u32; CLASSES as usize], GpuError> {
        Ok(read_buffer(frame, &self.runs, 0, 1)?[0])
    }
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
    /// Group 2 of what is sorted by reference.
    order: Option<BindGroupLayout>,
    empty: WholeWindow,
    /// One for each resolve that was asked for, one for each entry point and what it is made for, and one for each classification.
    empties: HashMap<u32, RenderPipeline>,
    resolves: HashMap<(&'static str, ResolveConstants), ComputePipeline>,
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
        let layout = |label| {
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some(label),
                entries: &[storage_entry(0, ShaderStages::COMPUTE, false)],
            })
        };
        let buffer = layout("classes");
        let order = lfb.by_reference.then(|| layout(ORDER));
        let layouts = [Some(picture_layout), Some(&buffer), order.as_ref(), Some(lfb_layout)];
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
            gather: Gather::new(gpu, lfb.gather, [picture_layout, lfb_layout], order.as_ref()),
            order,
        }
    }

    /// Groups 1 and 2 of passes over what is [`Listed`], or over pixels that are listed in the same way.
    pub(crate) fn list_layouts(&self) -> [Option<&BindGroupLayout>; 2] {
        [Some(&self.buffer), self.order.as_ref()]
    }

    /// All buffers it takes for so many pixels, with their bytes.
    pub(crate) fn needs(pixels: u64) -> [(&'static str, u64); 2] {
        [(RUNS, CLASSES * (1 + pixels.div_ceil(RUN_PX)) * 4), (DISPATCHES, CLASSES * DISPATCH_BYTES)]
    }

    /// The buffer it takes besides, if fragments in so many slots have to be sorted by reference.
    pub(crate) fn order_need(slots: u64) -> (&'static str, u64) {
        (ORDER, slots * REFERENCE_BYTES)
    }

    /// Records everything that comes after the capture of a window: towards the picture, or towards layers. All fragments lie
    /// in slots below `slots`.
    pub(crate) fn record(
        &mut self,
        frame: &mut Frame<'_>,
        window: Window,
        lfb: &BindGroup,
        slots: u64,
    ) -> Result<(), GpuError> {
        let gpu = frame.gpu;
        let constants = ResolveConstants::of(frame);
        let wants_layers = matches!(frame.goal, Goal::Layers(_));
        let needs_order = wants_layers || !matches!(frame.resolve, Resolve::Nearest | Resolve::Complexity(_));
        let sorts_all = wants_layers || frame.presort || self.sort.is_none();
        let listed = self.list(frame, window, lfb, sorts_all || !needs_order)?;
        let sorts_by_class = needs_order && !sorts_all;
        let runs_of_class = if sorts_by_class { Some(listed.runs_of_class(frame)?) } else { None };
        let order = match &self.order {
            None => None,
            Some(layout) => {
                let sorts_in_place = needs_order && runs_of_class.is_none_or(|runs| runs[BLOCKS] + runs[MANY] > 0);
                Some(order_group(frame, layout, sorts_in_place.then_some(slots))?)
            }
        };
        let groups = [&frame.picture.bind_group.clone(), &listed.classes, lfb];
        let dispatches = listed.dispatches;

        if let Some(sort) = self.sort.as_ref().filter(|_| needs_order) {
            let mut pass = frame.compute_pass("sort")?;
            set_groups(&mut pass, groups, order.as_ref());
            pass.set_pipeline(sort);
            pass.dispatch_workgroups_indirect(&dispatches, Listed::MANY);
        }
        let mut pass = frame.compute_pass("read and blend")?;
        set_groups(&mut pass, groups, order.as_ref());
        let classes = match (needs_order, sorts_all) {
            (false, _) => &[(MANY, "unordered")][..],
            (true, true) => &[(MANY, "in_order")],
            (true, false) => &BY_CLASS,
        };
        // Without a pipeline for a class that has nothing: on llvmpipe each takes long to compile.
        for &(class, entry) in classes.iter().filter(|(class, _)| runs_of_class.is_none_or(|runs| runs[*class] > 0)) {
            pass.set_pipeline(self.resolve(gpu, entry, constants));
            pass.dispatch_workgroups_indirect(&dispatches, class as u64 * DISPATCH_BYTES);
        }
        drop(pass);
        if wants_layers {
            self.gather.read(frame, window, lfb, order.as_ref())?;
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
        set_groups(&mut pass, groups, None);
        pass.set_pipeline(self.classify(gpu, one_class));
        dispatch(&mut pass, window.pixels().div_ceil(CLASSIFIED_PX));
        pass.set_pipeline(&self.prepare);
        pass.set_bind_group(2, &prepared, &[]);
        pass.dispatch_workgroups(1, 1, 1);
        drop(pass);
        Ok(Listed { classes, runs, dispatches })
    }

    fn fill_empty_pixels(&mut self, frame: &mut Frame<'_>, window: Window, code: u32) -> Result<(), GpuError> {
        if !frame.surfaces.has_opaque {
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

    fn resolve(&mut self, gpu: &Context, entry: &'static str, constants: ResolveConstants) -> &ComputePipeline {
        let [picture, lfb] = &self.layouts;
        let layouts = [Some(picture), Some(&self.buffer), self.order.as_ref(), Some(lfb)];
        self.resolves.entry((entry, constants)).or_insert_with(|| {
            compute_pipeline(gpu, "read and blend", &self.resolve_module, entry, &layouts, &constants.by_name())
        })
    }
}

pub(crate) fn set_groups(
    pass: &mut wgpu::ComputePass<'_>,
    [picture, classes, lfb]: [&BindGroup; 3],
    order: Option<&BindGroup>,
) {
    pass.set_bind_group(0, picture, &[]);
    pass.set_bind_group(1, classes, &[]);
    pass.set_bind_group(2, order, &[]);
    pass.set_bind_group(3, lfb, &[]);
}

/// References to fragments, whose slots lie below this; `None` if nothing is sorted.
pub(crate) fn order_group(
    frame: &mut Frame<'_>,
    layout: &BindGroupLayout,
    slots: Option<u64>,
) -> Result<BindGroup, GpuError> {
    let order = match slots.map(OrderedPasses::order_need) {
        Some((name, bytes)) => frame.memory.buffer(frame.gpu, name, bytes)?,
        None => frame.memory.any_buffer(frame.gpu, ORDER)?,
    };
    Ok(frame.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(ORDER),
        layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: order.as_entire_binding() }],
    }))
}

/// What shaders that resolve are made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct ResolveConstants {
    code: u32,
    has_opaque: bool,
}

impl ResolveConstants {
    pub(crate) fn of(frame: &Frame<'_>) -> Self {
        Self { code: resolve_code(frame.resolve), has_opaque: frame.surfaces.has_opaque }
    }

    pub(crate) fn by_name(self) -> [(&'static str, f64); 2] {
        [("resolve", self.code.into()), (HAS_OPAQUE, f64::from(u8::from(self.has_opaque)))]
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shaders::constant;

    #[test]
    fn classes_are_what_shaders_take_them_for() {
        let shader = include_str!("../../shaders/shared/classes.wesl");
        assert_eq!((constant(shader, "CLASSES"), constant(shader, "RUN")), (CLASSES, RUN_PX));
        for (class, entry) in BY_CLASS {
            let name = if class == MANY { "MANY".to_owned() } else { entry.to_uppercase() };
            assert_eq!(constant(shader, &name), class as u64, "{name}");
        }
        let shader = include_str!("../../shaders/pass/classify.wesl");
        assert_eq!(constant(shader, "SHARE") * constant(shader, "LANES"), CLASSIFIED_PX);
        let number = format!("@id({HAS_OPAQUE}) override has_opaque");
        assert!(include_str!("../../shaders/shared/frame.wesl").contains(&number));
    }
}
