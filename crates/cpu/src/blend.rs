//! Ordered layers to pixels: blended front to back, eight pixels at a time, until nothing behind changes a bit.

use fearless_simd::{Select, Simd, SimdBase, SimdMask, dispatch, f32x8, u32x8};
use glam::Vec4;

use crate::fragments::COLOR;
use crate::lit_key;
use crate::order::{Row, STRIP, Strip};
use crate::simd::{columns, each_lane, lane_numbers, rows};
use crate::tile::{FrameParts, TILE_SAMPLES, TileCapture};

/// Layers blended between two looks at whether anything behind them still counts.
const LAYERS_A_LOOK: usize = 8;

/// Less than half the distance of an f32 from the next, as a share of it: added to it, this changes no bit.
const NOTHING: f32 = 1.0 / (1_u32 << 26) as f32;

/// The layers of a strip's pixels blended so far.
struct StripComposite<S: Simd> {
    red: f32x8<S>,
    green: f32x8<S>,
    blue: f32x8<S>,
    transmittance: f32x8<S>,
}

impl<S: Simd> StripComposite<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        let zero = f32x8::splat(simd, 0.0);
        Self { red: zero, green: zero, blue: zero, transmittance: f32x8::splat(simd, 1.0) }
    }

    /// As [`Composite::under`](pellucid_core::composite::Composite::under).
    #[inline(always)]
    fn under(&mut self, [red, green, blue, alpha]: [f32x8<S>; 4]) {
        self.red += red * self.transmittance;
        self.green += green * self.transmittance;
        self.blue += blue * self.transmittance;
        self.transmittance *= 1.0 - alpha;
    }

    /// As [`Composite::over`](pellucid_core::composite::Composite::over).
    #[inline(always)]
    fn over(self, [red, green, blue, alpha]: [f32x8<S>; 4]) -> [f32x8<S>; 4] {
        let Self { transmittance, .. } = self;
        [
            self.red + red * transmittance,
            self.green + green * transmittance,
            self.blue + blue * transmittance,
            (1.0 - transmittance) + alpha * transmittance,
        ]
    }

    /// Whether nothing behind changes a bit of any pixel, as none of it has more of a channel than `greatest`.
    #[inline(always)]
    fn is_complete(&self, greatest: Vec4) -> bool {
        let hides = |channel: f32x8<S>, greatest: f32| (self.transmittance * greatest).simd_le(channel * NOTHING);
        let hidden = hides(self.red, greatest.x) & hides(self.green, greatest.y) & hides(self.blue, greatest.z);
        (hidden & (self.transmittance * greatest.w).simd_le(NOTHING)).all_true()
    }
}

impl TileCapture {
    /// Blends every pixel front to back before `background`, row by row of the tile's samples.
    pub(crate) fn blend(&self, frame: FrameParts<'_>, background: Vec4, pixels: &mut [Vec4; TILE_SAMPLES]) {
        dispatch!(frame.level, simd => self.blend_simd(simd, frame, background, pixels));
    }

    #[inline(always)]
    fn blend_simd<S: Simd>(&self, simd: S, frame: FrameParts<'_>, background: Vec4, pixels: &mut [Vec4; TILE_SAMPLES]) {
        pixels.fill(background);
        if self.has_opaque {
            for (sample, x, y) in self.pixels() {
                if let Some(color) = self.opaque_color(sample, x, y, frame) {
                    pixels[sample] = color;
                }
            }
        }
        let greatest = frame.greatest_color.max(background.abs());
        for strip in &self.order.strips {
            let blended = match self.lit_source {
                Some(source) => self.blend_lit_strip(simd, strip, frame.palette[source as usize], greatest),
                None => self.blend_strip(simd, strip, frame, greatest),
            };
            let behind = each_lane(|lane| pixels[strip.samples[lane] as usize % TILE_SAMPLES].to_array());
            let mut colors = [[0.0; 4]; STRIP];
            rows(simd, blended.over(columns(simd, &behind)), &mut colors);
            for (color, &sample) in colors.iter().zip(&strip.samples[..strip.sample_count as usize]) {
                pixels[sample as usize % TILE_SAMPLES] = Vec4::from_array(*color);
            }
        }
    }

    #[inline(always)]
    fn blend_strip<S: Simd>(&self, simd: S, strip: &Strip, frame: FrameParts<'_>, greatest: Vec4) -> StripComposite<S> {
        let mut blended = StripComposite::new(simd);
        let (lights, sources, colors) = self.fragments.lights_and_sources();
        let has_whole_rows = self.fragments.has_whole_rows();
        for (i, row) in self.order.rows(strip).iter().enumerate() {
            let layer = if has_whole_rows && let Some(layer) = self.layer_of_one(simd, row, frame) {
                layer
            } else {
                let numbers = row.0.map(|key| key as u32 as usize);
                let mut layer = [[0.0; 4]; STRIP];
                for (color, number) in layer.iter_mut().zip(numbers) {
                    let source = sources[number];
                    *color = if source & COLOR == 0 {
                        let (color, light) = (frame.palette[source as usize], lights[number]);
                        (color * Vec4::new(light, light, light, 1.0)).to_array()
                    } else {
                        colors[(source & !COLOR) as usize]
                    };
                }
                columns(simd, &layer)
            };
            blended.under(layer);
            if i % LAYERS_A_LOOK == LAYERS_A_LOOK - 1 && blended.is_complete(greatest) {
                break;
            }
        }
        blended
    }

    /// The colours of a row's fragments, if these were captured one after the other, as those of one triangle are.
    #[inline(always)]
    fn layer_of_one<S: Simd>(&self, simd: S, row: &Row, frame: FrameParts<'_>) -> Option<[f32x8<S>; 4]> {
        let (lights, sources, colors) = self.fragments.lights_and_sources();
        let lanes = lane_numbers(simd);
        let first = row.0[0] as u32;
        if row.0[STRIP - 1] as u32 != first + (STRIP as u32 - 1) {
            return None;
        }
        let [numbers, _] = lit_key::halves(simd, &row.0);
        if !numbers.simd_eq(lanes + first).all_true() {
            return None;
        }
        let range = first as usize..first as usize + STRIP;
        let source = sources[range.start];
        let sources = u32x8::from_slice(simd, &sources[range.clone()]);
        if source & COLOR == 0 {
            if !sources.simd_eq(source).all_true() {
                return None;
            }
            let light = f32x8::from_slice(simd, &lights[range]);
            let [red, green, blue, alpha] = frame.palette[source as usize].to_array();
            return Some([light * red, light * green, light * blue, f32x8::splat(simd, alpha)]);
        }
        if !sources.simd_eq(lanes + source).all_true() {
            return None;
        }
        let first = (source & !COLOR) as usize;
        Some(columns(simd, &colors[first..first + STRIP]))
    }

    /// As `blend_strip`, of layers that have one colour before lighting, and their brightness in their keys.
    #[inline(always)]
    fn blend_lit_strip<S: Simd>(&self, simd: S, strip: &Strip, color: Vec4, greatest: Vec4) -> StripComposite<S> {
        let mut blended = StripComposite::new(simd);
        let zero = f32x8::splat(simd, 0.0);
        let [red, green, blue, alpha] = color.to_array().map(|channel| f32x8::splat(simd, channel));
        for (i, row) in self.order.rows(strip).iter().enumerate() {
            let (light, is_there) = lit_key::lights(simd, &row.0);
            blended.under([red * light, green * light, blue * light, is_there.select(alpha, zero)]);
            if i % LAYERS_A_LOOK == LAYERS_A_LOOK - 1 && blended.is_complete(greatest) {
                break;
            }
        }
        blended
    }
}
