//! The sRGB transfer function. Everything inside is linear light; sRGB is met only where textures and colours come in
//! and where pictures go out.

use std::sync::LazyLock;

/// Decodes one sRGB-encoded channel in 0..=1 to linear light in 0..=1.
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Encodes one linear channel in 0..=1 to sRGB in 0..=1.
pub fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Decodes an 8-bit sRGB channel to linear light.
pub fn linear_from_srgb8(encoded: u8) -> f32 {
    linear_from_srgb(f32::from(encoded) / 255.0)
}

/// Encodes a linear channel to 8-bit sRGB: clamped to 0..=1 (NaN counts as 0), rounded to nearest.
pub fn srgb8_from_linear(linear: f32) -> u8 {
    Srgb8Encoder::shared().encode(linear)
}

/// Encodes a value in 0..=1 as 8 bits, rounded to nearest; values outside are clamped, NaN counts as 0.
pub fn unorm8(value: f32) -> u8 {
    // `as` saturates and turns NaN into 0.
    (value * 255.0 + 0.5) as u8
}

/// [`srgb8_from_linear`] for many channels: a table instead of a power for each.
///
/// The range from 2^-13, which is black, to 1 is cut into buckets by exponent and the first seven bits of the mantissa.
/// None is as wide as a step of the encoding (which is 0.9 % of the value at least), so each holds one threshold at
/// most, and one comparison gives the exactly rounded result: the same on every machine, which `powf` is not.
#[derive(Debug)]
pub struct Srgb8Encoder {
    buckets: [Bucket; BUCKETS],
}

#[derive(Debug, Clone, Copy)]
struct Bucket {
    /// Values from here on are one greater.
    threshold: f32,
    /// The encoded value at the bucket's start.
    start: u8,
}

/// Bits of a float below those that number its bucket.
const BUCKET_SHIFT: u32 = 23 - 7;
/// 2^-13: below the first threshold, 0.5 / 255 / 12.92.
const FIRST: f32 = 1.0 / 8192.0;
const FIRST_BUCKET: u32 = FIRST.to_bits() >> BUCKET_SHIFT;
const BUCKETS: usize = ((1f32.to_bits() >> BUCKET_SHIFT) - FIRST_BUCKET) as usize;

impl Srgb8Encoder {
    /// The one there is.
    pub fn shared() -> &'static Self {
        static SHARED: LazyLock<Srgb8Encoder> = LazyLock::new(Srgb8Encoder::new);
        &SHARED
    }

    fn new() -> Self {
        let thresholds: Vec<f32> = (1..=255).map(least_linear_of).collect();
        let buckets = std::array::from_fn(|i| {
            let first_bits = (FIRST_BUCKET + i as u32) << BUCKET_SHIFT;
            let start = thresholds.partition_point(|&threshold| threshold <= f32::from_bits(first_bits));
            Bucket { threshold: thresholds.get(start).copied().unwrap_or(f32::INFINITY), start: start as u8 }
        });
        Self { buckets }
    }

    /// Encodes a linear channel to 8-bit sRGB: clamped to 0..=1 (NaN counts as 0), rounded to nearest.
    #[inline]
    pub fn encode(&self, linear: f32) -> u8 {
        if linear >= FIRST {
            let number = (linear.to_bits() >> BUCKET_SHIFT) - FIRST_BUCKET;
            match self.buckets.get(number as usize) {
                Some(bucket) => bucket.start + u8::from(linear >= bucket.threshold),
                None => 255,
            }
        } else {
            // NaN too.
            0
        }
    }
}

/// The least linear value that rounds to `encoded`.
fn least_linear_of(encoded: u8) -> f32 {
    let srgb = (f64::from(encoded) - 0.5) / 255.0;
    let linear = if srgb <= 0.04045 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) };
    let nearest = linear as f32;
    if f64::from(nearest) < linear { nearest.next_up() } else { nearest }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_8_bit_value_survives_the_round_trip() {
        for value in 0..=255 {
            assert_eq!(srgb8_from_linear(linear_from_srgb8(value)), value);
        }
    }

    #[test]
    fn values_out_of_range_are_clamped() {
        for black in [-1.0, -0.0, 0.0, f32::MIN_POSITIVE, f32::NAN, -f32::NAN, f32::NEG_INFINITY] {
            assert_eq!(srgb8_from_linear(black), 0, "{black}");
        }
        for white in [1.0, 1f32.next_up(), 2.0, f32::MAX, f32::INFINITY] {
            assert_eq!(srgb8_from_linear(white), 255, "{white}");
        }
    }

    /// The result as the transfer function states it, in double precision.
    fn by_definition(linear: f32) -> u8 {
        let linear = f64::from(linear);
        let srgb = if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        (srgb * 255.0 + 0.5) as u8
    }

    /// Between two edges of buckets or thresholds the encoder is constant, and the definition rises; so agreement at
    /// both sides of every edge is agreement for every float.
    #[test]
    fn the_table_equals_the_definition_for_every_float() {
        let bucket_edges = (0..=BUCKETS as u32).map(|i| f32::from_bits((FIRST_BUCKET + i) << BUCKET_SHIFT));
        let thresholds = (1..=255).map(least_linear_of);
        for edge in bucket_edges.chain(thresholds) {
            for linear in [edge.next_down(), edge] {
                assert_eq!(srgb8_from_linear(linear), by_definition(linear.min(1.0)), "{linear}");
            }
        }
    }

    #[test]
    fn no_bucket_holds_two_thresholds() {
        let mut numbers: Vec<u32> = (1..=255).map(|value| least_linear_of(value).to_bits() >> BUCKET_SHIFT).collect();
        numbers.dedup();
        assert_eq!(numbers.len(), 255);
    }

    #[test]
    fn single_precision_agrees_but_for_its_own_rounding() {
        for value in 1..=255u8 {
            let threshold = least_linear_of(value);
            assert_eq!(unorm8(srgb_from_linear(threshold * 1.000_01)), value);
            assert_eq!(unorm8(srgb_from_linear(threshold * 0.999_99)), value - 1);
        }
    }
}
