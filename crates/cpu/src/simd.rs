//! The SIMD levels there are. The picture is the same at any of them: no operation is used whose result differs between
//! levels (no fused multiply-add, no approximations), and none that depends on the number of lanes.

use std::ops::{Add, Div, Mul, Sub};

pub use fearless_simd::Level;
use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdInt, SimdNarrow, SimdWiden, f32x16, f64x8, i32x16};
use pellucid_core::shading::AMBIENT;

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

/// Sixteen numbers in f64: what planes are made of.
#[derive(Clone, Copy)]
pub(crate) struct Wide<S: Simd>(f64x8<S>, f64x8<S>);

impl<S: Simd> Wide<S> {
    #[inline(always)]
    pub(crate) fn splat(simd: S, value: f64) -> Self {
        Self(f64x8::splat(simd, value), f64x8::splat(simd, value))
    }

    #[inline(always)]
    pub(crate) fn from_f32(values: f32x16<S>) -> Self {
        let (low, high) = values.widen();
        Self(low, high)
    }

    #[inline(always)]
    pub(crate) fn from_int(values: i32x16<S>) -> Self {
        let (low, high) = values.widen();
        Self(low.to_float(), high.to_float())
    }

    /// From integers below 2^24, which f32 holds exactly.
    #[inline(always)]
    pub(crate) fn from_small_int(values: i32x16<S>) -> Self {
        Self::from_f32(values.to_float())
    }

    /// Rounded to nearest.
    #[inline(always)]
    pub(crate) fn to_f32(self) -> f32x16<S> {
        self.0.narrow(self.1)
    }
}

impl<S: Simd> Add for Wide<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }
}

impl<S: Simd> Sub for Wide<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }
}

impl<S: Simd> Mul for Wide<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0, self.1 * other.1)
    }
}

impl<S: Simd> Div for Wide<S> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0 / other.0, self.1 / other.1)
    }
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
