//! The F-Buffer on the GPU: a slot for every fragment, at its position in rasterization order.
//!
//! The order is found in compute: the rows of pixels that primitives cover are measured in integers, as the contract's
//! pixel grid has it, and summed up; there are no atomics, and slots are those of the CPU, bit for bit. The geometry stage
//! before that, transform and clipping, stays on the host: clipping needs the f64 that WGSL has not, and hardware may
//! round a product of matrices as it likes, either of which would move fragments to other slots.
//!
//! What each pass of each window rasterizes again is the table of rows: from a slot to its row by halving, from there to
//! pixel, depth and weights. Slots outside of the window are never touched. The alternative, to walk over all primitives
//! in every pass as the hardware had to, would find the same places more slowly.
//!
//! `geometry` is what is sent to the device, `raster` counts and sums, `sort` orders fragments.

pub(crate) mod geometry;
pub(crate) mod raster;
pub(crate) mod sort;

/// Invocations of a workgroup in passes over fragments and runs: `LANES` of the shaders.
pub(crate) const LANES: u64 = 64;

/// Dispatches so many workgroups, in two dimensions, as one does not reach far enough.
pub(crate) fn dispatch(pass: &mut wgpu::ComputePass<'_>, groups: u64) {
    const ROW: u64 = 32_768;
    pass.dispatch_workgroups(groups.min(ROW) as u32, groups.div_ceil(ROW) as u32, 1);
}
