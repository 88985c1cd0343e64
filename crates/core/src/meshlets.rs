//! Meshes cut into meshlets: runs of triangles with vertices of their own.
//!
//! What a run needs of its vertices stands together, in the order in which it is needed, and two bytes tell a vertex. Runs
//! are of consecutive triangles, as draw order matters; so how many vertices they share depends on the order of the mesh.

use glam::Vec3;

use crate::Mesh;

/// Vertices and triangles in a row that are taken together.
pub const LANES: usize = 8;

/// Triangles of a meshlet at most: so many that few vertices are in several, and few enough for their vertices to stay in
/// the second-level cache. Two bytes tell three vertices of each.
pub const MESHLET_TRIANGLES: usize = 16_384;
const _: () = assert!(3 * MESHLET_TRIANGLES <= 1 << u16::BITS);

/// Meshlets of a mesh at least, unless they get smaller than [`FEWEST_TRIANGLES`]: threads share them out.
const FEWEST_MESHLETS: usize = 16;

/// Triangles of a meshlet at least, but for the last.
const FEWEST_TRIANGLES: usize = 1024;

/// An attribute of eight vertices: axis by axis.
pub type Eight = [[f32; LANES]; 3];

/// A mesh as meshlets. Vertices that several share are in each: what is attached to them stands in the order in which it is
/// needed, eight vertices together.
#[derive(Debug, Clone, Default)]
pub struct Meshlets {
    ranges: Vec<Range>,
    corners: Vec<[[u16; LANES]; 3]>,
    positions: Vec<Eight>,
    /// Empty without normals.
    normals: Vec<Eight>,
}

/// Where what a meshlet has stands.
#[derive(Debug, Clone, Copy, Default)]
struct Range {
    first_triangle: u32,
    triangle_count: u32,
    /// Of eights.
    first_corners: u32,
    first_vertices: u32,
    vertices: u32,
}

/// A run of triangles and its own vertices.
#[derive(Debug, Clone, Copy)]
pub struct Meshlet<'a> {
    /// Number of its first triangle in the mesh.
    pub first_triangle: usize,
    /// How many there are.
    pub triangle_count: usize,
    /// Vertices of eight triangles at a time, corner by corner. Beyond the last triangle, the first vertex.
    pub corners: &'a [[[u16; LANES]; 3]],
    /// Positions of its vertices. Beyond the last vertex, those of the last.
    pub positions: &'a [Eight],
    /// Their normals; empty without any.
    pub normals: &'a [Eight],
}

impl Meshlets {
    /// Cuts a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let mut meshlets = Self::default();
        let each = (mesh.triangles().len() / FEWEST_MESHLETS).clamp(FEWEST_TRIANGLES, MESHLET_TRIANGLES);
        // For each vertex of the mesh the last meshlet it is in, counted from 1, and its number there.
        let mut places = vec![(0, 0); mesh.positions().len()];
        for (number, triangles) in (1..).zip(mesh.triangles().chunks(each)) {
            let mut vertices = Vec::new();
            let mut corner = |vertex: u32| {
                let place = &mut places[vertex as usize];
                if place.0 != number {
                    *place = (number, vertices.len() as u16);
                    vertices.push(vertex);
                }
                place.1
            };
            let corners: Vec<[u16; 3]> = triangles.iter().map(|triangle| triangle.map(&mut corner)).collect();
            meshlets.push(mesh, &vertices, &corners);
        }
        meshlets.corners.shrink_to_fit();
        meshlets.positions.shrink_to_fit();
        meshlets.normals.shrink_to_fit();
        meshlets
    }

    fn push(&mut self, mesh: &Mesh, vertices: &[u32], corners: &[[u16; 3]]) {
        let Some(&last) = vertices.last() else { return };
        let first_triangle = self.ranges.last().map_or(0, |range| range.first_triangle + range.triangle_count);
        self.ranges.push(Range {
            first_triangle,
            triangle_count: corners.len() as u32,
            first_corners: self.corners.len() as u32,
            first_vertices: self.positions.len() as u32,
            vertices: vertices.len().div_ceil(LANES) as u32,
        });
        self.corners.extend(corners.chunks(LANES).map(|eight| {
            let corner = |k: usize| std::array::from_fn(|lane| eight.get(lane).map_or(0, |corners| corners[k]));
            [corner(0), corner(1), corner(2)]
        }));
        let of_eight = |attribute: &[Vec3], eight: &[u32]| -> Eight {
            let values: [Vec3; LANES] =
                std::array::from_fn(|lane| attribute[*eight.get(lane).unwrap_or(&last) as usize]);
            [values.map(|value| value.x), values.map(|value| value.y), values.map(|value| value.z)]
        };
        self.positions.extend(vertices.chunks(LANES).map(|eight| of_eight(mesh.positions(), eight)));
        if let Some(normals) = mesh.normals() {
            self.normals.extend(vertices.chunks(LANES).map(|eight| of_eight(normals, eight)));
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.ranges.len()
    }

    /// How many triangles one of them has.
    pub fn triangle_count(&self, number: usize) -> usize {
        self.ranges[number].triangle_count as usize
    }

    /// One of them, in draw order.
    pub fn get(&self, number: usize) -> Meshlet<'_> {
        let range = self.ranges[number];
        let triangle_count = range.triangle_count as usize;
        let corners = range.first_corners as usize..range.first_corners as usize + triangle_count.div_ceil(LANES);
        let vertices = range.first_vertices as usize..(range.first_vertices + range.vertices) as usize;
        Meshlet {
            first_triangle: range.first_triangle as usize,
            triangle_count,
            corners: &self.corners[corners],
            positions: &self.positions[vertices.clone()],
            normals: if self.normals.is_empty() { &[] } else { &self.normals[vertices] },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a mesh's triangles are, from its meshlets.
    fn triangles(meshlets: &Meshlets) -> Vec<[Vec3; 3]> {
        let mut triangles = Vec::new();
        for meshlet in (0..meshlets.count()).map(|number| meshlets.get(number)) {
            assert_eq!(meshlet.first_triangle, triangles.len());
            for number in 0..meshlet.triangle_count {
                let corners = &meshlet.corners[number / LANES];
                triangles.push([0, 1, 2].map(|k| {
                    let vertex = corners[k][number % LANES] as usize;
                    Vec3::from_array([0, 1, 2].map(|axis| meshlet.positions[vertex / LANES][axis][vertex % LANES]))
                }));
            }
        }
        triangles
    }

    fn mesh(vertex_count: u32, triangles: Vec<[u32; 3]>) -> Mesh {
        let positions: Vec<Vec3> = (0..vertex_count).map(|i| Vec3::new(i as f32, 0.5, -(i as f32))).collect();
        Mesh::new(positions.clone(), triangles).and_then(|mesh| mesh.with_normals(positions)).expect("a mesh")
    }

    #[test]
    fn meshlets_are_the_triangles_of_the_mesh_in_order() {
        let apart = (0..20_000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let strip = (0..59_998).map(|i| [i, i + 1, i + 2]).collect();
        let jumping = (0..300_000).map(|i: u32| [i * 7 % 60_000, i % 251 * i % 60_000, i * 31 % 60_000]).collect();
        for (triangles_of_mesh, count) in
            [(apart, 16), (strip, 17), (jumping, 19), (vec![[5, 6, 5]; 2000], 2), (Vec::new(), 0)]
        {
            let mesh = mesh(60_000, triangles_of_mesh);
            let meshlets = Meshlets::new(&mesh);
            let expected: Vec<_> =
                mesh.triangles().iter().map(|t| t.map(|vertex| mesh.positions()[vertex as usize])).collect();
            assert_eq!(triangles(&meshlets), expected);
            assert_eq!(meshlets.count(), count);
        }
    }

    #[test]
    fn vertices_are_those_of_the_triangles_each_once() {
        let mesh = mesh(2100, (0..2098).map(|i| [i, i + 1, i + 2]).collect());
        let meshlet = mesh.meshlets().get(1);
        assert_eq!(meshlet.positions.len(), (FEWEST_TRIANGLES + 2).div_ceil(LANES));
        assert_eq!(meshlet.positions[0][0][0], FEWEST_TRIANGLES as f32);
        assert_eq!(meshlet.positions, meshlet.normals);
    }
}
