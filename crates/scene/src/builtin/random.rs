//! Random numbers and angles that are the same bits on every machine.

use glam::{Quat, Vec3, Vec4};

/// SplitMix64 (Steele, Lea and Flood: Fast Splittable Pseudorandom Number Generators, 2014).
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u32) -> Self {
        Self(u64::from(seed))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    /// In 0..1, a multiple of 2^-24.
    pub(super) fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }

    /// Between `low` and `high`.
    pub(super) fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// A whole number below `count`; the bias of at most `count` / 2^64 shows nowhere.
    pub(super) fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next()) * count as u128) >> 64) as usize
    }

    /// A point in the cube from -1 to 1.
    pub(super) fn in_cube(&mut self) -> Vec3 {
        Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    /// A point in the unit ball.
    pub(super) fn in_ball(&mut self) -> Vec3 {
        loop {
            let point = self.in_cube();
            if point.length_squared() <= 1.0 {
                return point;
            }
        }
    }

    /// A direction, all equally likely.
    pub(super) fn direction(&mut self) -> Vec3 {
        loop {
            let point = self.in_ball();
            if point.length_squared() > 1e-4 {
                return point.normalize();
            }
        }
    }

    /// A rotation, all equally likely.
    pub(super) fn rotation(&mut self) -> Quat {
        loop {
            let point = self.in_cube().extend(self.between(-1.0, 1.0));
            if (1e-4..=1.0).contains(&point.length_squared()) {
                return Quat::from_vec4(Vec4::normalize(point));
            }
        }
    }

    /// Every order equally likely.
    pub(super) fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.below(last + 1));
        }
    }
}

fn mix(bits: u64) -> u64 {
    let bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

/// A fixed random number in 0..1 for a cell of a lattice.
pub(super) fn lattice_noise(x: i32, y: i32, seed: u32) -> f32 {
    let cell = (u64::from(x as u32) << 32) | u64::from(y as u32);
    (mix(cell ^ mix(u64::from(seed))) >> 40) as f32 / (1 << 24) as f32
}

/// Sine and cosine of an angle in turns (1 is a full circle), by Taylor series: the system's own functions differ in the
/// last bit between machines.
pub(super) fn sin_cos(turns: f64) -> (f32, f32) {
    let turns = turns - turns.round();
    let quadrant = (turns * 4.0).round();
    let x = (turns - quadrant * 0.25) * std::f64::consts::TAU;
    let x2 = x * x;
    let (mut sin, mut cos) = (0.0, 0.0);
    // At most an eighth of a turn is left: the first term that is missing is below 1e-15.
    for k in [14.0, 12.0, 10.0, 8.0, 6.0, 4.0, 2.0] {
        cos = (1.0 + cos) * -x2 / (k * (k - 1.0));
        sin = (1.0 + sin) * -x2 / (k * (k + 1.0));
    }
    let (sin, cos) = ((x * (1.0 + sin)) as f32, (1.0 + cos) as f32);
    match quadrant as i32 {
        1 => (cos, -sin),
        -1 => (-cos, sin),
        0 => (sin, cos),
        _ => (-sin, -cos),
    }
}

/// A rotation by `turns` of a full circle about `axis`, which must have length 1; counter-clockwise seen against it.
pub(super) fn rotation(axis: Vec3, turns: f32) -> Quat {
    let (sin, cos) = sin_cos(f64::from(turns) * 0.5);
    Quat::from_vec4((axis * sin).extend(cos))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_agree_with_the_system() {
        for i in -2000..2000 {
            let turns = f64::from(i) / 777.0;
            let (sin, cos) = sin_cos(turns);
            let expected = (turns * std::f64::consts::TAU).sin_cos();
            assert!((f64::from(sin) - expected.0).abs() < 1e-7, "{turns}");
            assert!((f64::from(cos) - expected.1).abs() < 1e-7, "{turns}");
        }
        assert_eq!(sin_cos(1.0), (0.0, 1.0));
        assert_eq!(sin_cos(0.25), (1.0, 0.0));
    }

    #[test]
    fn the_generator_is_the_published_one() {
        let mut random = Random::new(0);
        assert_eq!([random.next(), random.next()], [0xe220_a839_7b1d_cdaf, 0x6e78_9e6a_a1b9_65f4]);
    }

    #[test]
    fn a_shuffle_keeps_all_items() {
        let mut items: Vec<u32> = (0..100).collect();
        Random::new(7).shuffle(&mut items);
        assert_ne!(items, (0..100).collect::<Vec<_>>());
        items.sort_unstable();
        assert_eq!(items, (0..100).collect::<Vec<_>>());
    }
}
