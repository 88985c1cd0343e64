//! Tubes along a path: twigs, hairs, rings and knots.

use glam::{Vec2, Vec3};

use super::random::sin_cos;
use super::shapes::Shape;

/// What a tube is made along.
pub(super) struct Tube<'a> {
    /// The middle of the tube, two points or more.
    pub(super) path: &'a [Vec3],
    /// One radius a point.
    pub(super) radii: &'a [f32],
    /// One direction a point in which the first side lies; none: as straight as can be.
    pub(super) towards: &'a [Vec3],
    /// Corners of the cross-section.
    pub(super) sides: u32,
    /// The last point is joined to the first; otherwise both ends get flat caps.
    pub(super) closed: bool,
    /// How often a texture repeats around, and along the whole path; the tube gets a seam for it.
    pub(super) texture_repeats: Option<Vec2>,
}

impl Default for Tube<'_> {
    fn default() -> Self {
        Self { path: &[], radii: &[], towards: &[], sides: 8, closed: false, texture_repeats: None }
    }
}

impl Tube<'_> {
    /// Triangles that [`Self::add_to`] makes: two for each side of a segment, and the caps.
    pub(super) fn triangle_count(sides: u64, segments: u64) -> u64 {
        2 * sides * segments + 2 * (sides - 2)
    }

    /// Adds the tube, with normals, to `shape`.
    pub(super) fn add_to(&self, shape: &mut Shape) {
        let first = shape.positions.len() as u32;
        let count = self.path.len() as u32;
        let columns = self.sides + u32::from(self.texture_repeats.is_some());
        let mut side_direction = self.tangent(0).any_orthonormal_vector();
        for point in 0..self.path.len() {
            let tangent = self.tangent(point);
            let wanted = self.towards.get(point).copied().unwrap_or(side_direction);
            side_direction = wanted.reject_from_normalized(tangent).normalize_or(tangent.any_orthonormal_vector());
            let other = tangent.cross(side_direction);
            for column in 0..columns {
                let (sin, cos) = sin_cos(f64::from(column) / f64::from(self.sides));
                let normal = side_direction * cos + other * sin;
                shape.positions.push(self.path[point] + normal * self.radii[point]);
                shape.normals.push(normal);
                if let Some(repeats) = self.texture_repeats {
                    let (u, v) = (column as f32 / self.sides as f32, point as f32 / (count - 1) as f32);
                    shape.tex_coords.push(Vec2::new(u, v) * repeats);
                }
            }
        }
        let at = |point: u32, side: u32| first + point % count * columns + side % columns;
        let segments = if self.closed { count } else { count - 1 };
        for segment in 0..segments {
            for side in 0..self.sides {
                let [a, b] = [at(segment, side), at(segment, side + 1)];
                let [d, c] = [at(segment + 1, side), at(segment + 1, side + 1)];
                shape.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        if !self.closed {
            self.add_cap(shape, at(0, 0), 0, true);
            self.add_cap(shape, at(count - 1, 0), self.path.len() - 1, false);
        }
    }

    fn tangent(&self, point: usize) -> Vec3 {
        let last = self.path.len() - 1;
        let (before, after) = match (self.closed, point) {
            (true, _) => ((point + last) % (last + 1), (point + 1) % (last + 1)),
            (false, _) => (point.saturating_sub(1), (point + 1).min(last)),
        };
        (self.path[after] - self.path[before]).normalize_or(Vec3::Y)
    }

    /// A flat polygon over the ring that begins at `ring`, with vertices of its own to be lit flat.
    fn add_cap(&self, shape: &mut Shape, ring: u32, point: usize, is_start: bool) {
        let first = shape.positions.len() as u32;
        let outwards = self.tangent(point) * if is_start { -1.0 } else { 1.0 };
        for side in 0..self.sides {
            shape.positions.push(shape.positions[(ring + side) as usize]);
            shape.normals.push(outwards);
            if self.texture_repeats.is_some() {
                shape.tex_coords.push(shape.tex_coords[(ring + side) as usize]);
            }
        }
        for side in 1..self.sides - 1 {
            let (a, b) = if is_start { (side + 1, side) } else { (side, side + 1) };
            shape.triangles.push([first, first + a, first + b]);
        }
    }
}

/// A ring of radius 1 around the y axis.
pub(super) fn torus(tube_radius: f32, segments: u32, sides: u32) -> Shape {
    let path: Vec<Vec3> = (0..segments)
        .map(|segment| {
            let (sin, cos) = sin_cos(f64::from(segment) / f64::from(segments));
            Vec3::new(sin, 0.0, cos)
        })
        .collect();
    let mut shape = Shape::default();
    let radii = vec![tube_radius; path.len()];
    Tube { path: &path, radii: &radii, towards: &path, sides, closed: true, ..Tube::default() }.add_to(&mut shape);
    shape
}

/// A knot that winds `around` times around the y axis and `through` times through the hole of a torus of radius 1.
pub(super) fn knot((around, through): (u32, u32), minor: f32, tube_radius: f32, segments: u32, sides: u32) -> Shape {
    let (path, towards): (Vec<Vec3>, Vec<Vec3>) = (0..segments)
        .map(|segment| {
            let t = f64::from(segment) / f64::from(segments);
            let (sin_a, cos_a) = sin_cos(t * f64::from(around));
            let (sin_t, cos_t) = sin_cos(t * f64::from(through));
            let outwards = Vec3::new(sin_a, 0.0, cos_a) * cos_t + Vec3::Y * sin_t;
            (Vec3::new(sin_a, 0.0, cos_a) + outwards * minor, outwards)
        })
        .unzip();
    let mut shape = Shape::default();
    let radii = vec![tube_radius; path.len()];
    Tube { path: &path, radii: &radii, towards: &towards, sides, closed: true, ..Tube::default() }.add_to(&mut shape);
    shape
}
