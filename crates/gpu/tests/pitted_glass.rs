//! The example of a shader of three passes: the same bits in buffers of any size.

use pellucid_gpu::wgpu;

mod common;
#[path = "../examples/pitted_glass/render.rs"]
mod pitted_glass;

#[test]
fn the_example_gives_the_same_bits_in_any_buffer() {
    if common::renderer(true).is_none() {
        return;
    }
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).unwrap();
    let (scene, view) = pitted_glass::scene([96, 80]).unwrap();
    let render = |side| {
        let (device, queue) = pollster::block_on(adapter.request_device(&Default::default())).unwrap();
        pitted_glass::render(&device, &queue, (&scene, &view), side).unwrap()
    };
    let (expected, drawn) = render(256);
    assert_eq!((drawn.windows, drawn.submissions), (1, 3));
    assert!(expected.pixels().iter().any(|pixel| pixel.x > 0.5), "lamps are reflected");
    for side in [32, 64] {
        let (image, drawn) = render(side);
        assert!(image == expected, "{side}");
        let windows = drawn.fragments.div_ceil(u64::from(side * side));
        assert_eq!((drawn.windows, drawn.submissions), (windows, 3 * windows));
    }
}
