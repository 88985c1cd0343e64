//! A power law through points: the straight line of least squares through their logarithms.

use serde::Serialize;

/// `y = factor * x ^ exponent`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct PowerLaw {
    pub(super) exponent: f64,
    pub(super) factor: f64,
    /// Share of the logarithms' variance that it explains: 1 if all points lie on it.
    pub(super) r_squared: f64,
}

/// The power law through two points or more, all above 0, of which not all have the same x.
pub(super) fn power_law(points: &[(f64, f64)]) -> Option<PowerLaw> {
    let logs: Vec<(f64, f64)> = points.iter().map(|&(x, y)| (x.ln(), y.ln())).collect();
    let count = logs.len() as f64;
    let (mean_x, mean_y) =
        (logs.iter().map(|(x, _)| x).sum::<f64>() / count, logs.iter().map(|(_, y)| y).sum::<f64>() / count);
    let sum = |of: &dyn Fn(f64, f64) -> f64| logs.iter().map(|(x, y)| of(x - mean_x, y - mean_y)).sum::<f64>();
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    let exponent = xy / xx;
    let factor = (mean_y - exponent * mean_x).exp();
    let r_squared = if yy > 0.0 { xy * xy / (xx * yy) } else { 1.0 };
    Some(PowerLaw { exponent, factor, r_squared }).filter(|law| law.exponent.is_finite() && law.factor.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_laws_are_found() {
        let law = power_law(&[(1.0, 3.0), (10.0, 300.0), (100.0, 30_000.0)]).unwrap();
        assert!((law.exponent - 2.0).abs() < 1e-9 && (law.factor - 3.0).abs() < 1e-9 && law.r_squared > 0.999_999);
        let flat = power_law(&[(1.0, 5.0), (9.0, 5.0)]).unwrap();
        assert!(flat.exponent.abs() < 1e-12 && (flat.factor - 5.0).abs() < 1e-9);
        assert_eq!(power_law(&[(2.0, 1.0)]), None);
        assert_eq!(power_law(&[(2.0, 1.0), (2.0, 3.0)]), None);
    }
}
