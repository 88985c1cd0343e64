//! Ordered layers to pixels: blended front to back, eight pixels at a time.

use fearless_simd::{Simd, SimdBase, SimdMask, dispatch, f32x8};
use glam::{Vec3, Vec4};
use pellucid_core::composite::Composite;

use crate::fragments::COLOR;
use crate::order::{STRIP, Strip};
use crate::tile::{FrameParts, TILE_SAMPLES, TileCapture};

/// The layers of a strip's pixels blended so far.
struct StripComposite<S: Simd> {
    red: f32x8<S>,
    green: f32x8<S>,
    blue: f32x8<S>,
    transmittance: f32x8<S>,
}

impl<S: Simd> StripComposite<S> {
    /// As [`Composite::under`].
    #[inline(always)]
    fn under(&mut self, [red, green, blue, alpha]: [f32x8<S>; 4]) {
        self.red += red * self.transmittance;
        self.green += green * self.transmittance;
        self.blue += blue * self.transmittance;
        self.transmittance *= 1.0 - alpha;
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
        for strip in &self.order.strips {
            let blended = self.blend_strip(simd, strip, frame);
            let channel = |values: f32x8<S>| -> [f32; STRIP] { values.into() };
            let (red, green, blue) = (channel(blended.red), channel(blended.green), channel(blended.blue));
            let transmittance = channel(blended.transmittance);
            for lane in 0..strip.sample_count as usize {
                let pixel = &mut pixels[strip.samples[lane] as usize % TILE_SAMPLES];
                let color = Vec3::new(red[lane], green[lane], blue[lane]);
                *pixel = Composite { color, transmittance: transmittance[lane] }.over(*pixel);
            }
        }
    }

    #[inline(always)]
    fn blend_strip<S: Simd>(&self, simd: S, strip: &Strip, frame: FrameParts<'_>) -> StripComposite<S> {
        let zero = f32x8::splat(simd, 0.0);
        let mut blended = StripComposite { red: zero, green: zero, blue: zero, transmittance: f32x8::splat(simd, 1.0) };
        let (lights, sources, colors) = self.fragments.lights_and_sources();
        for row in self.order.rows(strip) {
            let numbers = row.0.map(|key| key as u32 as usize);
            let mut layer = [[0.0; STRIP]; 4];
            for (lane, &number) in numbers.iter().enumerate() {
                let source = sources[number];
                let color = if source & COLOR == 0 {
                    let (color, light) = (frame.palette[source as usize], lights[number]);
                    (color * Vec4::new(light, light, light, 1.0)).to_array()
                } else {
                    colors[(source & !COLOR) as usize]
                };
                for (channel, value) in layer.iter_mut().zip(color) {
                    channel[lane] = value;
                }
            }
            blended.under(layer.map(|channel| f32x8::load_array(simd, channel)));
            // Exactly 0: nothing behind changes a bit.
            if blended.transmittance.simd_eq(zero).all_true() {
                break;
            }
        }
        blended
    }
}
