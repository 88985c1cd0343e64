//! What is seen of the reference's layers, tile by tile, so that they need not exist all at once.

use std::sync::Mutex;

use glam::{Vec3, Vec4};
use pellucid::core::composite::Composite;
use pellucid::core::layers::OpaqueSurface;
use pellucid::{Fragment, Image, Layers, Scene, View};
use pellucid_conformance::unsorted;

use super::reference::Reference;
use crate::legend;

/// Layers shown one by one.
const SHOWN_LAYERS: u32 = 8;
/// Widest picture of a layer.
const THUMBNAIL_WIDTH: u32 = 480;
/// Fragments listed of one pixel.
pub(super) const LISTED_FRAGMENTS: usize = 1024;

/// A picture blended in draw order, depth complexity, and the first layers one by one.
pub(super) struct Observation {
    pub(super) unsorted: Image,
    /// For each pixel, row by row.
    pub(super) depth_complexity: Vec<u32>,
    pub(super) layers: LayerPictures,
}

/// The first layers in full colour, reduced in size.
pub(super) struct LayerPictures {
    /// Pixels of the picture along one side of a thumbnail's pixel.
    scale: u32,
    background: Vec4,
    thumbnails: Vec<Image>,
    /// Pixels that have such a layer.
    pub(super) pixels: Vec<u64>,
}

/// What lies behind one pixel.
pub(super) struct Behind {
    pub(super) fragments: Vec<Fragment>,
    pub(super) opaque: Option<OpaqueSurface>,
}

impl Observation {
    pub(super) fn of(reference: &Reference, scene: &Scene, view: &View) -> anyhow::Result<Self> {
        let shown = reference.stats().max_depth_complexity.min(SHOWN_LAYERS);
        let seen = Mutex::new(Self {
            unsorted: Image::filled(view.width, view.height, view.background),
            depth_complexity: vec![0; view.width as usize * view.height as usize],
            layers: LayerPictures::new(shown, view),
        });
        reference.layers(scene, view, |tile| {
            let pixels = blended_unsorted(tile, view.background);
            let mut seen = seen.lock().expect("no visitor panics");
            for (i, unsorted) in pixels.into_iter().enumerate() {
                let (x, y) = (i as u32 % tile.width, i as u32 / tile.width);
                let (column, row) = (tile.left + x, tile.top + y);
                let place = row as usize * view.width as usize + column as usize;
                seen.unsorted.pixels_mut()[place] = unsorted;
                seen.depth_complexity[place] = tile.depth_complexity(x, y);
                seen.layers.add(column, row, tile.pixel(x, y));
            }
        })?;
        Ok(seen.into_inner().expect("no visitor panicked"))
    }

    /// The pixel with most layers, the first of several; `None` if there are none at all.
    pub(super) fn deepest(&self) -> Option<(u32, u32)> {
        let greatest = *self.depth_complexity.iter().max().filter(|&&count| count > 0)?;
        let place = self.depth_complexity.iter().position(|&count| count == greatest)? as u32;
        Some((place % self.unsorted.width(), place / self.unsorted.width()))
    }

    /// Numbers of pixels by depth complexity, from 0 on.
    pub(super) fn histogram(&self) -> Vec<u64> {
        let greatest = self.depth_complexity.iter().max().copied().unwrap_or(0);
        let mut pixels = vec![0; greatest as usize + 1];
        for &count in &self.depth_complexity {
            pixels[count as usize] += 1;
        }
        pixels
    }
}

fn blended_unsorted(tile: &Layers, background: Vec4) -> Vec<Vec4> {
    let mut scratch = Vec::new();
    let places = (0..tile.height).flat_map(|y| (0..tile.width).map(move |x| (x, y)));
    places.map(|(x, y)| unsorted::pixel(tile.pixel(x, y), tile.opaque(x, y), background, &mut scratch)).collect()
}

/// What lies behind some pixels, in their order.
pub(super) fn behind(
    pixels: &[(u32, u32)],
    reference: &Reference,
    scene: &Scene,
    view: &View,
) -> anyhow::Result<Vec<Behind>> {
    let found = Mutex::new(pixels.iter().map(|_| Behind { fragments: Vec::new(), opaque: None }).collect::<Vec<_>>());
    reference.layers(scene, view, |tile| {
        for (i, &(x, y)) in pixels.iter().enumerate() {
            let (Some(x), Some(y)) = (x.checked_sub(tile.left), y.checked_sub(tile.top)) else { continue };
            if x < tile.width && y < tile.height {
                let behind = Behind { fragments: tile.pixel(x, y).to_vec(), opaque: tile.opaque(x, y) };
                found.lock().expect("no visitor panics")[i] = behind;
            }
        }
    })?;
    Ok(found.into_inner().expect("no visitor panicked"))
}

impl LayerPictures {
    fn new(count: u32, view: &View) -> Self {
        let scale = view.width.div_ceil(THUMBNAIL_WIDTH);
        let (width, height) = ((view.width / scale).max(1), (view.height / scale).max(1));
        let empty = Image::filled(width, height, Vec4::ZERO);
        Self {
            scale,
            background: view.background,
            thumbnails: vec![empty; count as usize],
            pixels: vec![0; count as usize],
        }
    }

    /// Adds what one pixel has. Colours are undone of their alpha: a faint layer is shown as plainly as any.
    fn add(&mut self, x: u32, y: u32, fragments: &[Fragment]) {
        let (x, y) = (x / self.scale, y / self.scale);
        let share = 1.0 / (self.scale * self.scale) as f32;
        for (i, thumbnail) in self.thumbnails.iter_mut().enumerate() {
            let Some(fragment) = fragments.get(i) else { break };
            self.pixels[i] += 1;
            let color: Vec3 = fragment.color.truncate() / fragment.color.w.max(f32::MIN_POSITIVE);
            if x < thumbnail.width() && y < thumbnail.height() {
                let place = (y * thumbnail.width() + x) as usize;
                thumbnail.pixels_mut()[place] += color.clamp(Vec3::ZERO, Vec3::ONE).extend(1.0) * share;
            }
        }
    }

    /// All of them side by side, the nearest first, before the background.
    pub(super) fn strip(&self) -> Image {
        let Some(first) = self.thumbnails.first() else {
            return Image::filled(1, 1, self.background);
        };
        let (width, height) = (first.width(), first.height());
        let count = self.thumbnails.len() as u32;
        let mut strip = Image::filled(width * count, height, self.background);
        for (number, thumbnail) in (0..).zip(&self.thumbnails) {
            for (y, row) in thumbnail.pixels().chunks_exact(width as usize).enumerate() {
                let start = (y as u32 * width * count + number * width) as usize;
                for (target, &pixel) in strip.pixels_mut()[start..].iter_mut().zip(row) {
                    let composite = Composite { color: pixel.truncate(), transmittance: 1.0 - pixel.w };
                    *target = composite.over(self.background);
                }
            }
            legend::label(&mut strip, &format!("layer {}", number + 1), (number * width, width));
        }
        strip
    }
}
