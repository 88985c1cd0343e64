//! The lighting model: base colour x vertex colour x texture, a two-sided Lambert head light and a little ambient light.
//!
//! The head light shines along the line of sight of the camera, so a surface's brightness depends on its normal alone.
//! Interpolated normals are normalised at every fragment; a perspective division before that would change only their
//! length, so it is left out.

use glam::{Vec2, Vec3, Vec4};

use crate::pixel_grid::Plane;
use crate::primitive::{Draw, Piece};

/// Share of the light that comes from everywhere.
pub const AMBIENT: f32 = 0.25;

/// Greatest value of a colour: that of a half float, in which fragments are stored.
pub const GREATEST_COLOR: Vec4 = Vec4::splat(65_504.0);

/// Brightness of a surface with this camera-space normal, of any length.
#[inline]
pub fn light(normal: Vec3) -> f32 {
    let length = normal.dot(normal).sqrt();
    // A normal without direction is taken to face the camera. Not `<=`: NaN has none either.
    let lambert = if length > 0.0 && length.is_finite() { normal.z.abs() / length } else { 1.0 };
    AMBIENT + (1.0 - AMBIENT) * lambert
}

/// A piece of a primitive, ready to be shaded at any pixel. Attributes at corners are divided by w: affine on the screen.
#[derive(Debug, Clone)]
pub struct Surface {
    anchor_px: [i32; 2],
    weights: [Plane; 2],
    inv_w: [f32; 3],
    color: SurfaceColor,
    light: SurfaceLight,
}

#[derive(Debug, Clone)]
enum SurfaceColor {
    Constant(Vec4),
    Varying { vertex_colors: Option<[Vec4; 3]>, tex_coords: Option<[Vec2; 3]> },
}

#[derive(Debug, Clone)]
enum SurfaceLight {
    Constant(f32),
    Normals([Vec3; 3]),
}

impl Surface {
    /// A piece of one triangle of a draw's mesh.
    pub fn new(draw: &Draw<'_>, triangle: usize, piece: &Piece) -> Self {
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
        let color = if vertex_colors.is_none() && tex_coords.is_none() {
            SurfaceColor::Constant(draw.material.base_color)
        } else {
            SurfaceColor::Varying { vertex_colors, tex_coords }
        };
        let light = match draw.mesh.normals() {
            _ if !draw.lit => SurfaceLight::Constant(1.0),
            None => SurfaceLight::Constant(light(flat_normal(draw, vertices))),
            Some(normals) => {
                let [a, b, c] = piece.corners.attribute(vertices.map(|vertex| draw.view_from_normal * normals[vertex]));
                SurfaceLight::Normals([a * inv_w[0], b * inv_w[1], c * inv_w[2]])
            }
        };
        Self { anchor_px: piece.triangle.anchor_px(), weights: piece.triangle.weight_planes(), inv_w, color, light }
    }

    /// The colour at a pixel, linear light and premultiplied alpha; `None` where the alpha test fails. `draw` is the one
    /// the surface was made of.
    pub fn color(&self, draw: &Draw<'_>, x_px: i32, y_px: i32) -> Option<Vec4> {
        let weights = self.weights_at(x_px, y_px);
        let base = match &self.color {
            SurfaceColor::Constant(color) => *color,
            SurfaceColor::Varying { vertex_colors, tex_coords } => {
                let w = 1.0 / interpolate(self.inv_w, weights);
                let mut color = draw.material.base_color;
                if let Some(vertex_colors) = vertex_colors {
                    color *= interpolate(*vertex_colors, weights) * w;
                }
                if let Some(tex_coords) = tex_coords {
                    color *= self.texture_color(draw, *tex_coords, weights, w);
                }
                // Vertex colours may be anything, and coordinates so large that 1 / w is lost.
                if color.is_nan() { draw.material.base_color } else { color.clamp(Vec4::ZERO, GREATEST_COLOR) }
            }
        };
        if draw.cutoff.is_some_and(|cutoff| base.w < cutoff) {
            return None;
        }
        let alpha = if draw.blends { base.w.clamp(0.0, 1.0) * draw.opacity } else { draw.opacity };
        let light = match &self.light {
            SurfaceLight::Constant(light) => *light,
            SurfaceLight::Normals(normals) => light(interpolate(*normals, weights)),
        };
        Some((base.truncate() * (light * alpha)).extend(alpha))
    }

    /// The screen-space barycentric weights of the three corners at a pixel.
    #[inline]
    fn weights_at(&self, x_px: i32, y_px: i32) -> [f32; 3] {
        let (x, y) = (x_px - self.anchor_px[0], y_px - self.anchor_px[1]);
        let [second, third] = self.weights.map(|plane| plane.at(x, y) as f32);
        [1.0 - second - third, second, third]
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

/// The camera-space normal of a triangle's plane, of any length and either sign.
fn flat_normal(draw: &Draw<'_>, vertices: [usize; 3]) -> Vec3 {
    let [a, b, c] = vertices.map(|vertex| draw.mesh.positions()[vertex]);
    draw.view_from_normal * (b - a).cross(c - a)
}

#[inline]
fn interpolate<T>([a, b, c]: [T; 3], [first, second, third]: [f32; 3]) -> T
where
    T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>,
{
    (a * first + b * second) + c * third
}

/// Change of an interpolated value where the second and third weight change by so much.
#[inline]
fn slope<T>([a, b, c]: [T; 3], second: f32, third: f32) -> T
where
    T: Copy + std::ops::Add<Output = T> + std::ops::Sub<Output = T> + std::ops::Mul<f32, Output = T>,
{
    (b - a) * second + (c - a) * third
}
