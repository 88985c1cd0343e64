//! Values of options: from text to numbers, colours and vectors. Each error says what is wrong and what would be right.

use glam::{Vec3, Vec4};
use pellucid::core::color::linear_from_srgb;
use pellucid::core::view::MAX_SIZE_PX;

/// Why a text is no value, as half a sentence.
pub(crate) type Wrong = String;

/// `1280x720`.
pub(crate) fn size(text: &str) -> Result<(u32, u32), Wrong> {
    let number = |text: &str| digits(text).then(|| text.parse::<u64>().unwrap_or(u64::MAX));
    let parsed = text.split_once(['x', 'X']).and_then(|(width, height)| Some((number(width)?, number(height)?)));
    let Some((width, height)) = parsed else {
        return Err("not a size; write width x height in pixels, such as 1280x720".into());
    };
    let in_range = |size: u64| u32::try_from(size).ok().filter(|size| (1..=MAX_SIZE_PX).contains(size));
    in_range(width)
        .zip(in_range(height))
        .ok_or_else(|| format!("width and height must each lie between 1 and {MAX_SIZE_PX} pixels"))
}

/// `x,y,z`.
pub(crate) fn vector(text: &str) -> Result<Vec3, Wrong> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|part| number(part.trim())).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(Vec3::new(x, y, z)),
        _ => Err("not a point; write three numbers without spaces, such as 0,1.5,-3".into()),
    }
}

/// A direction: a vector other than 0.
pub(crate) fn direction(text: &str) -> Result<Vec3, Wrong> {
    vector(text)?.try_normalize().ok_or_else(|| "not a direction; one of the three numbers must not be 0".into())
}

/// Degrees above 0 and below 180, as radians.
pub(crate) fn angle(text: &str) -> Result<f32, Wrong> {
    let degrees = number(text).filter(|&degrees| degrees > 0.0 && degrees < 180.0);
    // A hair below 180 degrees is pi once it is rounded.
    let radians = degrees.map(f32::to_radians).filter(|&radians| radians > 0.0 && radians < std::f32::consts::PI);
    radians.ok_or_else(|| "not an angle of view; it must be a number above 0 and below 180 degrees".into())
}

/// A number above 0.
pub(crate) fn length(text: &str) -> Result<f32, Wrong> {
    number(text).filter(|&length| length > 0.0).ok_or_else(|| "not a length; it must be a number above 0".into())
}

/// A number from 0 to 1.
pub(crate) fn opacity(text: &str) -> Result<f32, Wrong> {
    number(text)
        .filter(|opacity| (0.0..=1.0).contains(opacity))
        .ok_or_else(|| "not an opacity; it must be a number from 0 (invisible) to 1 (as the materials are)".into())
}

/// A share of a whole.
pub(crate) fn share(text: &str) -> Result<f32, Wrong> {
    number(text)
        .filter(|share| (0.0..=1.0).contains(share))
        .ok_or_else(|| "not a share; it must be a number from 0 to 1".into())
}

/// A whole number in a range, both ends included.
pub(crate) fn whole(text: &str, least: u32, greatest: u32) -> Result<u32, Wrong> {
    let number = digits(text).then(|| text.parse().ok()).flatten();
    number
        .filter(|number| (least..=greatest).contains(number))
        .ok_or_else(|| format!("it must be a whole number from {least} to {greatest}"))
}

/// Bytes: a number with an optional K, M, G or T, each 1024 times the one before.
pub(crate) fn bytes(text: &str) -> Result<u64, Wrong> {
    let (number, shift) = match text.char_indices().next_back() {
        Some((end, unit)) if unit.is_ascii_alphabetic() => {
            let power = "KMGT".find(unit.to_ascii_uppercase()).map_or(0, |power| power as u32 + 1);
            (&text[..end], if power > 0 { Some(10 * power) } else { None })
        }
        _ => (text, Some(0)),
    };
    let factor = shift.map(|shift| 1u64 << shift);
    let count = digits(number).then(|| number.parse::<u64>().ok()).flatten();
    count
        .zip(factor)
        .and_then(|(count, factor)| count.checked_mul(factor))
        .filter(|&bytes| bytes > 0)
        .ok_or_else(|| "not an amount of memory; write bytes with K, M or G, such as 512M".into())
}

/// A CSS colour as linear light with premultiplied alpha; `none` is nothing.
pub(crate) fn color(text: &str) -> Result<Vec4, Wrong> {
    if text.eq_ignore_ascii_case("none") {
        return Ok(Vec4::ZERO);
    }
    let color = csscolorparser::parse(text)
        .map_err(|_| "not a colour; write a CSS name such as white, hex such as #20242c, or none".to_owned())?
        .clamp();
    let linear = Vec3::from([color.r, color.g, color.b].map(linear_from_srgb));
    Ok((linear * color.a).extend(color.a))
}

fn number(text: &str) -> Option<f32> {
    text.parse().ok().filter(|number: &f32| number.is_finite())
}

fn digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(size("1280x720"), Ok((1280, 720)));
        assert_eq!(size("1X16384"), Ok((1, 16384)));
        for bad in ["", "abc", "x", "10", "10x", "x10", "-1x5", "+1x5", "1.5x2", "1x2x3", " 1x2"] {
            assert!(size(bad).unwrap_err().starts_with("not a size"), "{bad}");
        }
        for bad in ["0x10", "10x0", "16385x1", "1000000x1", "1x99999999999999999999999"] {
            assert!(size(bad).unwrap_err().contains("between 1 and 16384"), "{bad}");
        }
    }

    #[test]
    fn points_and_directions() {
        assert_eq!(vector("-1,2.5,3e1"), Ok(Vec3::new(-1.0, 2.5, 30.0)));
        assert_eq!(vector("1, 2, 3"), Ok(Vec3::new(1.0, 2.0, 3.0)));
        for bad in ["", "1,2", "1,2,3,4", "a,b,c", "1,,3", "nan,0,0", "inf,0,0", "1e99,0,0"] {
            assert!(vector(bad).is_err(), "{bad}");
        }
        assert_eq!(direction("0,0,5"), Ok(Vec3::Z));
        assert!(direction("0,0,0").is_err());
    }

    #[test]
    fn numbers_in_range() {
        assert_eq!(angle("90"), Ok(std::f32::consts::FRAC_PI_2));
        for bad in ["0", "180", "179.99999999", "-5", "nan", "x", "1e-45"] {
            assert!(angle(bad).is_err(), "{bad}");
        }
        assert_eq!((opacity("0"), opacity("1"), opacity("0.25")), (Ok(0.0), Ok(1.0), Ok(0.25)));
        for bad in ["-0.1", "2", "nan", "", "50%"] {
            assert!(opacity(bad).is_err(), "{bad}");
        }
        assert!(length("0").is_err() && length("-1").is_err() && length("inf").is_err());
        assert_eq!(whole("7", 1, 9), Ok(7));
        for bad in ["0", "10", "-1", "+7", "7.0", "", "99999999999"] {
            assert!(whole(bad, 1, 9).is_err(), "{bad}");
        }
    }

    #[test]
    fn amounts_of_memory() {
        for (text, amount) in [("1", 1), ("4k", 4096), ("512M", 512 << 20), ("2G", 2 << 30), ("1T", 1 << 40)] {
            assert_eq!(bytes(text), Ok(amount));
        }
        for bad in ["", "0", "0M", "M", "-1M", "1.5G", "5X", "512MB", "99999999999999999999", "99999999999G", "5é"] {
            assert!(bytes(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn colours_are_linear_and_premultiplied() {
        assert_eq!(color("none"), Ok(Vec4::ZERO));
        assert_eq!(color("white"), Ok(Vec4::ONE));
        assert_eq!(color("#000"), Ok(Vec4::new(0.0, 0.0, 0.0, 1.0)));
        let half = color("#ff808080").unwrap();
        let alpha = 128.0 / 255.0;
        assert!((half - Vec4::new(alpha, alpha * 0.21586, alpha * 0.21586, alpha)).abs().max_element() < 1e-5);
        let out_of_gamut = color("rgb(300 -20 0)").unwrap();
        assert_eq!(out_of_gamut, Vec4::new(1.0, 0.0, 0.0, 1.0));
        for bad in ["", "bleu", "#12", "#gggggg"] {
            assert!(color(bad).is_err(), "{bad}");
        }
    }
}
