//! Depth peeling front to back, one layer a pass (Everitt 2001; Wellings, "Depth Peeling Order Independent Transparency in
//! Vulkan", 2016). Twins: `shaders/technique/peel*.wesl`.
//!
//! A pass draws the whole scene. A test in the shader discards what does not lie behind the layer before, the
//! fixed-function test keeps the nearest of the rest, and what is left is put under the layers so far.
//!
//! **Coplanar fragments.** Plain peeling compares depths alone and loses all but one of equal ones. Here the layer before
//! is known by depth *and* primitive: what passes is deeper, or as deep and drawn earlier. Among that, "nearer or equal"
//! leaves the later drawn of the nearest, as triangles reach the depth test in draw order. So every pass finds the next
//! fragment in THE order, and as that is total, none is found twice or lost.
//! What that relies on: rasterization order, which every API guarantees; that a triangle has the same depth to the bit in
//! every pass, for which positions are `@invariant` and all passes share the vertex shader; and that the depth a shader
//! sees is the depth that is tested and stored, as it is for 32-bit floats.
//!
//! **When to stop.** A pass that peels nothing is the last. Asking after each would stall the GPU once a layer, so passes
//! go out in batches, and one counter is read back for each: the greatest number of layers at a pixel, which is less than
//! the number of passes once a pass was empty. The first batch of a scene that was peeled before is just what it took then,
//! so a still picture reads back once and wastes no pass beyond the empty one; an unknown scene starts with 4 and then
//! adds a quarter of what it has, which bounds the waste by that. Rejected: occlusion queries, which tell no
//! more and have to be read back as well; a read-back in flight while the next batch runs, which wastes a whole batch.
//!
//! **Budget.** Memory does not depend on depth complexity: 24 bytes a pixel of the picture for attachments and 20 (with
//! pairs of layers 36) for the state of the resolve. A budget that does not hold that is served without attachments, see
//! `windowed`, in windows.
//!
//! The article's other trick, one render pass with input attachments as subpasses, is not in WebGPU.
//!
//! **Where the time goes**, in percent of a frame, measured as for [`linear`](super::linear): peel 71 and blend 21 (bunny, 8
//! layers); 94 and 4 before (dragon, 10 layers). The scene is drawn once a layer: hair, of 356, would take minutes.

mod attached;
mod layers;
mod under;
mod windowed;

use pellucid_core::Resolve;

use self::attached::Attached;
use self::layers::Gathering;
use self::under::{Progress, Under, Variant};
use self::windowed::Windowed;
use super::{Capture, Layouts, Outcome};
use crate::frame::{Frame, Goal};
use crate::memory::Window;
use crate::{Context, GpuError};

/// Passes before the first read-back where nothing is known.
const FIRST_BATCH: u32 = 4;

/// Passes that are submitted together: so few that no driver takes them for a hung GPU.
const SUBMITTED_PASSES: u32 = 32;

/// Draws in passes that are submitted together: a driver may hold kilobytes for each until it is done.
const SUBMITTED_DRAWS: u32 = 4096;

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct Peel {
    attached: Attached,
    windowed: Windowed,
    under: Under,
    /// Passes it took last time.
    expected: Option<u32>,
}

/// How many layers a window is peeled for.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Limit {
    layers: u32,
    /// Whether layers beyond it would be seen.
    cuts: bool,
}

impl Limit {
    fn new(frame: &Frame<'_>) -> Self {
        let wanted = match (&frame.goal, frame.resolve) {
            (Goal::Picture, Resolve::Nearest) => 1,
            (Goal::Picture, Resolve::Layer(number)) => number,
            _ => u32::MAX,
        };
        let allowed = frame.max_layers.unwrap_or(u32::MAX);
        Self { layers: wanted.min(allowed).max(1), cuts: allowed < wanted }
    }
}

impl Peel {
    pub(crate) fn new(gpu: &Context, layouts: Layouts<'_>) -> Self {
        Self {
            attached: Attached::new(gpu, layouts),
            windowed: Windowed::new(gpu, layouts),
            under: Under::new(gpu, layouts.picture),
            expected: None,
        }
    }

    /// Passes to record before the next read-back.
    fn batch(&self, passes: u32) -> u32 {
        match self.expected {
            Some(expected) if passes == 0 => expected,
            _ => (passes / 4).max(FIRST_BATCH),
        }
    }
}

impl Capture for Peel {
    fn window(&mut self, frame: &mut Frame<'_>, window: Window) -> Result<Outcome, GpuError> {
        let (gpu, pixels) = (frame.gpu, window.pixels());
        let is_wanted = matches!(frame.goal, Goal::Layers(_));
        let mut variant = Variant { resolve: frame.resolve, is_first: true, is_windowed: false, is_wanted };
        let picture_pixels = u64::from(frame.view.width) * u64::from(frame.view.height);
        let mut needs = [attached::needs(picture_pixels), variant.needs(pixels)].concat();
        if !frame.memory.fits(gpu, &needs) {
            variant.is_windowed = true;
            needs = variant.needs(pixels);
            if !frame.memory.fits(gpu, &needs) {
                return frame.memory.halves(gpu, window, &needs);
            }
        }
        frame.memory.make_room(&needs);
        if !variant.is_windowed && self.attached.prepare(frame)? {
            self.expected = None;
        }
        let state = variant.state(frame, pixels)?;
        frame.encoder().clear_buffer(&state.progress, 0, None);
        let groups = [0, 1].map(|layer| {
            let views = (!variant.is_windowed).then(|| self.attached.views(layer));
            self.under.bind_group(gpu, &state, views.as_ref())
        });
        if variant.is_windowed {
            self.under.record(frame, window, ("zero", "begin"), variant, &groups[0])?;
        }

        let limit = Limit::new(frame);
        let mut gathering = is_wanted.then(Gathering::default);
        let draws = frame.surfaces.count_transparent() as u32;
        let submitted_together = (SUBMITTED_DRAWS / draws.max(1)).clamp(1, SUBMITTED_PASSES);
        let mut passes = 0;
        let mut progress;
        loop {
            let batch = if draws > 0 { self.batch(passes) } else { 1 };
            for _ in 0..batch.min(limit.layers - passes) {
                self.peel(frame, window, passes, variant, &state.peeled)?;
                variant.is_first = passes == 0;
                let group = &groups[(passes % 2) as usize];
                self.under.record(frame, window, ("blend", "add_layer"), variant, group)?;
                if let Some(gathering) = &mut gathering {
                    gathering.add(frame, &state.entries, pixels)?;
                }
                passes += 1;
                if passes % submitted_together == 0 {
                    frame.submit()?;
                    gpu.wait()?;
                }
            }
            progress = state.progress(frame)?;
            if progress.layers < passes || passes == limit.layers {
                break;
            }
        }
        self.expected = Some((progress.layers + 1).min(limit.layers));

        if limit.cuts && progress.layers == passes {
            self.peel(frame, window, passes, variant, &state.peeled)?;
            let group = &groups[(passes % 2) as usize];
            self.under.record(frame, window, ("blend", "count_cut"), variant, group)?;
            let Progress { cut_pixels, .. } = state.progress(frame)?;
            frame.cut_pixels += u64::from(cut_pixels);
        }
        self.under.record(frame, window, ("compose", "finish"), variant, &groups[0])?;
        if let Some(gathering) = gathering {
            gathering.finish(frame, window)?;
        }
        Ok(Outcome::Done)
    }
}

impl Peel {
    /// Peels a layer, counted from 0.
    fn peel(
        &mut self,
        frame: &mut Frame<'_>,
        window: Window,
        layer: u32,
        variant: Variant,
        peeled: &wgpu::Buffer,
    ) -> Result<(), GpuError> {
        if variant.is_windowed {
            self.windowed.peel(frame, window, peeled)
        } else {
            self.attached.peel(frame, window, layer)
        }
    }
}
