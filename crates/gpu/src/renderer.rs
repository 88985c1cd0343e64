//! One frame, top to bottom.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use glam::Vec4;
use pellucid_core::fbuffer::Size;
use pellucid_core::resolve::finish;
use pellucid_core::{Image, Layers, Resolve, Scene, Stats, Technique, View};
use wgpu::BindGroupLayout;

use crate::frame::{Frame, FrameParts, Goal, Targets};
use crate::memory::{Memory, Window};
use crate::pass::opaque::OpaquePass;
use crate::pass::picture::{self, PictureGroup, Totals};
use crate::readback::{read_buffer, read_texture};
use crate::surface::{DrawGroups, SurfaceLayouts, Surfaces};
use crate::technique::{self, Capture, DepthFilter, Layouts, Outcome, Storage};
use crate::upload::SceneUpload;
use crate::{Context, ContextOptions, GpuError};

/// Bytes a capture may hold if nobody sets a budget.
pub const DEFAULT_BUDGET_BYTES: u64 = 1 << 30;

/// Renders on a GPU. Keep it from frame to frame: it holds on to pipelines, the uploaded scene and memory.
#[derive(Debug)]
pub struct GpuRenderer {
    gpu: Context,
    surfaces: SurfaceLayouts,
    picture_layout: BindGroupLayout,
    budget_bytes: u64,
    max_layers: Option<u32>,
    presort: bool,
    fbuffer_size: Option<Size>,
    depth_filter: DepthFilter,
    storage: Storage,
    kept: Mutex<Kept>,
}

/// What is kept from frame to frame.
#[derive(Debug)]
struct Kept {
    opaque: OpaquePass,
    techniques: Vec<(Technique, Box<dyn Capture>)>,
    /// Whose buffers are in `memory`.
    last: Option<Technique>,
    memory: Memory,
    upload: Option<SceneUpload>,
    targets: Option<Targets>,
    draw_groups: Option<DrawGroups>,
}

/// What came of a frame.
struct Rendered {
    image: Option<Image>,
    layers: Vec<Layers>,
    stats: Stats,
}

impl Kept {
    /// Gives up what a frame that was not finished may have left half done.
    fn forget(&mut self) {
        self.memory.clear();
        self.targets = None;
        self.last = None;
    }
}

impl GpuRenderer {
    /// Opens a device.
    ///
    /// # Errors
    /// If there is none, see [`Context::new`].
    pub fn new(options: &ContextOptions) -> Result<Self, GpuError> {
        let gpu = Context::new(options)?;
        let surfaces = SurfaceLayouts::new(&gpu);
        let picture_layout = picture::layout(&gpu);
        let kept = Kept {
            opaque: OpaquePass::new(&gpu, &surfaces),
            techniques: Vec::new(),
            last: None,
            memory: Memory::new(DEFAULT_BUDGET_BYTES),
            upload: None,
            targets: None,
            draw_groups: None,
        };
        gpu.check()?;
        Ok(Self {
            gpu,
            surfaces,
            picture_layout,
            budget_bytes: DEFAULT_BUDGET_BYTES,
            max_layers: None,
            presort: false,
            fbuffer_size: None,
            depth_filter: DepthFilter::default(),
            storage: Storage::default(),
            kept: Mutex::new(kept),
        })
    }

    /// The same renderer with another budget: the bytes a capture may hold. The picture is the same at any.
    #[must_use]
    pub fn budget_bytes(mut self, budget_bytes: u64) -> Self {
        self.budget_bytes = budget_bytes;
        self
    }

    /// The same renderer, stopping after so many layers where the technique peels them off one by one; `None`: after the
    /// last. [`Stats::cut_pixels`] tells where there were more. Other techniques capture all of them regardless.
    #[must_use]
    pub fn max_layers(mut self, max_layers: Option<u32>) -> Self {
        self.max_layers = max_layers;
        self
    }

    /// The same renderer, putting all fragments of an LFB in order in memory, those in textures by reference, before it
    /// resolves them: for resolves that read them more than once. Otherwise pixels with few fragments are sorted on the way to the
    /// resolve. The picture is the same.
    #[must_use]
    pub fn presort(mut self, presort: bool) -> Self {
        self.presort = presort;
        self
    }

    /// The same renderer with F-Buffers of a size at most, which slide over the fragments as a window where there are more;
    /// `None`: as large as fragments and budget make them. The picture is the same at any.
    #[must_use]
    pub fn fbuffer_size(mut self, size: Option<Size>) -> Self {
        self.fbuffer_size = size;
        self
    }

    /// The same renderer with another depth filter, through which the technique `lucid` blends. The picture is the same with
    /// a filter of any size, as pixels that it leaves out of order are sorted.
    #[must_use]
    pub fn depth_filter(mut self, depth_filter: DepthFilter) -> Self {
        self.depth_filter = depth_filter;
        self
    }

    /// The same renderer with another storage for the A-buffer's fragments. The picture is the same in either.
    #[must_use]
    pub fn storage(mut self, storage: Storage) -> Self {
        self.storage = storage;
        let kept = self.kept.get_mut().unwrap_or_else(PoisonError::into_inner);
        kept.techniques.retain(|(technique, _)| *technique != Technique::ABuffer);
        kept.memory.clear();
        self
    }

    /// The device it runs on.
    pub fn context(&self) -> &Context {
        &self.gpu
    }

    /// Renders a view.
    ///
    /// # Errors
    /// If the view is invalid, the technique cannot serve the resolve, something does not fit the device or the budget, or
    /// the device fails.
    pub fn render(
        &self,
        scene: &Scene,
        view: &View,
        resolve: Resolve,
        technique: Technique,
    ) -> Result<pellucid_core::Frame, GpuError> {
        let rendered = self.run(scene, view, resolve, technique, Goal::Picture)?;
        let mut image = rendered.image.unwrap_or_else(|| Image::filled(view.width, view.height, Vec4::ZERO));
        finish(resolve, &mut image, &rendered.stats);
        Ok(pellucid_core::Frame { image, stats: rendered.stats })
    }

    /// Hands out the ordered layers of a view, window by window.
    ///
    /// # Errors
    /// As [`Self::render`].
    pub fn layers(
        &self,
        scene: &Scene,
        view: &View,
        technique: Technique,
        visit: impl Fn(&Layers),
    ) -> Result<Stats, GpuError> {
        let rendered = self.run(scene, view, Resolve::Blend, technique, Goal::Layers(Vec::new()))?;
        rendered.layers.iter().for_each(visit);
        Ok(rendered.stats)
    }

    fn run(
        &self,
        scene: &Scene,
        view: &View,
        resolve: Resolve,
        technique: Technique,
        goal: Goal,
    ) -> Result<Rendered, GpuError> {
        view.check()?;
        let mut kept = self.kept.lock().unwrap_or_else(|poisoned| {
            self.kept.clear_poison();
            let mut kept = poisoned.into_inner();
            kept.forget();
            kept
        });
        let result = self.frame(&mut kept, scene, view, resolve, technique, goal);
        if result.is_err() {
            kept.forget();
        }
        result
    }

    fn frame(
        &self,
        kept: &mut Kept,
        scene: &Scene,
        view: &View,
        resolve: Resolve,
        technique: Technique,
        goal: Goal,
    ) -> Result<Rendered, GpuError> {
        let gpu = &self.gpu;
        let layouts = Layouts { surfaces: &self.surfaces, picture: &self.picture_layout };
        if !kept.techniques.iter().any(|(name, _)| *name == technique) {
            kept.techniques.push((technique, technique::new(gpu, layouts, technique, self.storage)?));
        }
        if kept.last.replace(technique) != Some(technique) {
            kept.memory.clear();
        }
        kept.memory.begin_frame(self.budget_bytes);
        if kept.upload.as_ref().is_none_or(|upload| upload.revision != scene.revision()) {
            kept.upload = None;
            kept.upload = Some(SceneUpload::new(gpu, &self.surfaces, scene)?);
        }
        let size = (view.width, view.height);
        if kept.targets.as_ref().is_none_or(|targets| (targets.width, targets.height) != size) {
            kept.targets = None;
            kept.targets = Some(Targets::new(gpu, view.width, view.height)?);
        }
        let Kept { opaque, techniques, memory, upload: Some(upload), targets: Some(targets), draw_groups, .. } = kept
        else {
            unreachable!("both have just been made")
        };
        let capture = techniques.iter_mut().find(|(name, _)| *name == technique).map(|(_, capture)| capture);
        let Some(capture) = capture else { unreachable!("it has just been made") };
        capture.load(gpu, scene, upload)?;

        let start = Instant::now();
        let instances = scene.instances().len();
        let groups = DrawGroups::ensure(draw_groups, gpu, &self.surfaces, instances, &targets.opaque_depth_view)?;
        let surfaces = Surfaces::new(gpu, &self.surfaces, upload, (scene, view), groups)?;
        let frame_data = groups.frame_data.clone();
        let picture = PictureGroup::new(gpu, &self.picture_layout, targets, &frame_data)?;
        let dropped_triangles = surfaces.dropped_triangles;
        let mut frame =
            Frame::new(FrameParts { gpu, scene, view, resolve, surfaces, targets, memory, picture, goal, frame_data });
        frame.max_layers = self.max_layers;
        frame.presort = self.presort;
        frame.fbuffer_size = self.fbuffer_size;
        frame.depth_filter = self.depth_filter;

        let whole = Window { left: 0, top: 0, width: view.width, height: view.height };
        frame.set_window(whole)?;
        opaque.record(&mut frame)?;
        let mut windows = 0;
        let mut pending = VecDeque::from([whole]);
        while let Some(window) = pending.pop_front() {
            frame.set_window(window)?;
            match capture.window(&mut frame, window)? {
                Outcome::Done => windows += 1,
                Outcome::Split(parts) => parts.into_iter().rev().for_each(|part| pending.push_front(part)),
            }
        }
        frame.finish()?;
        let total_ms = start.elapsed().as_secs_f64() * 1e3;

        let totals_buffer = frame.picture.totals.clone();
        let totals: Totals = read_buffer(&mut frame, &totals_buffer, 0, 1)?[0];
        let image = match &frame.goal {
            Goal::Layers(_) => None,
            Goal::Picture => {
                let texels: Vec<Vec4> = read_texture(&mut frame, &targets.picture, wgpu::TextureAspect::All)?;
                let mut image = Image::filled(view.width, view.height, Vec4::ZERO);
                image.pixels_mut().copy_from_slice(&texels);
                Some(image)
            }
        };
        let mut stats = Stats::new(technique, gpu.name().to_owned(), view.width, view.height);
        stats.triangles = u64::from(scene.primitive_count());
        stats.dropped_triangles = dropped_triangles;
        stats.fragments = totals.fragments();
        stats.max_depth_complexity = totals.greatest_count;
        stats.mean_depth_complexity = totals.fragments() as f64 / f64::from(totals.covered_pixels.max(1));
        stats.total_ms = total_ms;
        stats.windows = windows;
        stats.rerenders = frame.rerenders;
        stats.cut_pixels = frame.cut_pixels;
        stats.slot_windows = frame.slot_windows;
        stats.repaired_pixels = frame.repaired_pixels;
        stats.half_block_parts = frame.half_block_parts;
        stats.lone_share = frame.lone_share;
        stats.peak_bytes = frame.memory.peak_bytes();
        let layers = match std::mem::replace(&mut frame.goal, Goal::Picture) {
            Goal::Picture => Vec::new(),
            Goal::Layers(layers) => layers,
        };
        stats.steps = frame.steps.finish();
        Ok(Rendered { image, layers, stats })
    }
}
