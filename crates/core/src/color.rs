//! The sRGB transfer function. Everything inside is linear light; sRGB is met only where textures and colours come in
//! and where pictures go out.

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
    unorm8(srgb_from_linear(if linear > 0.0 { linear.min(1.0) } else { 0.0 }))
}

/// Encodes a value in 0..=1 as 8 bits, rounded to nearest; values outside are clamped, NaN counts as 0.
pub fn unorm8(value: f32) -> u8 {
    // `as` saturates and turns NaN into 0.
    (value * 255.0 + 0.5) as u8
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
        assert_eq!(srgb8_from_linear(-1.0), 0);
        assert_eq!(srgb8_from_linear(f32::NAN), 0);
        assert_eq!(srgb8_from_linear(f32::INFINITY), 255);
    }
}
