//! The lighting model: base colour x vertex colour x texture, a two-sided Lambert head light and a little ambient light.
//!
//! The head light shines along the line of sight of the camera, so a surface's brightness depends on its normal alone.
//! Interpolated normals are normalised at every fragment; a perspective division before that would change only their
//! length, so it is left out. Every surface is lit by a [`NormalPlane`]: a flat one's does not change over the screen, an
//! unlit one's faces the camera. Where colour varies too, [`Varying`] holds its parts.

use glam::{Vec2, Vec3, Vec3A, Vec4};

use crate::pixel_grid::{Plane, ScreenVertex};
use crate::primitive::{Corners, Draw, Piece};

/// Share of the light that comes from everywhere.
pub const AMBIENT: f32 = 0.25;

/// Greatest value of a colour: that of a half float, in which fragments are stored.
pub const GREATEST_COLOR: Vec4 = Vec4::splat(65_504.0);

/// Brightness of a surface with this camera-space normal, of any length: 1 facing the camera.
#[inline(always)]
pub fn light(normal: Vec3A) -> f32 {
    let length = normal.dot(normal).sqrt();
    // A normal without direction is taken to face the camera. NaN has none either.
    let lambert = if length > 0.0 && length < f32::INFINITY { normal.z.abs() / length } else { 1.0 };
    AMBIENT + (1.0 - AMBIENT) * lambert
}

/// A piece's camera-space normal over w, affine on the screen: `(value + y * dy) + x * dx`, in pixels from the piece's
/// anchor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalPlane {
    /// Normal at the anchor.
    pub value: Vec3A,
    /// Change for one pixel to the right.
    pub dx: Vec3A,
    /// Change for one pixel downwards.
    pub dy: Vec3A,
}

/// The camera-space normal over w at a piece's first corner, and how much those at the other two differ from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerNormals(pub [Vec3; 3]);

impl CornerNormals {
    /// The normals of a piece of one triangle of a draw's mesh.
    #[inline(always)]
    pub fn new(draw: &Draw<'_>, triangle: usize, vertices: &[ScreenVertex; 3], corners: &Corners) -> Self {
        let constant = |value: Vec3A| Self([value.into(), Vec3::ZERO, Vec3::ZERO]);
        if !draw.lit {
            return constant(Vec3A::Z);
        }
        let [i, j, k] = draw.mesh.triangles()[triangle];
        let (i, j, k) = (i as usize, j as usize, k as usize);
        let Some(normals) = draw.mesh.normals() else {
            let positions = draw.mesh.positions();
            let (a, b, c) = (positions[i], positions[j], positions[k]);
            // Of edges about 1 long, so that squares of it stay within f32 at any scale.
            let unit = |edge: Vec3| edge / edge.abs().max_element().max(f32::MIN_POSITIVE);
            return constant(draw.view_from_normal * Vec3A::from(unit(b - a).cross(unit(c - a))));
        };
        let corner = |vertex: usize| draw.view_from_normal * Vec3A::from(normals[vertex]);
        let [a, b, c] = corners.attribute([corner(i), corner(j), corner(k)]);
        let a = a * vertices[0].inv_w;
        let (to_b, to_c) = (b * vertices[1].inv_w - a, c * vertices[2].inv_w - a);
        Self([a.into(), to_b.into(), to_c.into()])
    }
}

impl NormalPlane {
    /// From a piece's normals and its [`weight_planes`].
    ///
    /// [`weight_planes`]: crate::pixel_grid::ScreenTriangle::weight_planes
    #[inline(always)]
    pub fn new(normals: &CornerNormals, [second, third]: [Plane; 2]) -> Self {
        let [a, to_b, to_c] = normals.0.map(Vec3A::from);
        Self {
            value: a + (to_b * second.value as f32 + to_c * third.value as f32),
            dx: to_b * second.dx as f32 + to_c * third.dx as f32,
            dy: to_b * second.dy as f32 + to_c * third.dy as f32,
        }
    }

    /// Brightness `x` pixels to the right of the anchor and `y` below it.
    #[inline(always)]
    pub fn light_at(&self, x: i32, y: i32) -> f32 {
        light((self.value + self.dy * y as f32) + self.dx * x as f32)
    }
}

/// A premultiplied colour in this light.
#[inline(always)]
pub fn lit(premultiplied: Vec4, light: f32) -> Vec4 {
    premultiplied * Vec4::new(light, light, light, 1.0)
}

/// The parts of a colour that varies over a piece, or has to pass an alpha test. Attributes at corners are divided by w:
/// affine on the screen.
#[derive(Debug, Clone)]
pub struct Varying {
    /// Weights of the second and third corner.
    pub weights: [Plane; 2],
    /// 1 / w at the corners.
    pub inv_w: [f32; 3],
    /// Vertex colours over w, if there are any.
    pub vertex_colors: Option<[Vec4; 3]>,
    /// Texture coordinates over w, moved as the material says, if there is a texture.
    pub tex_coords: Option<[Vec2; 3]>,
}

impl Varying {
    /// For a piece of one triangle of a draw's mesh; only where [`Draw::varies`].
    pub fn new(draw: &Draw<'_>, triangle: usize, piece: &Piece, weights: [Plane; 2]) -> Self {
        let vertices = draw.mesh.triangles()[triangle].map(|vertex| vertex as usize);
        let inv_w = piece.triangle.vertices.map(|vertex| vertex.inv_w);
        let vertex_colors = draw.mesh.colors().map(|colors| {
            let [a, b, c] = piece.corners.attribute(vertices.map(|vertex| colors[vertex]));
            [a * inv_w[0], b * inv_w[1], c * inv_w[2]]
        });
        let tex_coords = draw.texture.and_then(|(_, texture)| {
            let tex_coords = draw.mesh.tex_coords()?;
            let moved = vertices.map(|vertex| texture.transform.transform_point2(tex_coords[vertex]));
            let [a, b, c] = piece.corners.attribute(moved);
            Some([a * inv_w[0], b * inv_w[1], c * inv_w[2]])
        });
        Self { weights, inv_w, vertex_colors, tex_coords }
    }

    /// The colour, premultiplied and unlit, `x` pixels to the right of the anchor and `y` below it; `None` where the alpha
    /// test fails.
    pub fn color_at(&self, draw: &Draw<'_>, x: i32, y: i32) -> Option<Vec4> {
        let color = self.straight_color_at(draw, x, y);
        if draw.cutoff.is_some_and(|cutoff| color.w < cutoff) {
            return None;
        }
        Some(draw.premultiplied(color))
    }

    /// The colour, straight and unlit, before any alpha test.
    pub fn straight_color_at(&self, draw: &Draw<'_>, x: i32, y: i32) -> Vec4 {
        let [second, third] = self.weights.map(|plane| plane.at(x, y) as f32);
        let weights = [1.0 - second - third, second, third];
        let mut color = draw.material.base_color;
        let w = 1.0 / interpolate(self.inv_w, weights);
        if let Some(vertex_colors) = self.vertex_colors {
            color *= interpolate(vertex_colors, weights) * w;
        }
        if let Some(tex_coords) = self.tex_coords {
            color *= self.texture_color(draw, tex_coords, weights, w);
        }
        // Vertex colours may be anything, and coordinates so large that 1 / w is lost.
        if color.is_nan() { draw.material.base_color } else { color.clamp(Vec4::ZERO, GREATEST_COLOR) }
    }

    fn texture_color(&self, draw: &Draw<'_>, tex_coords: [Vec2; 3], weights: [f32; 3], w: f32) -> Vec4 {
        let Some((texture, _)) = draw.texture else { return Vec4::ONE };
        let uv = interpolate(tex_coords, weights) * w;
        // The quotient rule on (u / w) / (1 / w).
        let derivative = |second: f64, third: f64| {
            let (second, third) = (second as f32, third as f32);
            let numerator = slope(tex_coords, second, third);
            let denominator = slope(self.inv_w, second, third);
            (numerator - uv * denominator) * w
        };
        let [second, third] = self.weights;
        texture.sample(uv, derivative(second.dx, third.dx), derivative(second.dy, third.dy))
    }
}

impl Draw<'_> {
    /// Whether colour varies over a triangle or has to pass an alpha test; if not it is [`Draw::base_color`] in the light.
    #[inline(always)]
    pub fn varies(&self) -> bool {
        self.cutoff.is_some() || self.texture.is_some() || self.mesh.colors().is_some()
    }

    /// A colour of this draw, given straight, as it is captured: its alpha as material and view say, premultiplied.
    #[inline(always)]
    pub fn premultiplied(&self, color: Vec4) -> Vec4 {
        let alpha = if self.blends { color.w.min(1.0) * self.opacity } else { self.opacity };
        (color.truncate() * alpha).extend(alpha)
    }
}

/// The colour of a piece at a pixel, relative to its anchor: linear light, premultiplied; `None` where the alpha test
/// fails.
#[inline(always)]
pub fn color_at(draw: &Draw<'_>, normal: &NormalPlane, varying: Option<&Varying>, x: i32, y: i32) -> Option<Vec4> {
    let color = match varying {
        None => draw.base_color,
        Some(varying) => varying.color_at(draw, x, y)?,
    };
    Some(lit(color, normal.light_at(x, y)))
}

#[inline]
fn interpolate<T>([a, b, c]: [T; 3], [first, second, third]: [f32; 3]) -> T
where
    T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>,
{
    (a * first + b * second) + c * third
}

/// Change of a value interpolated between corners where the second and third weight change by so much.
#[inline]
pub fn slope<T>([a, b, c]: [T; 3], second: f32, third: f32) -> T
where
    T: Copy + std::ops::Add<Output = T> + std::ops::Sub<Output = T> + std::ops::Mul<f32, Output = T>,
{
    (b - a) * second + (c - a) * third
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_depends_on_the_angle_alone() {
        assert_eq!(light(Vec3A::Z), 1.0);
        assert_eq!(light(Vec3A::NEG_Z * 1e-10), 1.0);
        assert_eq!(light(Vec3A::X), AMBIENT);
        let slanted = Vec3A::from(Vec3::new(3.0, 0.0, 4.0));
        assert!((light(slanted) - (AMBIENT + (1.0 - AMBIENT) * 0.8)).abs() < 1e-6);
    }

    #[test]
    fn a_normal_without_direction_is_lit_as_if_it_faced_the_camera() {
        for normal in [Vec3A::ZERO, Vec3A::NAN, Vec3A::INFINITY, Vec3A::splat(1e-30), Vec3A::splat(1e30)] {
            assert_eq!(light(normal), 1.0);
        }
    }
}
