//! Corners that triangles share, with one for each triangle that is its own.
//!
//! A fragment has to know its primitive, and not every device tells. But a flat value comes from the first corner of a
//! triangle, everywhere: so each triangle gets a vertex to itself to begin with, and shares the others. A closed mesh has
//! twice as many triangles as vertices, so that half of the triangles need a copy: one vertex a triangle is drawn instead
//! of three. Corners are numbered as triangles first use them, so that neighbours in memory are neighbours in the mesh.

/// In place of the triangle of a corner that provokes none. Twin: `NO_TRIANGLE` in `shaders/shared/mesh.wesl`.
const NO_TRIANGLE: u32 = u32::MAX;

/// How the triangles of a mesh share corners.
#[derive(Debug, Default, PartialEq)]
pub(super) struct SharedCorners {
    /// Vertex, and the triangle that has it as its first corner or [`NO_TRIANGLE`].
    pub(super) corners: Vec<[u32; 2]>,
    /// Three corners for each triangle, in its own direction of rotation, the one it provokes first.
    pub(super) order: Vec<[u32; 3]>,
}

impl SharedCorners {
    pub(super) fn of(triangles: &[[u32; 3]], vertex_count: usize) -> Self {
        const UNUSED: u32 = u32::MAX;
        let mut shared = Self { corners: Vec::with_capacity(triangles.len()), order: Vec::with_capacity(triangles.len()) };
        let mut corner_of = vec![UNUSED; vertex_count];
        for (number, &triangle) in (0..).zip(triangles) {
            let mut corners = triangle.map(|vertex| {
                let corner = &mut corner_of[vertex as usize];
                if *corner == UNUSED {
                    *corner = shared.add(vertex, NO_TRIANGLE);
                }
                *corner
            });
            match corners.iter().position(|&corner| shared.corners[corner as usize][1] == NO_TRIANGLE) {
                Some(first) => {
                    corners.rotate_left(first);
                    shared.corners[corners[0] as usize][1] = number;
                }
                None => corners[0] = shared.add(triangle[0], number),
            }
            shared.order.push(corners);
        }
        shared
    }

    fn add(&mut self, vertex: u32, triangle: u32) -> u32 {
        self.corners.push([vertex, triangle]);
        (self.corners.len() - 1) as u32
    }

    /// Whether drawing by index saves at least a quarter of the corners.
    pub(super) fn pays(&self) -> bool {
        self.corners.len() * 4 <= self.order.len() * 3 * 3
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

    fn check(triangles: &[[u32; 3]], vertex_count: usize) -> SharedCorners {
        let shared = SharedCorners::of(triangles, vertex_count);
        for (number, (triangle, order)) in triangles.iter().zip(&shared.order).enumerate() {
            assert_eq!(shared.corners[order[0] as usize][1], number as u32, "its first corner is another's");
            let vertices = order.map(|corner| shared.corners[corner as usize][0]);
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
        let shared = check(&torus(20), 400);
        assert_eq!(shared.corners.len(), 800, "as many as triangles");
        assert!(shared.pays());
    }

    #[test]
    fn triangles_of_one_vertex_and_the_same_triangle_again_and_again_are_served() {
        check(&[[0, 0, 0], [0, 0, 0], [1, 1, 0]], 2);
        check(&[[0, 1, 2]; 9], 3);
        assert_eq!(SharedCorners::of(&[], 0), SharedCorners::default());
    }

    #[test]
    fn triangles_apart_are_not_worth_an_index() {
        let apart: Vec<_> = (0..10).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        assert!(!check(&apart, 30).pays());
    }
}
