//! Cuts polygons into triangles.
//!
//! A convex polygon becomes a fan, any other is cut by ear clipping (Meisters 1975; Eberly, "Triangulation by Ear
//! Clipping", 2008) in the coordinate plane that its normal is nearest to. A polygon of n corners always gives n - 2
//! triangles that use every corner: the crates `earcut` and `earcutr` leave out corners on straight edges, which opens
//! T-junctions in closed meshes, and those are seams in a transparent picture.

use glam::{DVec2, DVec3, Vec3};

/// Triangle tests allowed a corner, and a polygon, before the rest of it becomes a fan: a bound on time that sets in at
/// some 5000 corners.
const TESTS_PER_CORNER: usize = 4000;
const TESTS_PER_POLYGON: usize = 50_000_000;

/// What a warning says of [`Triangulator::bad`].
pub(crate) const BAD_POLYGONS: &str =
    "polygons that cross themselves or have very many corners, so that their triangles may overlap";

/// Cuts polygons into triangles, and counts those that cannot be cut well.
#[derive(Default)]
pub(crate) struct Triangulator {
    points: Vec<DVec2>,
    /// The corners not cut off yet.
    ring: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    /// Polygons that cross themselves or have too many corners; their triangles may overlap.
    pub(crate) bad: usize,
}

impl Triangulator {
    /// The triangles of a polygon as corner numbers 0..n, wound as the polygon is; none for less than 3 corners.
    pub(crate) fn cut(&mut self, corners: &[Vec3]) -> &[[u32; 3]] {
        self.triangles.clear();
        self.ring.clear();
        self.ring.extend(0..corners.len() as u32);
        if corners.len() > 3 && self.flatten(corners) {
            self.clip_ears();
        }
        for pair in self.ring.windows(2).skip(1) {
            self.triangles.push([self.ring[0], pair[0], pair[1]]);
        }
        &self.triangles
    }

    /// Projects the corners so that the polygon runs counter-clockwise; false if a fan will do, because the polygon is
    /// convex or has no area, or a corner is nowhere.
    fn flatten(&mut self, corners: &[Vec3]) -> bool {
        let mut normal = DVec3::ZERO;
        for (i, corner) in corners.iter().enumerate() {
            let (a, b) = (corner.as_dvec3(), corners[(i + 1) % corners.len()].as_dvec3());
            let origin = corners[0].as_dvec3();
            normal += (a - origin).cross(b - origin);
        }
        if !normal.is_finite() || normal == DVec3::ZERO {
            return false;
        }
        let size = normal.abs();
        self.points.clear();
        self.points.extend(corners.iter().map(|c| {
            let c = c.as_dvec3();
            let (point, up) = if size.z >= size.x && size.z >= size.y {
                (DVec2::new(c.x, c.y), normal.z)
            } else if size.x >= size.y {
                (DVec2::new(c.y, c.z), normal.x)
            } else {
                (DVec2::new(c.z, c.x), normal.y)
            };
            if up > 0.0 { point } else { DVec2::new(point.y, point.x) }
        }));
        let n = corners.len();
        !(0..n).all(|i| turn(self.points[i], self.points[(i + 1) % n], self.points[(i + 2) % n]) > 0.0)
    }

    /// Cuts ears off the ring until a triangle is left, or something that has no ear.
    fn clip_ears(&mut self) {
        let mut tests_left = (self.ring.len() * TESTS_PER_CORNER).min(TESTS_PER_POLYGON);
        let mut at = 0;
        while self.ring.len() > 3 {
            let n = self.ring.len();
            // Corners on a straight edge come last, so that they end as corners of triangles with an area.
            let ear = self.find_ear(at, false, &mut tests_left).or_else(|| self.find_ear(at, true, &mut tests_left));
            let Some(ear) = ear else {
                self.bad += 1;
                return;
            };
            let [a, b, c] = [(ear + n - 1) % n, ear, (ear + 1) % n].map(|i| self.ring[i]);
            self.triangles.push([a, b, c]);
            self.ring.remove(ear);
            // Not the same corner again: that would make a fan of slivers.
            at = ear + 1;
        }
    }

    fn find_ear(&self, start: usize, flat: bool, tests_left: &mut usize) -> Option<usize> {
        let n = self.ring.len();
        let point = |i: usize| self.points[self.ring[i % n] as usize];
        (start..start + n).map(|i| i % n).find(|&i| {
            let [a, b, c] = [point(i + n - 1), point(i), point(i + 1)];
            let area = turn(a, b, c);
            *tests_left = tests_left.saturating_sub(1);
            if !(if flat { area == 0.0 } else { area > 0.0 }) || *tests_left < n {
                return false;
            }
            // A flat ear is cut only where it does not fold back.
            if flat {
                return (b - a).dot(c - b) >= 0.0;
            }
            *tests_left -= n;
            (2..n - 1).all(|k| {
                let p = point(i + k);
                // Only a reflex or straight corner can lie in an ear first.
                turn(point(i + k - 1), p, point(i + k + 1)) > 0.0
                    || turn(a, b, p) < 0.0
                    || turn(b, c, p) < 0.0
                    || turn(c, a, p) < 0.0
                    || p == a
                    || p == c
            })
        })
    }
}

/// Twice the area of a triangle: above 0 if it runs counter-clockwise.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The triangles and the sum of their areas, each checked to run as the polygon does.
    fn check(corners: &[Vec3], normal: Vec3) -> f32 {
        let mut triangulator = Triangulator::default();
        let triangles = triangulator.cut(corners).to_vec();
        assert_eq!(triangulator.bad, 0);
        assert_eq!(triangles.len(), corners.len() - 2);
        let mut edges = std::collections::HashMap::new();
        let mut area = 0.0;
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|i| corners[i as usize]);
            let signed = (b - a).cross(c - a).dot(normal) / 2.0;
            assert!(signed >= 0.0, "{triangle:?} is turned over");
            area += signed;
            for k in 0..3 {
                let (from, to) = (triangle[k], triangle[(k + 1) % 3]);
                *edges.entry((from.min(to), from.max(to))).or_insert(0) += if from < to { 1 } else { -1 };
            }
        }
        // Inner edges cancel; what is left is the outline, each edge once.
        let outline = edges.values().filter(|&&sum| sum != 0).count();
        assert_eq!(outline, corners.len(), "{triangles:?}");
        area
    }

    fn flat(points: &[(f32, f32)]) -> Vec<Vec3> {
        points.iter().map(|&(x, y)| Vec3::new(x, y, 0.0)).collect()
    }

    #[test]
    fn convex_polygons_become_fans() {
        let square = flat(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]);
        assert_eq!(Triangulator::default().cut(&square), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(Triangulator::default().cut(&square[..3]), [[0, 1, 2]]);
        assert!(Triangulator::default().cut(&square[..2]).is_empty());
        assert!(Triangulator::default().cut(&[]).is_empty());
    }

    #[test]
    fn concave_polygons_keep_their_area_in_every_plane_and_direction() {
        let arrow = flat(&[(0.0, 0.0), (4.0, -3.0), (1.0, 0.0), (4.0, 3.0)]);
        let comb: Vec<_> = (0..20)
            .map(|i| (i as f32, if i % 2 == 0 { 5.0 } else { 1.0 }))
            .chain([(19.0, 0.0), (0.0, 0.0)])
            .map(|(x, y)| Vec3::new(-x, y, 0.0))
            .collect();
        for (polygon, area) in [(arrow, 3.0), (comb, 57.0)] {
            for turned in 0..6 {
                let place = |v: Vec3| match turned % 3 {
                    0 => v,
                    1 => Vec3::new(v.z, v.x, v.y),
                    _ => Vec3::new(v.y, v.z, v.x),
                };
                let mut corners: Vec<_> = polygon.iter().map(|&v| place(v)).collect();
                let mut normal = place(Vec3::Z);
                if turned >= 3 {
                    corners.reverse();
                    normal = -normal;
                }
                for shift in 0..corners.len() {
                    corners.rotate_left(1);
                    let found = check(&corners, normal);
                    assert!((found - area).abs() < 1e-4, "turned {turned}, shift {shift}: {found} for {area}");
                }
            }
        }
    }

    #[test]
    fn corners_on_a_straight_edge_are_used() {
        let plate = flat(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (3.0, 1.0), (0.0, 1.0)]);
        assert_eq!(check(&plate, Vec3::Z), 3.0);
        let step =
            flat(&[(0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (4.0, 2.0), (2.0, 2.0), (2.0, 3.0), (2.0, 4.0), (0.0, 4.0)]);
        assert_eq!(check(&step, Vec3::Z), 12.0);
    }

    #[test]
    fn a_hole_joined_by_a_bridge_stays_open() {
        let frame = flat(&[
            (0.0, 0.0),
            (4.0, 0.0),
            (4.0, 4.0),
            (0.0, 4.0),
            (0.0, 0.0),
            (1.0, 1.0),
            (1.0, 3.0),
            (3.0, 3.0),
            (3.0, 1.0),
            (1.0, 1.0),
        ]);
        let mut triangulator = Triangulator::default();
        let area: f32 = triangulator
            .cut(&frame)
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| frame[i as usize]);
                (b - a).cross(c - a).z / 2.0
            })
            .sum();
        assert_eq!(area, 12.0);
    }

    #[test]
    fn nonsense_gives_a_triangle_for_every_corner_but_two() {
        let mut seed = 1_u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 24) as f32 - 128.0
        };
        for n in 3..60 {
            let corners: Vec<_> = (0..n).map(|_| Vec3::new(random(), random(), random())).collect();
            assert_eq!(Triangulator::default().cut(&corners).len(), n - 2);
            let same = vec![corners[0]; n];
            assert_eq!(Triangulator::default().cut(&same).len(), n - 2);
        }
        for value in [f32::NAN, f32::INFINITY, f32::MAX] {
            let corners = [Vec3::ZERO, Vec3::X, Vec3::splat(value), Vec3::Y, -Vec3::X * value];
            assert_eq!(Triangulator::default().cut(&corners).len(), 3);
        }
    }
}
