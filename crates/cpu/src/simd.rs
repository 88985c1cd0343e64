//! The SIMD levels there are. The picture is the same at any of them: no operation is used whose result differs between
//! levels (no fused multiply-add, no approximations), and none that depends on the number of lanes.

pub use fearless_simd::Level;
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
use fearless_simd::i32x4;
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
use fearless_simd::{Avx2, SimdInto};
use fearless_simd::{
    Bytes, Select, Simd, SimdBase, SimdCombine, SimdFloat, SimdInt, SimdInterleaved, SimdNarrow, SimdSplit, SimdWiden,
};
use fearless_simd::{f32x4, f32x8, f64x4, f64x8, i32x8, u32x8, u32x16};
use pellucid_core::shading::AMBIENT;
#[cfg(target_arch = "x86")]
use std::arch::x86::{
    _mm256_castpd_ps, _mm256_castps_pd, _mm256_cvtepi32_pd, _mm256_permutevar8x32_epi32, _mm256_unpackhi_pd,
    _mm256_unpackhi_ps, _mm256_unpacklo_pd, _mm256_unpacklo_ps,
};
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{
    _mm256_castpd_ps, _mm256_castps_pd, _mm256_cvtepi32_pd, _mm256_permutevar8x32_epi32, _mm256_unpackhi_pd,
    _mm256_unpackhi_ps, _mm256_unpacklo_pd, _mm256_unpacklo_ps,
};

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

/// Eight integers in f64, which holds them exactly.
#[inline(always)]
pub(crate) fn wide<S: Simd>(values: i32x8<S>) -> f64x8<S> {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(avx2) = values.simd.level().as_avx2() {
        let (low, high) = i32x8::load_array(avx2, values.into()).split();
        let (low, high) = (converted(avx2, low), converted(avx2, high));
        return f64x8::load_array(values.simd, low.combine(high).into());
    }
    let (low, high) = values.widen();
    low.to_float::<f64x4<S>>().combine(high.to_float::<f64x4<S>>())
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

/// What there is for each lane. Written out, so that it goes to registers: vectors that are loaded from where their lanes
/// have just been stored wait for it.
#[inline(always)]
pub(crate) fn each_lane<T>(of: impl Fn(usize) -> T) -> [T; 8] {
    [of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7)]
}

/// 0 to 7.
#[inline(always)]
pub(crate) fn lane_numbers<S: Simd>(simd: S) -> u32x8<S> {
    u32x8::load_array(simd, each_lane(|lane| lane as u32))
}

/// The first and the second numbers of eight pairs.
#[inline(always)]
pub(crate) fn unzip<S: Simd, V: SimdBase<S>>(simd: S, pairs: [[V::Element; 2]; 8]) -> [V; 2] {
    let (low, high) = pairs.as_flattened().split_at(8);
    V::from_slice(simd, low).deinterleave(V::from_slice(simd, high)).into()
}

/// Eight rows of four numbers, column by column.
#[inline(always)]
pub(crate) fn columns<S: Simd>(simd: S, all: &[[f32; 4]]) -> [f32x8<S>; 4] {
    let all = &all.as_chunks::<8>().0[0];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(avx2) = simd.level().as_avx2() {
        let row = |number: usize| f32x4::load_array_ref(avx2, &all[number]);
        let pairs = [row(0).combine(row(4)), row(1).combine(row(5)), row(2).combine(row(6)), row(3).combine(row(7))];
        let [a, b, c, d] = transposed(avx2, pairs);
        return [
            f32x8::load_array(simd, a.into()),
            f32x8::load_array(simd, b.into()),
            f32x8::load_array(simd, c.into()),
            f32x8::load_array(simd, d.into()),
        ];
    }
    let (low, high) = all.as_flattened().split_at(16);
    let ([a, b, c, d], [high_a, high_b, high_c, high_d]) =
        (f32x4::load_four_interleaved(simd, low), f32x4::load_four_interleaved(simd, high));
    [a.combine(high_a), b.combine(high_b), c.combine(high_c), d.combine(high_d)]
}

/// Four columns of eight numbers, row by row.
#[inline(always)]
pub(crate) fn rows<S: Simd>(simd: S, [a, b, c, d]: [f32x8<S>; 4], all: &mut [[f32; 4]]) {
    let all = &mut all.as_chunks_mut::<8>().0[0];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(avx2) = simd.level().as_avx2() {
        let columns = [
            f32x8::load_array(avx2, a.into()),
            f32x8::load_array(avx2, b.into()),
            f32x8::load_array(avx2, c.into()),
            f32x8::load_array(avx2, d.into()),
        ];
        let (first, second) = all.split_at_mut(4);
        let [a, b, c, d] = transposed(avx2, columns);
        let [((a, e), (b, f)), ((c, g), (d, h))] = [(a.split(), b.split()), (c.split(), d.split())];
        a.store_slice(&mut first[0]);
        b.store_slice(&mut first[1]);
        c.store_slice(&mut first[2]);
        d.store_slice(&mut first[3]);
        e.store_slice(&mut second[0]);
        f.store_slice(&mut second[1]);
        g.store_slice(&mut second[2]);
        h.store_slice(&mut second[3]);
        return;
    }
    let (first, second) = all.as_flattened_mut().split_at_mut(16);
    let ((a, e), (b, f), (c, g), (d, h)) = (a.split(), b.split(), c.split(), d.split());
    f32x4::store_four_interleaved([a, b, c, d], first);
    f32x4::store_four_interleaved([e, f, g, h], second);
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

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
fearless_simd::kernel!(
    /// Each half, of four rows and four columns, with its rows as columns.
    #[inline(always)]
    fn transposed(avx2: Avx2, rows: [f32x8<Avx2>; 4]) -> [f32x8<Avx2>; 4] {
        let [a, b, c, d] = rows;
        let low_ab = _mm256_castps_pd(_mm256_unpacklo_ps(a.into(), b.into()));
        let high_ab = _mm256_castps_pd(_mm256_unpackhi_ps(a.into(), b.into()));
        let low_cd = _mm256_castps_pd(_mm256_unpacklo_ps(c.into(), d.into()));
        let high_cd = _mm256_castps_pd(_mm256_unpackhi_ps(c.into(), d.into()));
        [
            _mm256_castpd_ps(_mm256_unpacklo_pd(low_ab, low_cd)).simd_into(avx2),
            _mm256_castpd_ps(_mm256_unpackhi_pd(low_ab, low_cd)).simd_into(avx2),
            _mm256_castpd_ps(_mm256_unpacklo_pd(high_ab, high_cd)).simd_into(avx2),
            _mm256_castpd_ps(_mm256_unpackhi_pd(high_ab, high_cd)).simd_into(avx2),
        ]
    }
);

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
fearless_simd::kernel!(
    #[inline(always)]
    fn converted(avx2: Avx2, values: i32x4<Avx2>) -> f64x4<Avx2> {
        _mm256_cvtepi32_pd(values.into()).simd_into(avx2)
    }
);
