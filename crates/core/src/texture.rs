//! Textures: 8-bit sRGB colour with straight alpha, mip-mapped, filtered in linear light.
//!
//! A level is chosen from analytic derivatives of the texture coordinates (OpenGL 4.6 specification, section 8.14), and
//! levels are made by an exact box filter in linear light, weighted by alpha, so that colours under transparent texels
//! do not bleed.

use std::sync::{LazyLock, OnceLock};

use glam::{Vec2, Vec4};

use crate::Error;
use crate::color::{linear_from_srgb8, srgb8_from_linear, unorm8};

/// Largest width or height of a texture, in texels.
pub const MAX_TEXTURE_SIZE_PX: u32 = 16_384;

/// Mip levels of the largest texture.
const MAX_LEVELS: usize = MAX_TEXTURE_SIZE_PX.ilog2() as usize + 1;

/// Most places of a texture of which the alphas around are gathered: they take 256 MiB.
pub const MAX_ALPHA_QUADS: u64 = 1 << 26;

/// What lies beyond the edge of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Wrap {
    /// The texture again.
    #[default]
    Repeat,
    /// The texture mirrored.
    MirroredRepeat,
    /// The edge texel.
    ClampToEdge,
}

/// How texels become a colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Filter {
    /// The one texel the coordinate lies in.
    Nearest,
    /// Four texels weighted by distance.
    #[default]
    Linear,
}

/// How a texture is sampled (glTF 2.0, section 5.26).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Sampler {
    /// Beyond left and right edge.
    pub wrap_u: Wrap,
    /// Beyond top and bottom edge.
    pub wrap_v: Wrap,
    /// Where a texel covers more than a pixel.
    pub magnify: Filter,
    /// Where a pixel covers more than a texel, within a mip level.
    pub minify: Filter,
    /// Between mip levels; `None`: the full-size level only.
    pub mip: Option<Filter>,
}

impl Default for Sampler {
    /// Repeating, linear everywhere.
    fn default() -> Self {
        Self {
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            magnify: Filter::Linear,
            minify: Filter::Linear,
            mip: Some(Filter::Linear),
        }
    }
}

/// One mip level: RGBA, 8 bits a channel, sRGB-encoded colour, straight alpha.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MipLevel {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Number of its first texel among those of the texture.
    pub first_texel: u32,
}

impl MipLevel {
    fn texel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// A texture with all its mip levels.
#[derive(Debug, Clone)]
pub struct Texture {
    levels: Vec<MipLevel>,
    texels: Vec<[u8; 4]>,
    is_opaque: bool,
    sampler: Sampler,
    alpha_quads: OnceLock<Option<AlphaQuads>>,
}

/// The alphas of the four texels around each place between texels side by side: what an alpha test needs of a level, in one
/// read instead of four.
#[derive(Debug, Clone)]
pub struct AlphaQuads {
    /// Number of each level's first quad.
    firsts: [u32; MAX_LEVELS.next_power_of_two()],
    /// Top left, top right, bottom left, bottom right, wrapped.
    quads: Vec<[u8; 4]>,
}

/// What the 256 values of a texel's channel mean.
#[derive(Debug)]
pub struct TexelValues {
    /// Linear light of a colour channel.
    pub linear: [f32; 256],
    /// Alpha.
    pub alpha: [f32; 256],
}

static DECODER: LazyLock<TexelValues> = LazyLock::new(|| TexelValues {
    linear: std::array::from_fn(|i| linear_from_srgb8(i as u8)),
    alpha: std::array::from_fn(|i| i as f32 / 255.0),
});

impl TexelValues {
    /// The one table.
    #[inline]
    pub fn get() -> &'static Self {
        &DECODER
    }

    #[inline(always)]
    fn decode(&self, [r, g, b, a]: [u8; 4]) -> Vec4 {
        let linear = &self.linear;
        Vec4::new(linear[r as usize], linear[g as usize], linear[b as usize], self.alpha[a as usize])
    }
}

impl Texture {
    /// A texture from `width * height` RGBA texels, sRGB-encoded colour and straight alpha, rows from the top. Mip
    /// levels are made if the sampler uses them.
    ///
    /// # Errors
    /// [`Error::Texture`] if a side is 0 or above [`MAX_TEXTURE_SIZE_PX`], or the data do not fit the size.
    pub fn new(width: u32, height: u32, mut texels: Vec<[u8; 4]>, sampler: Sampler) -> Result<Self, Error> {
        let sides = 1..=MAX_TEXTURE_SIZE_PX;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(Error::Texture(format!(
                "{width} x {height} texels; a side must lie between 1 and {MAX_TEXTURE_SIZE_PX}"
            )));
        }
        if texels.len() != width as usize * height as usize {
            return Err(Error::Texture(format!("{} texels for {width} x {height}", texels.len())));
        }
        let levels = levels(width, height, sampler.mip.is_some());
        let texel_count: usize = levels.iter().map(MipLevel::texel_count).sum();
        texels.reserve_exact(texel_count - texels.len());
        for pair in levels.windows(2) {
            push_half(&pair[0], &pair[1], &mut texels);
        }
        let is_opaque = texels.iter().all(|texel| texel[3] == u8::MAX);
        Ok(Self { levels, texels, is_opaque, sampler, alpha_quads: OnceLock::new() })
    }

    /// All levels, the full size first.
    pub fn levels(&self) -> &[MipLevel] {
        &self.levels
    }

    /// The texels of all levels, the full size first, each level row by row from the top.
    pub fn texels(&self) -> &[[u8; 4]] {
        &self.texels
    }

    /// Those of one of its levels.
    pub fn level_texels(&self, level: &MipLevel) -> &[[u8; 4]] {
        &self.texels[level.first_texel as usize..][..level.texel_count()]
    }

    /// Whether every texel of every level is opaque.
    pub fn is_opaque(&self) -> bool {
        self.is_opaque
    }

    /// How it is sampled.
    pub fn sampler(&self) -> Sampler {
        self.sampler
    }

    /// The alphas around all places of all levels, which are gathered when first asked for; `None` if they are more than
    /// [`MAX_ALPHA_QUADS`].
    pub fn alpha_quads(&self) -> Option<&AlphaQuads> {
        self.alpha_quads.get_or_init(|| AlphaQuads::new(self)).as_ref()
    }

    /// The colour at texture coordinate `uv`, linear light and straight alpha, for a pixel over which the coordinate
    /// changes by `duv_dx` to the right and `duv_dy` downwards.
    pub fn sample(&self, uv: Vec2, duv_dx: Vec2, duv_dy: Vec2) -> Vec4 {
        let base = &self.levels[0];
        let size = Vec2::new(base.width as f32, base.height as f32);
        let (dx, dy) = (duv_dx * size, duv_dy * size);
        self.sample_scaled(uv, dx.length_squared().max(dy.length_squared()))
    }

    /// The colour at texture coordinate `uv`, for a pixel that covers so many texels of the full size along its longer
    /// side, squared.
    pub fn sample_scaled(&self, uv: Vec2, texels_squared: f32) -> Vec4 {
        let uv = if uv.is_finite() { uv } else { Vec2::ZERO };
        if texels_squared <= 1.0 || texels_squared.is_nan() {
            return self.sample_level(0, self.sampler.magnify, uv);
        }
        let Some(mip_filter) = self.sampler.mip else {
            return self.sample_level(0, self.sampler.minify, uv);
        };
        let last = self.levels.len() - 1;
        let level = (0.5 * log2(texels_squared)).min(last as f32);
        match mip_filter {
            Filter::Nearest => self.sample_level((level + 0.5) as usize, self.sampler.minify, uv),
            Filter::Linear => {
                let whole = level as usize;
                let fraction = level - whole as f32;
                let near = self.sample_level(whole, self.sampler.minify, uv);
                if fraction == 0.0 {
                    return near;
                }
                near + (self.sample_level((whole + 1).min(last), self.sampler.minify, uv) - near) * fraction
            }
        }
    }

    #[inline]
    fn sample_level(&self, level: usize, filter: Filter, uv: Vec2) -> Vec4 {
        let level = &self.levels[level];
        let texels = self.level_texels(level);
        let u = wrap_unit(uv.x, self.sampler.wrap_u) * level.width as f32;
        let v = wrap_unit(uv.y, self.sampler.wrap_v) * level.height as f32;
        let column = |x: i32| wrap_texel(x, level.width as i32, self.sampler.wrap_u);
        let row = |y: i32| wrap_texel(y, level.height as i32, self.sampler.wrap_v) * level.width as usize;
        let decoder = &*DECODER;
        let at = |row: usize, column: usize| decoder.decode(texels[row + column]);
        match filter {
            Filter::Nearest => at(row(floor(v) as i32), column(floor(u) as i32)),
            Filter::Linear => {
                let (u, v) = (u - 0.5, v - 0.5);
                let (x, y) = (floor(u), floor(v));
                let (fx, fy) = (u - x, v - y);
                let (left, right) = (column(x as i32), column(x as i32 + 1));
                let (top, bottom) = (row(y as i32), row(y as i32 + 1));
                let (top_left, bottom_left) = (at(top, left), at(bottom, left));
                let above = top_left + (at(top, right) - top_left) * fx;
                let below = bottom_left + (at(bottom, right) - bottom_left) * fx;
                above + (below - above) * fy
            }
        }
    }
}

impl AlphaQuads {
    fn new(texture: &Texture) -> Option<Self> {
        let Sampler { wrap_u, wrap_v, .. } = texture.sampler;
        let sides = |level: &MipLevel| [quads_along(level.width, wrap_u), quads_along(level.height, wrap_v)];
        let count: u64 =
            texture.levels.iter().map(sides).map(|[across, down]| u64::from(across) * u64::from(down)).sum();
        if count > MAX_ALPHA_QUADS {
            return None;
        }
        let mut firsts = [0; MAX_LEVELS.next_power_of_two()];
        let mut quads = Vec::with_capacity(count as usize);
        for (level, first) in texture.levels.iter().zip(&mut firsts) {
            *first = quads.len() as u32;
            let [across, down] = sides(level);
            let texels = texture.level_texels(level);
            let row = |y: i32| wrap_texel(y, level.height as i32, wrap_v) * level.width as usize;
            let column = |x: i32| wrap_texel(x, level.width as i32, wrap_u);
            let alpha = |row: usize, x: i32| texels[row + column(x)][3];
            for y in 0..down as i32 {
                let (top, bottom) = (row(y - 1), row(y));
                quads.extend(
                    (0..across as i32)
                        .map(|x| [alpha(top, x - 1), alpha(top, x), alpha(bottom, x - 1), alpha(bottom, x)]),
                );
            }
        }
        Some(Self { firsts, quads })
    }

    /// Where a level's quads begin. They lie row by row: from the one before the first texel to the one behind the last, or of
    /// mirrored textures to the one behind the last of the mirror image.
    #[inline(always)]
    pub fn first(&self, level: usize) -> u32 {
        self.firsts[level % MAX_LEVELS.next_power_of_two()]
    }

    /// Whether there is a quad at a place.
    pub fn has(&self, place: u32) -> bool {
        (place as usize) < self.quads.len()
    }

    /// The quad at a place; where there is none, one of alphas 0.
    #[inline(always)]
    pub fn quad(&self, place: u32) -> [u8; 4] {
        self.quads.get(place as usize).copied().unwrap_or_default()
    }
}

/// Quads along a side: from before the first texel to behind the last, of mirrored textures behind the last of the mirror image.
fn quads_along(texels: u32, wrap: Wrap) -> u32 {
    if wrap == Wrap::MirroredRepeat { texels * 2 + 1 } else { texels + 1 }
}

/// Base-2 logarithm of a number above 0, exact at powers of two and linear between them: the same bits on every machine
/// and in every shader, and near enough for a choice of mip level (at most 0.09 off).
pub fn log2(value: f32) -> f32 {
    let bits = value.to_bits();
    let exponent = (bits >> 23) as i32 - 127;
    let mantissa = f32::from_bits((bits & 0x007f_ffff) | 0x3f80_0000);
    exponent as f32 + (mantissa - 1.0)
}

/// The greatest whole number that is not above `t`. The standard one is a library call where the processor's own
/// instruction is not sure to be there.
#[inline(always)]
fn floor(t: f32) -> f32 {
    // From 2^23 on every f32 is whole.
    if t.abs() < 8_388_608.0 {
        let toward_zero = t as i32 as f32;
        if toward_zero > t { toward_zero - 1.0 } else { toward_zero }
    } else {
        t
    }
}

/// Brings a coordinate near 0..=1, so that it can be scaled to texels: whole repeats removed, mirrored halves unfolded
/// later by [`wrap_texel`].
fn wrap_unit(t: f32, wrap: Wrap) -> f32 {
    match wrap {
        Wrap::Repeat => t - floor(t),
        Wrap::MirroredRepeat => t - 2.0 * floor(t * 0.5),
        Wrap::ClampToEdge => t.clamp(0.0, 1.0),
    }
}

/// The texel that stands at position `i`, which lies outside the level by no more than [`wrap_unit`] leaves and one texel.
#[inline]
fn wrap_texel(i: i32, size: i32, wrap: Wrap) -> usize {
    let i = match wrap {
        Wrap::Repeat if i < 0 => i + size,
        Wrap::Repeat if i >= size => i - size,
        Wrap::Repeat => i,
        Wrap::MirroredRepeat if i < 0 || i >= 2 * size => 0,
        Wrap::MirroredRepeat if i >= size => 2 * size - 1 - i,
        Wrap::MirroredRepeat => i,
        Wrap::ClampToEdge => i.clamp(0, size - 1),
    };
    i as usize
}

/// The levels of a texture: the full size alone, or with it each side halved, rounded down, as long as one is longer than a texel.
fn levels(width: u32, height: u32, is_mip_mapped: bool) -> Vec<MipLevel> {
    let mut levels = vec![MipLevel { width, height, first_texel: 0 }];
    let mut last = levels[0];
    while is_mip_mapped && (last.width > 1 || last.height > 1) {
        last = MipLevel {
            width: (last.width / 2).max(1),
            height: (last.height / 2).max(1),
            first_texel: last.first_texel + last.width * last.height,
        };
        levels.push(last);
    }
    levels
}

/// Appends the texels of the level below the last one.
fn push_half(level: &MipLevel, half: &MipLevel, texels: &mut Vec<[u8; 4]>) {
    let columns = box_weights(level.width, half.width);
    let rows = box_weights(level.height, half.height);
    let decoder = &*DECODER;
    let first = level.first_texel as usize;
    for row in &rows {
        for column in &columns {
            let (mut weighted, mut plain, mut alpha) = (Vec4::ZERO, Vec4::ZERO, 0.0);
            for &(y, weight_y) in row {
                for &(x, weight_x) in column {
                    let weight = weight_x * weight_y;
                    let texel = decoder.decode(texels[first + y as usize * level.width as usize + x as usize]);
                    plain += texel * weight;
                    weighted += texel * (weight * texel.w);
                    alpha += weight * texel.w;
                }
            }
            let color = if alpha > 0.0 { weighted / alpha } else { plain };
            texels.push([
                srgb8_from_linear(color.x),
                srgb8_from_linear(color.y),
                srgb8_from_linear(color.z),
                unorm8(alpha),
            ]);
        }
    }
}

/// For each texel of a side halved from `from` to `to`, the texels it covers and the share of each.
fn box_weights(from: u32, to: u32) -> Vec<Vec<(u32, f32)>> {
    let scale = f64::from(from) / f64::from(to);
    (0..to)
        .map(|i| {
            let (start, end) = (f64::from(i) * scale, f64::from(i + 1) * scale);
            (start as u32..(end.ceil() as u32).min(from))
                .filter_map(|x| {
                    let covered = end.min(f64::from(x + 1)) - start.max(f64::from(x));
                    (covered > 1e-9).then_some((x, (covered / scale) as f32))
                })
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checker(sampler: Sampler) -> Texture {
        let (black, white) = ([0, 0, 0, 255], [255; 4]);
        Texture::new(2, 2, vec![black, white, white, black], sampler).unwrap()
    }

    #[test]
    fn mips_average_in_linear_light() {
        let texture = checker(Sampler::default());
        assert_eq!(texture.levels().len(), 2);
        // Half of linear white is sRGB 188, not 128.
        assert_eq!(texture.level_texels(&texture.levels()[1]), [[188, 188, 188, 255]]);
    }

    #[test]
    fn transparent_texels_do_not_bleed_into_mips() {
        let texture = Texture::new(2, 1, vec![[200, 0, 0, 255], [0, 255, 0, 0]], Sampler::default()).unwrap();
        assert_eq!(texture.level_texels(&texture.levels()[1]), [[200, 0, 0, 128]]);
    }

    #[test]
    fn odd_sides_lose_no_texel() {
        let texels = vec![[0, 0, 0, 255], [0, 0, 0, 255], [255, 255, 255, 255]];
        let texture = Texture::new(3, 1, texels, Sampler::default()).unwrap();
        let third = srgb8_from_linear(1.0 / 3.0);
        assert_eq!(texture.level_texels(&texture.levels()[1]), [[third, third, third, 255]]);
    }

    #[test]
    fn wraps_choose_the_texel_beyond_the_edge() {
        for (wrap, expected) in [
            (Wrap::Repeat, [3, 0, 1, 2, 3, 0, 1, 2, 3, 0]),
            (Wrap::MirroredRepeat, [0, 0, 1, 2, 3, 3, 2, 1, 0, 0]),
            (Wrap::ClampToEdge, [0, 0, 1, 2, 3, 3, 3, 3, 3, 3]),
        ] {
            let texels = (0..4).map(|i| [0, 0, 0, i]).collect();
            let sampler =
                Sampler { wrap_u: wrap, wrap_v: wrap, magnify: Filter::Nearest, minify: Filter::Nearest, mip: None };
            let texture = Texture::new(4, 1, texels, sampler).unwrap();
            for (i, &alpha) in (-1..).zip(&expected) {
                let uv = Vec2::new((i as f32 + 0.5) / 4.0, 0.5);
                let sampled = texture.sample(uv, Vec2::ZERO, Vec2::ZERO).w * 255.0;
                assert_eq!(sampled.round() as u8, alpha, "{wrap:?} at texel {i}");
            }
        }
    }

    #[test]
    fn minified_samples_come_from_the_level_that_fits() {
        let texture = checker(Sampler::default());
        let sharp = texture.sample(Vec2::splat(0.25), Vec2::ZERO, Vec2::ZERO);
        assert_eq!(sharp.x, 0.0);
        let far = texture.sample(Vec2::splat(0.25), Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0));
        assert!((far.x - 0.5).abs() < 0.01, "{far}");
    }

    #[test]
    fn absurd_coordinates_give_a_colour() {
        for value in [f32::NAN, f32::INFINITY, 1e38, -1e38, f32::MIN_POSITIVE] {
            for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
                let texture = checker(Sampler { wrap_u: wrap, wrap_v: wrap, ..Sampler::default() });
                for derivative in [0.0, 1.0, value] {
                    let color = texture.sample(Vec2::new(value, -value), Vec2::splat(derivative), Vec2::ZERO);
                    assert!(color.is_finite(), "{value} {derivative}");
                }
            }
        }
    }

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        assert!(Texture::new(0, 1, vec![], Sampler::default()).is_err());
        assert!(Texture::new(2, 2, vec![[0; 4]; 3], Sampler::default()).is_err());
        assert!(Texture::new(MAX_TEXTURE_SIZE_PX + 1, 1, vec![], Sampler::default()).is_err());
    }
}
