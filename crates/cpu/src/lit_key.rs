//! A fragment's depth and brightness in one number, that orders like the depth and has room for the order of equal ones.
//!
//! From the top: 0, 30 bits of depth (those of an f32 up to 1), [`RANK_BITS`] of rank, [`LIGHT_BITS`] of brightness.
//! Such a number is a key itself: once sorted, everything that blends fragments of one colour is in it.

use fearless_simd::{Bytes, Select, Simd, SimdBase, SimdCombine};
use fearless_simd::{f32x8, i32x8, mask32x8, u32x8, u64x8};
use pellucid_core::meshlets::LANES;
use pellucid_core::shading::AMBIENT;

use crate::networks::Bits;
use crate::simd::words;

/// Bits of brightness, which is at least [`AMBIENT`] and less than 2: a normal so short that its square is rounded much may
/// give more than 1.
const LIGHT_BITS: u32 = 25;

/// Bits of a fragment's place among those of its pixel in draw order, from 1 on: later drawn ones are in front of others as
/// deep. 0 where it is not known yet.
pub(crate) const RANK_BITS: u32 = 8;

/// Fragments that a pixel may have for all to have a rank.
pub(crate) const MOST_RANKS: u32 = (1 << RANK_BITS) - 1;

/// Where a key has its rank.
pub(crate) const RANK: Bits = Bits { first: LIGHT_BITS, count: RANK_BITS };

const DEPTH_SHIFT: u32 = RANK_BITS + LIGHT_BITS;

/// Bits of the number that is the least brightness. One less is the brightness of no fragment.
const LEAST_LIGHT: u32 = AMBIENT.to_bits();

/// A key is less than infinity, as an f64 of the same bits.
const _: () = assert!(((1.0_f32.to_bits() as u64 + 1) << DEPTH_SHIFT) <= f64::INFINITY.to_bits());

const _: () = assert!(2.0_f32.to_bits() - LEAST_LIGHT < 1 << LIGHT_BITS);

/// Depths and brightnesses as keys without rank.
#[inline(always)]
pub(crate) fn pack<S: Simd>(depth: f32x8<S>, light: f32x8<S>, keys: &mut [u64; LANES]) {
    let light = light.bitcast::<u32x8<S>>() - (LEAST_LIGHT - 1);
    let depth = depth.bitcast::<u32x8<S>>() << (DEPTH_SHIFT - u32::BITS);
    store_halves([light, depth], keys);
}

/// The depths and brightnesses of keys without rank.
#[inline(always)]
pub(crate) fn unpack<S: Simd>(simd: S, keys: &[u64; LANES]) -> [f32x8<S>; 2] {
    let [light, depth] = halves(simd, keys);
    [(depth >> (DEPTH_SHIFT - u32::BITS)).bitcast(), (light + (LEAST_LIGHT - 1)).bitcast()]
}

/// A rank, to be added to a key that has none.
#[inline(always)]
pub(crate) fn rank(rank: u32) -> u64 {
    u64::from(rank) << LIGHT_BITS
}

/// The depth of a key.
#[inline(always)]
pub(crate) fn depth(key: u64) -> f32 {
    f32::from_bits((key >> DEPTH_SHIFT) as u32)
}

/// The brightness of a key.
#[inline(always)]
pub(crate) fn light(key: u64) -> f32 {
    f32::from_bits((key & ((1 << LIGHT_BITS) - 1)) as u32 + (LEAST_LIGHT - 1))
}

/// The brightnesses of keys, and where there is a fragment: a key that is 0 is none, and dark.
#[inline(always)]
pub(crate) fn lights<S: Simd>(simd: S, keys: &[u64; LANES]) -> (f32x8<S>, mask32x8<S>) {
    let [light, _] = halves(simd, keys);
    let light: i32x8<S> = (light & ((1 << LIGHT_BITS) - 1)).bitcast();
    let is_there = light.simd_gt(0);
    let zero = f32x8::splat(simd, 0.0);
    (is_there.select((light + (LEAST_LIGHT as i32 - 1)).bitcast(), zero), is_there)
}

/// The lower and the upper halves of keys.
#[inline(always)]
pub(crate) fn halves<S: Simd>(simd: S, keys: &[u64; LANES]) -> [u32x8<S>; 2] {
    in_order(words(u64x8::load_array_ref(simd, keys).bitcast()))
}

/// Stores keys of these lower and upper halves.
#[inline(always)]
pub(crate) fn store_halves<S: Simd>(halves: [u32x8<S>; 2], keys: &mut [u64; LANES]) {
    let [first, second] = in_order(halves);
    let (low, high) = first.interleave(second);
    low.combine(high).bitcast::<u64x8<S>>().store_array(keys);
}

/// The lower and the upper half of a number as they lie in memory, or the other way round.
#[inline(always)]
fn in_order<T>([low, high]: [T; 2]) -> [T; 2] {
    if cfg!(target_endian = "little") { [low, high] } else { [high, low] }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{SimdMask, dispatch};
    use glam::Vec3A;
    use pellucid_core::shading;

    use super::*;
    use crate::simd::levels;

    const DEPTHS: [f32; LANES] = [0.0, 1e-45, 1e-39, 0.1, 0.25, 0.5, 0.999_999_9, 1.0];

    #[test]
    fn depths_and_lights_come_back_and_keys_order_like_depths() {
        // Squares of these are rounded so much that a normal seems longer than it is.
        let slight = [3.9e-23, 4.5e-23].map(|z| shading::light(Vec3A::new(2.6e-23, 0.0, z)));
        let lights = [AMBIENT, AMBIENT.next_up(), 0.6, 1.0, 1.0_f32.next_up(), slight[0], slight[1], 1.99];
        for (_, level) in levels() {
            let mut keys = [0; LANES];
            dispatch!(level, simd => {
                pack(f32x8::load_array(simd, DEPTHS), f32x8::load_array(simd, lights), &mut keys);
                let [depths_back, lights_back] = unpack(simd, &keys);
                assert_eq!([depths_back, lights_back].map(<[f32; LANES]>::from), [DEPTHS, lights]);
                let ranked = keys.map(|key| key | rank(MOST_RANKS));
                let (lights_back, is_there) = super::lights(simd, &ranked);
                assert_eq!((<[f32; LANES]>::from(lights_back), is_there.to_bitmask()), (lights, 0xFF));
                assert_eq!(super::lights(simd, &[0; LANES]).1.to_bitmask(), 0);
            });
            for (i, &key) in keys.iter().enumerate() {
                assert_eq!((depth(key), light(key)), (DEPTHS[i], lights[i]));
                assert!(i == 0 || keys[i - 1] | rank(MOST_RANKS) < key | rank(1));
                assert!(f64::from_bits(key | rank(MOST_RANKS)).is_finite());
            }
        }
    }

    /// However short: up to where squares vanish.
    #[test]
    fn no_normal_is_too_bright_for_a_key() {
        for i in 0..200_000 {
            let (x, z) = ((i % 447) as f32 * 3e-25, (i / 447) as f32 * 3e-25);
            assert!((AMBIENT..2.0).contains(&shading::light(Vec3A::new(x, 0.0, z))));
        }
    }
}
