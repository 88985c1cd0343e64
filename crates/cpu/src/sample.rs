//! Textures sampled at eight coordinates: their colours, or alphas alone. The operations are those of
//! [`Texture::sample_scaled`], in the same order.

use fearless_simd::{Bytes, Select, Simd, SimdBase, SimdFloat, SimdInt, SimdMask, f32x4, f32x8, i32x8, u32x8};
use glam::Vec2;
use pellucid_core::Texture;
use pellucid_core::texture::{AlphaQuads, Filter, TexelValues, Wrap};

use crate::simd::columns;

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
    /// The colours of the first `count`, channel by channel, as [`Texture::sample_scaled`]; alphas that are not wanted are 1.
    #[inline(always)]
    pub(crate) fn sample(&self, simd: S, texture: &Texture, count: usize, wants_alpha: bool) -> [f32x8<S>; 4] {
        let Some(Levels { near, far }) = self.levels(simd, texture, count) else {
            let colors = sample_each(texture, [self.u.into(), self.v.into()], self.texels_squared.into(), count);
            return columns(simd, &colors);
        };
        let near = Footprints::new(simd, texture, near, self);
        let is_opaque = texture.is_opaque() || !wants_alpha;
        match far {
            None if is_opaque => near.colors::<S, true>(simd, count),
            None => near.colors::<S, false>(simd, count),
            Some((far, fraction)) => {
                let far = Footprints::new(simd, texture, far, self);
                if is_opaque {
                    near.colors_between::<S, true>(simd, &far, fraction.into(), count)
                } else {
                    near.colors_between::<S, false>(simd, &far, fraction.into(), count)
                }
            }
        }
    }

    /// Alphas alone of the first `count`, which `quads` holds; `None` where filters are mixed, or coordinates have no value.
    #[inline(always)]
    pub(crate) fn alphas(&self, simd: S, texture: &Texture, quads: &AlphaQuads, count: usize) -> Option<f32x8<S>> {
        let Levels { near, far } = self.levels(simd, texture, count)?;
        let near = self.level_alphas(simd, texture, quads, near, count);
        let Some((far, fraction)) = far else { return Some(near) };
        Some(near + (self.level_alphas(simd, texture, quads, far, count) - near) * fraction)
    }

    /// Which levels the first `count` see; `None` where filters are mixed, or coordinates have no value.
    #[inline(always)]
    fn levels(&self, simd: S, texture: &Texture, count: usize) -> Option<Levels<S>> {
        let sampler = texture.sampler();
        let lanes = (1 << count) - 1;
        let odd = !self.u.is_finite() | !self.v.is_finite() | self.texels_squared.is_nan();
        let all_linear = sampler.magnify == Filter::Linear
            && sampler.minify == Filter::Linear
            && sampler.mip != Some(Filter::Nearest);
        if !all_linear || odd.to_bitmask() & lanes != 0 {
            return None;
        }
        let last = texture.levels().len() as f32 - 1.0;
        let minified = self.texels_squared.simd_gt(1.0);
        let zero = i32x8::splat(simd, 0);
        if sampler.mip.is_none() || minified.to_bitmask() & lanes == 0 {
            return Some(Levels { near: zero, far: None });
        }
        let level = minified.select((log2(simd, self.texels_squared) * 0.5).min(last), zero.to_float());
        let near: i32x8<S> = level.to_int();
        let fraction = level - near.to_float::<f32x8<S>>();
        if fraction.simd_gt(0.0).to_bitmask() & lanes == 0 {
            return Some(Levels { near, far: None });
        }
        Some(Levels { near, far: Some(((near + 1).min(last as i32), fraction)) })
    }

    /// The alphas on a level each; those beyond the first `count` may be anything.
    #[inline(always)]
    fn level_alphas(&self, simd: S, texture: &Texture, quads: &AlphaQuads, level: i32x8<S>, count: usize) -> f32x8<S> {
        let sampler = texture.sampler();
        let [width, height] = level_size(simd, texture, level);
        let (left, across) = texel_before(self.u, width, sampler.wrap_u);
        let (top, down) = texel_before(self.v, height, sampler.wrap_v);
        let columns = if sampler.wrap_u == Wrap::MirroredRepeat { width * 2 } else { width };
        let first = of_level(simd, level, |level| quads.first(level));
        let places: [i32; LANES] = (first + (top + 1) * (columns + 1) + (left + 1)).into();
        debug_assert!(places[..count].iter().all(|&place| quads.has(place as u32)));
        let found = u32x8::from_fn(simd, |lane| u32::from_le_bytes(quads.quad(places[lane] as u32))).bitcast();
        let (top_left, top_right) = (alpha(found), alpha(found >> 8));
        let (bottom_left, bottom_right) = (alpha(found >> 16), alpha(found >> 24));
        let above = top_left + (top_right - top_left) * across;
        let below = bottom_left + (bottom_right - bottom_left) * across;
        above + (below - above) * down
    }
}

/// Which levels eight coordinates are sampled on.
struct Levels<S: Simd> {
    near: i32x8<S>,
    /// The next smaller one, and how far each colour is on the way there.
    far: Option<(i32x8<S>, f32x8<S>)>,
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

/// The four texels around each of eight coordinates, each on a level of its own.
struct Footprints<'a> {
    texels: &'a [[u8; 4]],
    /// Places among the texels: top left, top right, bottom left, bottom right.
    places: [[i32; LANES]; 4],
    /// The shares of the texels to the right and below.
    across: [f32; LANES],
    down: [f32; LANES],
}

impl<'a> Footprints<'a> {
    #[inline(always)]
    fn new<S: Simd>(simd: S, texture: &'a Texture, level: i32x8<S>, at: &OnTexture<S>) -> Self {
        let sampler = texture.sampler();
        let [width, height] = level_size(simd, texture, level);
        let (left, right, across) = texel_pair(simd, at.u, width, sampler.wrap_u);
        let (top, bottom, down) = texel_pair(simd, at.v, height, sampler.wrap_v);
        let first = of_level(simd, level, |level| texture.levels()[level].first_texel);
        let (top, bottom) = (top * width + first, bottom * width + first);
        Self {
            texels: texture.texels(),
            places: [(top + left).into(), (top + right).into(), (bottom + left).into(), (bottom + right).into()],
            across: across.into(),
            down: down.into(),
        }
    }

    /// The colour of one: its texels, weighted by distance. All channels together, so that what comes from the table of
    /// values stays in registers.
    #[inline(always)]
    fn color<S: Simd, const OPAQUE: bool>(&self, simd: S, values: &TexelValues, lane: usize) -> f32x4<S> {
        let texels = self.texels;
        let top_left = texel::<S, OPAQUE>(simd, values, texels[self.places[0][lane] as usize]);
        let top_right = texel::<S, OPAQUE>(simd, values, texels[self.places[1][lane] as usize]);
        let bottom_left = texel::<S, OPAQUE>(simd, values, texels[self.places[2][lane] as usize]);
        let bottom_right = texel::<S, OPAQUE>(simd, values, texels[self.places[3][lane] as usize]);
        let above = top_left + (top_right - top_left) * self.across[lane];
        let below = bottom_left + (bottom_right - bottom_left) * self.across[lane];
        above + (below - above) * self.down[lane]
    }

    /// The colours of the first `count`, channel by channel.
    #[inline(always)]
    fn colors<S: Simd, const OPAQUE: bool>(&self, simd: S, count: usize) -> [f32x8<S>; 4] {
        let values = TexelValues::get();
        let mut colors = [[0.0; 4]; LANES];
        for (lane, color) in colors.iter_mut().enumerate().take(count) {
            *color = self.color::<S, OPAQUE>(simd, values, lane).into();
        }
        Self::channels_of::<S, OPAQUE>(simd, &colors)
    }

    #[inline(always)]
    fn channels_of<S: Simd, const OPAQUE: bool>(simd: S, colors: &[[f32; 4]; LANES]) -> [f32x8<S>; 4] {
        let [red, green, blue, alpha] = columns(simd, colors);
        [red, green, blue, if OPAQUE { f32x8::splat(simd, 1.0) } else { alpha }]
    }

    /// The colours of the first `count`, each so far on the way to that on another level.
    #[inline(always)]
    fn colors_between<S: Simd, const OPAQUE: bool>(
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
        Self::channels_of::<S, OPAQUE>(simd, &colors)
    }
}

/// Linear light and alpha of a texel; no alpha where all are opaque.
#[inline(always)]
fn texel<S: Simd, const OPAQUE: bool>(simd: S, values: &TexelValues, texel: [u8; 4]) -> f32x4<S> {
    // Through a number, so that there is one load instead of four.
    let [red, green, blue, alpha] = u32::from_le_bytes(texel).to_le_bytes().map(usize::from);
    let alpha = if OPAQUE { 0.0 } else { values.alpha[alpha] };
    f32x4::load_array(simd, [values.linear[red], values.linear[green], values.linear[blue], alpha])
}

/// Texels along the sides of levels, each half as large as the one before.
#[inline(always)]
fn level_size<S: Simd>(simd: S, texture: &Texture, level: i32x8<S>) -> [i32x8<S>; 2] {
    let full_size = &texture.levels()[0];
    let width = i32x8::splat(simd, full_size.width as i32) >> level;
    let height = i32x8::splat(simd, full_size.height as i32) >> level;
    [width.max(1), height.max(1)]
}

/// What there is for each lane's level. Neighbours are mostly on one.
#[inline(always)]
fn of_level<S: Simd>(simd: S, level: i32x8<S>, of: impl Fn(usize) -> u32) -> i32x8<S> {
    let levels: [i32; LANES] = level.into();
    if level.simd_eq(levels[0]).all_true() {
        return i32x8::splat(simd, of(levels[0] as usize) as i32);
    }
    i32x8::load_array(simd, levels.map(|level| of(level as usize) as i32))
}

/// The alpha in the lowest byte, as [`TexelValues`] has it.
#[inline(always)]
fn alpha<S: Simd>(texel: i32x8<S>) -> f32x8<S> {
    (texel & 0xff).to_float::<f32x8<S>>() / 255.0
}

/// Along one axis of a level: the texels before and behind a coordinate, and the share of the latter.
#[inline(always)]
fn texel_pair<S: Simd>(simd: S, coordinate: f32x8<S>, size: i32x8<S>, wrap: Wrap) -> (i32x8<S>, i32x8<S>, f32x8<S>) {
    let (before, share_behind) = texel_before(coordinate, size, wrap);
    (wrap_texel(simd, before, size, wrap), wrap_texel(simd, before + 1, size, wrap), share_behind)
}

/// Along one axis of a level: the position of the texel before a coordinate, which may be off the level, and the share of the
/// one behind.
#[inline(always)]
fn texel_before<S: Simd>(coordinate: f32x8<S>, size: i32x8<S>, wrap: Wrap) -> (i32x8<S>, f32x8<S>) {
    let in_unit = match wrap {
        Wrap::Repeat => coordinate - floor(coordinate),
        Wrap::MirroredRepeat => coordinate - floor(coordinate * 0.5) * 2.0,
        Wrap::ClampToEdge => coordinate.max(0.0).min(1.0),
    };
    let at = in_unit * size.to_float::<f32x8<S>>() - 0.5;
    let before = floor(at);
    (before.to_int(), at - before)
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
