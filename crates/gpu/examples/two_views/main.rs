//! Two LFBs in a renderer of one's own: one from the camera, one from the light, read together by one shader.
//!
//! ```console
//! $ cargo run --release -p pellucid-gpu --example two_views -- two_views.png
//! ```

use std::error::Error;

use pellucid_gpu::wgpu;

mod render;

const SIZE: [u32; 2] = [960, 540];

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args_os().nth(1).ok_or("name the picture to write: two_views OUT.png")?;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..Default::default()
    }))?;
    // Default limits, no features: what every WebGPU device has.
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let picture = render::render(&device, &queue, SIZE[0], SIZE[1])?;
    image::save_buffer(path, &picture, SIZE[0], SIZE[1], image::ExtendedColorType::Rgba8)?;
    Ok(())
}
