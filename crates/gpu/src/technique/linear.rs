//! The linearized LFB: fragments are counted, counts are summed up, and as much is allocated as there is to capture, in
//! rows of a table (LFB chapter, section 20.4). Twin: `shaders/technique/linear.wesl`.
//!
//! The offset table is summed in place, as in the chapter, and captured into in place: where a pixel's fragments start
//! becomes where they end. Unlike the chapter's it is not padded to a power of two, and has one entry more, in which the
//! total appears.
//!
//! Fragments lie in a texture: llvmpipe writes either about as fast, and reads texels in half the time of a buffer's words (246 ms and
//! 135 for 7.9 million in Sponza). What stores wait for are cache lines, as neighbours on the screen are far apart here.
//!
//! **Where the time goes**, in percent of a frame of 1280 x 720 on llvmpipe, two cores (suite `peers` of the benchmark; the
//! rest of 100 is opaque surfaces, zero, empty pixels, classify and the host):
//!
//! |               | bunny | dragon | hair | Sponza |
//! |---|---|---|---|---|
//! | count render   | 34 | 39 | 29 | 13 |
//! | prefix sums    |  9 |  4 |  2 |  2 |
//! | main render    | 40 | 52 | 51 | 75 |
//! | sort           |  0 |  0 |  6 |  0 |
//! | read and blend |  5 |  2 | 11 |  8 |
//!
//! Meshes of small triangles are transformed and set up twice, which costs more than their fragments; where textures are
//! read (Sponza), the second pass does nearly all, and this technique is the fastest exact one where no window is cut.

use pellucid_core::primitive::Pass;
use wgpu::{BindGroupEntry, BindGroupLayout, BindingResource, ShaderStages};

use super::{Capture, Layouts, Outcome};
use crate::frame::Frame;
use crate::memory::Window;
use crate::pass::ordered::{LfbShaders, OrderedPasses};
use crate::pass::prefix_sum::PrefixSum;
use crate::readback::read_buffer;
use crate::surface::{SurfacePass, SurfacePipelines, depth_state, storage_entry};
use crate::{Context, GpuError, shaders, table};

const OFFSETS: &str = "offsets";
const FRAGMENTS: &str = "fragments";

/// The passes over a linearized LFB, whoever captured it.
pub(super) const ORDERED_SHADERS: LfbShaders = LfbShaders {
    classify: shaders::CLASSIFY_LINEAR,
    sort: Some(shaders::SORT_LINEAR),
    resolve: shaders::RESOLVE_LINEAR,
    gather: shaders::GATHER_LINEAR,
    by_reference: true,
};

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct Linear {
    /// Of the count pass, the capture, and what comes after it.
    layouts: [BindGroupLayout; 3],
    count: SurfacePipelines,
    capture: SurfacePipelines,
    prefix_sum: PrefixSum,
    ordered: OrderedPasses,
}

impl Linear {
    pub(crate) fn new(gpu: &Context, layouts: Layouts<'_>) -> Self {
        let (fragment, compute) = (ShaderStages::FRAGMENT, ShaderStages::COMPUTE);
        let layout = |label, entries: &[_]| {
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        let own_layouts = [
            layout("linear, counted", &[storage_entry(0, fragment, false)]),
            layout(
                "linear, captured",
                &[storage_entry(0, fragment, false), table::stored_entry(1, fragment, table::GROUPS)],
            ),
            layout("linear", &[storage_entry(0, compute, false), table::read_entry(1, compute)]),
        ];
        let pass = |label, plain, varied, ignores_color, own_layout| SurfacePass {
            label,
            wgsl: shaders::LINEAR,
            plain,
            varied,
            ignores_color,
            targets: &[],
            depth_stencil: depth_state(false, false),
            own_layout: Some(own_layout),
        };
        let pipelines = |pass| SurfacePipelines::new(gpu, layouts.surfaces, &pass);
        let [counted, captured, ordered] = &own_layouts;
        Self {
            count: pipelines(pass("count render", "count", "count_varied", true, counted)),
            capture: pipelines(pass("main render", "capture", "capture_varied", false, captured)),
            prefix_sum: PrefixSum::new(gpu),
            ordered: OrderedPasses::new(gpu, ORDERED_SHADERS, layouts.picture, ordered),
            layouts: own_layouts,
        }
    }

    /// All buffers of a window with so many pixels and fragments.
    fn needs(pixels: u64, fragments: u64) -> Vec<(&'static str, u64)> {
        let mut needs = vec![
            (OFFSETS, (pixels + 1) * 4),
            (FRAGMENTS, table::bytes(table::GROUPS, fragments)),
            OrderedPasses::order_need(fragments),
        ];
        needs.extend(PrefixSum::needs(pixels + 1));
        needs.extend(OrderedPasses::needs(pixels));
        needs
    }
}

fn bind_group(
    gpu: &Context,
    layout: &BindGroupLayout,
    offsets: &wgpu::Buffer,
    fragments: Option<&wgpu::TextureView>,
) -> wgpu::BindGroup {
    let resources = [Some(offsets.as_entire_binding()), fragments.map(BindingResource::TextureView)];
    let entries: Vec<_> = (0..)
        .zip(resources.into_iter().flatten())
        .map(|(binding, resource)| BindGroupEntry { binding, resource })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("linear"), layout, entries: &entries })
}

impl Capture for Linear {
    fn window(&mut self, frame: &mut Frame<'_>, window: Window) -> Result<Outcome, GpuError> {
        let (gpu, pixels) = (frame.gpu, window.pixels());
        if !frame.memory.fits(gpu, &Self::needs(pixels, 0)) {
            return frame.memory.halves(gpu, window, &Self::needs(pixels, 0));
        }

        // Steps 1 and 2: fragments of each pixel.
        let entries = pixels + 1;
        frame.memory.make_room(&Self::needs(pixels, 0));
        let offsets = frame.memory.buffer(gpu, OFFSETS, entries * 4)?;
        frame.zero("zero", &offsets, entries * 4)?;
        let [counted, captured, ordered] = &self.layouts;
        let group = bind_group(gpu, counted, &offsets, None);
        let mut pass = frame.capture_pass("count render", window)?;
        pass.set_bind_group(3, &group, &[]);
        frame.surfaces.draw(gpu, &mut pass, Pass::Transparent, &mut self.count);
        drop(pass);

        // Step 3: where they go, and how many there are.
        self.prefix_sum.record(frame, "prefix sums", &offsets, entries)?;
        let total: u32 = read_buffer(frame, &offsets, pixels, 1)?[0];
        let needs = Self::needs(pixels, total.into());
        if total == u32::MAX || !frame.memory.fits(gpu, &needs) {
            let starts: Vec<u32> = read_buffer(frame, &offsets, 0, entries)?;
            return split(frame, window, &starts);
        }

        // Step 4: exactly that much is allocated, and captured into.
        if frame.memory.make_room(&needs) {
            // The offsets were given back too, as they were larger than they need to be: once more, in what fits.
            return self.window(frame, window);
        }
        let fragments = frame.memory.table(gpu, FRAGMENTS, table::GROUPS, total.into())?;
        let [captured, group] = [captured, ordered].map(|layout| bind_group(gpu, layout, &offsets, Some(&fragments)));
        let mut pass = frame.capture_pass("main render", window)?;
        pass.set_bind_group(3, &captured, &[]);
        frame.surfaces.draw(gpu, &mut pass, Pass::Transparent, &mut self.capture);
        drop(pass);
        self.ordered.record(frame, window, &group, total.into())?;
        Ok(Outcome::Done)
    }
}

/// Parts of a window that fit, now that it is known where each pixel's fragments start.
fn split(frame: &Frame<'_>, window: Window, starts: &[u32]) -> Result<Outcome, GpuError> {
    // Sums stick at the greatest number: what lies beyond is counted again in smaller windows.
    if starts.last() == Some(&u32::MAX)
        && let Some(halves) = window.halves()
    {
        return Ok(Outcome::Split(halves.to_vec()));
    }
    let counts: Vec<u32> = starts.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let fits = |pixels, fragments| frame.memory.fits(frame.gpu, &Linear::needs(pixels, fragments));
    match window.parts(&counts, fits) {
        Ok(parts) => Ok(Outcome::Split(parts)),
        Err(fragments) => Err(frame.memory.refusal(frame.gpu, &Linear::needs(1, fragments))),
    }
}
