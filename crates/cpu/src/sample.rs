//! Textures sampled at eight coordinates: which texels, and their colours or alphas alone. The operations are those of
//! [`Texture::sample_scaled`], in the same order.

use fearless_simd::{
    Bytes, Select, Simd, SimdBase, SimdCombine, SimdFloat, SimdInt, SimdInterleaved, SimdMask, f32x4, f32x8, i32x8,
};
use glam::Vec2;
use pellucid_core::Texture;
use pellucid_core::texture::{Filter, MipLevel, TexelValues, Wrap};

/// Coordinates sampled at a time.
const LANES: usize = 8;

/// Where eight fragments lie on a texture.
#[derive(Clone, Copy)]
pub(crate) struct OnTexture<S: Simd> {
    pub(crate) u: f32x8<S>,
    pub(crate) v: f32x8<S>,
    /// The square of how many texels of the full size a pixel covers.
    pub(crate) texels_squared: f32x8<S>,
}

impl<S: Simd> OnTexture<S> {
    /// The colours of the first `count`, channel by channel, as [`Texture::sample_scaled`].
    #[inline(always)]
    pub(crate) fn sample(&self, simd: S, texture: &Texture, count: usize) -> [f32x8<S>; 4] {
        match self.footprints(simd, texture, count) {
            Some(Footprints { near, far: None }) => near.colors(simd, count),
            Some(Footprints { near, far: Some((far, fraction)) }) => near.colors_between(simd, &far, fraction, count),
            None => {
                let colors = sample_each(texture, [self.u.into(), self.v.into()], self.texels_squared.into(), count);
                channels(simd, colors.as_flattened())
            }
        }
    }

    /// Which texels the first `count` see; `None` where filters are mixed, or coordinates have no value.
    #[inline(always)]
    pub(crate) fn footprints<'t>(&self, simd: S, texture: &'t Texture, count: usize) -> Option<Footprints<'t>> {
        let Self { u, v, texels_squared } = *self;
        let sampler = texture.sampler();
        let lanes = (1 << count) - 1;
        let odd = !u.is_finite() | !v.is_finite() | texels_squared.is_nan();
        let all_linear = sampler.magnify == Filter::Linear
            && sampler.minify == Filter::Linear
            && sampler.mip != Some(Filter::Nearest);
        if !all_linear || odd.to_bitmask() & lanes != 0 {
            return None;
        }
        let last = texture.levels().len() as f32 - 1.0;
        let minified = texels_squared.simd_gt(1.0);
        let zero = i32x8::splat(simd, 0);
        if sampler.mip.is_none() || minified.to_bitmask() & lanes == 0 {
            return Some(Footprints { near: LevelFootprints::new(simd, texture, zero, [u, v]), far: None });
        }
        let level = minified.select((log2(simd, texels_squared) * 0.5).min(last), zero.to_float());
        let whole: i32x8<S> = level.to_int();
        let fraction = level - whole.to_float::<f32x8<S>>();
        let near = LevelFootprints::new(simd, texture, whole, [u, v]);
        if fraction.simd_gt(0.0).to_bitmask() & lanes == 0 {
            return Some(Footprints { near, far: None });
        }
        let far = LevelFootprints::new(simd, texture, (whole + 1).min(last as i32), [u, v]);
        Some(Footprints { near, far: Some((far, fraction.into())) })
    }
}

/// Each lane on its own: where filters are mixed, or coordinates have no value.
#[cold]
#[inline(never)]
fn sample_each(
    texture: &Texture,
    [u, v]: [[f32; LANES]; 2],
    texels_squared: [f32; LANES],
    count: usize,
) -> [[f32; 4]; LANES] {
    let mut colors = [[0.0; 4]; LANES];
    for lane in 0..count {
        colors[lane] = texture.sample_scaled(Vec2::new(u[lane], v[lane]), texels_squared[lane]).to_array();
    }
    colors
}

/// As [`pellucid_core::texture::log2`].
#[inline(always)]
fn log2<S: Simd>(simd: S, value: f32x8<S>) -> f32x8<S> {
    let bits: i32x8<S> = value.bitcast();
    let exponent = (bits >> 23) - 127;
    let mantissa: f32x8<S> = ((bits & 0x007f_ffff) | i32x8::splat(simd, 0x3f80_0000)).bitcast();
    exponent.to_float::<f32x8<S>>() + (mantissa - 1.0)
}

/// The texels around each of eight coordinates.
pub(crate) struct Footprints<'a> {
    near: LevelFootprints<'a>,
    /// Those on the next smaller level, and how far each colour is on the way there.
    far: Option<(LevelFootprints<'a>, [f32; LANES])>,
}

impl Footprints<'_> {
    /// The alphas of the first `count`.
    #[inline(always)]
    pub(crate) fn alphas<S: Simd>(&self, simd: S, count: usize) -> f32x8<S> {
        let near = self.near.alphas(simd, count);
        let Some((far, fraction)) = &self.far else { return near };
        near + (far.alphas(simd, count) - near) * f32x8::load_array(simd, *fraction)
    }
}

/// The four texels around each of eight coordinates, each on a level of its own.
struct LevelFootprints<'a> {
    levels: &'a [MipLevel],
    /// Whether no texel is translucent.
    is_opaque: bool,
    level: [i32; LANES],
    /// Places in the level: top left, top right, bottom left, bottom right.
    places: [[i32; LANES]; 4],
    /// The shares of the texels to the right and below.
    across: [f32; LANES],
    down: [f32; LANES],
}

impl<'a> LevelFootprints<'a> {
    #[inline(always)]
    fn new<S: Simd>(simd: S, texture: &'a Texture, level: i32x8<S>, [u, v]: [f32x8<S>; 2]) -> Self {
        let levels = texture.levels();
        let sampler = texture.sampler();
        // Each level is half as large as the one before.
        let width = (i32x8::splat(simd, levels[0].width as i32) >> level).max(1);
        let height = (i32x8::splat(simd, levels[0].height as i32) >> level).max(1);
        let (left, right, across) = texel_pair(simd, u, width, sampler.wrap_u);
        let (top, bottom, down) = texel_pair(simd, v, height, sampler.wrap_v);
        let (top, bottom) = (top * width, bottom * width);
        Self {
            levels,
            is_opaque: texture.is_opaque(),
            level: level.into(),
            places: [(top + left).into(), (top + right).into(), (bottom + left).into(), (bottom + right).into()],
            across: across.into(),
            down: down.into(),
        }
    }

    /// The colour of one: its texels, weighted by distance. All channels together, so that what comes from the table of
    /// values stays in registers.
    #[inline(always)]
    fn color<S: Simd, const OPAQUE: bool>(&self, simd: S, values: &TexelValues, lane: usize) -> f32x4<S> {
        let texels: &[[u8; 4]] = &self.levels[self.level[lane] as usize].texels;
        let top_left = texel::<S, OPAQUE>(simd, values, texels[self.places[0][lane] as usize]);
        let top_right = texel::<S, OPAQUE>(simd, values, texels[self.places[1][lane] as usize]);
        let bottom_left = texel::<S, OPAQUE>(simd, values, texels[self.places[2][lane] as usize]);
        let bottom_right = texel::<S, OPAQUE>(simd, values, texels[self.places[3][lane] as usize]);
        let above = top_left + (top_right - top_left) * self.across[lane];
        let below = bottom_left + (bottom_right - bottom_left) * self.across[lane];
        above + (below - above) * self.down[lane]
    }

    /// The alphas of the first `count`, as [`Self::color`] has them.
    #[inline(always)]
    fn alphas<S: Simd>(&self, simd: S, count: usize) -> f32x8<S> {
        let values = TexelValues::get();
        let mut corners = [[0.0; LANES]; 4];
        for lane in 0..count {
            let texels: &[[u8; 4]] = &self.levels[self.level[lane] as usize].texels;
            for (corner, places) in corners.iter_mut().zip(&self.places) {
                corner[lane] = values.alpha[texels[places[lane] as usize][3] as usize];
            }
        }
        let [top_left, top_right, bottom_left, bottom_right] = corners;
        let (top_left, top_right) = (f32x8::load_array(simd, top_left), f32x8::load_array(simd, top_right));
        let (bottom_left, bottom_right) = (f32x8::load_array(simd, bottom_left), f32x8::load_array(simd, bottom_right));
        let across = f32x8::load_array(simd, self.across);
        let above = top_left + (top_right - top_left) * across;
        let below = bottom_left + (bottom_right - bottom_left) * across;
        above + (below - above) * f32x8::load_array(simd, self.down)
    }

    /// The colours of the first `count`, channel by channel.
    #[inline(always)]
    fn colors<S: Simd>(&self, simd: S, count: usize) -> [f32x8<S>; 4] {
        if self.is_opaque { self.colors_of::<S, true>(simd, count) } else { self.colors_of::<S, false>(simd, count) }
    }

    #[inline(always)]
    fn colors_of<S: Simd, const OPAQUE: bool>(&self, simd: S, count: usize) -> [f32x8<S>; 4] {
        let values = TexelValues::get();
        let mut colors = [[0.0; 4]; LANES];
        for (lane, color) in colors.iter_mut().enumerate().take(count) {
            *color = self.color::<S, OPAQUE>(simd, values, lane).into();
        }
        channels(simd, colors.as_flattened())
    }

    /// The colours of the first `count`, each so far on the way to that on another level.
    #[inline(always)]
    fn colors_between<S: Simd>(&self, simd: S, far: &Self, fraction: [f32; LANES], count: usize) -> [f32x8<S>; 4] {
        if self.is_opaque {
            self.colors_between_of::<S, true>(simd, far, fraction, count)
        } else {
            self.colors_between_of::<S, false>(simd, far, fraction, count)
        }
    }

    #[inline(always)]
    fn colors_between_of<S: Simd, const OPAQUE: bool>(
        &self,
        simd: S,
        far: &Self,
        fraction: [f32; LANES],
        count: usize,
    ) -> [f32x8<S>; 4] {
        let values = TexelValues::get();
        let mut colors = [[0.0; 4]; LANES];
        for lane in 0..count {
            let near = self.color::<S, OPAQUE>(simd, values, lane);
            let far = far.color::<S, OPAQUE>(simd, values, lane);
            colors[lane] = (near + (far - near) * fraction[lane]).into();
        }
        channels(simd, colors.as_flattened())
    }
}

/// Linear light and alpha of a texel.
#[inline(always)]
fn texel<S: Simd, const OPAQUE: bool>(simd: S, values: &TexelValues, texel: [u8; 4]) -> f32x4<S> {
    // Through a number, so that there is one load instead of four.
    let [red, green, blue, alpha] = u32::from_le_bytes(texel).to_le_bytes().map(usize::from);
    let alpha = if OPAQUE { 1.0 } else { values.alpha[alpha] };
    f32x4::load_array(simd, [values.linear[red], values.linear[green], values.linear[blue], alpha])
}

/// Colours channel by channel.
#[inline(always)]
pub(crate) fn channels<S: Simd>(simd: S, colors: &[f32]) -> [f32x8<S>; 4] {
    let (low, high) = colors.split_at(LANES * 2);
    let [red, green, blue, alpha] = f32x4::load_four_interleaved(simd, low);
    let [high_red, high_green, high_blue, high_alpha] = f32x4::load_four_interleaved(simd, high);
    [red.combine(high_red), green.combine(high_green), blue.combine(high_blue), alpha.combine(high_alpha)]
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
