//! Linked lists of pages of fragments, one list for each pixel (Crassin's follow-up of 2010; LFB chapter, section 20.2).
//! Twin: `shaders/technique/pages.wesl`.
//!
//! Where `list` takes a node from the global counter for every fragment, this takes a page for every four: fewer atomic
//! operations on one address and fewer links, at the cost of pages that are not full.
//!
//! The source guards each pixel with a semaphore, so that one invocation takes a page while the others wait for it. A
//! lock in a fragment shader hangs GPUs that run the waiting invocation and not the one it waits for. Here each pixel has
//! one word with the number of its first page and how full that is, advanced by compare-exchange. Who finds the page full
//! takes a page and tries to put it in front, with itself as its first fragment; an exchange fails only because another
//! fragment has got its place, so that somebody always gets on, whoever is run. Who loses keeps the page it took and puts
//! it in front all the same: no page is lost, but one behind it may stay half empty, so links tell how full each is.
//! Rejected: to give the page up, which leaks it; to count first and find the page by walking, which is quadratic.
//!
//! How many pages a capture takes thus depends on timing a little; what is in them, once sorted, does not.
//!
//! **Where the time goes**, in percent of a frame, measured as for [`linear`](super::linear): main render 75 (bunny), 88
//! (dragon), 55 (hair), 70 (Sponza); sort 14 and read and blend 29 on hair, and 6 to 18 elsewhere. About as fast as `list`,
//! though its pages stay in a buffer, as sorting moves fragments from page to page.

use pellucid_core::primitive::Pass;
use wgpu::{BindGroupLayout, ShaderStages};

use super::growth::{STUCK, Splits, most_that_fits};
use super::{Capture, Layouts, Outcome};
use crate::frame::Frame;
use crate::memory::{Estimate, Window};
use crate::pass::ordered::{LfbShaders, OrderedPasses};
use crate::readback::read_buffer;
use crate::surface::{SurfacePass, SurfacePipelines, depth_state, storage_entry};
use crate::{Context, GpuError, shaders};

/// Fragments of a page. Twin: `page_size` in `shaders/technique/pages.wesl`.
const PAGE_SIZE: u64 = 4;
/// Bytes of a page.
const PAGE_BYTES: u64 = PAGE_SIZE * 16;
/// Bytes of a link.
const LINK_BYTES: u64 = 4;
/// First link and counter of a pixel, in words.
const HEAD_WORDS: u64 = 2;
/// Most pages that a link can tell apart.
const MAX_PAGES: u64 = 1 << 29;

const HEADS: &str = "heads";
const LINKS: &str = "links";
const FRAGMENTS: &str = "fragments";

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct Pages {
    layout: BindGroupLayout,
    capture: SurfacePipelines,
    ordered: OrderedPasses,
    /// Of fragments that pages have room for.
    estimate: Estimate,
    splits: Splits,
}

/// What came of a capture.
struct Captured {
    heads: wgpu::Buffer,
    group: wgpu::BindGroup,
    /// Pages asked for: where there was no room, one for each fragment.
    pages: u32,
    /// Whether there was room for so many.
    is_whole: bool,
}

/// Pages to make room for, so that these many are there for full ones: some are put in front of others before they are.
fn with_slack(pages: u64) -> u64 {
    pages + pages / 32
}

impl Pages {
    pub(crate) fn new(gpu: &Context, layouts: Layouts<'_>) -> Self {
        let visibility = ShaderStages::FRAGMENT | ShaderStages::COMPUTE;
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("pages"),
            entries: &[0, 1, 2].map(|binding| storage_entry(binding, visibility, false)),
        });
        let capture = SurfacePass {
            label: "main render",
            wgsl: shaders::PAGES,
            plain: "capture",
            varied: "capture_varied",
            ignores_color: false,
            targets: &[],
            depth_stencil: depth_state(false, false),
            own_layout: Some(&layout),
        };
        let ordered_shaders = LfbShaders {
            classify: shaders::CLASSIFY_PAGES,
            sort: Some(shaders::SORT_PAGES),
            resolve: shaders::RESOLVE_PAGES,
            gather: shaders::GATHER_PAGES,
            by_reference: false,
        };
        Self {
            capture: SurfacePipelines::new(gpu, layouts.surfaces, &capture),
            ordered: OrderedPasses::new(gpu, ordered_shaders, layouts.picture, &layout),
            layout,
            estimate: Estimate::default(),
            splits: Splits::default(),
        }
    }

    /// All buffers of a window with so many pixels and pages.
    fn needs(pixels: u64, pages: u64) -> [(&'static str, u64); 5] {
        let [runs, dispatches] = OrderedPasses::needs(pixels);
        let heads = (HEADS, (pixels * HEAD_WORDS + 1) * 4);
        [heads, (LINKS, pages * LINK_BYTES), (FRAGMENTS, pages * PAGE_BYTES), runs, dispatches]
    }

    fn fits(frame: &Frame<'_>, pixels: u64, pages: u64) -> bool {
        pages < MAX_PAGES && frame.memory.fits(frame.gpu, &Self::needs(pixels, pages))
    }

    /// Captures with room for so many pages.
    fn capture(&mut self, frame: &mut Frame<'_>, window: Window, room: u64) -> Result<Captured, GpuError> {
        let (gpu, pixels) = (frame.gpu, window.pixels());
        let needs = Self::needs(pixels, room);
        frame.memory.make_room(&needs);
        let [heads, links, fragments, ..] = needs.map(|(name, bytes)| frame.memory.buffer(gpu, name, bytes));
        let (heads, links, fragments) = (heads?, links?, fragments?);
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("pages"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: heads.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: links.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 2, resource: fragments.as_entire_binding() },
            ],
        });
        frame.zero("zero", &heads, needs[0].1)?;
        let mut pass = frame.capture_pass("main render", window)?;
        pass.set_bind_group(3, &group, &[]);
        frame.surfaces.draw(gpu, &mut pass, Pass::Transparent, &mut self.capture);
        drop(pass);
        let pages: u32 = read_buffer(frame, &heads, pixels * HEAD_WORDS, 1)?[0];
        let there_are = (links.size() / LINK_BYTES).min(fragments.size() / PAGE_BYTES);
        Ok(Captured { heads, group, pages, is_whole: u64::from(pages) <= there_are })
    }
}

impl Capture for Pages {
    fn window(&mut self, frame: &mut Frame<'_>, window: Window) -> Result<Outcome, GpuError> {
        let (gpu, pixels) = (frame.gpu, window.pixels());
        if let Some(parts) = self.splits.parts_of(window, |a, b| a + b, |pages| Self::fits(frame, pixels, pages)) {
            return Ok(Outcome::Split(parts));
        }
        let known = self.splits.need(window);
        let guess = || self.estimate.fragments(&window).div_ceil(PAGE_SIZE);
        let wanted = known.map_or_else(guess, Estimate::with_slack);
        let Some(mut room) = most_that_fits(wanted, |pages| Self::fits(frame, pixels, pages)) else {
            return frame.memory.halves(gpu, window, &Self::needs(pixels, 1));
        };
        loop {
            let Captured { heads, group, pages, is_whole } = self.capture(frame, window, room)?;
            if is_whole {
                if known.is_some() {
                    self.splits.learn(window, pages.into());
                } else {
                    self.estimate.learn(&window, u64::from(pages) * PAGE_SIZE);
                }
                self.ordered.record(frame, window, &group, u64::from(pages) * PAGE_SIZE)?;
                return Ok(Outcome::Done);
            }
            frame.rerenders += 1;
            let words: Vec<u32> = read_buffer(frame, &heads, 0, pixels * HEAD_WORDS)?;
            let counts: Vec<u32> = words.into_iter().skip(1).step_by(HEAD_WORDS as usize).collect();
            let sum = |counts: &[u32]| counts.iter().map(|&count| u64::from(count)).sum::<u64>();
            let full_pages: Vec<u32> = counts.iter().map(|count| count.div_ceil(PAGE_SIZE as u32)).collect();
            let full = with_slack(sum(&full_pages));
            if full > room && Self::fits(frame, pixels, full) {
                room = full;
                continue;
            }
            // Timing took more than that. Every page has a fragment, so that there are never more pages than those.
            let greatest = sum(&counts).min(u64::from(STUCK));
            let most = most_that_fits(greatest, |pages| Self::fits(frame, pixels, pages)).unwrap_or(room);
            if full <= room {
                if most <= room {
                    return frame.memory.halves(gpu, window, &Self::needs(pixels, greatest));
                }
                room = most;
                continue;
            }
            let fits = |pixels, pages| Self::fits(frame, pixels, with_slack(pages));
            let parts = window
                .parts(&full_pages, fits)
                .map_err(|pages| frame.memory.refusal(gpu, &Self::needs(1, with_slack(pages))))?;
            self.splits.split(window, &full_pages, &parts, |pages| with_slack(sum(pages)));
            return Ok(Outcome::Split(parts));
        }
    }
}
