//! The SIMD levels there are. The picture is the same at any of them: no operation is used whose result differs between
//! levels (no fused multiply-add, no approximations), and none that depends on the number of lanes.

pub use fearless_simd::Level;
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
use fearless_simd::{Avx2, SimdInto};
use fearless_simd::{Bytes, Select, Simd, SimdBase, SimdCombine, SimdFloat, SimdNarrow, SimdSplit, SimdWiden};
use fearless_simd::{f32x8, f64x8, i32x8, u32x8, u32x16};
use pellucid_core::shading::AMBIENT;
#[cfg(target_arch = "x86")]
use std::arch::x86::_mm256_permutevar8x32_epi32;
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::_mm256_permutevar8x32_epi32;

/// The levels this machine has, slowest first, with their names.
pub fn levels() -> Vec<(&'static str, Level)> {
    let best = Level::new();
    let mut levels = vec![("scalar", Level::fallback())];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        levels.extend(best.as_sse2().map(|simd| ("sse2", Level::Sse2(simd))));
        levels.extend(best.as_sse4_2().map(|simd| ("sse4.2", Level::Sse4_2(simd))));
        levels.extend(best.as_avx2().map(|simd| ("avx2", Level::Avx2(simd))));
        levels.extend(best.as_avx512().map(|simd| ("avx512", Level::Avx512(simd))));
    }
    #[cfg(target_arch = "aarch64")]
    levels.extend(best.as_neon().map(|simd| ("neon", Level::Neon(simd))));
    if levels.len() == 1 && !best.is_fallback() {
        levels.push(("best", best));
    }
    levels
}

/// Brightness of surfaces with these normals in camera space: [`pellucid_core::shading::light`], operation by operation.
#[inline(always)]
pub(crate) fn light<S: Simd, V: SimdFloat<S, Element = f32>>(simd: S, [x, y, z]: [V; 3]) -> V
where
    V::Mask: Select<V>,
{
    let length = ((x * x + y * y) + z * z).sqrt();
    let has_direction = length.simd_gt(V::splat(simd, 0.0)) & length.simd_lt(V::splat(simd, f32::INFINITY));
    let lambert = has_direction.select(z.abs() / length, V::splat(simd, 1.0));
    lambert * (1.0 - AMBIENT) + AMBIENT
}

/// Eight numbers in f64.
#[inline(always)]
pub(crate) fn widen<S: Simd>(values: f32x8<S>) -> f64x8<S> {
    let (low, high) = values.widen();
    low.combine(high)
}

/// Eight numbers rounded to nearest.
#[inline(always)]
pub(crate) fn narrow<S: Simd>(values: f64x8<S>) -> f32x8<S> {
    let (low, high) = values.split();
    low.narrow(high)
}

/// The lower and the upper words of eight numbers.
#[inline(always)]
pub(crate) fn words<S: Simd>(values: f64x8<S>) -> [u32x8<S>; 2] {
    let (low, high) = values.bitcast::<u32x16<S>>().split();
    low.deinterleave(high).into()
}

/// Which one of eight numbers each lane gets.
pub(crate) struct Lookup<S: Simd> {
    simd: S,
    numbers: u32x8<S>,
}

impl<S: Simd> Lookup<S> {
    /// By the low three bits of numbers.
    #[inline(always)]
    pub(crate) fn new(simd: S, numbers: u32x8<S>) -> Self {
        Self { simd, numbers }
    }

    #[inline(always)]
    pub(crate) fn words(&self, values: u32x8<S>) -> u32x8<S> {
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        if let Some(avx2) = self.simd.level().as_avx2() {
            let values = u32x8::load_array(avx2, values.into());
            let numbers = u32x8::load_array(avx2, self.numbers.into());
            return u32x8::load_array(self.simd, permuted(avx2, values, numbers).into());
        }
        let (values, numbers): ([u32; 8], [u32; 8]) = (values.into(), self.numbers.into());
        u32x8::from_fn(self.simd, |lane| values[numbers[lane] as usize % 8])
    }

    #[inline(always)]
    pub(crate) fn ints(&self, values: i32x8<S>) -> i32x8<S> {
        self.words(values.bitcast()).bitcast()
    }

    #[inline(always)]
    pub(crate) fn floats(&self, values: f32x8<S>) -> f32x8<S> {
        self.words(values.bitcast()).bitcast()
    }

    /// Of numbers in f64, by their words.
    #[inline(always)]
    pub(crate) fn wide(&self, [low, high]: [u32x8<S>; 2]) -> f64x8<S> {
        let (low, high) = self.words(low).interleave(self.words(high));
        low.combine(high).bitcast()
    }
}

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
fearless_simd::kernel!(
    #[inline(always)]
    fn permuted(avx2: Avx2, values: u32x8<Avx2>, numbers: u32x8<Avx2>) -> u32x8<Avx2> {
        _mm256_permutevar8x32_epi32(values.into(), numbers.into()).simd_into(avx2)
    }
);
