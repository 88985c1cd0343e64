//! STL (3D Systems, "StereoLithography Interface Specification", 1989): ascii and binary.
//!
//! The triangles are lit flat, by their own normals: the file's are often zero, and are not read. Colours that some
//! programs hide in the attribute bytes are not read either.
//!
//! Read here and not with `stl_io`, which takes every file that begins with "solid" for ascii, refuses NaN, and names no
//! line.

use glam::{Affine3A, Vec3};
use pellucid_core::{Instance, Material, Mesh, Scene};

use crate::text::{At, Lines, Words, shown};
use crate::{Assets, LoadError, Loaded};

const FORMAT: &str = "STL";
const HEADER_BYTES: usize = 84;
const TRIANGLE_BYTES: usize = 50;

/// Parses an STL file.
///
/// # Errors
/// [`LoadError::Malformed`] if it is not valid or has no triangles.
pub fn parse(bytes: &[u8], _assets: &dyn Assets) -> Result<Loaded, LoadError> {
    let invalid = |detail: String| LoadError::Malformed { format: FORMAT, detail };
    if bytes.is_empty() {
        return Err(invalid("the file is empty".into()));
    }
    let mut warnings = Vec::new();
    let positions = if is_text(bytes) { read_text(bytes, &mut warnings)? } else { read_binary(bytes)? };
    if positions.is_empty() {
        return Err(invalid("it has no triangles".into()));
    }
    let vertex_count = u32::try_from(positions.len())
        .map_err(|_| invalid(format!("{} vertices; at most 2^32 - 1 can be numbered", positions.len())))?;
    let triangles = (0..vertex_count / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mut scene = Scene::new();
    let mesh = scene.add_mesh(Mesh::new(positions, triangles)?)?;
    let material = scene.add_material(Material::default())?;
    scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY })?;
    Ok(Loaded { scene, warnings })
}

/// Binary files may begin with "solid" too: they are known by their exact length, or by a byte that no text holds.
fn is_text(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let begins_solid = text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let has_binary_length = announced_bytes(bytes) == Some(bytes.len() as u64);
    begins_solid && !has_binary_length && !bytes[..bytes.len().min(512)].contains(&0)
}

/// The length that a binary file has by its own account.
fn announced_bytes(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(80..)?.first_chunk().copied().map(u32::from_le_bytes)?;
    Some(HEADER_BYTES as u64 + u64::from(count) * TRIANGLE_BYTES as u64)
}

/// Three corners a triangle.
fn read_binary(bytes: &[u8]) -> Result<Vec<Vec3>, LoadError> {
    let invalid = |detail: String| LoadError::Malformed { format: FORMAT, detail };
    let Some(announced) = announced_bytes(bytes) else {
        return Err(invalid(format!(
            "it does not begin with 'solid', and its {} bytes are too few for a binary header",
            bytes.len()
        )));
    };
    let Some(body) = usize::try_from(announced).ok().and_then(|end| bytes.get(HEADER_BYTES..end)) else {
        return Err(invalid(format!("its triangles would end at byte {announced}, but it has only {}", bytes.len())));
    };
    let rows = body.as_chunks::<TRIANGLE_BYTES>().0;
    let mut positions = Vec::with_capacity(3 * rows.len());
    for row in rows {
        // The normal, three corners, two bytes of attributes.
        for corner in row[12..48].as_chunks::<12>().0 {
            let [x, y, z] = std::array::from_fn(|axis| {
                f32::from_le_bytes([corner[4 * axis], corner[4 * axis + 1], corner[4 * axis + 2], corner[4 * axis + 3]])
            });
            positions.push(Vec3::new(x, y, z));
        }
    }
    Ok(positions)
}

/// Three corners a triangle.
fn read_text(bytes: &[u8], warnings: &mut Vec<String>) -> Result<Vec<Vec3>, LoadError> {
    let mut positions = Vec::new();
    let mut in_solid = false;
    // Corners of the facet being read; `None` between facets.
    let mut facet: Option<usize> = None;
    let mut last = At { format: FORMAT, line: 0 };
    for (line, text) in Lines::new(bytes, 1) {
        let at = At { format: FORMAT, line };
        last = at;
        let mut words = Words::new(text);
        while let Some(word) = words.next() {
            let lower = word.to_ascii_lowercase();
            match (lower.as_slice(), &mut facet) {
                (b"solid", None) => {
                    in_solid = true;
                    break; // the rest of the line is a name
                }
                (b"endsolid", None) => {
                    in_solid = false;
                    break;
                }
                (b"facet", None) => {
                    facet = Some(0);
                    // "normal" and three numbers, whatever they are
                    words.by_ref().take(4).for_each(drop);
                }
                (b"outer" | b"loop" | b"endloop", Some(_)) => {}
                (b"vertex", Some(corners)) => {
                    positions.push(Vec3::from(at.numbers::<3>(&mut words, "a vertex")?));
                    *corners += 1;
                }
                (b"endfacet", Some(corners)) => {
                    if *corners != 3 {
                        return Err(at.error(format_args!("a facet of {corners} vertices; it must have 3")));
                    }
                    facet = None;
                }
                _ => return Err(at.error(format_args!("'{}' is out of place", shown(word)))),
            }
        }
    }
    if facet.is_some() {
        return Err(last.error("the file ends inside a facet"));
    }
    if in_solid {
        warnings.push("the file ends without 'endsolid': something may be missing".into());
    }
    Ok(positions)
}
