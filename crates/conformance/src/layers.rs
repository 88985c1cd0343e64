//! Captures against the oracle's, fragment by fragment.

use std::sync::Mutex;

use pellucid::{Error, Layers, Renderer, Scene, View};

/// The layers of a whole view, put together from the rectangles a renderer hands out.
///
/// # Errors
/// As [`Renderer::layers`].
///
/// # Panics
/// If the rectangles overlap or leave a gap.
pub fn gather(renderer: &Renderer, scene: &Scene, view: &View) -> Result<Layers, Error> {
    let pixel_count = view.width as usize * view.height as usize;
    let pixels = Mutex::new(vec![None; pixel_count]);
    renderer.layers(scene, view, |tile| {
        let mut pixels = pixels.lock().expect("no visitor panics");
        for y in 0..tile.height {
            for x in 0..tile.width {
                let place = &mut pixels[((tile.top + y) * view.width + tile.left + x) as usize];
                assert!(place.is_none(), "two rectangles hold one pixel");
                *place = Some((tile.pixel(x, y).to_vec(), tile.opaque(x, y)));
            }
        }
    })?;
    let mut layers = Layers { width: view.width, height: view.height, ..Layers::default() };
    for pixel in pixels.into_inner().expect("no visitor panicked") {
        let (fragments, opaque) = pixel.expect("every pixel is in a rectangle");
        layers.fragments.extend(fragments);
        layers.ends.push(layers.fragments.len() as u32);
        layers.opaque.push(opaque);
    }
    Ok(layers)
}

/// The first pixel at which two captures of one view differ by a bit, and how; `None` if they are the same.
pub fn first_difference(expected: &Layers, layers: &Layers) -> Option<String> {
    for y in 0..expected.height {
        for x in 0..expected.width {
            let (want, have) = (expected.pixel(x, y), layers.pixel(x, y));
            if want != have {
                return Some(format!("at pixel {x}, {y} expected\n{want:#?}\nand got\n{have:#?}"));
            }
            let (want, have) = (expected.opaque(x, y), layers.opaque(x, y));
            if want != have {
                return Some(format!("at pixel {x}, {y} expected the opaque surface {want:?} and got {have:?}"));
            }
        }
    }
    None
}
