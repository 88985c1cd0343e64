//! Workgroups of a dispatch, row by row, as one dimension does not reach far enough.

/// Workgroups in a row. Twin in `shaders/shared/grid.wesl`, which says why they are so few.
const GRID_WIDTH: u64 = 1024;

/// Dispatches so many workgroups.
pub(crate) fn dispatch(pass: &mut wgpu::ComputePass<'_>, groups: u64) {
    pass.dispatch_workgroups(groups.min(GRID_WIDTH) as u32, groups.div_ceil(GRID_WIDTH) as u32, 1);
}
