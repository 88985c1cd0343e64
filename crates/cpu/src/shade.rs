//! Colours that vary over a triangle, eight fragments at a time.
//!
//! Fragments are shaded as soon as a triangle is captured, while what they have in common is at hand: its planes, one
//! texture, and texels next to each other. Shading after the sort, when it is known what is hidden, saves little where
//! surfaces are translucent, and jumps from texture to texture. The operations are those of [`Varying::color_at`], in the
//! same order.

use fearless_simd::{Bytes, Level, Select, Simd, SimdBase, SimdFloat, SimdInt, SimdMask, SimdNarrow, SimdSplit};
use fearless_simd::{dispatch, f32x8, f64x8, i32x8};
use glam::{Vec2, Vec4};
use pellucid_core::Texture;
use pellucid_core::pixel_grid::Plane;
use pellucid_core::primitive::Draw;
use pellucid_core::shading::{GREATEST_COLOR, Varying, slope};
use pellucid_core::texture::{Filter, TexelValues, Wrap};

use crate::bin::TILE_PX;
use crate::fragments::Fragments;

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

impl VaryingSurface<'_> {
    /// Shades the fragments from number `first` on, all of this surface, and leaves out those that fail the alpha test.
    #[inline(always)]
    fn shade<S: Simd>(&self, simd: S, first: usize, fragments: &mut Fragments) {
        let end = fragments.end();
        let mut kept = first;
        for start in (first..end).step_by(LANES) {
            let count = (end - start).min(LANES);
            let (samples, lights) = fragments.lanes(start);
            let (samples, lights) = (*samples, *lights);
            let (color, passes) = self.colors(simd, &samples, &lights, count);
            for lane in 0..count {
                if passes >> lane & 1 != 0 {
                    let color = Vec4::new(color[0][lane], color[1][lane], color[2][lane], color[3][lane]);
                    fragments.shaded(start + lane, kept, color);
                    kept += 1;
                }
            }
        }
        fragments.truncate(kept);
    }

    /// The colours of the first `count` lanes, lit and premultiplied, channel by channel, and which lanes pass the alpha
    /// test.
    #[inline(always)]
    fn colors<S: Simd>(
        &self,
        simd: S,
        samples: &[u32; LANES],
        lights: &[f32; LANES],
        count: usize,
    ) -> ([[f32; LANES]; 4], u64) {
        let (draw, varying) = (self.draw, &self.varying);
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        for ((x, y), sample) in x.iter_mut().zip(&mut y).zip(samples) {
            *x = f64::from((sample % TILE_PX) as i32 + self.left);
            *y = f64::from((sample / TILE_PX) as i32 + self.top);
        }
        let (x, y) = (f64x8::load_array(simd, x), f64x8::load_array(simd, y));
        let [second, third] = [plane_at(&varying.weights[0], x, y), plane_at(&varying.weights[1], x, y)];
        let weights = [f32x8::splat(simd, 1.0) - second - third, second, third];
        let w = f32x8::splat(simd, 1.0) / interpolate(varying.inv_w, weights);
        let base = draw.material.base_color.to_array();
        let mut color = [f32x8::splat(simd, 0.0); 4];
        for i in 0..4 {
            color[i] = f32x8::splat(simd, base[i]);
        }
        if let Some(corners) = varying.vertex_colors {
            for i in 0..4 {
                color[i] *= interpolate([corners[0][i], corners[1][i], corners[2][i]], weights) * w;
            }
        }
        if let (Some(corners), Some((texture, _))) = (varying.tex_coords, draw.texture) {
            let u = interpolate(corners.map(|corner| corner.x), weights) * w;
            let v = interpolate(corners.map(|corner| corner.y), weights) * w;
            let sampled = self.sample(simd, texture, corners, [u, v], w, count);
            for i in 0..4 {
                color[i] *= sampled[i];
            }
        }
        let is_nan = color[0].is_nan() | color[1].is_nan() | color[2].is_nan() | color[3].is_nan();
        for i in 0..4 {
            let within = color[i].max(0.0).min(GREATEST_COLOR[i]);
            color[i] = is_nan.select(f32x8::splat(simd, base[i]), within);
        }
        let passes = match draw.cutoff {
            Some(cutoff) => !color[3].simd_lt(cutoff).to_bitmask(),
            None => u64::MAX,
        };
        // As `Draw::premultiplied` and `lit`.
        let opacity = f32x8::splat(simd, draw.opacity);
        let alpha = if draw.blends { color[3].min(1.0) * opacity } else { opacity };
        let light = f32x8::load_array(simd, *lights);
        let [red, green, blue, _] = color;
        (
            [(red * alpha * light).into(), (green * alpha * light).into(), (blue * alpha * light).into(), alpha.into()],
            passes,
        )
    }

    /// As [`Texture::sample`].
    #[inline(always)]
    fn sample<S: Simd>(
        &self,
        simd: S,
        texture: &Texture,
        corners: [Vec2; 3],
        [u, v]: [f32x8<S>; 2],
        w: f32x8<S>,
        count: usize,
    ) -> [f32x8<S>; 4] {
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
        let sampler = texture.sampler();
        let lanes = (1 << count) - 1;
        let odd = !u.is_finite() | !v.is_finite() | texels_x.is_nan() | texels_y.is_nan();
        let all_linear = sampler.magnify == Filter::Linear
            && sampler.minify == Filter::Linear
            && sampler.mip != Some(Filter::Nearest);
        if !all_linear || odd.to_bitmask() & lanes != 0 {
            let channels = sample_each(
                texture,
                [u.into(), v.into()],
                [du_dx.into(), dv_dx.into()],
                [du_dy.into(), dv_dy.into()],
                count,
            );
            let mut color = [u; 4];
            for i in 0..4 {
                color[i] = f32x8::load_array(simd, channels[i]);
            }
            return color;
        }
        let texels_squared = texels_x.max(texels_y);
        let last = texture.levels().len() as f32 - 1.0;
        let minified = texels_squared.simd_gt(1.0);
        if sampler.mip.is_none() || minified.to_bitmask() & lanes == 0 {
            return sample_level(simd, texture, [0; LANES], [u, v], count);
        }
        let zero = f32x8::splat(simd, 0.0);
        let level = minified.select((log2(simd, texels_squared) * 0.5).min(last), zero);
        let whole: i32x8<S> = level.to_int();
        let fraction = level - whole.to_float::<f32x8<S>>();
        let near = sample_level(simd, texture, whole.into(), [u, v], count);
        if fraction.simd_gt(0.0).to_bitmask() & lanes == 0 {
            return near;
        }
        let far = sample_level(simd, texture, (whole + 1).min(last as i32).into(), [u, v], count);
        let mut between = near;
        for i in 0..4 {
            between[i] += (far[i] - near[i]) * fraction;
        }
        between
    }
}

/// Shades the fragments of a surface from number `first` on. A function of its own, for the time it takes to compile.
#[inline(never)]
pub(crate) fn shade(level: Level, surface: &VaryingSurface<'_>, first: usize, fragments: &mut Fragments) {
    dispatch!(level, simd => surface.shade(simd, first, fragments));
}

/// Each lane on its own: where filters are mixed, or coordinates have no value.
#[cold]
#[inline(never)]
fn sample_each(
    texture: &Texture,
    uv: [[f32; LANES]; 2],
    duv_dx: [[f32; LANES]; 2],
    duv_dy: [[f32; LANES]; 2],
    count: usize,
) -> [[f32; LANES]; 4] {
    let mut color = [[0.0; LANES]; 4];
    for lane in 0..count {
        let at = |pair: &[[f32; LANES]; 2]| Vec2::new(pair[0][lane], pair[1][lane]);
        let sampled = texture.sample(at(&uv), at(&duv_dx), at(&duv_dy));
        for (channel, value) in color.iter_mut().zip(sampled.to_array()) {
            channel[lane] = value;
        }
    }
    color
}

/// A plane rounded to f32, as [`Plane::at`].
#[inline(always)]
fn plane_at<S: Simd>(plane: &Plane, x: f64x8<S>, y: f64x8<S>) -> f32x8<S> {
    let (low, high) = ((y * plane.dy + plane.value) + x * plane.dx).split();
    low.narrow(high)
}

#[inline(always)]
fn interpolate<S: Simd>([a, b, c]: [f32; 3], [first, second, third]: [f32x8<S>; 3]) -> f32x8<S> {
    (first * a + second * b) + third * c
}

/// As [`pellucid_core::texture::log2`].
#[inline(always)]
fn log2<S: Simd>(simd: S, value: f32x8<S>) -> f32x8<S> {
    let bits: i32x8<S> = value.bitcast();
    let exponent = (bits >> 23) - 127;
    let mantissa: f32x8<S> = ((bits & 0x007f_ffff) | i32x8::splat(simd, 0x3f80_0000)).bitcast();
    exponent.to_float::<f32x8<S>>() + (mantissa - 1.0)
}

/// The four texels around each coordinate on its own level, weighted by distance.
#[inline(always)]
fn sample_level<S: Simd>(
    simd: S,
    texture: &Texture,
    level: [i32; LANES],
    [u, v]: [f32x8<S>; 2],
    count: usize,
) -> [f32x8<S>; 4] {
    let levels = texture.levels();
    let sampler = texture.sampler();
    let (mut width, mut height) = ([1; LANES], [1; LANES]);
    for lane in 0..count {
        let level = &levels[level[lane] as usize];
        (width[lane], height[lane]) = (level.width as i32, level.height as i32);
    }
    let (width, height) = (i32x8::load_array(simd, width), i32x8::load_array(simd, height));
    let (left, right, across) = texel_pair(simd, u, width, sampler.wrap_u);
    let (top, bottom, down) = texel_pair(simd, v, height, sampler.wrap_v);
    let (top, bottom) = (top * width, bottom * width);
    let places: [[i32; LANES]; 4] =
        [(top + left).into(), (top + right).into(), (bottom + left).into(), (bottom + right).into()];
    let values = TexelValues::get();
    let mut channels = [[[0.0; LANES]; 4]; 4];
    for lane in 0..count {
        let texels: &[[u8; 4]] = &levels[level[lane] as usize].texels;
        for (corner, places) in channels.iter_mut().zip(&places) {
            let [red, green, blue, alpha] = texels[places[lane] as usize];
            corner[0][lane] = values.linear[red as usize];
            corner[1][lane] = values.linear[green as usize];
            corner[2][lane] = values.linear[blue as usize];
            corner[3][lane] = values.alpha[alpha as usize];
        }
    }
    let mut color = [f32x8::splat(simd, 0.0); 4];
    for i in 0..4 {
        let top_left = f32x8::load_array(simd, channels[0][i]);
        let top_right = f32x8::load_array(simd, channels[1][i]);
        let bottom_left = f32x8::load_array(simd, channels[2][i]);
        let bottom_right = f32x8::load_array(simd, channels[3][i]);
        let above = top_left + (top_right - top_left) * across;
        let below = bottom_left + (bottom_right - bottom_left) * across;
        color[i] = above + (below - above) * down;
    }
    color
}

/// Along one axis of a level: the texels before and behind a coordinate, and the share of the latter.
#[inline(always)]
fn texel_pair<S: Simd>(simd: S, coordinate: f32x8<S>, size: i32x8<S>, wrap: Wrap) -> (i32x8<S>, i32x8<S>, f32x8<S>) {
    let in_unit = match wrap {
        Wrap::Repeat => coordinate - floor(coordinate),
        Wrap::MirroredRepeat => coordinate - floor(coordinate * 0.5) * 2.0,
        Wrap::ClampToEdge => coordinate.max(0.0).min(1.0),
    };
    let at = in_unit * size.to_float::<f32x8<S>>() - 0.5;
    let before = floor(at);
    let first: i32x8<S> = before.to_int();
    (wrap_texel(simd, first, size, wrap), wrap_texel(simd, first + 1, size, wrap), at - before)
}

/// The greatest whole number that is not above `t`: rounded towards zero, as every level can, from 2^23 on as it is.
#[inline(always)]
fn floor<S: Simd>(t: f32x8<S>) -> f32x8<S> {
    let toward_zero = t.to_int::<i32x8<S>>().to_float::<f32x8<S>>();
    let below = toward_zero.simd_gt(t).select(toward_zero - 1.0, toward_zero);
    t.abs().simd_lt(8_388_608.0).select(below, t)
}

/// The texel that stands at position `i`.
#[inline(always)]
fn wrap_texel<S: Simd>(simd: S, i: i32x8<S>, size: i32x8<S>, wrap: Wrap) -> i32x8<S> {
    let zero = i32x8::splat(simd, 0);
    match wrap {
        Wrap::Repeat => {
            let from_below = i.simd_lt(0).select(i + size, i);
            i.simd_ge(size).select(i - size, from_below)
        }
        Wrap::MirroredRepeat => {
            let mirrored = i.simd_ge(size).select(size * 2 - 1 - i, i);
            (i.simd_lt(0) | i.simd_ge(size * 2)).select(zero, mirrored)
        }
        Wrap::ClampToEdge => i.max(0).min(size - 1),
    }
}
