//! Colours that vary over a triangle, eight fragments at a time.
//!
//! Fragments are shaded as soon as some triangles of a draw are captured, while what they have in common is at hand: one
//! texture, and texels next to each other. Shading after the sort, when it is known what is hidden, saves little where
//! surfaces are translucent, and jumps from texture to texture. The operations are those of [`Varying::color_at`], in the
//! same order.

use fearless_simd::{Bytes, Level, Select, Simd, SimdBase, SimdFloat, SimdInt, SimdMask};
use fearless_simd::{dispatch, f32x8, f64x8, i32x8, mask32x8, u32x8};
use glam::Vec2;
use pellucid_core::Texture;
use pellucid_core::pixel_grid::Plane;
use pellucid_core::primitive::Draw;
use pellucid_core::shading::{GREATEST_COLOR, Varying, slope};

use crate::bin::TILE_PX;
use crate::fragments::Fragments;
use crate::sample::OnTexture;
use crate::simd::{columns, lane_numbers, narrow, rows, widen};
use crate::tile::TILE_SAMPLES;

/// Fragments shaded at a time.
pub(crate) const SHADED_LANES: usize = 8;

const LANES: usize = SHADED_LANES;

/// A piece whose colour varies.
pub(crate) struct VaryingSurface<'a> {
    pub(crate) draw: &'a Draw<'a>,
    pub(crate) varying: Varying,
    /// Pixels from the piece's anchor to the tile's top left pixel.
    pub(crate) left: i32,
    pub(crate) top: i32,
}

/// Fragments to shade that are enough to do so: what is known of them should stay in the first-level cache.
const ENOUGH: usize = 256;

/// The last fragments of a tile as long as they are not shaded, all of one draw. Triangles have few fragments in a tile, so
/// that only what depends on the triangle is done for each of them; the rest waits until there are many.
#[derive(Debug)]
pub(crate) struct Unshaded {
    /// Number of the draw.
    draw: u32,
    /// Number of the first.
    first: usize,
    count: usize,
    /// Texture coordinates.
    u: Vec<f32>,
    v: Vec<f32>,
    /// The square of how many texels a pixel covers.
    texels_squared: Vec<f32>,
    /// Colours before the texture, where vertices have some.
    colors: Vec<[f32; 4]>,
}

impl Default for Unshaded {
    fn default() -> Self {
        const ROOM: usize = ENOUGH + TILE_SAMPLES + LANES;
        let numbers = || vec![0.0; ROOM];
        let (u, v, texels_squared) = (numbers(), numbers(), numbers());
        Self { draw: 0, first: 0, count: 0, u, v, texels_squared, colors: vec![[0.0; 4]; ROOM] }
    }
}

impl Unshaded {
    /// The draw to shade before a fragment of draw `next` is added, if there is one to.
    #[inline(always)]
    pub(crate) fn draw_before(&self, next: Option<u32>) -> Option<u32> {
        (self.count >= ENOUGH || self.count > 0 && next != Some(self.draw)).then_some(self.draw)
    }

    /// Adds the fragments of a surface, those from number `first` on. A function of its own, as is [`Self::shade`], for the
    /// time it takes to compile.
    #[inline(never)]
    pub(crate) fn add(
        &mut self,
        level: Level,
        draw_number: u32,
        surface: &VaryingSurface<'_>,
        first: usize,
        fragments: &mut Fragments,
    ) {
        if self.count == 0 {
            (self.draw, self.first) = (draw_number, first);
        }
        dispatch!(level, simd => self.add_simd(simd, surface, first, fragments));
    }

    #[inline(always)]
    fn add_simd<S: Simd>(&mut self, simd: S, surface: &VaryingSurface<'_>, first: usize, fragments: &mut Fragments) {
        let (draw, varying) = (surface.draw, &surface.varying);
        let end = fragments.end();
        fragments.make_room_after(LANES);
        let mut to = self.count;
        for start in (first..end).step_by(LANES) {
            let samples: i32x8<S> = u32x8::from_slice(simd, fragments.samples_from(start)).bitcast();
            let x = to_f64((samples & (TILE_PX as i32 - 1)) + surface.left);
            let y = to_f64((samples >> TILE_PX.ilog2()) + surface.top);
            let [second, third] = [plane_at(&varying.weights[0], x, y), plane_at(&varying.weights[1], x, y)];
            let weights = [f32x8::splat(simd, 1.0) - second - third, second, third];
            let w = f32x8::splat(simd, 1.0) / interpolate(varying.inv_w, weights);
            if let Some(corners) = varying.vertex_colors {
                let mut color = [w; 4];
                for i in 0..4 {
                    let channel = interpolate([corners[0][i], corners[1][i], corners[2][i]], weights) * w;
                    color[i] = channel * draw.material.base_color[i];
                }
                rows(simd, color, &mut self.colors[to..to + LANES]);
            }
            if let (Some(corners), Some((texture, _))) = (varying.tex_coords, draw.texture) {
                let u = interpolate(corners.map(|corner| corner.x), weights) * w;
                let v = interpolate(corners.map(|corner| corner.y), weights) * w;
                u.store_slice(&mut self.u[to..to + LANES]);
                v.store_slice(&mut self.v[to..to + LANES]);
                let texels_squared = surface.texels_squared(simd, texture, corners, [u, v], w);
                texels_squared.store_slice(&mut self.texels_squared[to..to + LANES]);
            }
            to += LANES;
        }
        self.count += end - first;
    }

    /// Shades all, and leaves out those that fail the alpha test.
    #[inline(never)]
    pub(crate) fn shade(&mut self, level: Level, draw: &Draw<'_>, fragments: &mut Fragments) {
        dispatch!(level, simd => self.shade_simd(simd, draw, fragments));
        self.count = 0;
    }

    #[inline(always)]
    fn shade_simd<S: Simd>(&mut self, simd: S, draw: &Draw<'_>, fragments: &mut Fragments) {
        let lanes = lane_numbers(simd);
        fragments.make_room_after(LANES);
        let is_tested = draw.cutoff.is_some() && self.test_alphas(simd, draw, fragments);
        let end = fragments.end();
        fragments.make_room_for_colors(self.count + LANES);
        let mut kept = self.first;
        for start in (self.first..end).step_by(LANES) {
            let count = (end - start).min(LANES);
            let lights = f32x8::from_slice(simd, fragments.lights_from(start));
            let (colors, passes) = self.lit_colors(simd, draw, start - self.first, lights, count, is_tested);
            let Some(passes) = passes else {
                let to = fragments.shaded(start, count);
                (lanes + to.first_source).store_slice(to.sources);
                rows(simd, colors, to.colors);
                kept += count;
                continue;
            };
            let bits = passes.to_bitmask() & ((1 << count) - 1);
            let passes = mask32x8::from_bitmask(simd, bits);
            let passed = bits.count_ones() as usize;
            fragments.keep(simd, start, kept, passes);
            let to = fragments.shaded(kept, passed);
            (lanes + to.first_source).store_slice(to.sources);
            let [red, green, blue, alpha] = colors;
            let colors = [red.compress(passes), green.compress(passes), blue.compress(passes), alpha.compress(passes)];
            rows(simd, colors, to.colors);
            kept += passed;
        }
        fragments.truncate(kept);
    }

    /// Leaves out what fails the alpha test, as far as the texture's alpha alone tells: of leaves most, and what is left out
    /// needs no colour. Returns whether all that is left passes.
    #[inline(always)]
    fn test_alphas<S: Simd>(&mut self, simd: S, draw: &Draw<'_>, fragments: &mut Fragments) -> bool {
        let (Some(cutoff), Some((texture, _))) = (draw.cutoff, draw.texture) else { return false };
        if texture.is_opaque() || draw.mesh.colors().is_some() || draw.mesh.tex_coords().is_none() {
            return false;
        }
        let Some(quads) = texture.alpha_quads() else { return false };
        let mut all_tested = true;
        let end = fragments.end();
        let mut kept = self.first;
        for start in (self.first..end).step_by(LANES) {
            let count = (end - start).min(LANES);
            let mut bits = (1 << count) - 1;
            if let Some(alphas) = self.on_texture(simd, start - self.first).alphas(simd, texture, quads, count) {
                let alpha = alphas * draw.material.base_color.w;
                bits &= (!alpha.min(GREATEST_COLOR.w).simd_lt(cutoff)).to_bitmask();
            } else {
                all_tested = false;
            }
            let passes = mask32x8::from_bitmask(simd, bits);
            fragments.keep(simd, start, kept, passes);
            let (from, to) = (start - self.first, kept - self.first);
            for values in [&mut self.u, &mut self.v, &mut self.texels_squared] {
                let passed = f32x8::from_slice(simd, &values[from..from + LANES]).compress(passes);
                passed.store_slice(&mut values[to..to + LANES]);
            }
            kept += bits.count_ones() as usize;
        }
        fragments.truncate(kept);
        self.count = kept - self.first;
        all_tested
    }

    /// The colours of the vector of fragments from place `at` on, the first `count` of which are there: lit and
    /// premultiplied, channel by channel; and which of them pass the alpha test, if there is one.
    #[inline(always)]
    fn lit_colors<S: Simd>(
        &self,
        simd: S,
        draw: &Draw<'_>,
        at: usize,
        light: f32x8<S>,
        count: usize,
        is_tested: bool,
    ) -> ([f32x8<S>; 4], Option<mask32x8<S>>) {
        let base = draw.material.base_color.to_array();
        // Whether anything depends on the texture's alpha.
        let cutoff = draw.cutoff.filter(|_| !is_tested);
        let wants_alpha = draw.blends || cutoff.is_some();
        let mut color = [f32x8::splat(simd, 0.0); 4];
        if draw.mesh.colors().is_some() {
            color = columns(simd, &self.colors[at..at + LANES]);
        } else {
            for i in 0..4 {
                color[i] = f32x8::splat(simd, base[i]);
            }
        }
        if let Some((texture, _)) = draw.texture
            && draw.mesh.tex_coords().is_some()
        {
            let sampled = self.on_texture(simd, at).sample(simd, texture, count, wants_alpha);
            for i in 0..4 {
                color[i] *= sampled[i];
            }
        }
        let is_nan = color[0].is_nan() | color[1].is_nan() | color[2].is_nan() | color[3].is_nan();
        for i in 0..4 {
            let within = color[i].max(0.0).min(GREATEST_COLOR[i]);
            color[i] = is_nan.select(f32x8::splat(simd, base[i]), within);
        }
        let passes = cutoff.map(|cutoff| !color[3].simd_lt(cutoff));
        // As `Draw::premultiplied` and `lit`.
        let opacity = f32x8::splat(simd, draw.opacity);
        let alpha = if draw.blends { color[3].min(1.0) * opacity } else { opacity };
        let [red, green, blue, _] = color;
        ([red * alpha * light, green * alpha * light, blue * alpha * light, alpha], passes)
    }

    /// Where the vector of fragments from place `at` on lies on the texture, and the square of how many texels a pixel
    /// covers there.
    #[inline(always)]
    fn on_texture<S: Simd>(&self, simd: S, at: usize) -> OnTexture<S> {
        let range = at..at + LANES;
        OnTexture {
            u: f32x8::from_slice(simd, &self.u[range.clone()]),
            v: f32x8::from_slice(simd, &self.v[range.clone()]),
            texels_squared: f32x8::from_slice(simd, &self.texels_squared[range]),
        }
    }
}

impl VaryingSurface<'_> {
    /// The square of how many texels a pixel covers, as [`Texture::sample`] has it.
    #[inline(always)]
    fn texels_squared<S: Simd>(
        &self,
        simd: S,
        texture: &Texture,
        corners: [Vec2; 3],
        [u, v]: [f32x8<S>; 2],
        w: f32x8<S>,
    ) -> f32x8<S> {
        // The quotient rule on (u / w) / (1 / w), as in `Varying`.
        let [second, third] = &self.varying.weights;
        let derivative = |second: f64, third: f64| {
            let (second, third) = (second as f32, third as f32);
            (slope(corners, second, third), slope(self.varying.inv_w, second, third))
        };
        let (to_right, to_right_w) = derivative(second.dx, third.dx);
        let (down, down_w) = derivative(second.dy, third.dy);
        let base = &texture.levels()[0];
        let (width, height) = (base.width as f32, base.height as f32);
        let du_dx = (f32x8::splat(simd, to_right.x) - u * to_right_w) * w;
        let dv_dx = (f32x8::splat(simd, to_right.y) - v * to_right_w) * w;
        let du_dy = (f32x8::splat(simd, down.x) - u * down_w) * w;
        let dv_dy = (f32x8::splat(simd, down.y) - v * down_w) * w;
        let texels_x = (du_dx * width) * (du_dx * width) + (dv_dx * height) * (dv_dx * height);
        let texels_y = (du_dy * width) * (du_dy * width) + (dv_dy * height) * (dv_dy * height);
        texels_x.max_precise(texels_y)
    }
}

/// From integers below 2^24, which f32 holds exactly.
#[inline(always)]
fn to_f64<S: Simd>(values: i32x8<S>) -> f64x8<S> {
    widen(values.to_float())
}

/// A plane rounded to f32, as [`Plane::at`].
#[inline(always)]
fn plane_at<S: Simd>(plane: &Plane, x: f64x8<S>, y: f64x8<S>) -> f32x8<S> {
    narrow((y * plane.dy + plane.value) + x * plane.dx)
}

#[inline(always)]
fn interpolate<S: Simd>([a, b, c]: [f32; 3], [first, second, third]: [f32x8<S>; 3]) -> f32x8<S> {
    (first * a + second * b) + third * c
}
