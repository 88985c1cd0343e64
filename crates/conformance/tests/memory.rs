//! What the CPU renderer holds, counted byte by byte. A test alone in its program, which counts for all threads.

use std::alloc::System;

use cap::Cap;
use pellucid::{Resolve, View};
use pellucid_cpu::CpuRenderer;

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

const MIB: usize = 1 << 20;

#[test]
fn memory_stays_in_the_budget_and_is_used_again() {
    // 4.6 million fragments of 12 bytes: 53 MiB beside the picture and what threads need, far more than the budget.
    let scene = pellucid::load("@grids:layers=20,tessellation=200").unwrap().scene;
    let view = View::of(&scene).size(640, 360).opacity(0.3);
    let (picture, vertices) = (640 * 360 * 16, 20 * 201 * 201 * 16);

    let before = ALLOCATOR.allocated();
    let renderer = CpuRenderer::new(2).budget_bytes(8 << 20);
    let bounded = renderer.render(&scene, &view, Resolve::Blend).unwrap();
    let most = ALLOCATOR.max_allocated() - before;
    assert!(most < picture + vertices + 16 * MIB, "{most} bytes in a budget of 8 MiB");
    assert!(bounded.stats.windows > 8, "{:?}", bounded.stats);
    drop(renderer);

    let renderer = CpuRenderer::new(2);
    let all_at_once = renderer.render(&scene, &view, Resolve::Blend).unwrap();
    let most = ALLOCATOR.max_allocated() - before;
    assert!(most > 64 * MIB, "{most} bytes at once");
    assert!(bounded.image == all_at_once.image);

    // Once it has what it needs, a frame allocates its picture and a little of what does not grow with fragments.
    renderer.render(&scene, &view, Resolve::Blend).unwrap();
    let allocated = ALLOCATOR.total_allocated();
    renderer.render(&scene, &view, Resolve::Blend).unwrap();
    let allocated = ALLOCATOR.total_allocated() - allocated;
    assert!(allocated < picture + 64 * 1024, "{allocated} bytes for a frame, {picture} of them the picture");
}
