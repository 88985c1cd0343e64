//! Clipping of a triangle against the near plane, the far plane and the guard band, in homogeneous coordinates
//! (Sutherland and Hodgman 1974, Blinn and Newell 1978).
//!
//! A new vertex is always computed from the inside end of its edge towards the outside one, so two triangles that share
//! an edge get the same vertex to the last bit, and no seam opens.

use glam::{DVec3, DVec4, Vec4};

use crate::pixel_grid::Viewport;

/// A corner of a clipped triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClippedVertex {
    /// Clip-space position.
    pub clip: DVec4,
    /// Weights of the original three corners.
    pub weights: DVec3,
}

/// Most corners of a clipped triangle: three, and one more for each of six planes.
pub const MAX_CLIPPED_VERTICES: usize = 9;

/// The part of a triangle inside all planes, a convex polygon with the triangle's winding: empty or at least three
/// corners. Positions must be finite.
pub fn clip_triangle(corners: [Vec4; 3], viewport: &Viewport) -> Vec<ClippedVertex> {
    let [guard_x, guard_y] = viewport.guard().map(f64::from);
    // Inside where the dot product is not negative; and how to land exactly on the plane, however large the numbers.
    type Land = fn(&mut DVec4, f64);
    let planes: [(DVec4, f64, Land); 6] = [
        (DVec4::new(0.0, 0.0, -1.0, 1.0), 0.0, land_on_near_plane),
        (DVec4::new(0.0, 0.0, 1.0, 0.0), 0.0, |clip, _| clip.z = 0.0),
        (DVec4::new(1.0, 0.0, 0.0, guard_x), guard_x, |clip, guard| clip.x = -guard * clip.w),
        (DVec4::new(-1.0, 0.0, 0.0, guard_x), guard_x, |clip, guard| clip.x = guard * clip.w),
        (DVec4::new(0.0, 1.0, 0.0, guard_y), guard_y, |clip, guard| clip.y = -guard * clip.w),
        (DVec4::new(0.0, -1.0, 0.0, guard_y), guard_y, |clip, guard| clip.y = guard * clip.w),
    ];
    let mut polygon = Vec::with_capacity(MAX_CLIPPED_VERTICES);
    polygon.extend(
        [DVec3::X, DVec3::Y, DVec3::Z]
            .into_iter()
            .zip(corners)
            .map(|(weights, clip)| ClippedVertex { clip: clip.as_dvec4(), weights }),
    );
    let mut next = Vec::with_capacity(MAX_CLIPPED_VERTICES);
    for (plane, guard, land) in planes {
        let crossing = |inside: ClippedVertex, distance_in: f64, outside: ClippedVertex, distance_out: f64| {
            let mut vertex = crossing(inside, distance_in, outside, distance_out);
            land(&mut vertex.clip, guard);
            vertex
        };
        next.clear();
        for (i, &current) in polygon.iter().enumerate() {
            let following = polygon[(i + 1) % polygon.len()];
            let (here, there) = (plane.dot(current.clip), plane.dot(following.clip));
            if here >= 0.0 {
                next.push(current);
            }
            if here >= 0.0 && there < 0.0 {
                next.push(crossing(current, here, following, there));
            } else if here < 0.0 && there >= 0.0 {
                next.push(crossing(following, there, current, here));
            }
        }
        std::mem::swap(&mut polygon, &mut next);
        if polygon.len() < 3 {
            return Vec::new();
        }
    }
    polygon
}

/// Where an edge crosses a plane, given its ends' signed distances: `inside` not negative, `outside` negative.
fn crossing(inside: ClippedVertex, distance_in: f64, outside: ClippedVertex, distance_out: f64) -> ClippedVertex {
    let t = distance_in / (distance_in - distance_out);
    ClippedVertex {
        clip: inside.clip + (outside.clip - inside.clip) * t,
        weights: inside.weights + (outside.weights - inside.weights) * t,
    }
}

/// On the near plane z equals w. A perspective camera's z is the same everywhere, and positive; an orthographic one's w.
fn land_on_near_plane(clip: &mut DVec4, _: f64) {
    if clip.w == 1.0 { clip.z = 1.0 } else { clip.w = clip.z }
}
