//! The pixel grid: where vertices snap, and which pixels a triangle covers.
//!
//! Positions snap to 1/256 pixel. Coverage is then decided in integers alone: a triangle covers a pixel if the pixel's
//! centre (x + 0.5, y + 0.5) lies inside all three edges, or on an edge that is a *top* or a *left* one (the fill rule of
//! Direct3D, Vulkan and WebGPU). Two triangles that share an edge therefore cover every pixel along it exactly once.
//!
//! Coordinates: x to the right, y downwards, from the top left corner of the picture; in subpixels unless a name says
//! pixels (`px`).

use glam::{DVec2, Vec4};

use crate::view::View;

/// Subpixels in a pixel, along one axis.
pub const SUBPIXELS: i32 = 256;

/// Distance from the middle of the picture, in pixels along each axis, up to which triangles are rasterized as they are;
/// what reaches beyond is clipped. Twice the farthest pixel of the largest picture, and small enough that two snapped
/// positions never differ by more than 2^23 subpixels.
pub const GUARD_BAND_PX: i32 = 16_384;

/// From clip space to the pixel grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewport {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Half the picture in subpixels.
    half_x: i32,
    half_y: i32,
}

/// A vertex on the pixel grid.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ScreenVertex {
    /// Subpixels from the left.
    pub x: i32,
    /// Subpixels from the top.
    pub y: i32,
    /// Reverse-Z depth in 0..=1.
    pub depth: f32,
    /// One over clip-space w.
    pub inv_w: f32,
}

/// Bits of [`Viewport::outcode`]: beyond which plane of the clip volume a position lies.
pub mod outcode {
    /// In front of the near plane.
    pub const NEAR: u8 = 1;
    /// Beyond the far plane.
    pub const FAR: u8 = 2;
    /// Beyond the guard band to the left.
    pub const LEFT: u8 = 4;
    /// Beyond the guard band to the right.
    pub const RIGHT: u8 = 8;
    /// Beyond the guard band at the top.
    pub const TOP: u8 = 16;
    /// Beyond the guard band at the bottom.
    pub const BOTTOM: u8 = 32;
    /// Not a number, or infinite.
    pub const NOT_FINITE: u8 = 64;
}

impl Viewport {
    /// The viewport of a view, whose size has been checked.
    pub fn of(view: &View) -> Self {
        let half = |size: u32| size as i32 * (SUBPIXELS / 2);
        Self { width: view.width, height: view.height, half_x: half(view.width), half_y: half(view.height) }
    }

    /// Half the picture in subpixels, in x and y.
    pub fn half(&self) -> [i32; 2] {
        [self.half_x, self.half_y]
    }

    /// Guard band over half the picture, in x and y: a position is inside while |x| <= guard * w.
    pub fn guard(&self) -> [f32; 2] {
        let guard = (GUARD_BAND_PX * SUBPIXELS) as f32;
        [guard / self.half_x as f32, guard / self.half_y as f32]
    }

    /// Beyond which planes a clip-space position lies; 0 if it can be projected as it is.
    #[inline(always)]
    pub fn outcode(&self, clip: Vec4) -> u8 {
        let [guard_x, guard_y] = self.guard();
        let (x, y) = (guard_x * clip.w, guard_y * clip.w);
        let bit = |beyond: bool, bit: u8| if beyond { bit } else { 0 };
        bit(clip.z > clip.w, outcode::NEAR)
            | bit(clip.z < 0.0, outcode::FAR)
            | bit(clip.x < -x, outcode::LEFT)
            | bit(clip.x > x, outcode::RIGHT)
            | bit(clip.y > y, outcode::TOP)
            | bit(clip.y < -y, outcode::BOTTOM)
            | bit(!clip.is_finite(), outcode::NOT_FINITE)
    }

    /// Divides by w and snaps to the grid. The position must lie inside all planes of [`Self::outcode`].
    #[inline(always)]
    pub fn project(&self, clip: Vec4) -> ScreenVertex {
        let inv_w = 1.0 / clip.w;
        // Rounding may lead a little over the guard band, and 1 / w may be infinite.
        let guard = (GUARD_BAND_PX * SUBPIXELS) as f32;
        let snap = |ndc: f32, half: i32| (ndc * half as f32).max(-guard).min(guard).round_ties_even() as i32;
        let (x, y) = (snap(clip.x * inv_w, self.half_x), snap(clip.y * inv_w, self.half_y));
        // Order keys are made of the bits: `max` turns NaN into 0, adding zero turns -0 into 0.
        let depth = (clip.z * inv_w).max(0.0) + 0.0;
        let depth = depth.min(1.0);
        ScreenVertex { x: self.half_x + x, y: self.half_y - y, depth, inv_w }
    }
}

/// The subpixel coordinate of a pixel's centre, along one axis.
#[inline(always)]
pub fn center(px: i32) -> i32 {
    px * SUBPIXELS + SUBPIXELS / 2
}

/// One edge of a triangle as a line: `a * x + b * y + c`, positive inside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// Change for one subpixel to the right.
    pub a: i64,
    /// Change for one subpixel downwards.
    pub b: i64,
    /// Value at the origin.
    pub c: i64,
    /// Whether pixel centres on the line are inside: a top or a left edge.
    pub owns_line: bool,
}

impl Edge {
    fn new(from: ScreenVertex, to: ScreenVertex) -> Self {
        let (dx, dy) = (i64::from(to.x) - i64::from(from.x), i64::from(to.y) - i64::from(from.y));
        let (a, b) = (-dy, dx);
        Self {
            a,
            b,
            c: -(a * i64::from(from.x) + b * i64::from(from.y)),
            // Clockwise on the screen: a top edge runs to the right, a left edge runs upwards.
            owns_line: dy < 0 || (dy == 0 && dx > 0),
        }
    }

    /// Value at a position in subpixels.
    #[inline(always)]
    pub fn at(&self, x: i32, y: i32) -> i64 {
        self.a * i64::from(x) + self.b * i64::from(y) + self.c
    }

    /// Value at a position, less 1 if the line itself is not inside: inside exactly where it is not negative.
    #[inline(always)]
    pub fn biased_at(&self, x: i32, y: i32) -> i64 {
        self.at(x, y) - i64::from(!self.owns_line)
    }
}

/// A value that is affine over the screen, evaluated at pixel centres: `(value + y * dy) + x * dx` in f64, in exactly this
/// order, with x and y in pixels from an anchor. Anchored near the triangle, so that little cancels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Value at the anchor pixel's centre.
    pub value: f64,
    /// Change for one pixel to the right.
    pub dx: f64,
    /// Change for one pixel downwards.
    pub dy: f64,
}

impl Plane {
    /// Value `x` pixels to the right of the anchor and `y` below it.
    #[inline(always)]
    pub fn at(&self, x: i32, y: i32) -> f64 {
        (self.value + f64::from(y) * self.dy) + f64::from(x) * self.dx
    }
}

/// A triangle on the pixel grid, clockwise on the screen, of non-zero area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScreenTriangle {
    /// Its corners.
    pub vertices: [ScreenVertex; 3],
    /// Edge `i` lies opposite to corner `i`.
    pub edges: [Edge; 3],
    /// Twice its area in square subpixels; positive.
    pub twice_area: i64,
}

/// Twice the signed area in square subpixels: positive if the corners run clockwise on the screen.
#[inline(always)]
pub fn twice_signed_area([a, b, c]: [ScreenVertex; 3]) -> i64 {
    (i64::from(b.x) - i64::from(a.x)) * (i64::from(c.y) - i64::from(a.y))
        - (i64::from(c.x) - i64::from(a.x)) * (i64::from(b.y) - i64::from(a.y))
}

/// Whether a pixel's centre lies within one subpixel of a triangle's outline, so that another rounding of the vertices
/// might cover it or not. The triangle may have no area.
pub fn is_near_outline(corners: [ScreenVertex; 3], x_px: i32, y_px: i32) -> bool {
    let point = DVec2::new(f64::from(center(x_px)), f64::from(center(y_px)));
    let [a, b, c] = corners.map(|vertex| DVec2::new(f64::from(vertex.x), f64::from(vertex.y)));
    [(a, b), (b, c), (c, a)].into_iter().any(|(from, to)| {
        let along = to - from;
        let t = ((point - from).dot(along) / along.length_squared().max(1.0)).clamp(0.0, 1.0);
        point.distance_squared(from + along * t) <= 1.0
    })
}

/// Whether a triangle is so thin that another rounding of its corners might turn it over.
pub fn may_turn_over(corners: [ScreenVertex; 3]) -> bool {
    let [a, b, c] = corners.map(|vertex| DVec2::new(f64::from(vertex.x), f64::from(vertex.y)));
    twice_signed_area(corners).abs() as f64 <= a.distance(b) + b.distance(c) + c.distance(a) + 1.0
}

impl ScreenTriangle {
    /// The triangle with these corners; `None` unless they run clockwise on the screen around a non-zero area.
    pub fn new(vertices: [ScreenVertex; 3]) -> Option<Self> {
        let twice_area = twice_signed_area(vertices);
        if twice_area <= 0 {
            return None;
        }
        let [a, b, c] = vertices;
        Some(Self { vertices, edges: [Edge::new(b, c), Edge::new(c, a), Edge::new(a, b)], twice_area })
    }

    /// Whether the triangle covers a pixel.
    pub fn covers(&self, x_px: i32, y_px: i32) -> bool {
        self.edges.iter().all(|edge| edge.biased_at(center(x_px), center(y_px)) >= 0)
    }

    /// The pixel that its planes are anchored at: the one with the first corner in it.
    #[inline(always)]
    pub fn anchor_px(&self) -> [i32; 2] {
        [self.vertices[0].x.div_euclid(SUBPIXELS), self.vertices[0].y.div_euclid(SUBPIXELS)]
    }

    /// The planes of the second and third corner's barycentric weight (screen space, not perspective-correct).
    #[inline(always)]
    pub fn weight_planes(&self) -> [Plane; 2] {
        let [x, y] = self.anchor_px().map(center);
        let inv_area = 1.0 / self.twice_area as f64;
        let step = f64::from(SUBPIXELS) * inv_area;
        [self.edges[1], self.edges[2]].map(|edge| Plane {
            value: edge.at(x, y) as f64 * inv_area,
            dx: edge.a as f64 * step,
            dy: edge.b as f64 * step,
        })
    }

    /// The plane of depth, given [`Self::weight_planes`]. Rounded to f32 and clamped to [`Self::depth_range`] it is a
    /// fragment's depth.
    #[inline(always)]
    pub fn depth_plane(&self, [second, third]: [Plane; 2]) -> Plane {
        let [z0, z1, z2] = self.vertices.map(|v| f64::from(v.depth));
        let (dz1, dz2) = (z1 - z0, z2 - z0);
        Plane {
            value: z0 + (second.value * dz1 + third.value * dz2),
            dx: second.dx * dz1 + third.dx * dz2,
            dy: second.dy * dz1 + third.dy * dz2,
        }
    }

    /// Least and greatest depth of the corners. Clamping to it keeps slivers, whose planes are steep, in place.
    #[inline(always)]
    pub fn depth_range(&self) -> [f32; 2] {
        let [a, b, c] = self.vertices.map(|v| v.depth);
        [a.min(b).min(c), a.max(b).max(c)]
    }
}

/// A fragment's depth: a plane's value rounded to f32, inside the range of its triangle. Adding zero turns -0, whose bits
/// would be in front of everything, into 0.
#[inline(always)]
pub fn depth_at(plane: &Plane, [least, greatest]: [f32; 2], x_from_anchor: i32, y_from_anchor: i32) -> f32 {
    (plane.at(x_from_anchor, y_from_anchor) as f32).clamp(least, greatest) + 0.0
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn vertex(x: i32, y: i32) -> ScreenVertex {
        ScreenVertex { x, y, depth: 0.5, inv_w: 1.0 }
    }

    fn triangle(points: [(i32, i32); 3]) -> Option<ScreenTriangle> {
        let mut corners = points.map(|(x, y)| vertex(x, y));
        if twice_signed_area(corners) < 0 {
            corners.swap(1, 2);
        }
        ScreenTriangle::new(corners)
    }

    #[test]
    fn a_depth_just_below_zero_is_zero_and_not_minus_zero() {
        let plane = Plane { value: -1e-60, dx: 0.0, dy: 0.0 };
        assert_eq!(depth_at(&plane, [0.0, 1.0], 0, 0).to_bits(), 0, "its bits would lie in front of everything");
    }

    #[test]
    fn a_pixel_square_owns_its_top_left_corner_only() {
        // Corners on pixel centres: of the four centres on its outline only the top left one is covered.
        let (low, high) = (center(1), center(2));
        let covered = |x, y| {
            let halves = [
                triangle([(low, low), (high, low), (high, high)]).unwrap(),
                triangle([(low, low), (high, high), (low, high)]).unwrap(),
            ];
            halves.iter().filter(|half| half.covers(x, y)).count()
        };
        assert_eq!([covered(1, 1), covered(2, 1), covered(1, 2), covered(2, 2)], [1, 0, 0, 0]);
    }

    fn point() -> impl Strategy<Value = (i32, i32)> {
        // Often on the pixel centres, where the fill rule decides.
        let coordinate = || prop_oneof![(-1..9).prop_map(center), -300..2400];
        (coordinate(), coordinate())
    }

    proptest! {
        /// A fan from the corners to any point covers each pixel as often as the triangle itself does: parts that run
        /// the other way are counted off.
        #[test]
        fn triangles_that_share_edges_cover_each_pixel_once(a in point(), b in point(), c in point(), apex in point()) {
            let signed_count = |points: [(i32, i32); 3], x, y| {
                let turn = twice_signed_area(points.map(|(x, y)| vertex(x, y))).signum();
                triangle(points).map_or(0, |part| if part.covers(x, y) { turn } else { 0 })
            };
            for y in -2..11 {
                for x in -2..11 {
                    let fan: i64 = [[a, b, apex], [b, c, apex], [c, a, apex]].map(|part| signed_count(part, x, y)).iter().sum();
                    prop_assert_eq!(fan, signed_count([a, b, c], x, y), "pixel {} {}", x, y);
                }
            }
        }

        #[test]
        fn depth_stays_within_the_corners(a in point(), b in point(), c in point(), depths in prop::array::uniform3(0.0f32..1.0)) {
            let Some(mut t) = triangle([a, b, c]) else { return Ok(()) };
            for (vertex, depth) in t.vertices.iter_mut().zip(depths) {
                vertex.depth = depth;
            }
            let (plane, [x0, y0]) = (t.depth_plane(t.weight_planes()), t.anchor_px());
            for y in -2..11 {
                for x in -2..11 {
                    if t.covers(x, y) {
                        let exact: f64 = (0..3)
                            .map(|i| t.edges[i].at(center(x), center(y)) as f64 / t.twice_area as f64 * f64::from(t.vertices[i].depth))
                            .sum();
                        let depth = depth_at(&plane, t.depth_range(), x - x0, y - y0);
                        prop_assert!((f64::from(depth) - exact).abs() < 1e-7, "{} for {}", depth, exact);
                    }
                }
            }
        }
    }
}
