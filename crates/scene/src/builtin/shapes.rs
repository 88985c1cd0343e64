//! Shapes that scenes are made of, counter-clockwise seen from outside.

use std::collections::HashMap;

use glam::{Affine3A, Vec2, Vec3, Vec4};
use pellucid_core::{Error, Mesh};

use super::random::sin_cos;

/// A mesh in the making. Attributes have one value a vertex or none at all.
#[derive(Debug, Clone, Default)]
pub(super) struct Shape {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    pub(super) tex_coords: Vec<Vec2>,
    pub(super) colors: Vec<Vec4>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// A mesh with the attributes that are there.
    pub(super) fn into_mesh(self) -> Result<Mesh, Error> {
        let mut mesh = Mesh::new(self.positions, self.triangles)?;
        if !self.normals.is_empty() {
            mesh = mesh.with_normals(self.normals)?;
        }
        if !self.tex_coords.is_empty() {
            mesh = mesh.with_tex_coords(self.tex_coords)?;
        }
        if !self.colors.is_empty() {
            mesh = mesh.with_colors(self.colors)?;
        }
        Ok(mesh)
    }

    /// A mesh lit smoothly across shared vertices.
    pub(super) fn into_smooth_mesh(self) -> Result<Mesh, Error> {
        Ok(self.into_mesh()?.with_smooth_normals())
    }

    /// Adds a copy of `other`, moved, in one colour. Both have positions and colours only.
    pub(super) fn append(&mut self, other: &Self, place: &Affine3A, color: Vec4) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions.iter().map(|&position| place.transform_point3(position)));
        self.colors.resize(self.positions.len(), color);
        self.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
    }

    /// Two triangles over the corners a, b, c, d, counter-clockwise.
    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangles.push([a, b, c]);
        self.triangles.push([a, c, d]);
    }
}

/// A box around the origin, lit flat: 12 triangles.
pub(super) fn cuboid(half: Vec3) -> Shape {
    let corner = |i: u32| {
        let sign = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        half * Vec3::new(sign(0), sign(1), sign(2))
    };
    let mut shape = Shape { positions: (0..8).map(corner).collect(), ..Shape::default() };
    for face in [[1, 3, 7, 5], [0, 4, 6, 2], [2, 6, 7, 3], [0, 1, 5, 4], [4, 5, 7, 6], [0, 2, 3, 1]] {
        shape.quad(face);
    }
    shape
}

/// A sphere of radius 1: an icosahedron whose triangles are split in four `subdivisions` times.
pub(super) fn icosphere(subdivisions: u32) -> Shape {
    let g = (1.0 + 5.0_f32.sqrt()) / 2.0;
    let rectangle = [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)];
    let mut positions: Vec<Vec3> = Vec::new();
    positions.extend(rectangle.map(|(a, b)| Vec3::new(a, b, 0.0).normalize()));
    positions.extend(rectangle.map(|(a, b)| Vec3::new(0.0, a, b).normalize()));
    positions.extend(rectangle.map(|(a, b)| Vec3::new(b, 0.0, a).normalize()));
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..subdivisions {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    Shape { normals: positions.clone(), positions, triangles, ..Shape::default() }
}

/// A flat grid from -1 to 1 in x and y that faces +z, textured upright.
pub(super) fn grid(columns: u32, rows: u32) -> Shape {
    let mut shape = Shape::default();
    for row in 0..=rows {
        for column in 0..=columns {
            let (u, v) = (column as f32 / columns as f32, row as f32 / rows as f32);
            shape.positions.push(Vec3::new(u * 2.0 - 1.0, v * 2.0 - 1.0, 0.0));
            shape.tex_coords.push(Vec2::new(u, 1.0 - v));
        }
    }
    let at = |column, row| row * (columns + 1) + column;
    for row in 0..rows {
        for column in 0..columns {
            shape.quad([at(column, row), at(column + 1, row), at(column + 1, row + 1), at(column, row + 1)]);
        }
    }
    shape
}

/// The unit circle in `sides` points as (x, z), counter-clockwise seen from above (+y).
pub(super) fn circle(sides: u32) -> Vec<Vec2> {
    (0..sides)
        .map(|side| {
            let (sin, cos) = sin_cos(f64::from(side) / f64::from(sides));
            Vec2::new(sin, cos)
        })
        .collect()
}

/// Turns a profile of (radius, height) about the y axis, `ring` saying how round. Walking along the profile, outside is
/// to the right. Radius 0 makes one vertex; a profile point given twice makes a crease. Meant to be lit smoothly.
pub(super) fn revolve(profile: &[Vec2], ring: &[Vec2]) -> Shape {
    let mut shape = Shape::default();
    let sides = ring.len() as u32;
    let mut previous: Option<(u32, Vec2)> = None;
    for &point in profile {
        let first = shape.positions.len() as u32;
        if point.x == 0.0 {
            shape.positions.push(Vec3::new(0.0, point.y, 0.0));
        } else {
            shape.positions.extend(ring.iter().map(|r| Vec3::new(r.x * point.x, point.y, r.y * point.x)));
        }
        if let Some((below, before)) = previous.filter(|(_, before)| *before != point) {
            for side in 0..sides {
                let next = (side + 1) % sides;
                match (before.x == 0.0, point.x == 0.0) {
                    (true, true) => {}
                    (true, false) => shape.triangles.push([below, first + next, first + side]),
                    (false, true) => shape.triangles.push([below + side, below + next, first]),
                    (false, false) => shape.quad([below + side, below + next, first + next, first + side]),
                }
            }
        }
        previous = Some((first, point));
    }
    shape
}
