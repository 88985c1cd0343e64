//! What is the same for a frame and for a draw, as the shaders read it.

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec2, Vec4};
use pellucid_core::pixel_grid::SUBPIXELS;
use pellucid_core::primitive::Draw;
use pellucid_core::texture::{Filter, Wrap};
use pellucid_core::{Projection, Resolve, Texture, View};

use crate::memory::Window;

/// What is the same for a whole window of a frame. Twin: `FrameData` in `shaders/shared/frame.wesl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct FrameData {
    /// Left, top of the window.
    pub window_origin: [u32; 2],
    /// Width, height of the window.
    pub window_size: [u32; 2],
    /// Of the picture.
    pub size: [u32; 2],
    /// Subpixels of half the picture.
    pub half_size: Vec2,
    /// Linear light, premultiplied.
    pub background: Vec4,
    /// Distance of the near plane.
    pub near: f32,
    /// Distance of the far plane, if there is one.
    pub far: f32,
    /// 1 or 0.
    pub is_perspective: u32,
    /// World units.
    pub thickness_unit: f32,
    /// Of the resolve `layer:N`.
    pub layer: u32,
    /// Pixels of half the hardware's viewport, see `Frame::render_pass_into`.
    pub half_viewport: f32,
    /// Ends on a multiple of 16 bytes.
    pub padding: [u32; 2],
}

impl FrameData {
    pub(crate) fn new(view: &View, resolve: Resolve, window: Window, viewport: f32) -> Self {
        let (near, far, is_perspective) = match view.camera.projection {
            Projection::Perspective { near, .. } => (near, 0.0, 1),
            Projection::Orthographic { near, far, .. } => (near, far, 0),
        };
        Self {
            window_origin: [window.left, window.top],
            window_size: [window.width, window.height],
            size: [view.width, view.height],
            half_size: Vec2::new(view.width as f32, view.height as f32) * (SUBPIXELS / 2) as f32,
            background: view.background,
            near,
            far,
            is_perspective,
            thickness_unit: view.thickness_unit,
            layer: if let Resolve::Layer(number) = resolve { number } else { 0 },
            half_viewport: viewport / 2.0,
            padding: [0; 2],
        }
    }
}

/// One instance. Twin: `DrawData` in `shaders/shared/mesh.wesl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct DrawData {
    /// Clip space from the mesh's own.
    pub clip_from_mesh: Mat4,
    /// Three columns, each padded to four numbers.
    pub view_from_normal: [Vec4; 3],
    /// Premultiplied, as captured where nothing varies.
    pub base_color: Vec4,
    /// Straight, as the material has it.
    pub material_color: Vec4,
    /// Columns x and y of the texture's transform.
    pub uv_from_tex_coord: Vec4,
    /// Its translation.
    pub uv_offset: Vec2,
    /// Multiplies alpha.
    pub opacity: f32,
    /// Alpha below it is not there.
    pub cutoff: f32,
    /// Number of its first triangle in draw order.
    pub first_primitive: u32,
    /// Place of its first vertex number among the indices.
    pub first_index: u32,
    /// Its first vertex.
    pub first_vertex: u32,
    /// Place of its normals among the attributes.
    pub normals: u32,
    /// Place of its texture coordinates.
    pub tex_coords: u32,
    /// Place of its colours.
    pub colors: u32,
    /// See [`flags`].
    pub flags: u32,
    /// How its texture is sampled, in bits.
    pub sampling: u32,
    /// Width and height of its texture in texels.
    pub texture_size: [u32; 2],
    /// Number of the instance.
    pub number: u32,
    /// Where its texture lies in the atlas of all.
    pub atlas: AtlasPlace,
    /// Ends on a multiple of 16 bytes.
    pub padding: [u32; 2],
}

/// Where a texture lies in the atlas of all textures, in which techniques that shade all draws together find them. Twin: the
/// last three members of `DrawData` in `shaders/shared/mesh.wesl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct AtlasPlace {
    /// Column of the full size, and row from bit 16 on.
    pub full_size: u32,
    /// The same of the smaller levels.
    pub smaller: u32,
    /// Page of the full size, and that of the smaller levels from bit 16 on.
    pub pages: u32,
}

/// Bits of [`DrawData::flags`], as in `shaders/shared/mesh.wesl`.
pub mod flags {
    /// Is lit.
    pub const LIT: u32 = 1;
    /// Has a normal at each vertex.
    pub const HAS_NORMALS: u32 = 2;
    /// Base colour has a say in alpha.
    pub const BLENDS: u32 = 8;
    /// Has to pass an alpha test.
    pub const HAS_CUTOFF: u32 = 16;
    /// Has a colour at each vertex.
    pub const HAS_COLORS: u32 = 32;
    /// Has a texture.
    pub const HAS_TEXTURE: u32 = 64;
    /// Back faces are left out.
    pub const CULLS_BACK: u32 = 128;
    /// Front faces run clockwise.
    pub const MIRRORED: u32 = 256;
}

/// Where a mesh's data lie in the buffers of its scene.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct MeshPlaces {
    pub(crate) first_index: u32,
    pub(crate) first_vertex: u32,
    pub(crate) normals: u32,
    pub(crate) tex_coords: u32,
    pub(crate) colors: u32,
}

impl DrawData {
    pub(crate) fn new(draw: &Draw<'_>, number: u32, places: &MeshPlaces, atlas: AtlasPlace) -> Self {
        let bit = |condition: bool, bit: u32| if condition { bit } else { 0 };
        let flags = bit(draw.lit, flags::LIT)
            | bit(draw.mesh.normals().is_some(), flags::HAS_NORMALS)
            | bit(draw.blends, flags::BLENDS)
            | bit(draw.cutoff.is_some(), flags::HAS_CUTOFF)
            | bit(draw.mesh.colors().is_some(), flags::HAS_COLORS)
            | bit(draw.texture.is_some(), flags::HAS_TEXTURE)
            | bit(draw.culls_back_faces, flags::CULLS_BACK)
            | bit(draw.mirrored, flags::MIRRORED);
        let normal = draw.view_from_normal;
        let (transform, sampling) = draw
            .texture
            .map_or((glam::Affine2::IDENTITY, 0), |(texture, material)| (material.transform, sampling_bits(texture)));
        let matrix = transform.matrix2;
        Self {
            clip_from_mesh: draw.clip_from_mesh,
            view_from_normal: [normal.x_axis, normal.y_axis, normal.z_axis].map(|axis| axis.extend(0.0)),
            base_color: draw.base_color,
            material_color: draw.material.base_color,
            uv_from_tex_coord: Vec4::new(matrix.x_axis.x, matrix.x_axis.y, matrix.y_axis.x, matrix.y_axis.y),
            uv_offset: transform.translation,
            opacity: draw.opacity,
            cutoff: draw.cutoff.unwrap_or(0.0),
            first_primitive: draw.first_primitive,
            first_index: places.first_index,
            first_vertex: places.first_vertex,
            normals: places.normals,
            tex_coords: places.tex_coords,
            colors: places.colors,
            flags,
            sampling,
            texture_size: draw
                .texture
                .map_or([0; 2], |(texture, _)| [texture.levels()[0].width, texture.levels()[0].height]),
            number,
            atlas,
            padding: [0; 2],
        }
    }
}

/// How a texture is sampled in bits, as in `shaders/shared/texture.wesl`.
fn sampling_bits(texture: &Texture) -> u32 {
    let sampler = texture.sampler();
    let wrap = |wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::MirroredRepeat => 1,
        Wrap::ClampToEdge => 2,
    };
    let linear = |filter, bit| if filter == Filter::Linear { bit } else { 0 };
    let mip = match sampler.mip {
        None => 0,
        Some(Filter::Nearest) => 64,
        Some(Filter::Linear) => 128,
    };
    wrap(sampler.wrap_u)
        | (wrap(sampler.wrap_v) << 2)
        | linear(sampler.magnify, 16)
        | linear(sampler.minify, 32)
        | mip
        | ((texture.levels().len() as u32) << 8)
}
