//! Pixels worth a look, with all that lies behind them.

use glam::Vec4;
use pellucid::core::composite::Composite;
use pellucid::core::image::srgb8_pixel;
use pellucid::{Camera, Fragment, Scene, View};
use serde::Serialize;

use super::measure::Measured;
use super::observation::{Behind, LISTED_FRAGMENTS, Observation, behind};
use super::reference::Reference;

#[derive(Serialize)]
pub(super) struct Spot {
    /// `worst`: where `technique` differs most; `deepest`: where most layers are.
    kind: &'static str,
    technique: Option<&'static str>,
    x: u32,
    y: u32,
    expected: Color,
    shown: Option<Color>,
    depth_complexity: u32,
    background: Color,
    opaque: Option<Surface>,
    fragments: Vec<Layer>,
}

/// A surface behind the pixel, nearest first.
#[derive(Serialize)]
struct Layer {
    primitive: u32,
    #[serde(flatten)]
    surface: Surface,
    /// The pixel, were this the last layer.
    accumulated: Color,
    /// Share of the light from behind that gets through to the eye.
    transmittance: f32,
}

#[derive(Serialize)]
struct Surface {
    depth: f32,
    /// Along the line of sight in world units; `None`: infinite.
    distance: Option<f32>,
    color: Color,
}

/// 8-bit sRGB, straight alpha in 0..=1.
#[derive(Serialize)]
struct Color {
    srgb: String,
    alpha: f32,
}

/// The worst pixel of each technique that has one, and the deepest.
pub(super) fn spots(
    scene: &Scene,
    view: &View,
    reference: &Reference,
    observation: &Observation,
    measured: &[Measured],
) -> anyhow::Result<Vec<Spot>> {
    let worst = measured.iter().filter_map(|measured| Some((Some(measured), measured.worst()?)));
    let places: Vec<_> = worst.chain(observation.deepest().map(|place| (None, place))).collect();
    let pixels: Vec<(u32, u32)> = places.iter().map(|&(_, place)| place).collect();
    let behind = behind(&pixels, reference, scene, view)?;
    let spots = places.into_iter().zip(behind).map(|((measured, (x, y)), behind)| Spot {
        kind: if measured.is_some() { "worst" } else { "deepest" },
        technique: measured.map(|measured| measured.compared.name()),
        x,
        y,
        expected: Color::of(reference.image().pixel(x, y)),
        shown: measured.map(|measured| Color::of(measured.image.pixel(x, y))),
        depth_complexity: behind.fragments.len() as u32,
        background: Color::of(view.background),
        opaque: behind.opaque.map(|surface| Surface::new(surface.color, surface.depth, &view.camera)),
        fragments: listed(&behind, view),
    });
    Ok(spots.collect())
}

fn listed(behind: &Behind, view: &View) -> Vec<Layer> {
    let mut composite = Composite::default();
    let last = behind.opaque.map_or(view.background, |surface| surface.color);
    let layer = |fragment: &Fragment| {
        composite.under(fragment.color);
        Layer {
            primitive: fragment.primitive,
            surface: Surface::new(fragment.color, fragment.depth, &view.camera),
            accumulated: Color::of(composite.over(last)),
            transmittance: composite.transmittance,
        }
    };
    behind.fragments.iter().take(LISTED_FRAGMENTS).map(layer).collect()
}

impl Surface {
    fn new(color: Vec4, depth: f32, camera: &Camera) -> Self {
        let distance = Some(camera.distance_from_depth(depth)).filter(|distance| distance.is_finite());
        Self { depth, distance, color: Color::of(color) }
    }
}

impl Color {
    fn of(pixel: Vec4) -> Self {
        let [r, g, b, _] = srgb8_pixel(pixel);
        Self { srgb: format!("#{r:02x}{g:02x}{b:02x}"), alpha: pixel.w }
    }
}
