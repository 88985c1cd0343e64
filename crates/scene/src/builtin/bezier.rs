//! Bézier curves of degree 3.

/// Points along curves that share their ends, `pieces` steps a curve: of 3 n + 1 control points, 1 + n * pieces points.
pub(super) fn along<const N: usize>(points: &[[f32; N]], pieces: u32) -> Vec<[f32; N]> {
    let mut result = vec![points[0]];
    for curve in points.windows(4).step_by(3) {
        result.extend((1..pieces).map(|i| bezier(curve, i as f32 / pieces as f32)));
        // The exact end, not a rounded one: profiles must close on the axis.
        result.push(curve[3]);
    }
    result
}

fn bezier<const N: usize>(points: &[[f32; N]], t: f32) -> [f32; N] {
    let s = 1.0 - t;
    let weights = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
    std::array::from_fn(|k| points.iter().zip(weights).map(|(point, weight)| point[k] * weight).sum())
}
