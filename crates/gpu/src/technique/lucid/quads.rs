//! Triangles in pairs: quads are what set-up takes, so that the vertices that two triangles share are transformed once.
//!
//! Every two triangles that share an edge, which they run through in opposite directions, could be a quad; two such quads
//! exclude each other if they have a triangle in common. A maximal independent set of that graph is found greedily, quads
//! that exclude the fewest others first (Halldorsson and Radhakrishnan 1994). Long thin quads are left out: their bounds
//! would tell little. What remains alone is a quad with one triangle.

use glam::Vec3;
use pellucid_core::Mesh;

/// Four vertices and two triangles. The first triangle has vertices 0, 1 and 2, the second, if there is one, 0, 2 and 3.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quad {
    pub(super) vertices: [u32; 4],
    pub(super) triangles: [u32; 2],
}

/// In place of a second triangle.
pub(super) const NO_TRIANGLE: u32 = u32::MAX;

/// Least area of a quad over the square of its longest side or diagonal, which is 1/2 for a square.
const SQUARENESS: f32 = 1.0 / 32.0;

/// An edge that two triangles share: each with the number of the corner where it starts.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    triangles: [u32; 2],
    starts: [u8; 2],
}

/// The quads of a mesh, whose vertices are numbered from `first_vertex` on.
pub(super) fn quads(mesh: &Mesh, first_vertex: u32) -> Vec<Quad> {
    let candidates = candidates(mesh);
    let mut partners = vec![None; mesh.triangles().len()];
    for number in independent(&candidates, mesh.triangles().len()) {
        let Candidate { triangles: [a, b], starts } = candidates[number as usize];
        partners[a as usize] = Some((b, starts));
        partners[b as usize] = Some((a, [starts[1], starts[0]]));
    }
    let vertex = |triangle: u32, corner: u32| first_vertex + mesh.triangles()[triangle as usize][corner as usize % 3];
    let mut quads = Vec::with_capacity(mesh.triangles().len() / 2 + 1);
    for (triangle, partner) in (0..).zip(&partners) {
        quads.push(match *partner {
            // With the one drawn first.
            Some((other, _)) if other < triangle => continue,
            None => {
                let [a, b, c] = [0, 1, 2].map(|corner| vertex(triangle, corner));
                Quad { vertices: [a, b, c, c], triangles: [triangle, NO_TRIANGLE] }
            }
            Some((other, starts)) => {
                // The edge runs from vertex 2 to vertex 0 in the first, and back in the second.
                let [first, second] = [(u32::from(starts[0]) + 1) % 3, u32::from(starts[1])];
                let [a, b, c] = [0, 1, 2].map(|corner| vertex(triangle, first + corner));
                Quad { vertices: [a, b, c, vertex(other, second + 2)], triangles: [triangle, other] }
            }
        });
    }
    quads
}

/// How many quads have one triangle only.
pub(super) fn lone(quads: &[Quad]) -> usize {
    quads.iter().filter(|quad| quad.triangles[1] == NO_TRIANGLE).count()
}

fn candidates(mesh: &Mesh) -> Vec<Candidate> {
    // Both directions of an edge next to each other: forwards first, then by triangle.
    let mut edges: Vec<(u32, u32, bool, u32, u8)> = Vec::with_capacity(mesh.triangles().len() * 3);
    for (triangle, corners) in (0..).zip(mesh.triangles()) {
        for start in 0..3u8 {
            let (from, to) = (corners[usize::from(start)], corners[(usize::from(start) + 1) % 3]);
            if from != to {
                edges.push((from.min(to), from.max(to), from > to, triangle, start));
            }
        }
    }
    edges.sort_unstable();
    let mut candidates = Vec::with_capacity(edges.len() / 2);
    for shared in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let backwards = shared.partition_point(|edge| !edge.2);
        let (forwards, backwards) = shared.split_at(backwards);
        for (&(.., a, a_start), &(.., b, b_start)) in forwards.iter().zip(backwards) {
            let candidate = Candidate { triangles: [a, b], starts: [a_start, b_start] };
            if a != b && is_square_enough(mesh, &candidate) {
                candidates.push(candidate);
            }
        }
    }
    candidates
}

fn is_square_enough(mesh: &Mesh, candidate: &Candidate) -> bool {
    let corners = |i: usize| mesh.triangles()[candidate.triangles[i] as usize].map(|v| mesh.positions()[v as usize]);
    let area = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).length() / 2.0;
    let (a, b) = (corners(0), corners(1));
    let points = [a[0], a[1], a[2], b[(usize::from(candidate.starts[1]) + 2) % 3]];
    let lengths = (0..4).flat_map(|i| (0..i).map(move |j| points[i].distance_squared(points[j])));
    area(a) + area(b) >= SQUARENESS * lengths.fold(0.0, f32::max)
}

/// The greedy maximal independent set of candidates of which no two share a triangle.
fn independent(candidates: &[Candidate], triangles: usize) -> Vec<u32> {
    // At most one for each edge of a triangle.
    let mut of_triangle = vec![[u32::MAX; 3]; triangles];
    for (number, candidate) in (0..).zip(candidates) {
        for (triangle, start) in candidate.triangles.into_iter().zip(candidate.starts) {
            of_triangle[triangle as usize][usize::from(start)] = number;
        }
    }
    let mut is_open = vec![true; candidates.len()];
    let neighbours = |number: u32| {
        let all = candidates[number as usize].triangles.into_iter().flat_map(|t| of_triangle[t as usize]);
        all.filter(move |&other| other != u32::MAX && other != number)
    };
    // Candidates by how many open ones they exclude; those whose number has gone down stand in a lower queue again.
    let mut degrees: Vec<u8> = (0..candidates.len() as u32).map(|number| neighbours(number).count() as u8).collect();
    let mut queues: [Vec<u32>; 5] = Default::default();
    for (number, &degree) in degrees.iter().enumerate().rev() {
        queues[usize::from(degree)].push(number as u32);
    }
    let mut chosen = Vec::with_capacity(triangles / 2);
    while let Some(degree) = queues.iter().position(|queue| !queue.is_empty()) {
        let Some(number) = queues[degree].pop() else { continue };
        if !is_open[number as usize] || usize::from(degrees[number as usize]) != degree {
            continue;
        }
        is_open[number as usize] = false;
        chosen.push(number);
        for excluded in neighbours(number) {
            if !std::mem::replace(&mut is_open[excluded as usize], false) {
                continue;
            }
            for other in neighbours(excluded).filter(|&other| is_open[other as usize]) {
                let degree = &mut degrees[other as usize];
                *degree = degree.saturating_sub(1);
                queues[usize::from(*degree)].push(other);
            }
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(side: u32) -> Mesh {
        let positions = (0..=side).flat_map(|y| (0..=side).map(move |x| Vec3::new(x as f32, y as f32, 0.0)));
        let triangles = (0..side).flat_map(|y| (0..side).map(move |x| y * (side + 1) + x)).flat_map(|corner| {
            let below = corner + side + 1;
            // Rotated, so that corners have to be told.
            [[corner + 1, corner, below + 1], [below, below + 1, corner]]
        });
        Mesh::new(positions.collect(), triangles.collect()).unwrap()
    }

    /// Every triangle is in exactly one quad, as itself.
    fn check(mesh: &Mesh, quads: &[Quad], first_vertex: u32) {
        let mut seen = vec![0; mesh.triangles().len()];
        for quad in quads {
            for (triangle, places) in quad.triangles.into_iter().zip([[0, 1, 2], [0, 2, 3]]) {
                if triangle != NO_TRIANGLE {
                    seen[triangle as usize] += 1;
                    let mut vertices = places.map(|place: usize| quad.vertices[place] - first_vertex);
                    let expected = mesh.triangles()[triangle as usize];
                    let is_turned = (0..3).any(|_| {
                        vertices.rotate_left(1);
                        vertices == expected
                    });
                    assert!(is_turned, "{vertices:?} instead of {expected:?}");
                }
            }
        }
        assert!(seen.iter().all(|&times| times == 1));
    }

    #[test]
    fn a_grid_falls_into_quads() {
        for side in [1, 2, 7, 40] {
            let mesh = grid(side);
            let quads = quads(&mesh, 100);
            check(&mesh, &quads, 100);
            assert!(lone(&quads) * 20 <= quads.len(), "{side}: {} of {}", lone(&quads), quads.len());
        }
    }

    /// Triangles between any vertices: shared by many, turned over, degenerate, twice.
    #[test]
    fn every_triangle_of_any_mesh_is_in_one_quad() {
        let mut state = 7u32;
        let mut random = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % below
        };
        let mut paired = 0;
        for _ in 0..300 {
            let vertices = 1 + random(30);
            let positions: Vec<Vec3> = (0..vertices).map(|_| Vec3::from([(); 3].map(|()| random(5) as f32))).collect();
            let triangles: Vec<[u32; 3]> = (0..random(80)).map(|_| [(); 3].map(|()| random(vertices))).collect();
            let count = triangles.len();
            let mesh = Mesh::new(positions, triangles).unwrap();
            let quads = quads(&mesh, 5);
            check(&mesh, &quads, 5);
            assert_eq!(2 * quads.len() - lone(&quads), count);
            paired += quads.len() - lone(&quads);
            // No two that are alone could be one.
            let alone: Vec<u32> =
                quads.iter().filter(|quad| quad.triangles[1] == NO_TRIANGLE).map(|quad| quad.triangles[0]).collect();
            let is_left = |candidate: &Candidate| candidate.triangles.iter().all(|triangle| alone.contains(triangle));
            assert!(!candidates(&mesh).iter().any(is_left), "not maximal");
        }
        assert!(paired > 300, "{paired}");
    }

    #[test]
    fn what_shares_nothing_or_is_turned_over_stays_alone() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE, Vec3::new(1e3, 1e-3, 0.0)];
        let of = |triangles: Vec<[u32; 3]>| {
            let mesh = Mesh::new(positions.clone(), triangles).unwrap();
            let quads = quads(&mesh, 0);
            check(&mesh, &quads, 0);
            quads.len()
        };
        assert_eq!(of(vec![[0, 1, 2], [2, 1, 3]]), 1);
        assert_eq!(of(vec![[0, 1, 2], [1, 2, 3]]), 2, "turned over");
        assert_eq!(of(vec![[0, 1, 2], [1, 0, 4]]), 2, "too long");
        assert_eq!(of(vec![[0, 1, 2], [0, 1, 2]]), 2, "the same twice");
        assert_eq!(of(vec![[0, 0, 0], [1, 1, 2], [2, 1, 1]]), 3, "degenerate");
        assert_eq!(of(Vec::new()), 0);
    }
}
