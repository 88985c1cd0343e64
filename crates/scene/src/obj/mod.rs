//! OBJ, the Wavefront format (Wavefront, "Advanced Visualizer Manual", appendices B1 and B2), with MTL materials.
//!
//! - Faces become one mesh and one instance a material, in the order in which the materials are first used; the faces
//!   that ask to be lit flat make one of their own.
//! - Corners without a normal get a smooth one, the mean over the triangles of their smoothing group around the position,
//!   across materials; after `s off` or `s 0` they are lit flat.
//! - The v of a texture coordinate points up in these files, and is turned round.
//! - Colours of vertices (`v x y z r g b`) and of materials are sRGB-encoded, as viewers show them.
//! - Lines, points and free-form surfaces are left out with a warning. A material or texture that cannot be had is left
//!   out with a warning too; only a name that leads out of the scene's folder is an error.
//!
//! Read here and not with `tobj`, whose errors name no line, which joins no continued lines, fans concave polygons and
//! drops smoothing groups.

mod build;
mod mtl;
mod texture;

use std::collections::{HashMap, HashSet};

use glam::{Vec2, Vec3, Vec4};
use pellucid_core::color::linear_from_srgb;

use crate::polygon::Triangulator;
use crate::text::{At, Lines, Words, shown};
use crate::warnings::Warnings;
use crate::{Assets, LoadError, Loaded};

const FORMAT: &str = "OBJ";

/// Material libraries read from one file: a bound on time for files that name them over and over.
const MAX_LIBRARIES: usize = 100;

/// Stands for "not given" in a [`Corner`].
const NONE: u32 = u32::MAX;

/// The smoothing group before the first `s`.
const UNSAID: u32 = u32::MAX;

/// Parses an OBJ file.
///
/// # Errors
/// [`LoadError::Malformed`] if it is not valid or has no faces, [`LoadError::OutsideFolder`] if a material library or
/// texture leads out of the scene's folder.
pub fn parse(bytes: &[u8], assets: &dyn Assets) -> Result<Loaded, LoadError> {
    let mut reader = Reader::new(assets);
    let mut joined = Vec::new();
    let mut lines = Lines::new(bytes, 1);
    while let Some((line, text)) = lines.next() {
        let at = At { format: FORMAT, line };
        let is_continued = |text: &[u8]| text.ends_with(b"\\") && !text.trim_ascii_start().starts_with(b"#");
        if !is_continued(text) {
            reader.statement(at, text)?;
            continue;
        }
        joined.clear();
        let mut part = Some(text);
        while let Some(text) = part {
            let more = is_continued(text);
            joined.extend_from_slice(if more { &text[..text.len() - 1] } else { text });
            joined.push(b' ');
            part = if more { lines.next().map(|(_, text)| text) } else { None };
        }
        reader.statement(at, &joined)?;
    }
    reader.finish(bytes)
}

/// A corner of a face: 0-based numbers, or [`NONE`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Corner {
    position: u32,
    tex_coord: u32,
    normal: u32,
    /// The smoothing group of a corner without a normal, 0 for lit flat; 0 where there is a normal.
    smoothing: u32,
}

/// Faces that become one mesh.
#[derive(Default)]
struct Part {
    /// As `usemtl` has it; empty before the first.
    material: Vec<u8>,
    flat: bool,
    vertices: HashMap<Corner, u32>,
    corners: Vec<Corner>,
    triangles: Vec<[u32; 3]>,
}

struct Reader<'a> {
    assets: &'a dyn Assets,
    positions: Vec<Vec3>,
    /// As many as positions, or none if no position has a colour.
    colors: Vec<Vec4>,
    tex_coords: Vec<Vec2>,
    normals: Vec<Vec3>,
    parts: Vec<Part>,
    part_of: HashMap<(Vec<u8>, bool), usize>,
    /// The part for smooth and for flat faces of the current material, if looked up already.
    current: [Option<usize>; 2],
    material: Vec<u8>,
    smoothing: u32,
    /// Of the face being read: corners, where they are, and which vertices of the part they become.
    face: Vec<Corner>,
    polygon: Vec<Vec3>,
    vertices: Vec<u32>,
    triangulator: Triangulator,
    libraries: HashSet<String>,
    materials: HashMap<Vec<u8>, mtl::Definition>,
    skipped_elements: usize,
    skipped_surfaces: usize,
    warnings: Warnings,
}

impl<'a> Reader<'a> {
    fn new(assets: &'a dyn Assets) -> Self {
        Self {
            assets,
            positions: Vec::new(),
            colors: Vec::new(),
            tex_coords: Vec::new(),
            normals: Vec::new(),
            parts: Vec::new(),
            part_of: HashMap::new(),
            current: [None; 2],
            material: Vec::new(),
            smoothing: UNSAID,
            face: Vec::new(),
            polygon: Vec::new(),
            vertices: Vec::new(),
            triangulator: Triangulator::default(),
            libraries: HashSet::new(),
            materials: HashMap::new(),
            skipped_elements: 0,
            skipped_surfaces: 0,
            warnings: Warnings::default(),
        }
    }

    fn statement(&mut self, at: At, text: &[u8]) -> Result<(), LoadError> {
        let mut words = Words::new(text);
        let Some(keyword) = words.next() else {
            return Ok(());
        };
        match keyword {
            b"v" => self.position(at, uncommented(words))?,
            b"vt" => {
                let mut words = uncommented(words);
                let u = at.number(&mut words, "a texture coordinate")?;
                let v = if words.rest().is_empty() { 0.0 } else { at.number(&mut words, "a texture coordinate")? };
                self.tex_coords.push(Vec2::new(u, 1.0 - v));
            }
            b"vn" => self.normals.push(at.numbers::<3>(&mut uncommented(words), "a normal")?.into()),
            b"f" | b"fo" => self.face(at, uncommented(words))?,
            b"s" => {
                let group = uncommented(words).next().unwrap_or_default();
                self.smoothing = match group {
                    b"off" => 0,
                    b"on" => 1,
                    _ => crate::text::parse(group)
                        .ok_or_else(|| at.error(format_args!("'{}' is no smoothing group", shown(group))))?,
                };
            }
            b"usemtl" => {
                self.material = words.rest().to_vec();
                self.current = [None; 2];
            }
            b"mtllib" => self.library(words)?,
            b"l" | b"p" => self.skipped_elements += 1,
            b"curv" | b"curv2" | b"surf" => self.skipped_surfaces += 1,
            // Names of groups, display attributes, and what belongs to free-form geometry.
            b"g" | b"o" | b"mg" | b"bevel" | b"c_interp" | b"d_interp" | b"lod" | b"maplib" | b"usemap"
            | b"shadow_obj" | b"trace_obj" | b"ctech" | b"stech" | b"vp" | b"cstype" | b"deg" | b"bmat" | b"step"
            | b"parm" | b"trim" | b"hole" | b"scrv" | b"sp" | b"end" | b"con" => {}
            _ if keyword.starts_with(b"#") => {}
            _ => {
                let keyword = shown(keyword);
                self.warnings.add(format!("line {}: '{keyword}' is no OBJ statement, and is skipped", at.line));
            }
        }
        Ok(())
    }

    fn position(&mut self, at: At, mut words: Words<'_>) -> Result<(), LoadError> {
        let position = at.numbers::<3>(&mut words, "a vertex")?;
        let (mut more, mut count) = ([0.0; 3], 0);
        while !words.rest().is_empty() {
            let number = at.number(&mut words, "a vertex")?;
            if let Some(place) = more.get_mut(count) {
                *place = number;
            }
            count += 1;
        }
        // One more number is a weight, and means nothing without free-form surfaces.
        if count >= 3 {
            self.colors.resize(self.positions.len(), Vec4::ONE);
            self.colors.push(linear(more).extend(1.0));
        }
        self.positions.push(position.into());
        Ok(())
    }

    fn face(&mut self, at: At, words: Words<'_>) -> Result<(), LoadError> {
        self.face.clear();
        self.polygon.clear();
        for word in words {
            let corner = self.corner(at, word)?;
            self.polygon.push(self.positions[corner.position as usize]);
            self.face.push(corner);
        }
        if self.face.len() < 3 {
            return Err(at.error(format_args!("a face of {} corners; it needs 3", self.face.len())));
        }
        let flat = self.smoothing == 0 && self.face.iter().any(|corner| corner.normal == NONE);
        let number = match self.current[usize::from(flat)] {
            Some(number) => number,
            None => self.find_part(flat),
        };
        let part = &mut self.parts[number];
        self.vertices.clear();
        for corner in &mut self.face {
            if flat {
                corner.normal = NONE;
            }
            let smoothing = if corner.normal == NONE { self.smoothing } else { 0 };
            let corner = Corner { smoothing, ..*corner };
            self.vertices.push(*part.vertices.entry(corner).or_insert_with(|| {
                part.corners.push(corner);
                // Too many are noticed in `finish`.
                (part.corners.len() - 1) as u32
            }));
        }
        let triangles = self.triangulator.cut(&self.polygon).iter();
        part.triangles.extend(triangles.map(|triangle| triangle.map(|i| self.vertices[i as usize])));
        Ok(())
    }

    fn find_part(&mut self, flat: bool) -> usize {
        let material = &self.material;
        let parts = &mut self.parts;
        let number = *self.part_of.entry((material.clone(), flat)).or_insert_with(|| {
            parts.push(Part { material: material.clone(), flat, ..Part::default() });
            parts.len() - 1
        });
        self.current[usize::from(flat)] = Some(number);
        number
    }

    fn corner(&self, at: At, word: &[u8]) -> Result<Corner, LoadError> {
        let mut numbers = word.split(|&b| b == b'/');
        let mut next = |what, count| match numbers.next() {
            None | Some(b"") => Ok(NONE),
            Some(number) => resolve(at, number, what, count),
        };
        let no_corner = || at.error(format_args!("'{}' is no corner of a face", shown(word)));
        let position = next("vertex", self.positions.len())?;
        if position == NONE {
            return Err(no_corner());
        }
        let tex_coord = next("texture coordinate", self.tex_coords.len())?;
        let normal = next("normal", self.normals.len())?;
        if numbers.next().is_some() {
            return Err(no_corner());
        }
        Ok(Corner { position, tex_coord, normal, smoothing: 0 })
    }

    /// Reads the material libraries of an `mtllib` line: one whose name is the whole line, else one a word.
    fn library(&mut self, mut words: Words<'_>) -> Result<(), LoadError> {
        let whole = words.rest();
        let first_error = match self.read_library(whole)? {
            Ok(()) => return Ok(()),
            Err(error) => error,
        };
        if !whole.contains(&b' ') {
            self.warnings.add(first_error);
            return Ok(());
        }
        for word in words.by_ref() {
            if let Err(error) = self.read_library(word)? {
                self.warnings.add(error);
            }
        }
        Ok(())
    }

    /// Reads a material library unless it has been read; the inner error is a warning.
    fn read_library(&mut self, name: &[u8]) -> Result<Result<(), String>, LoadError> {
        let name = texture::plain_name(&String::from_utf8_lossy(name));
        if name.is_empty() {
            return Ok(Err("'mtllib' without a name".into()));
        }
        if self.libraries.contains(&name) {
            return Ok(Ok(()));
        }
        if self.libraries.len() >= MAX_LIBRARIES {
            return Ok(Err(format!("only {MAX_LIBRARIES} material libraries are read")));
        }
        let bytes = match self.assets.read(&name) {
            Ok(bytes) => bytes,
            Err(error @ LoadError::OutsideFolder { .. }) => return Err(error),
            Err(error) => return Ok(Err(error.to_string())),
        };
        mtl::parse(&bytes, &mut self.materials, &mut self.warnings)
            .map_err(|error| LoadError::InFile { path: name.as_str().into(), source: Box::new(error) })?;
        self.libraries.insert(name);
        Ok(Ok(()))
    }
}

/// The number, counted from 0, that a number of an OBJ file means: they count from 1, or back from -1.
fn resolve(at: At, number: &[u8], what: &str, count: usize) -> Result<u32, LoadError> {
    let index: i64 = crate::text::parse(number)
        .ok_or_else(|| at.error(format_args!("'{}' is no number of a {what}", shown(number))))?;
    let position = if index < 0 { count as i64 + index } else { index - 1 };
    if position < 0 || position >= (count as i64).min(i64::from(NONE)) {
        return Err(at.error(format_args!("{what} {index} is named, but there are {count} so far")));
    }
    Ok(position as u32)
}

/// Without the comment at the end.
fn uncommented(words: Words<'_>) -> Words<'_> {
    let text = words.rest();
    Words::new(text.split(|&b| b == b'#').next().unwrap_or(text))
}

/// An sRGB-encoded colour as linear light in 0..=1.
fn linear(encoded: [f32; 3]) -> Vec3 {
    // Not `clamp`: NaN becomes 0.
    encoded.map(|value| if value > 0.0 { linear_from_srgb(value.min(1.0)) } else { 0.0 }).into()
}
