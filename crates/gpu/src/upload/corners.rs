//! Corners that triangles share, with one for each triangle that is its own.
//!
//! A fragment has to know its primitive, and not every device tells. But a flat value comes from the first corner of a
//! triangle, everywhere: so each triangle gets a corner to itself to begin with, and shares the others. A closed mesh has
//! twice as many triangles as vertices, so that half of the triangles need a copy: one corner a triangle is drawn instead
//! of three. They are numbered as triangles first use them, so that neighbours in memory are neighbours in the mesh.
//!
//! They are copies in a vertex buffer, as lavapipe reads those far faster than storage.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use pellucid_core::Mesh;

/// In place of the triangle of a corner that provokes none. Twin: `NO_TRIANGLE` in `shaders/shared/mesh.wesl`.
const NO_TRIANGLE: u32 = u32::MAX;

/// A vertex as triangles have it. Twin: `Corner` in `shaders/shared/mesh.wesl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct Corner {
    position: Vec3,
    /// Of any length.
    normal: Vec3,
    /// Number in the scene's buffers.
    vertex: u32,
    /// The triangle of the mesh that has it as its first corner, or [`NO_TRIANGLE`].
    triangle: u32,
}

impl Corner {
    /// As the vertex shader takes it.
    pub(crate) const ATTRIBUTES: [wgpu::VertexAttribute; 4] =
        wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Uint32, 3 => Uint32];
}

/// The corners of a mesh.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Corners {
    pub(super) corners: Vec<Corner>,
    /// Three for each triangle, in its own direction of rotation, the one it provokes first.
    pub(super) order: Vec<[u32; 3]>,
}

impl Corners {
    /// Of a mesh whose first vertex has a number in the scene's buffers.
    pub(super) fn of(mesh: &Mesh, first_vertex: u32) -> Self {
        let corner = |vertex: u32, normal| Corner {
            position: mesh.positions()[vertex as usize],
            normal,
            vertex: first_vertex + vertex,
            triangle: NO_TRIANGLE,
        };
        match mesh.normals() {
            Some(normals) => Self::shared(mesh, |vertex| corner(vertex, normals[vertex as usize])),
            None => Self::apart(mesh, corner),
        }
    }

    fn shared(mesh: &Mesh, corner_of: impl Fn(u32) -> Corner) -> Self {
        const UNUSED: u32 = u32::MAX;
        let mut shared = Self::default();
        shared.order.reserve(mesh.triangles().len());
        let mut number_of = vec![UNUSED; mesh.positions().len()];
        for (number, &triangle) in (0..).zip(mesh.triangles()) {
            let mut order = triangle.map(|vertex| {
                let place = &mut number_of[vertex as usize];
                if *place == UNUSED {
                    *place = shared.add(corner_of(vertex));
                }
                *place
            });
            match order.iter().position(|&corner| shared.corners[corner as usize].triangle == NO_TRIANGLE) {
                Some(first) => order.rotate_left(first),
                None => order[0] = shared.add(corner_of(triangle[0])),
            }
            shared.corners[order[0] as usize].triangle = number;
            shared.order.push(order);
        }
        shared
    }

    /// Where every triangle has its own normal, nothing can be shared.
    fn apart(mesh: &Mesh, corner: impl Fn(u32, Vec3) -> Corner) -> Self {
        let mut apart = Self::default();
        for (number, &triangle) in (0..).zip(mesh.triangles()) {
            let [a, b, c] = triangle.map(|vertex| mesh.positions()[vertex as usize]);
            let normal = (b - a).cross(c - a);
            let order = triangle.map(|vertex| apart.add(corner(vertex, normal)));
            apart.corners[order[0] as usize].triangle = number;
            apart.order.push(order);
        }
        apart
    }

    fn add(&mut self, corner: Corner) -> u32 {
        self.corners.push(corner);
        (self.corners.len() - 1) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of so many squares a side, as a closed surface: both sides are joined.
    fn torus(side: u32) -> Vec<[u32; 3]> {
        let at = |x: u32, y: u32| (y % side) * side + x % side;
        (0..side * side)
            .map(|i| (i % side, i / side))
            .flat_map(|(x, y)| {
                let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    fn check(triangles: &[[u32; 3]], vertex_count: usize, has_normals: bool) -> Corners {
        let mut mesh = Mesh::new(vec![Vec3::X; vertex_count], triangles.to_vec()).unwrap();
        if has_normals {
            mesh = mesh.with_normals(vec![Vec3::Y; vertex_count]).unwrap();
        }
        let shared = Corners::of(&mesh, 1000);
        for (number, (triangle, order)) in triangles.iter().zip(&shared.order).enumerate() {
            assert_eq!(shared.corners[order[0] as usize].triangle, number as u32, "its first corner is another's");
            let vertices = order.map(|corner| shared.corners[corner as usize].vertex - 1000);
            let turned = (0..3).map(|by| {
                let mut turned = *triangle;
                turned.rotate_left(by);
                turned
            });
            assert!(turned.into_iter().any(|turned| turned == vertices), "{triangle:?} became {vertices:?}");
        }
        shared
    }

    #[test]
    fn every_triangle_has_its_first_corner_to_itself_and_keeps_its_direction() {
        let shared = check(&torus(20), 400, true);
        assert_eq!(shared.corners.len(), 800, "as many as triangles");
        let apart = check(&torus(20), 400, false);
        assert_eq!(apart.corners.len(), 2400);
    }

    #[test]
    fn triangles_of_one_vertex_and_the_same_triangle_again_and_again_are_served() {
        check(&[[0, 0, 0], [0, 0, 0], [1, 1, 0]], 2, true);
        check(&[[0, 1, 2]; 9], 3, true);
        assert_eq!(check(&[], 0, true), Corners::default());
    }
}
