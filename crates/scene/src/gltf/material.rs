//! Materials: the base colour, what its alpha means, and the texture that multiplies it.

use glam::{Affine2, Mat2, Vec2, Vec4};
use pellucid_core::scene::MaterialTexture;
use pellucid_core::{AlphaMode, Material, MaterialId};

use super::document::{self, TextureInfo, TextureTransform};
use super::texture::TexelAlpha;
use super::{Loader, TRANSMISSION_CLARITY, malformed};
use crate::LoadError;

const DEFAULT_CUTOFF: f32 = 0.5;

/// A material of the scene, and the set of texture coordinates it needs.
#[derive(Clone, Copy)]
pub(super) struct Prepared {
    pub(super) id: MaterialId,
    pub(super) tex_coord_set: Option<u32>,
}

impl Loader<'_> {
    /// The material of that number in the document; `None` is the default one.
    pub(super) fn material(&mut self, index: Option<usize>, place: &str) -> Result<Prepared, LoadError> {
        if let Some(&known) = self.materials.get(&index) {
            return Ok(known);
        }
        let prepared = match index {
            Some(index) => {
                let Some(source) = self.document.materials.get(index) else {
                    let count = self.document.materials.len();
                    return Err(malformed(format!("{place}: material {index} does not exist; there are {count}")));
                };
                self.prepare(source, &format!("material {index}"))?
            }
            None => {
                let white = Material { double_sided: false, ..Material::default() };
                Prepared { id: self.scene.add_material(white)?, tex_coord_set: None }
            }
        };
        self.materials.insert(index, prepared);
        Ok(prepared)
    }

    fn prepare(&mut self, source: &document::Material, place: &str) -> Result<Prepared, LoadError> {
        let pbr = &source.pbr_metallic_roughness;
        let factor = Vec4::from(pbr.base_color_factor.unwrap_or([1.0; 4]));
        if !factor.is_finite() {
            return Err(malformed(format!("{place}: a base colour that is not finite")));
        }
        let mut base_color = factor.clamp(Vec4::ZERO, Vec4::ONE);
        let mut alpha_mode = match source.alpha_mode.as_deref() {
            None | Some("OPAQUE") => AlphaMode::Opaque,
            Some("MASK") => AlphaMode::Mask { cutoff: source.alpha_cutoff.unwrap_or(DEFAULT_CUTOFF) },
            Some("BLEND") => AlphaMode::Blend,
            Some(other) => {
                return Err(malformed(format!("{place}: unknown alpha mode '{}'", super::buffers::shown(other))));
            }
        };
        if source.extensions.specular_glossiness.is_some() {
            self.warnings
                .add("KHR_materials_pbrSpecularGlossiness is not supported: its materials show their fallback colour");
        }

        let mut texel_alpha = TexelAlpha::AsItIs;
        if let Some(transmission) = &source.extensions.transmission {
            let factor = transmission.transmission_factor.clamp(0.0, 1.0);
            if factor > 0.0 {
                if transmission.transmission_texture.is_some() {
                    self.warnings.add("transmission textures are not supported: the factor counts everywhere");
                }
                (base_color.w, texel_alpha) = clear(base_color.w, alpha_mode, pbr.base_color_texture.is_some());
                base_color.w *= 1.0 - TRANSMISSION_CLARITY * factor;
                alpha_mode = AlphaMode::Blend;
            }
        }

        let mut texture = None;
        let mut tex_coord_set = None;
        if let Some(info) = &pbr.base_color_texture
            && let Some(id) = self.texture(info.index, texel_alpha, place)?
        {
            let (transform, set) = coordinates(info, place)?;
            texture = Some(MaterialTexture { texture: id, transform });
            tex_coord_set = Some(set);
        }
        let id = self.scene.add_material(Material {
            name: source.name.clone(),
            base_color,
            texture,
            alpha_mode,
            double_sided: source.double_sided,
            unlit: source.extensions.unlit.is_some(),
        })?;
        Ok(Prepared { id, tex_coord_set })
    }
}

/// Alpha of the base colour and of texels once a material blends that had `mode` before.
fn clear(alpha: f32, mode: AlphaMode, is_textured: bool) -> (f32, TexelAlpha) {
    match mode {
        AlphaMode::Opaque => (1.0, TexelAlpha::One),
        AlphaMode::Mask { cutoff } if is_textured => {
            // Which texels pass the test together with the factor; above 255, none.
            let least = (cutoff / alpha * 255.0).ceil().clamp(0.0, 256.0);
            (1.0, TexelAlpha::Tested { least: if alpha > 0.0 || cutoff <= 0.0 { least as u16 } else { 256 } })
        }
        AlphaMode::Mask { cutoff } => (if alpha >= cutoff { 1.0 } else { 0.0 }, TexelAlpha::AsItIs),
        AlphaMode::Blend => (alpha, TexelAlpha::AsItIs),
    }
}

/// How texture coordinates are moved, and which set of them is meant.
fn coordinates(info: &TextureInfo, place: &str) -> Result<(Affine2, u32), LoadError> {
    let Some(transform) = &info.extensions.transform else {
        return Ok((Affine2::IDENTITY, info.tex_coord));
    };
    let matrix = affine(transform);
    if !matrix.is_finite() {
        return Err(malformed(format!("{place}: a texture transform that is not finite")));
    }
    Ok((matrix, transform.tex_coord.unwrap_or(info.tex_coord)))
}

/// `translation * rotation * scale` of KHR_texture_transform. As v points down, its counter-clockwise rotation takes
/// +u towards -v; the extension's first drafts, still copied a lot, had it the other way round.
fn affine(transform: &TextureTransform) -> Affine2 {
    let scale = Vec2::from(transform.scale.unwrap_or([1.0; 2]));
    let rotation = Mat2::from_angle(-transform.rotation);
    Affine2::from_mat2_translation(rotation * Mat2::from_diagonal(scale), transform.offset.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extensions_own_example_uses_the_lower_left_quadrant() {
        let quarter_turn = std::f32::consts::FRAC_PI_2;
        let transform =
            TextureTransform { offset: [0.0, 1.0], rotation: quarter_turn, scale: Some([0.5, 0.5]), tex_coord: None };
        let matrix = affine(&transform);
        for (uv, expected) in [([0.0, 0.0], [0.0, 1.0]), ([1.0, 0.0], [0.0, 0.5]), ([0.0, 1.0], [0.5, 1.0])] {
            let found = matrix.transform_point2(uv.into());
            assert!(found.abs_diff_eq(expected.into(), 1e-6), "{uv:?} became {found}");
        }
    }

    #[test]
    fn what_passed_its_alpha_test_is_solid_glass() {
        assert_eq!(clear(0.3, AlphaMode::Opaque, true), (1.0, TexelAlpha::One));
        assert_eq!(clear(0.3, AlphaMode::Blend, true), (0.3, TexelAlpha::AsItIs));
        assert_eq!(clear(0.3, AlphaMode::Mask { cutoff: 0.5 }, false), (0.0, TexelAlpha::AsItIs));
        let mask = AlphaMode::Mask { cutoff: 0.5 };
        assert_eq!(clear(1.0, mask, true), (1.0, TexelAlpha::Tested { least: 128 }));
        assert_eq!(clear(0.0, mask, true), (1.0, TexelAlpha::Tested { least: 256 }));
        assert_eq!(clear(0.0, AlphaMode::Mask { cutoff: 0.0 }, true), (1.0, TexelAlpha::Tested { least: 0 }));
    }
}
