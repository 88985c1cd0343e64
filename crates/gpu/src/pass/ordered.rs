//! From a captured LFB to ordered fragments to the picture: the steps "sort" and "read and blend", the same for every
//! technique that is an LFB. Twins: `shaders/pass/{sort,resolve}.wesl`, linked with the technique's own module.

use std::collections::HashMap;

use pellucid_core::Resolve;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, ShaderModule};

use crate::frame::{Frame, Goal};
use crate::memory::Window;
use crate::pass::gather::Gather;
use crate::pass::picture::GROUP_PX;
use crate::surface::shader;
use crate::{Context, GpuError};

/// The passes over an LFB, linked with its technique.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LfbShaders {
    pub(crate) sort: &'static str,
    pub(crate) resolve: &'static str,
    pub(crate) gather: &'static str,
}

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct OrderedPasses {
    sort: ComputePipeline,
    resolve_module: ShaderModule,
    resolve_layouts: [BindGroupLayout; 2],
    /// One for each resolve that was asked for.
    resolves: HashMap<u32, ComputePipeline>,
    gather: Gather,
}

impl OrderedPasses {
    /// `picture_layout` is group 0, `lfb_layout` group 3.
    pub(crate) fn new(
        gpu: &Context,
        shaders: LfbShaders,
        picture_layout: &BindGroupLayout,
        lfb_layout: &BindGroupLayout,
    ) -> Self {
        let layouts = [Some(picture_layout), None, None, Some(lfb_layout)];
        let sort_module = shader(gpu, "sort", shaders.sort);
        Self {
            sort: compute_pipeline(gpu, "sort", &sort_module, "main", &layouts, &[]),
            resolve_module: shader(gpu, "read and blend", shaders.resolve),
            resolve_layouts: [picture_layout.clone(), lfb_layout.clone()],
            resolves: HashMap::new(),
            gather: Gather::new(gpu, shaders.gather, picture_layout, lfb_layout),
        }
    }

    /// Records everything that comes after the capture of a window: towards the picture, or towards layers.
    pub(crate) fn record(&mut self, frame: &mut Frame<'_>, window: Window, lfb: &BindGroup) -> Result<(), GpuError> {
        let wants_layers = matches!(frame.goal, Goal::Layers(_));
        if wants_layers || !matches!(frame.resolve, Resolve::Nearest | Resolve::Complexity(_)) {
            let mut pass = frame.compute_pass("sort")?;
            pass.set_pipeline(&self.sort);
            dispatch_window(&mut pass, frame, window, lfb);
        }
        let mut pass = frame.compute_pass("read and blend")?;
        pass.set_pipeline(self.resolve(frame.gpu, frame.resolve));
        dispatch_window(&mut pass, frame, window, lfb);
        drop(pass);
        if wants_layers {
            self.gather.read(frame, window, lfb)?;
        }
        Ok(())
    }

    fn resolve(&mut self, gpu: &Context, resolve: Resolve) -> &ComputePipeline {
        let code = resolve_code(resolve);
        self.resolves.entry(code).or_insert_with(|| {
            let [picture, lfb] = &self.resolve_layouts;
            compute_pipeline(
                gpu,
                "read and blend",
                &self.resolve_module,
                "main",
                &[Some(picture), None, None, Some(lfb)],
                &[("resolve", f64::from(code))],
            )
        })
    }
}

/// Number of a resolve in `shaders/shared/resolve.wesl`.
pub(crate) fn resolve_code(resolve: Resolve) -> u32 {
    match resolve {
        Resolve::Blend => 0,
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
