//! A shader of three passes over a mesh of one's own, each fragment with a slot of its own in an F-Buffer between them.
//!
//! ```console
//! $ cargo run --release -p pellucid-gpu --example pitted_glass -- pitted_glass.png
//! ```

use std::error::Error;

use pellucid_gpu::wgpu;

mod render;

const SIZE: [u32; 2] = [640, 640];

/// Slots along each side of the F-Buffer.
const SIDE: u32 = 256;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args_os().nth(1).ok_or("name the picture to write: pitted_glass OUT.png")?;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..Default::default()
    }))?;
    // Default limits, no features: what every WebGPU device has.
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let (scene, view) = render::scene(SIZE)?;
    let (picture, drawn) = render::render(&device, &queue, (&scene, &view), SIDE)?;
    println!(
        "{} fragments in {} windows of {SIDE} x {SIDE} slots: geometry drawn {} times",
        drawn.fragments, drawn.windows, drawn.submissions
    );
    image::save_buffer(path, &picture.to_srgb8(), SIZE[0], SIZE[1], image::ExtendedColorType::Rgba8)?;
    Ok(())
}
