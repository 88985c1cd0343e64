//! The A-buffer (Crassin 2010): an array of fragments for each pixel, all of the same length, filled in one pass over the
//! geometry behind an atomic counter for each pixel. Twin: `shaders/technique/abuffer.wesl`.
//!
//! The article fixes the length, and loses what lies beyond it. Here it is the greatest count of the last frame; counters
//! count on beyond it, and a capture that did not fit is repeated with the greatest of them. One deep pixel makes all
//! arrays long: where that exceeds the budget, the window is split so that deep pixels are among few others.

use pellucid_core::primitive::Pass;
use wgpu::{BindGroupLayout, ComputePipeline, ShaderStages};

use super::growth::{KnownNeeds, most_that_fits};
use super::{Capture, Layouts, Outcome};
use crate::frame::Frame;
use crate::memory::Window;
use crate::pass::ordered::{LfbShaders, OrderedPasses, compute_pipeline, dispatch_window};
use crate::readback::read_buffer;
use crate::surface::{SurfacePass, SurfacePipelines, depth_state, shader, storage_entry};
use crate::{Context, GpuError, shaders};

/// Bytes of a stored fragment.
const FRAGMENT_BYTES: u64 = 16;
/// Length of the arrays as long as nothing is known.
const FIRST_GUESS: u64 = 8;

const COUNTS: &str = "counts";
const FRAGMENTS: &str = "fragments";

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct ABuffer {
    layout: BindGroupLayout,
    capture: SurfacePipelines,
    reduce: ComputePipeline,
    ordered: OrderedPasses,
    guess: u64,
    known: KnownNeeds,
}

/// What came of a capture.
struct Captured {
    counts: wgpu::Buffer,
    group: wgpu::BindGroup,
    /// Most fragments at one pixel.
    greatest: u64,
    /// Whether there was room for so many.
    is_whole: bool,
}

impl ABuffer {
    pub(crate) fn new(gpu: &Context, layouts: Layouts<'_>) -> Self {
        let visibility = ShaderStages::FRAGMENT | ShaderStages::COMPUTE;
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("abuffer"),
            entries: &[0, 1].map(|binding| storage_entry(binding, visibility, false)),
        });
        let capture = SurfacePass {
            label: "main render",
            wgsl: shaders::ABUFFER,
            plain: "capture",
            varied: "capture_varied",
            ignores_color: false,
            targets: &[],
            depth_stencil: depth_state(false, false),
            own_layout: Some(&layout),
        };
        let ordered_shaders = LfbShaders {
            sort: shaders::SORT_ABUFFER,
            resolve: shaders::RESOLVE_ABUFFER,
            gather: shaders::GATHER_ABUFFER,
        };
        let module = shader(gpu, "greatest count", shaders::ABUFFER);
        let group_layouts = [Some(layouts.picture), None, None, Some(&layout)];
        Self {
            capture: SurfacePipelines::new(gpu, layouts.surfaces, &capture),
            reduce: compute_pipeline(gpu, "greatest count", &module, "reduce", &group_layouts, &[]),
            ordered: OrderedPasses::new(gpu, ordered_shaders, layouts.picture, &layout),
            layout,
            guess: FIRST_GUESS,
            known: KnownNeeds::default(),
        }
    }

    /// All buffers of a window with so many pixels and layers.
    fn needs(pixels: u64, layers: u64) -> [(&'static str, u64); 2] {
        [(COUNTS, (pixels + 1) * 4), (FRAGMENTS, pixels * layers * FRAGMENT_BYTES)]
    }

    /// Captures with room for so many layers.
    fn capture(&mut self, frame: &mut Frame<'_>, window: Window, layers: u64) -> Result<Captured, GpuError> {
        let (gpu, pixels) = (frame.gpu, window.pixels());
        let needs = Self::needs(pixels, layers);
        frame.memory.make_room(&needs);
        let [counts, fragments] = needs.map(|(name, bytes)| frame.memory.buffer(gpu, name, bytes));
        let (counts, fragments) = (counts?, fragments?);
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("abuffer"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: counts.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: fragments.as_entire_binding() },
            ],
        });
        frame.zero("zero", &counts, needs[0].1)?;
        let mut pass = frame.capture_pass("main render", window)?;
        pass.set_bind_group(3, &group, &[]);
        frame.surfaces.draw(gpu, &mut pass, Pass::Transparent, &mut self.capture);
        drop(pass);
        let mut pass = frame.compute_pass("greatest count")?;
        pass.set_pipeline(&self.reduce);
        dispatch_window(&mut pass, frame, window, &group);
        drop(pass);
        let greatest = u64::from(read_buffer::<u32>(frame, &counts, pixels, 1)?[0]);
        let is_whole = greatest <= fragments.size() / FRAGMENT_BYTES / pixels;
        Ok(Captured { counts, group, greatest, is_whole })
    }

    /// Parts of a window that fit, now that it is known how many fragments each pixel has.
    fn split(&mut self, frame: &mut Frame<'_>, window: Window, counts: &wgpu::Buffer) -> Result<Outcome, GpuError> {
        let counts: Vec<u32> = read_buffer(frame, counts, 0, window.pixels())?;
        let fits = |pixels, layers| frame.memory.fits(frame.gpu, &Self::needs(pixels, layers));
        let parts = window
            .parts_by(&counts, u64::max, fits)
            .map_err(|layers| frame.memory.refusal(frame.gpu, &Self::needs(1, layers)))?;
        let greatest = |counts: &[u32]| counts.iter().copied().max().map_or(0, u64::from);
        self.known.learn(window, &counts, &parts, greatest);
        Ok(Outcome::Split(parts))
    }
}

impl Capture for ABuffer {
    fn window(&mut self, frame: &mut Frame<'_>, window: Window) -> Result<Outcome, GpuError> {
        let (gpu, pixels) = (frame.gpu, window.pixels());
        let known = self.known.take(window);
        let wanted = known.unwrap_or(self.guess);
        let Some(mut room) = most_that_fits(wanted, |layers| frame.memory.fits(gpu, &Self::needs(pixels, layers)))
        else {
            return frame.memory.halves(gpu, window, &Self::needs(pixels, 1));
        };
        loop {
            let captured = self.capture(frame, window, room)?;
            if known.is_none() {
                self.guess = captured.greatest.max(1);
            }
            if captured.is_whole {
                self.ordered.record(frame, window, &captured.group)?;
                return Ok(Outcome::Done);
            }
            frame.rerenders += 1;
            room = captured.greatest;
            if !frame.memory.fits(gpu, &Self::needs(pixels, room)) {
                return self.split(frame, window, &captured.counts);
            }
        }
    }
}
