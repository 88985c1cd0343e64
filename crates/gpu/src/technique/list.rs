//! Linked lists of fragments, one for each pixel (Yang et al. 2010; LFB chapter, section 20.3). Twin:
//! `shaders/technique/list.wesl`.
//!
//! One pass over the geometry: a global atomic counter hands out nodes, an atomic exchange of the pixel's head pointer puts
//! each in front of its list. How many nodes there will be is not known before; the chapter leaves open to count first,
//! to lose fragments, or to render again. Here room is made by the last frame's need, and rendered again where it fails.
//!
//! Beside its head pointer each pixel counts its fragments, which the chapter does not: one atomic addition more for a
//! fragment, next to the word that is exchanged anyway. Rejected: to walk the list for its length, in every pass anew. The
//! count also goes on when there is no room left, so that a window that has to be split is split where it must be, at once.
//!
//! **Where the time goes**, in percent of a frame, measured as for [`linear`](super::linear):
//!
//! |               | bunny | dragon | hair | Sponza |
//! |---|---|---|---|---|
//! | main render    | 77 | 90 | 62 | 79 |
//! | sort           |  0 |  0 |  6 |  0 |
//! | read and blend |  9 |  5 | 31 | 20 |
//! | empty pixels   |  4 |  1 |  0 |  0 |
//!
//! One pass over the geometry makes it 1.5 to 1.8 times as fast as `linear` on bunny and dragon; where many fragments lie behind
//! each other its links make reading two to three times as long. On the bunny a seventh of the time of fragment shaders is two
//! threads taking turns at the counter, and a sixth the first atomic operation on a pixel; all of them together take no longer
//! than those of `alpha`, which blend.

use std::num::NonZero;

use pellucid_core::primitive::Pass;
use wgpu::{BindGroupEntry, BindGroupLayout, BindingResource, BufferBinding, ShaderStages};

use super::growth::{STUCK, Splits, most_that_fits};
use super::{Capture, Layouts, Outcome};
use crate::frame::Frame;
use crate::memory::{Estimate, Window};
use crate::pass::ordered::{LfbShaders, OrderedPasses};
use crate::readback::read_buffer;
use crate::surface::{SurfacePass, SurfacePipelines, depth_state, storage_entry};
use crate::{Context, GpuError, shaders, table};

/// Bytes of a link.
const NEXT_BYTES: u64 = 4;
/// Head pointer and counter of a pixel, in words.
const HEAD_WORDS: u64 = 2;

const HEADS: &str = "heads";
const NEXTS: &str = "nexts";
const FRAGMENTS: &str = "fragments";

/// What came of a capture.
struct Captured {
    heads: wgpu::Buffer,
    group: wgpu::BindGroup,
    /// How many there are.
    nodes: u32,
}

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct List {
    /// Of the capture, and of what comes after it.
    layouts: [BindGroupLayout; 2],
    capture: SurfacePipelines,
    ordered: OrderedPasses,
    estimate: Estimate,
    splits: Splits,
}

impl List {
    pub(crate) fn new(gpu: &Context, layouts: Layouts<'_>) -> Self {
        let (fragment, compute) = (ShaderStages::FRAGMENT, ShaderStages::COMPUTE);
        let layout = |label, stages, fragments| {
            let [heads, nexts] = [0, 1].map(|binding| storage_entry(binding, stages, false));
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some(label),
                entries: &[heads, nexts, fragments],
            })
        };
        let captured = layout("list, captured", fragment, table::stored_entry(2, fragment, table::GROUPS));
        let ordered = layout("list", compute, table::read_entry(2, compute));
        let capture = SurfacePass {
            label: "main render",
            wgsl: shaders::LIST,
            plain: "capture",
            varied: "capture_varied",
            ignores_color: false,
            targets: &[],
            depth_stencil: depth_state(false, false),
            own_layout: Some(&captured),
        };
        let ordered_shaders = LfbShaders {
            classify: shaders::CLASSIFY_LIST,
            sort: Some(shaders::SORT_LIST),
            resolve: shaders::RESOLVE_LIST,
            gather: shaders::GATHER_LIST,
            by_reference: true,
        };
        Self {
            capture: SurfacePipelines::new(gpu, layouts.surfaces, &capture),
            ordered: OrderedPasses::new(gpu, ordered_shaders, layouts.picture, &ordered),
            layouts: [captured, ordered],
            estimate: Estimate::default(),
            splits: Splits::default(),
        }
    }

    /// All buffers of a window with so many pixels and nodes.
    fn needs(pixels: u64, nodes: u64) -> [(&'static str, u64); 6] {
        let [runs, dispatches] = OrderedPasses::needs(pixels);
        let heads = (HEADS, (pixels * HEAD_WORDS + 1) * 4);
        let fragments = (FRAGMENTS, table::bytes(table::GROUPS, nodes));
        [heads, (NEXTS, nodes * NEXT_BYTES), fragments, OrderedPasses::order_need(nodes), runs, dispatches]
    }

    /// Captures with room for so many nodes.
    fn capture(&mut self, frame: &mut Frame<'_>, window: Window, room: u64) -> Result<Captured, GpuError> {
        let (gpu, pixels) = (frame.gpu, window.pixels());
        let needs = Self::needs(pixels, room);
        frame.memory.make_room(&needs);
        let [(heads, heads_bytes), (nexts, nexts_bytes), ..] = needs;
        let heads = frame.memory.buffer(gpu, heads, heads_bytes)?;
        let nexts = frame.memory.buffer(gpu, nexts, nexts_bytes)?;
        let fragments = frame.memory.table(gpu, FRAGMENTS, table::GROUPS, room)?;
        // The shader takes the length of the links for the room that there is.
        let links = BufferBinding { buffer: &nexts, offset: 0, size: NonZero::new(room * NEXT_BYTES) };
        let [captured, group] = self.layouts.each_ref().map(|layout| {
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("list"),
                layout,
                entries: &[
                    BindGroupEntry { binding: 0, resource: heads.as_entire_binding() },
                    BindGroupEntry { binding: 1, resource: BindingResource::Buffer(links.clone()) },
                    BindGroupEntry { binding: 2, resource: BindingResource::TextureView(&fragments) },
                ],
            })
        });
        frame.zero("zero", &heads, heads_bytes)?;
        let mut pass = frame.capture_pass("main render", window)?;
        pass.set_bind_group(3, &captured, &[]);
        frame.surfaces.draw(gpu, &mut pass, Pass::Transparent, &mut self.capture);
        drop(pass);
        let nodes: u32 = read_buffer(frame, &heads, pixels * HEAD_WORDS, 1)?[0];
        Ok(Captured { heads, group, nodes })
    }

    /// Parts of a window that fit, now that it is known how many fragments each pixel has.
    fn split(&mut self, frame: &mut Frame<'_>, window: Window, heads: &wgpu::Buffer) -> Result<Outcome, GpuError> {
        let words: Vec<u32> = read_buffer(frame, heads, 0, window.pixels() * HEAD_WORDS)?;
        let counts: Vec<u32> = words.into_iter().skip(1).step_by(HEAD_WORDS as usize).collect();
        let fits =
            |pixels, nodes| nodes < u64::from(STUCK) && frame.memory.fits(frame.gpu, &Self::needs(pixels, nodes));
        let parts =
            window.parts(&counts, fits).map_err(|nodes| frame.memory.refusal(frame.gpu, &Self::needs(1, nodes)))?;
        self.splits.split(window, &counts, &parts, |counts| counts.iter().map(|&count| u64::from(count)).sum());
        Ok(Outcome::Split(parts))
    }
}

impl Capture for List {
    fn window(&mut self, frame: &mut Frame<'_>, window: Window) -> Result<Outcome, GpuError> {
        let (gpu, pixels) = (frame.gpu, window.pixels());
        let fits = |nodes| frame.memory.fits(gpu, &Self::needs(pixels, nodes));
        if let Some(parts) = self.splits.parts_of(window, |a, b| a + b, fits) {
            return Ok(Outcome::Split(parts));
        }
        let known = self.splits.need(window);
        let wanted = known.map_or_else(|| self.estimate.fragments(&window), Estimate::with_slack);
        let Some(mut room) = most_that_fits(wanted, fits) else {
            return frame.memory.halves(gpu, window, &Self::needs(pixels, 1));
        };
        loop {
            let Captured { heads, group, nodes } = self.capture(frame, window, room)?;
            if known.is_some() {
                self.splits.learn(window, nodes.into());
            } else if nodes < STUCK {
                self.estimate.learn(&window, nodes.into());
            }
            if u64::from(nodes) <= room {
                self.ordered.record(frame, window, &group, nodes.into())?;
                return Ok(Outcome::Done);
            }
            frame.rerenders += 1;
            room = nodes.into();
            if nodes >= STUCK || !frame.memory.fits(gpu, &Self::needs(pixels, room)) {
                return self.split(frame, window, &heads);
            }
        }
    }
}
