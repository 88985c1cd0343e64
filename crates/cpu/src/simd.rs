//! The SIMD levels there are. The picture is the same at any of them: no operation is used whose result differs between
//! levels (no fused multiply-add, no approximations), and none that depends on the number of lanes.

pub use fearless_simd::Level;

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
