//! PSNR, SSIM and FLIP against independent implementations, on the pictures in `tests/data`; `tests/data/make.py` made
//! them and these numbers.

use glam::Vec4;
use pellucid::Image;
use pellucid_conformance::metrics::flip::{PIXELS_PER_DEGREE, map};
use pellucid_conformance::metrics::{self, Shown};

/// Name, PSNR in decibels and SSIM by scikit-image 0.26, mean and greatest FLIP by flip-evaluator 1.7.
const EXPECTED: [(&str, f64, f64, f64, f32); 5] = [
    ("reference", f64::INFINITY, 1.00000000, 0.00000000, 0.000000),
    ("one-pixel", 44.598689, 0.99710830, 0.00080556, 0.253372),
    ("noise", 26.588929, 0.81742737, 0.09050124, 0.309532),
    ("shifted", 20.441607, 0.63241747, 0.15691939, 0.506407),
    ("contrast", 17.751444, 0.64211222, 0.35636514, 0.675951),
];

fn stored(name: &str) -> Shown {
    let path = format!("{}/tests/data/{name}.png", env!("CARGO_MANIFEST_DIR"));
    let picture = image::open(path).unwrap().into_rgb8();
    Shown::new(picture.width(), picture.height(), picture.pixels().map(|pixel| pixel.0).collect())
}

#[test]
fn stored_pairs_measure_as_elsewhere() {
    let reference = stored("reference");
    for (name, psnr, ssim, flip_mean, flip_greatest) in EXPECTED {
        let picture = stored(name);
        let have = metrics::psnr(&reference, &picture);
        assert!(have == psnr || (have - psnr).abs() < 1e-5, "{name}: PSNR {have}, not {psnr}");
        let have = metrics::ssim(&reference, &picture).unwrap();
        assert!((have - ssim).abs() < 1e-7, "{name}: SSIM {have}, not {ssim}");
        // The other one computes in single precision.
        let have = metrics::flip(&reference, &picture);
        assert!((have - flip_mean).abs() < 1e-4 * flip_mean.max(0.01), "{name}: FLIP {have}, not {flip_mean}");
        let map = map(&reference, &picture, PIXELS_PER_DEGREE);
        let have = map.into_iter().fold(0.0, f32::max);
        assert!((have - flip_greatest).abs() < 1e-3, "{name}: greatest FLIP {have}, not {flip_greatest}");
    }
}

#[test]
fn black_and_white_are_as_far_apart_as_can_be() {
    let [black, white] = [0, 255].map(|value| Shown::new(20, 20, vec![[value; 3]; 400]));
    assert_eq!(metrics::psnr(&black, &white), 0.0);
    assert!(metrics::ssim(&black, &white).unwrap() < 1e-3);
    // The largest HyAB distance is that of green and blue; black and white are a little nearer.
    let flip = metrics::flip(&black, &white);
    assert!((0.9..1.0).contains(&flip), "{flip}");
}

#[test]
fn pictures_of_any_size_are_measured() {
    for (width, height) in [(1, 1), (10, 400), (11, 11), (3, 1)] {
        let picture = Shown::new(width, height, vec![[90, 20, 200]; (width * height) as usize]);
        assert_eq!(metrics::psnr(&picture, &picture), f64::INFINITY);
        assert_eq!(metrics::flip(&picture, &picture), 0.0);
        let expected = if width.min(height) >= 11 { Some(1.0) } else { None };
        assert_eq!(metrics::ssim(&picture, &picture).map(|ssim| (ssim * 1e6).round() / 1e6), expected);
    }
}

#[test]
fn differences_are_in_steps_of_what_is_shown_and_heed_alpha() {
    let reference = Image::filled(2, 1, Vec4::new(0.0, 0.0, 0.0, 1.0));
    let mut image = reference.clone();
    image.pixels_mut()[1] = Vec4::new(0.0, 1.0, 0.5, 0.0);
    assert_eq!(metrics::differences(&reference, &image), [0, 255]);
    image.pixels_mut()[1] = Vec4::new(0.0, 0.0, 0.0, 0.5);
    assert_eq!(metrics::differences(&reference, &image), [0, 127]);
}
