//! Structural similarity, as [`super::ssim`] states it.

use super::Shown;

const RADIUS: usize = 5;
const SIGMA: f64 = 1.5;
const C1: f64 = (0.01 * 255.0) * (0.01 * 255.0);
const C2: f64 = (0.03 * 255.0) * (0.03 * 255.0);

/// Of one place in two pictures: both values, both squares and the product.
type Moments = [f64; 5];

pub(super) fn mean(a: &Shown, b: &Shown) -> Option<f64> {
    let (width, height) = (a.width().checked_sub(2 * RADIUS)?, a.height().checked_sub(2 * RADIUS)?);
    if width == 0 || height == 0 {
        return None;
    }
    let weights = window();
    let mut sum = 0.0;
    for channel in 0..3 {
        let moments = |(a, b): (&[u8; 3], &[u8; 3])| {
            let (a, b) = (f64::from(a[channel]), f64::from(b[channel]));
            [a, b, a * a, b * b, a * b]
        };
        let plane: Vec<Moments> = a.pixels().iter().zip(b.pixels()).map(moments).collect();
        // Rows first, then columns: the window is a product of two Gaussians.
        let rows: Vec<Moments> =
            plane.chunks_exact(a.width()).flat_map(|row| (0..width).map(|x| weigh(&weights, |i| row[x + i]))).collect();
        for y in 0..height {
            for x in 0..width {
                sum += similarity(weigh(&weights, |i| rows[(y + i) * width + x]));
            }
        }
    }
    Some(sum / (3 * width * height) as f64)
}

fn window() -> [f64; 2 * RADIUS + 1] {
    let weights: [f64; 2 * RADIUS + 1] = std::array::from_fn(|i| {
        let distance = i as f64 - RADIUS as f64;
        (-0.5 * (distance / SIGMA).powi(2)).exp()
    });
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

fn weigh(weights: &[f64], moments: impl Fn(usize) -> Moments) -> Moments {
    let mut sum = [0.0; 5];
    for (i, weight) in weights.iter().enumerate() {
        for (sum, moment) in sum.iter_mut().zip(moments(i)) {
            *sum += weight * moment;
        }
    }
    sum
}

fn similarity([mean_a, mean_b, square_a, square_b, product]: Moments) -> f64 {
    let (variance_a, variance_b) = (square_a - mean_a * mean_a, square_b - mean_b * mean_b);
    let covariance = product - mean_a * mean_b;
    (2.0 * mean_a * mean_b + C1) * (2.0 * covariance + C2)
        / ((mean_a * mean_a + mean_b * mean_b + C1) * (variance_a + variance_b + C2))
}
