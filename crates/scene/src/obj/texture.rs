//! The textures of MTL materials: colour from `map_Kd`, alpha from `map_d` or else from the picture of `map_Kd`.
//!
//! The alpha of a `map_d` is the picture's own alpha if it has any, otherwise its brightness.

use std::collections::HashMap;

use pellucid_core::texture::{Sampler, Wrap};
use pellucid_core::{Scene, Texture, TextureId};

use super::mtl::{Definition, Map};
use crate::texture_image::decode;
use crate::warnings::Warnings;
use crate::{Assets, LoadError};

/// Texels this near to 0 or 255 count as not there or fully there.
const ALPHA_SLACK: u8 = 8;

/// A cut-out may have this share of texels in between, along its edges.
const EDGE_SHARE: f64 = 0.1;

/// What the alpha of a texture is like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Alpha {
    /// 255 throughout.
    None,
    /// There or not there, but for few texels along edges.
    CutOut,
    /// Anything else.
    Graded,
}

/// What a texture is made from.
#[derive(PartialEq, Eq, Hash)]
struct Recipe {
    /// File names in one spelling.
    color: Option<String>,
    alpha: Option<String>,
    clamp: bool,
}

/// Textures made so far, and those that could not be made.
#[derive(Default)]
pub(super) struct Textures {
    made: HashMap<Recipe, Option<(TextureId, Alpha)>>,
}

impl Textures {
    /// The texture of a material; pictures that cannot be had are left out with a warning.
    pub(super) fn texture(
        &mut self,
        material: &Definition,
        assets: &dyn Assets,
        scene: &mut Scene,
        warnings: &mut Warnings,
    ) -> Result<Option<(TextureId, Alpha)>, LoadError> {
        let Some(main) = material.color_map.as_ref().or(material.alpha_map.as_ref()) else {
            return Ok(None);
        };
        let name = |map: &Option<Map>| map.as_ref().map(|m| plain_name(&m.name));
        let recipe = Recipe { color: name(&material.color_map), alpha: name(&material.alpha_map), clamp: main.clamp };
        if let Some(&made) = self.made.get(&recipe) {
            return Ok(made);
        }
        let mut picture = |name: &Option<String>| match name {
            Some(name) => read(name, assets, warnings),
            None => Ok(None),
        };
        let (color, alpha) = (picture(&recipe.color)?, picture(&recipe.alpha)?);
        let made = match combine(color, alpha) {
            None => None,
            Some(picture) => {
                let wrap = if main.clamp { Wrap::ClampToEdge } else { Wrap::Repeat };
                let sampler = Sampler { wrap_u: wrap, wrap_v: wrap, ..Sampler::default() };
                let kind = alpha_of(&picture.texels);
                let texture = Texture::new(picture.width, picture.height, picture.texels, sampler)?;
                Some((scene.add_texture(texture)?, kind))
            }
        };
        self.made.insert(recipe, made);
        Ok(made)
    }
}

/// A file name in one spelling, so that nothing is read twice: `/` between folders, no `.` folders.
pub(super) fn plain_name(name: &str) -> String {
    let portable = name.replace('\\', "/");
    let root = if portable.starts_with('/') { "/" } else { "" };
    let parts: Vec<_> = portable.split('/').filter(|part| !matches!(*part, "" | ".")).collect();
    format!("{root}{}", parts.join("/"))
}

#[derive(Debug, PartialEq)]
struct Picture {
    width: u32,
    height: u32,
    texels: Vec<[u8; 4]>,
}

fn read(name: &str, assets: &dyn Assets, warnings: &mut Warnings) -> Result<Option<Picture>, LoadError> {
    let bytes = match assets.read(name) {
        Ok(bytes) => bytes,
        Err(error @ LoadError::OutsideFolder { .. }) => return Err(error),
        Err(error) => {
            warnings.add(error.to_string());
            return Ok(None);
        }
    };
    match decode(&bytes, Sampler { mip: None, ..Sampler::default() }) {
        Ok(texture) => {
            let level = &texture.levels()[0];
            Ok(Some(Picture { width: level.width, height: level.height, texels: texture.texels().to_vec() }))
        }
        Err(detail) => {
            warnings.add(format!("the texture '{name}' {detail}"));
            Ok(None)
        }
    }
}

/// The colour of one picture with the alpha of the other, at the larger size of both; without a colour, white.
fn combine(color: Option<Picture>, alpha: Option<Picture>) -> Option<Picture> {
    let Some(alpha) = alpha else {
        return color;
    };
    let color = color.unwrap_or(Picture { width: 1, height: 1, texels: vec![[255; 4]] });
    let has_alpha = alpha.texels.iter().any(|texel| texel[3] < 255);
    let (width, height) = (color.width.max(alpha.width), color.height.max(alpha.height));
    let nearest = |picture: &Picture, x: u32, y: u32| {
        let scaled = |at: u32, from: u32, to: u32| (u64::from(at) * u64::from(to) / u64::from(from)) as usize;
        let row = scaled(y, height, picture.height) * picture.width as usize;
        picture.texels[row + scaled(x, width, picture.width)]
    };
    let mut texels = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let [r, g, b, _] = nearest(&color, x, y);
            let [ar, ag, ab, aa] = nearest(&alpha, x, y);
            let brightness = ((u16::from(ar) + u16::from(ag) + u16::from(ab) + 1) / 3) as u8;
            texels.push([r, g, b, if has_alpha { aa } else { brightness }]);
        }
    }
    Some(Picture { width, height, texels })
}

fn alpha_of(texels: &[[u8; 4]]) -> Alpha {
    if texels.iter().all(|texel| texel[3] == 255) {
        return Alpha::None;
    }
    let between = texels.iter().filter(|t| (ALPHA_SLACK..=255 - ALPHA_SLACK).contains(&t[3])).count();
    if between as f64 <= EDGE_SHARE * texels.len() as f64 { Alpha::CutOut } else { Alpha::Graded }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_one_spelling() {
        for (name, plain) in [("a b.png", "a b.png"), (".\\sub\\a.png", "sub/a.png"), ("./sub//./a", "sub/a")] {
            assert_eq!(plain_name(name), plain);
        }
        // What leads out must still do so.
        assert_eq!(plain_name("../a"), "../a");
        assert_eq!(plain_name("/etc/a"), "/etc/a");
        assert_eq!(plain_name("C:\\a"), "C:/a");
    }

    #[test]
    fn alpha_is_taken_from_the_second_picture_at_the_larger_size() {
        let color = Picture { width: 2, height: 1, texels: vec![[1, 2, 3, 77], [4, 5, 6, 77]] };
        let alpha = Picture { width: 1, height: 2, texels: vec![[0, 0, 0, 255], [90, 90, 90, 255]] };
        let expected = vec![[1, 2, 3, 0], [4, 5, 6, 0], [1, 2, 3, 90], [4, 5, 6, 90]];
        assert_eq!(combine(Some(color), Some(alpha)), Some(Picture { width: 2, height: 2, texels: expected }));
        // A picture with an alpha of its own gives that, and without a colour the surface is white.
        let alpha = Picture { width: 1, height: 1, texels: vec![[10, 20, 30, 40]] };
        assert_eq!(combine(None, Some(alpha)).unwrap().texels, [[255, 255, 255, 40]]);
    }

    #[test]
    fn cut_outs_are_told_from_graded_alpha() {
        let texels = |alphas: &[u8]| alphas.iter().map(|&a| [0, 0, 0, a]).collect::<Vec<_>>();
        assert_eq!(alpha_of(&texels(&[255; 20])), Alpha::None);
        let mut cut_out = vec![0; 10];
        cut_out.extend([255; 10]);
        cut_out[3] = 128;
        assert_eq!(alpha_of(&texels(&cut_out)), Alpha::CutOut);
        assert_eq!(alpha_of(&texels(&[128; 20])), Alpha::Graded);
    }
}
