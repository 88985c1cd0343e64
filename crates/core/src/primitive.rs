//! From a scene's triangles to triangles on the pixel grid: transform, clip, snap, cull.
//!
//! A [`Draw`] is one instance with everything that is the same for all its triangles. [`Draw::pieces`] is the geometry
//! stage as the contract defines it; a renderer may do the same faster, never differently.

use std::ops::{Add, Mul};

use glam::{DAffine3, DMat4, DVec3, Mat3A, Mat4, Vec3, Vec4};

use crate::clip::clip_triangle;
use crate::pixel_grid::{ScreenTriangle, ScreenVertex, Viewport, outcode, twice_signed_area};
use crate::scene::{AlphaMode, Material, MaterialTexture, Mesh};
use crate::view::Shading;
use crate::{Error, Scene, Texture, View};

/// Which part of a frame a surface belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Pass {
    /// Hides what is behind: goes through the depth buffer, before everything transparent.
    Opaque,
    /// Captured.
    Transparent,
}

/// One instance, ready to be drawn.
#[derive(Debug, Clone)]
pub struct Draw<'a> {
    /// Its triangles.
    pub mesh: &'a Mesh,
    /// What it looks like.
    pub material: &'a Material,
    /// Its texture and how coordinates are moved first; `None` too if the mesh has no coordinates.
    pub texture: Option<(&'a Texture, MaterialTexture)>,
    /// Clip space from the mesh's own.
    pub clip_from_mesh: Mat4,
    /// Turns normals into camera space, up to a factor.
    pub view_from_normal: Mat3A,
    /// Number of its first triangle in draw order.
    pub first_primitive: u32,
    /// Which part of the frame it belongs to.
    pub pass: Pass,
    /// Alpha below it is not there.
    pub cutoff: Option<f32>,
    /// Whether base colour and texture have a say in alpha; if not it is `opacity` alone.
    pub blends: bool,
    /// Multiplies alpha.
    pub opacity: f32,
    /// The material's base colour as it is captured where nothing varies: premultiplied, unlit.
    pub base_color: Vec4,
    /// Whether it is lit.
    pub lit: bool,
    /// Whether back faces are left out: as the material says, unless it is only the view's opacity that lets one see
    /// through it.
    pub culls_back_faces: bool,
    /// Whether the transform mirrors, so that front faces run clockwise.
    pub mirrored: bool,
}

/// All instances of a scene in draw order, ready to be drawn in a view.
///
/// # Errors
/// If the view is invalid, see [`View::check`].
pub fn draws<'a>(scene: &'a Scene, view: &View) -> Result<Vec<Draw<'a>>, Error> {
    view.check()?;
    let view_from_world = view.view_from_world()?;
    let clip_from_view = view.camera.clip_from_view(view.aspect())?;
    let mut first_primitive = 0;
    let mut draws = Vec::with_capacity(scene.instances().len());
    for instance in scene.instances() {
        let mesh = scene.mesh(instance.mesh);
        let material = scene.material(instance.material);
        let affine = instance.world_from_mesh;
        let world_from_mesh = DAffine3::from_cols(
            affine.matrix3.x_axis.as_dvec3(),
            affine.matrix3.y_axis.as_dvec3(),
            affine.matrix3.z_axis.as_dvec3(),
            affine.translation.as_dvec3(),
        );
        let view_from_mesh = view_from_world * DMat4::from(world_from_mesh);
        let (pass, cutoff) = match material.alpha_mode {
            AlphaMode::Opaque if view.opacity >= 1.0 => (Pass::Opaque, None),
            AlphaMode::Mask { cutoff } if view.opacity >= 1.0 => (Pass::Opaque, Some(cutoff)),
            AlphaMode::Mask { cutoff } => (Pass::Transparent, Some(cutoff)),
            AlphaMode::Opaque | AlphaMode::Blend => (Pass::Transparent, None),
        };
        let mut draw = Draw {
            mesh,
            material,
            texture: material
                .texture
                .filter(|_| mesh.tex_coords().is_some())
                .map(|texture| (scene.texture(texture.texture), texture)),
            clip_from_mesh: (clip_from_view * view_from_mesh).as_mat4(),
            view_from_normal: view_from_normal(&view_from_mesh),
            first_primitive,
            pass,
            cutoff,
            blends: material.alpha_mode == AlphaMode::Blend,
            opacity: view.opacity,
            base_color: Vec4::ZERO,
            lit: view.shading == Shading::Lit && !material.unlit,
            // Single-sidedness is a saving meant for solids one cannot see into.
            culls_back_faces: !material.double_sided
                && (pass == Pass::Opaque || material.alpha_mode == AlphaMode::Blend),
            mirrored: world_from_mesh.matrix3.determinant() < 0.0,
        };
        draw.base_color = draw.premultiplied(material.base_color);
        draws.push(draw);
        first_primitive += mesh.triangles().len() as u32;
    }
    Ok(draws)
}

/// The cofactors of a transform's linear part: its inverse transpose times its determinant. Unlike the inverse they exist
/// for flattening transforms too; the factor goes when normals are normalised. Scaled to keep clear of f32's limits.
fn view_from_normal(view_from_mesh: &DMat4) -> Mat3A {
    let [x, y, z] = [view_from_mesh.x_axis, view_from_mesh.y_axis, view_from_mesh.z_axis].map(|axis| axis.truncate());
    let columns = [y.cross(z), z.cross(x), x.cross(y)];
    let greatest = columns.iter().fold(0.0f64, |greatest, column| greatest.max(column.abs().max_element()));
    let scale = if greatest > 0.0 { 1.0 / greatest } else { 0.0 };
    let [x, y, z] = columns.map(|column: DVec3| (column * scale).as_vec3a());
    Mat3A::from_cols(x, y, z)
}

/// A point as clip coordinates, in the order of operations that every renderer keeps.
#[inline(always)]
pub fn transform_point(matrix: &Mat4, point: Vec3) -> Vec4 {
    ((matrix.x_axis * point.x + matrix.y_axis * point.y) + matrix.z_axis * point.z) + matrix.w_axis
}

/// How the corners of a piece follow from those of its primitive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Corners {
    /// They are the same; the second and third swapped if the primitive ran counter-clockwise on the screen.
    Whole {
        /// Whether they are swapped.
        swapped: bool,
    },
    /// Clipped: each a weighted sum of the primitive's corners.
    Clipped([Vec3; 3]),
}

impl Corners {
    /// A vertex attribute at the piece's corners from the primitive's.
    #[inline(always)]
    pub fn attribute<T: Copy + Add<Output = T> + Mul<f32, Output = T>>(&self, [a, b, c]: [T; 3]) -> [T; 3] {
        match self {
            Self::Whole { swapped: false } => [a, b, c],
            Self::Whole { swapped: true } => [a, c, b],
            Self::Clipped(weights) => weights.map(|w| a * w.x + b * w.y + c * w.z),
        }
    }
}

/// A triangle on the pixel grid: a primitive, or a part of a clipped one.
///
/// Snapping may turn a thin part of a clipped primitive over, which then covers samples that the other parts cover too
/// often. Taken off them, what remains is what the snapped outline encloses, and it fits what the primitives beside this
/// one cover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// The triangle.
    pub triangle: ScreenTriangle,
    /// Where its corners come from.
    pub corners: Corners,
    /// How it adds to the primitive's coverage.
    pub fold: Fold,
}

/// How a piece adds to the coverage of its primitive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fold {
    /// The primitive covers what its pieces cover: no piece was turned over.
    #[default]
    None,
    /// Turned over: each of its samples takes one coverage off, that of the first piece after it.
    TakesOff,
    /// Beside a piece that was turned over: covers a sample unless that is taken off or another piece covered it before.
    Adds,
}

/// What becomes of a primitive that cannot be drawn: a vertex is NaN or infinite, or projects beyond the range of f32.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotFinite;

impl Draw<'_> {
    /// What one triangle of the mesh becomes on the pixel grid: nothing if it is out of sight, degenerate or culled, one
    /// piece as a rule, more if it is clipped.
    ///
    /// # Errors
    /// [`NotFinite`] if it cannot be drawn.
    pub fn pieces(&self, triangle: usize, viewport: &Viewport) -> Result<Vec<Piece>, NotFinite> {
        let corners = self.clip_corners(triangle);
        let codes = corners.map(|clip| viewport.outcode(clip));
        if codes.iter().any(|code| code & outcode::NOT_FINITE != 0) {
            return Err(NotFinite);
        }
        if codes[0] & codes[1] & codes[2] != 0 {
            return Ok(Vec::new());
        }
        if codes == [0; 3] {
            let corners = corners.map(|clip| viewport.project(clip));
            return Ok(self.whole_piece(corners).into_iter().collect());
        }
        Ok(self.clipped_pieces(corners, viewport))
    }

    /// The piece of a triangle that needs no clipping.
    #[inline(always)]
    pub fn whole_piece(&self, mut corners: [ScreenVertex; 3]) -> Option<Piece> {
        let area = twice_signed_area(corners);
        if !self.shows_side(area) {
            return None;
        }
        let swapped = area < 0;
        if swapped {
            corners.swap(1, 2);
        }
        let triangle = ScreenTriangle::new(corners)?;
        Some(Piece { triangle, corners: Corners::Whole { swapped }, fold: Fold::None })
    }

    /// The pieces of a triangle that has corners on both sides of a clipping plane, those that take off first.
    pub fn clipped_pieces(&self, corners: [Vec4; 3], viewport: &Viewport) -> Vec<Piece> {
        let polygon: Vec<(ScreenVertex, Vec3)> = clip_triangle(corners, viewport)
            .into_iter()
            .map(|vertex| (viewport.project(vertex.clip.as_vec4()), vertex.weights.as_vec3()))
            .collect();
        let fan = || (2..polygon.len()).map(|i| [polygon[0], polygon[i - 1], polygon[i]]);
        let signed_area = |corners: [(ScreenVertex, Vec3); 3]| twice_signed_area(corners.map(|(vertex, _)| vertex));
        let area: i64 = fan().map(signed_area).sum();
        if !self.shows_side(area) {
            return Vec::new();
        }
        let turned_over = |corners| signed_area(corners) * area.signum() < 0;
        let folded = fan().any(turned_over);
        let pieces = |take_off: bool| {
            fan().filter(move |&corners| turned_over(corners) == take_off).filter_map(move |mut corners| {
                if signed_area(corners) < 0 {
                    corners.swap(1, 2);
                }
                let triangle = ScreenTriangle::new(corners.map(|(vertex, _)| vertex))?;
                let fold = match (folded, take_off) {
                    (false, _) => Fold::None,
                    (true, true) => Fold::TakesOff,
                    (true, false) => Fold::Adds,
                };
                Some(Piece { triangle, corners: Corners::Clipped(corners.map(|(_, weights)| weights)), fold })
            })
        };
        pieces(true).chain(pieces(false)).collect()
    }

    /// The snapped triangles that one triangle of the mesh falls into, drawn or not, with the sides they turn to the
    /// camera as they come.
    pub fn outlines(&self, triangle: usize, viewport: &Viewport) -> Vec<[ScreenVertex; 3]> {
        let corners = self.clip_corners(triangle);
        if corners.iter().any(|&clip| viewport.outcode(clip) & outcode::NOT_FINITE != 0) {
            return Vec::new();
        }
        let polygon: Vec<_> =
            clip_triangle(corners, viewport).iter().map(|vertex| viewport.project(vertex.clip.as_vec4())).collect();
        (2..polygon.len()).map(|i| [polygon[0], polygon[i - 1], polygon[i]]).collect()
    }

    fn clip_corners(&self, triangle: usize) -> [Vec4; 3] {
        self.mesh.triangles()[triangle].map(|vertex| {
            let position = self.mesh.positions()[vertex as usize];
            transform_point(&self.clip_from_mesh, position)
        })
    }

    /// Whether the side that a triangle of this signed area (clockwise on the screen positive) turns to the camera is
    /// drawn.
    #[inline(always)]
    pub fn shows_side(&self, twice_signed_area: i64) -> bool {
        let front = (twice_signed_area < 0) != self.mirrored;
        front || !self.culls_back_faces
    }
}

/// The piece by which a primitive covers a pixel: the first one that does, after as many as pieces turned over take off.
pub fn covering_piece(pieces: &[Piece], x: i32, y: i32) -> Option<usize> {
    let mut taken_off = 0;
    for (number, piece) in pieces.iter().enumerate().filter(|(_, piece)| piece.triangle.covers(x, y)) {
        if piece.fold == Fold::TakesOff {
            taken_off += 1;
        } else if taken_off > 0 {
            taken_off -= 1;
        } else {
            return Some(number);
        }
    }
    None
}
