//! Peeled layers, handed out: each is read back as it is peeled, as no pass ever sees all layers of a pixel.

use pellucid_core::{Fragment, Layers};

use crate::GpuError;
use crate::frame::{Frame, Goal};
use crate::memory::Window;
use crate::pass::gather::{opaque_surfaces, unpack};
use crate::readback::read_buffer;

/// The layers so far, nearest first: for each pixel that has one, its place in the window and the fragment.
#[derive(Debug, Default)]
pub(super) struct Gathering {
    layers: Vec<Vec<(usize, Fragment)>>,
}

impl Gathering {
    /// Reads the layer that has just been peeled. Waits for it.
    pub(super) fn add(&mut self, frame: &mut Frame<'_>, layer: &wgpu::Buffer, pixels: u64) -> Result<(), GpuError> {
        let stored: Vec<[u32; 4]> = read_buffer(frame, layer, 0, pixels)?;
        let there = stored.into_iter().enumerate().filter(|(_, words)| words[3] != 0);
        self.layers
            .push(there.map(|(i, [rg, ba, depth, primitive])| (i, unpack([rg, ba, depth, primitive - 1]))).collect());
        Ok(())
    }

    /// Adds them to the frame's goal, pixel by pixel.
    pub(super) fn finish(self, frame: &mut Frame<'_>, window: Window) -> Result<(), GpuError> {
        let mut pixels: Vec<Vec<Fragment>> = vec![Vec::new(); window.pixels() as usize];
        for (pixel, fragment) in self.layers.into_iter().flatten() {
            pixels[pixel].push(fragment);
        }
        let mut end = 0;
        let ends = pixels
            .iter()
            .map(|fragments| {
                end += fragments.len() as u32;
                end
            })
            .collect();
        let fragments = pixels.into_iter().flatten().collect();
        let opaque = opaque_surfaces(frame, window)?;
        let Window { left, top, width, height } = window;
        if let Goal::Layers(all) = &mut frame.goal {
            all.push(Layers { left, top, width, height, ends, fragments, opaque });
        }
        Ok(())
    }
}
