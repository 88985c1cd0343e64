//! What a pass is told of a fragment.

use std::ops::{Add, Mul};

use glam::{Vec3, Vec4};
use pellucid_core::fbuffer::Place;
use pellucid_core::fbuffer::order::{Geometry, Primitive};
use pellucid_core::pixel_grid::{Plane, depth_at};
use pellucid_core::primitive::{Corners, Draw, Piece};
use pellucid_core::shading::{CornerNormals, NormalPlane, Varying, color_at};

/// A piece with the planes of what varies over it.
#[derive(Debug)]
pub(super) struct Shaded {
    piece: Piece,
    weights: [Plane; 2],
    depth: Plane,
    normal: NormalPlane,
    varying: Option<Varying>,
}

impl Shaded {
    /// The pieces of a primitive.
    pub(super) fn of(geometry: &Geometry<'_>, primitive: &Primitive) -> Vec<Self> {
        let (draw, triangle) = (&geometry.draws[primitive.draw as usize], primitive.triangle as usize);
        let pieces = geometry.pieces_of(primitive).iter();
        pieces
            .map(|piece| {
                let weights = piece.triangle.weight_planes();
                let normals = CornerNormals::new(draw, triangle, &piece.triangle.vertices, &piece.corners);
                Self {
                    piece: *piece,
                    weights,
                    depth: piece.triangle.depth_plane(weights),
                    normal: NormalPlane::new(&normals, weights),
                    varying: draw.varies().then(|| Varying::new(draw, triangle, piece, weights)),
                }
            })
            .collect()
    }
}

/// A fragment, the same in every pass.
#[derive(Debug)]
pub struct Fragment<'a> {
    /// Its position in rasterization order.
    pub slot: u64,
    /// Column of its pixel.
    pub x: u32,
    /// Row of its pixel.
    pub y: u32,
    /// Reverse-Z depth in 0..=1.
    pub depth: f32,
    /// The instance.
    pub draw: &'a Draw<'a>,
    /// Number of its triangle in the draw's mesh.
    pub triangle: usize,
    shaded: &'a Shaded,
}

impl<'a> Fragment<'a> {
    pub(super) fn new(geometry: &'a Geometry<'_>, place: &Place, shaded: &'a Shaded) -> Self {
        let primitive = &geometry.primitives[place.primitive];
        let triangle = &shaded.piece.triangle;
        let [left, top] = triangle.anchor_px();
        let depth = depth_at(&shaded.depth, triangle.depth_range(), place.x as i32 - left, place.y as i32 - top);
        Self {
            slot: place.slot,
            x: place.x,
            y: place.y,
            depth,
            draw: &geometry.draws[primitive.draw as usize],
            triangle: primitive.triangle as usize,
            shaded,
        }
    }

    /// Number of its primitive in draw order.
    pub fn primitive(&self) -> u32 {
        self.draw.first_primitive + self.triangle as u32
    }

    /// The colour that the lighting model gives it: linear light, premultiplied; `None` where its alpha test fails.
    pub fn color(&self) -> Option<Vec4> {
        let [x, y] = self.offset_px();
        color_at(self.draw, &self.shaded.normal, self.shaded.varying.as_ref(), x, y)
    }

    /// Weights of its triangle's three vertices, perspective-correct.
    pub fn weights(&self) -> Vec3 {
        let [x, y] = self.offset_px();
        let [second, third] = self.shaded.weights.map(|plane| plane.at(x, y));
        let inv_w = self.shaded.piece.triangle.vertices.map(|vertex| f64::from(vertex.inv_w));
        let [a, b, c] = [(1.0 - second - third) * inv_w[0], second * inv_w[1], third * inv_w[2]];
        let sum = a + b + c;
        let [a, b, c] = [a, b, c].map(|weight| (weight / sum) as f32);
        match self.shaded.piece.corners {
            Corners::Whole { swapped: false } => Vec3::new(a, b, c),
            Corners::Whole { swapped: true } => Vec3::new(a, c, b),
            Corners::Clipped(weights) => weights[0] * a + weights[1] * b + weights[2] * c,
        }
    }

    /// A vertex attribute from the triangle's three vertices.
    pub fn interpolate<T: Copy + Add<Output = T> + Mul<f32, Output = T>>(&self, [a, b, c]: [T; 3]) -> T {
        let weights = self.weights();
        a * weights.x + b * weights.y + c * weights.z
    }

    /// Its triangle's vertices in the draw's mesh.
    pub fn vertices(&self) -> [usize; 3] {
        self.draw.mesh.triangles()[self.triangle].map(|vertex| vertex as usize)
    }

    /// Pixels from the anchor of its piece's planes.
    fn offset_px(&self) -> [i32; 2] {
        let [left, top] = self.shaded.piece.triangle.anchor_px();
        [self.x as i32 - left, self.y as i32 - top]
    }
}
