//! MTL, the material libraries of OBJ.
//!
//! `Kd` is the base colour; `d` or, where that is not given, 1 - `Tr` the alpha; `map_Kd` and `map_d` are the textures.
//! Everything else concerns lighting that is not done here, and is ignored.

use std::collections::HashMap;

use glam::{Affine2, Vec2};

use crate::LoadError;
use crate::text::{At, Lines, Words, parse as parse_number, shown};
use crate::warnings::Warnings;

const FORMAT: &str = "MTL";

/// A texture as a statement names it.
#[derive(Debug, Clone, Default)]
pub(super) struct Map {
    pub(super) name: String,
    pub(super) clamp: bool,
    scale: Option<Vec2>,
    offset: Vec2,
}

impl Map {
    /// The transform of texture coordinates whose v points down, from scale and offset for a v that points up.
    pub(super) fn transform(&self) -> Affine2 {
        let scale = self.scale.unwrap_or(Vec2::ONE);
        Affine2::from_scale_angle_translation(scale, 0.0, Vec2::new(self.offset.x, 1.0 - scale.y - self.offset.y))
    }
}

/// What a library says about a material.
#[derive(Debug, Clone, Default)]
pub(super) struct Definition {
    /// sRGB-encoded.
    pub(super) color: Option<[f32; 3]>,
    dissolve: Option<f32>,
    transparency: Option<f32>,
    pub(super) color_map: Option<Map>,
    pub(super) alpha_map: Option<Map>,
}

impl Definition {
    /// `d` wins over `Tr`, which some programs write the other way round.
    pub(super) fn alpha(&self) -> f32 {
        let alpha = self.dissolve.or(self.transparency.map(|t| 1.0 - t)).unwrap_or(1.0);
        // Not `clamp`: NaN becomes 0.
        if alpha > 0.0 { alpha.min(1.0) } else { 0.0 }
    }
}

/// Adds the materials of a library; one with the name of an earlier one replaces it.
pub(super) fn parse(
    bytes: &[u8],
    materials: &mut HashMap<Vec<u8>, Definition>,
    warnings: &mut Warnings,
) -> Result<(), LoadError> {
    let mut current: Option<(&[u8], Definition)> = None;
    for (line, text) in Lines::new(bytes, 1) {
        let at = At { format: FORMAT, line };
        let mut words = Words::new(text);
        let keyword = words.next().unwrap_or_default();
        if keyword == b"newmtl" {
            let finished = current.replace((words.rest(), Definition::default()));
            materials.extend(finished.map(|(name, definition)| (name.to_vec(), definition)));
            continue;
        }
        let Some((_, material)) = &mut current else {
            continue;
        };
        match keyword.to_ascii_lowercase().as_slice() {
            b"kd" => match words.clone().next() {
                Some(b"spectral" | b"xyz") => warnings.add("MTL colours given as spectrum or XYZ are left out"),
                _ => {
                    let red = at.number(&mut words, "Kd")?;
                    // Green and blue are the same as red where they are left out.
                    let is_grey = words.rest().is_empty();
                    let [green, blue] = if is_grey { [red; 2] } else { at.numbers(&mut words, "Kd")? };
                    material.color = Some([red, green, blue]);
                }
            },
            b"d" => {
                if words.clone().next() == Some(b"-halo") {
                    words.next();
                }
                material.dissolve = Some(at.number(&mut words, "d")?);
            }
            b"tr" => material.transparency = Some(at.number(&mut words, "Tr")?),
            b"map_kd" => material.color_map = parse_map(at, words, warnings)?,
            b"map_d" => material.alpha_map = parse_map(at, words, warnings)?,
            _ => {}
        }
    }
    materials.extend(current.map(|(name, definition)| (name.to_vec(), definition)));
    Ok(())
}

/// Options, each with its values, and then a file name that may contain spaces.
fn parse_map(at: At, mut words: Words<'_>, warnings: &mut Warnings) -> Result<Option<Map>, LoadError> {
    let mut map = Map::default();
    loop {
        let mut after = words.clone();
        let count = match after.next().unwrap_or_default() {
            option @ (b"-o" | b"-s" | b"-t") => {
                let default = if option == b"-s" { 1.0 } else { 0.0 };
                let value = up_to_three(at, &mut after, default)?;
                match option {
                    b"-o" => map.offset = value,
                    b"-s" => map.scale = Some(value),
                    _ => {}
                }
                0
            }
            b"-clamp" => {
                map.clamp = after.next() == Some(b"on");
                0
            }
            b"-blendu" | b"-blendv" | b"-bm" | b"-boost" | b"-cc" | b"-imfchan" | b"-texres" | b"-type" => 1,
            b"-mm" => 2,
            _ => break,
        };
        after.by_ref().take(count).for_each(drop);
        words = after;
    }
    let name = words.rest().trim_ascii();
    if name.is_empty() {
        warnings.add(format!("MTL line {}: a texture without a file name", at.line));
        return Ok(None);
    }
    map.name = String::from_utf8_lossy(name).into_owned();
    Ok(Some(map))
}

/// The first two of the one to three numbers that follow.
fn up_to_three(at: At, words: &mut Words<'_>, default: f32) -> Result<Vec2, LoadError> {
    let mut values = [default; 3];
    for (i, value) in values.iter_mut().enumerate() {
        let mut after = words.clone();
        let word = after.next().unwrap_or_default();
        match parse_number::<f32>(word) {
            Some(number) if number.is_finite() => *value = number,
            // The file name may be a number: it is the last word.
            _ if i > 0 => break,
            _ => return Err(at.error(format_args!("'{}' is no number for a texture option", shown(word)))),
        }
        if i > 0 && after.rest().is_empty() {
            *value = default;
            break;
        }
        *words = after;
    }
    Ok(Vec2::new(values[0], values[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn definitions(text: &str) -> HashMap<Vec<u8>, Definition> {
        let mut materials = HashMap::new();
        parse(text.as_bytes(), &mut materials, &mut Warnings::default()).unwrap();
        materials
    }

    fn color_map(statement: &str) -> Map {
        definitions(&format!("newmtl m\nmap_Kd {statement}"))[&b"m"[..]].color_map.clone().unwrap()
    }

    #[test]
    fn dissolve_wins_over_transparency() {
        for (text, alpha) in [("d 0.25", 0.25), ("Tr 0.25", 0.75), ("d 0.5\nTr 1", 0.5), ("Tr 1\nd 0.5", 0.5)] {
            assert_eq!(definitions(&format!("newmtl m\n{text}"))[&b"m"[..]].alpha(), alpha, "{text}");
        }
        for (text, alpha) in [("", 1.0), ("d -halo 0.5", 0.5), ("d 7", 1.0), ("d -7", 0.0), ("d nan", 0.0)] {
            assert_eq!(definitions(&format!("newmtl m\n{text}"))[&b"m"[..]].alpha(), alpha, "{text}");
        }
    }

    #[test]
    fn options_do_not_become_part_of_the_name() {
        assert_eq!(color_map("my file.png").name, "my file.png");
        assert_eq!(color_map("-blendu on -mm 0 1 -bm 2 -t 1 2 my file.png").name, "my file.png");
        let map = color_map("-clamp on -s 2 3 1 -o 0.5 sub\\7.png");
        assert_eq!((map.name.as_str(), map.clamp), ("sub\\7.png", true));
        assert_eq!((map.scale, map.offset), (Some(Vec2::new(2.0, 3.0)), Vec2::new(0.5, 0.0)));
        assert_eq!(color_map("-s 2 7").name, "7");
        assert_eq!(color_map("-unknown.png").name, "-unknown.png");
    }

    #[test]
    fn scale_and_offset_act_on_a_v_that_points_up() {
        let transform = color_map("-s 2 3 -o 0.5 0.25 a.png").transform();
        let (u, v_up) = (0.3, 0.4);
        let moved = transform.transform_point2(Vec2::new(u, 1.0 - v_up));
        assert!((moved - Vec2::new(u * 2.0 + 0.5, 1.0 - (v_up * 3.0 + 0.25))).length() < 1e-6, "{moved}");
    }

    #[test]
    fn nonsense_is_refused_with_its_line() {
        for text in ["newmtl m\nKd 1 x 0", "newmtl m\nd", "newmtl m\nKd 1 1", "newmtl m\nmap_Kd -s a.png"] {
            let error = parse(text.as_bytes(), &mut HashMap::new(), &mut Warnings::default()).unwrap_err();
            assert!(error.to_string().contains("line 2"), "{error}");
        }
    }
}
