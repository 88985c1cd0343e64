//! PLY, the Stanford polygon format (Turk, "The PLY Polygon File Format", 1994): ascii, binary little and big endian.
//!
//! - `vertex` gives positions `x y z`, normals `nx ny nz`, texture coordinates `u v`, `s t`, `texture_u texture_v` or
//!   `texture_s texture_t` (v points up in these files and is turned round; there is no texture), and colours
//!   `red green blue alpha`, with or without `diffuse_` before them: integers are sRGB-encoded with their type's
//!   largest value as 1, floats are linear light. An alpha below 1 makes the surface transparent.
//! - `face` gives polygons as `vertex_indices` or `vertex_index`, `tristrips` triangle strips separated by -1.
//! - Everything else is skipped. Without normals, smooth ones are made.
//!
//! Read here and not with `ply-rs-bw`, which looks up every property of every element by its name and allocates a list
//! for every face.

mod body;
mod header;

use std::sync::LazyLock;

use glam::{Affine3A, Vec2, Vec3, Vec4};
use pellucid_core::color::{linear_from_srgb, linear_from_srgb8};
use pellucid_core::{AlphaMode, Instance, Material, Mesh, Scene};

use crate::mesh_parts::repair_normals;
use crate::polygon::{BAD_POLYGONS, Triangulator};
use crate::warnings::Warnings;
use crate::{Assets, LoadError, Loaded};
use body::{Ascii, Big, Binary, Little, Source};
use header::{Element, Encoding, Header, Kind};

const FORMAT: &str = "PLY";

/// Parses a PLY file. Texture files that comments may name are not read.
///
/// # Errors
/// [`LoadError::Malformed`] if it is not valid or has no triangles, [`LoadError::Unsupported`] for a point cloud.
pub fn parse(bytes: &[u8], _assets: &dyn Assets) -> Result<Loaded, LoadError> {
    let header = header::parse(bytes)?;
    let body = &bytes[header.body_start..];
    let mut content = Content::new(&header)?;
    match header.encoding {
        Encoding::Ascii => content.read(&header, Ascii::new(body, header.line_count)),
        Encoding::Little => content.read(&header, Binary::<Little>::new(body, header.body_start)),
        Encoding::Big => content.read(&header, Binary::<Big>::new(body, header.body_start)),
    }?;
    content.into_scene()
}

/// What a vertex property means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meaning {
    Position(usize),
    Normal(usize),
    TexCoord(usize),
    Color(usize),
}

impl Meaning {
    fn of(name: &str) -> Option<Self> {
        Some(match name.strip_prefix("diffuse_").unwrap_or(name) {
            "x" => Self::Position(0),
            "y" => Self::Position(1),
            "z" => Self::Position(2),
            "nx" => Self::Normal(0),
            "ny" => Self::Normal(1),
            "nz" => Self::Normal(2),
            "u" | "s" | "texture_u" | "texture_s" => Self::TexCoord(0),
            "v" | "t" | "texture_v" | "texture_t" => Self::TexCoord(1),
            "red" | "r" => Self::Color(0),
            "green" | "g" => Self::Color(1),
            "blue" | "b" => Self::Color(2),
            "alpha" | "a" => Self::Color(3),
            _ => return None,
        })
    }
}

/// What has been read.
struct Content {
    vertex_count: u32,
    has_normals: bool,
    has_tex_coords: bool,
    has_colors: bool,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    tex_coords: Vec<Vec2>,
    colors: Vec<Vec4>,
    /// Corners of all polygons, one after the other, and where each polygon ends. Cut into triangles at the end, as
    /// faces may come before vertices.
    corners: Vec<u32>,
    ends: Vec<usize>,
    warnings: Warnings,
    too_small: usize,
}

impl Content {
    fn new(header: &Header) -> Result<Self, LoadError> {
        let invalid = |detail: String| LoadError::Malformed { format: FORMAT, detail };
        let vertex = header.element("vertex").ok_or_else(|| invalid("it has no element 'vertex'".into()))?;
        let has =
            |meaning| vertex.properties.iter().any(|p| Meaning::of(&p.name) == Some(meaning) && p.count.is_none());
        if !(0..3).all(|axis| has(Meaning::Position(axis))) {
            return Err(invalid("element 'vertex' lacks x, y or z".into()));
        }
        let vertex_count = u32::try_from(vertex.count)
            .map_err(|_| invalid(format!("{} vertices; at most 2^32 - 1 can be numbered", vertex.count)))?;
        let surfaces = ["face", "tristrips"].map(|name| header.element(name).is_some_and(|e| e.count > 0));
        if surfaces == [false, false] {
            return Err(if vertex_count == 0 {
                invalid("it has no vertices and no faces".into())
            } else {
                LoadError::Unsupported {
                    format: FORMAT,
                    detail: format!("it has {vertex_count} vertices and no faces; point clouds cannot be shown"),
                }
            });
        }
        let mut warnings = Warnings::default();
        if header.element("face").is_some_and(|face| face.properties.iter().any(|p| p.name == "red")) {
            warnings.add("colours of faces are left out; only colours of vertices are shown");
        }
        Ok(Self {
            vertex_count,
            has_normals: (0..3).all(|axis| has(Meaning::Normal(axis))),
            has_tex_coords: (0..2).all(|axis| has(Meaning::TexCoord(axis))),
            has_colors: (0..3).all(|channel| has(Meaning::Color(channel))) || has(Meaning::Color(3)),
            positions: Vec::new(),
            normals: Vec::new(),
            tex_coords: Vec::new(),
            colors: Vec::new(),
            corners: Vec::new(),
            ends: Vec::new(),
            warnings,
            too_small: 0,
        })
    }

    fn read<S: Source>(&mut self, header: &Header, mut source: S) -> Result<(), LoadError> {
        for element in &header.elements {
            source.start(element)?;
            if element.count == 0 {
                continue;
            }
            match element.name.as_str() {
                "vertex" => self.read_vertices(element, &mut source)?,
                "face" => self.read_faces(element, &mut source)?,
                "tristrips" => self.read_strips(element, &mut source)?,
                _ if element.properties.is_empty() => {}
                _ => {
                    for _ in 0..element.count {
                        source.row()?;
                        skip(&mut source, element, 0..element.properties.len())?;
                    }
                }
            }
        }
        Ok(())
    }

    fn read_vertices<S: Source>(&mut self, element: &Element, source: &mut S) -> Result<(), LoadError> {
        // `Source::start` has seen that the file has room for them.
        let count = self.vertex_count as usize;
        self.positions.reserve_exact(count);
        self.normals.reserve_exact(if self.has_normals { count } else { 0 });
        self.tex_coords.reserve_exact(if self.has_tex_coords { count } else { 0 });
        self.colors.reserve_exact(if self.has_colors { count } else { 0 });
        let meanings: Vec<_> = element
            .properties
            .iter()
            .map(|p| (p.count.is_none().then(|| Meaning::of(&p.name)).flatten(), p.value))
            .collect();
        for _ in 0..count {
            source.row()?;
            let (mut position, mut normal, mut tex_coord) = ([0.0; 3], [0.0; 3], [0.0; 2]);
            let mut color = [1.0; 4];
            for (i, &(meaning, kind)) in meanings.iter().enumerate() {
                match meaning {
                    Some(Meaning::Position(axis)) => position[axis] = source.value(kind)? as f32,
                    Some(Meaning::Normal(axis)) => normal[axis] = source.value(kind)? as f32,
                    Some(Meaning::TexCoord(axis)) => tex_coord[axis] = source.value(kind)? as f32,
                    Some(Meaning::Color(channel)) => color[channel] = linear(source.value(kind)?, kind, channel == 3),
                    None => skip(source, element, i..i + 1)?,
                }
            }
            self.positions.push(position.into());
            if self.has_normals {
                self.normals.push(normal.into());
            }
            if self.has_tex_coords {
                self.tex_coords.push(Vec2::new(tex_coord[0], 1.0 - tex_coord[1]));
            }
            if self.has_colors {
                self.colors.push(color.into());
            }
        }
        Ok(())
    }

    fn read_faces<S: Source>(&mut self, element: &Element, source: &mut S) -> Result<(), LoadError> {
        let (list, count_kind, index_kind) = index_list(element)?;
        for _ in 0..element.count {
            source.row()?;
            skip(source, element, 0..list)?;
            let count = source.list(count_kind, index_kind)?;
            for _ in 0..count {
                let index = source.value(index_kind)?;
                let index = self.vertex(index).ok_or_else(|| self.no_vertex(source, index))?;
                self.corners.push(index);
            }
            if count < 3 {
                self.corners.truncate(self.corners.len() - count);
                self.too_small += 1;
            } else {
                self.ends.push(self.corners.len());
            }
            skip(source, element, list + 1..element.properties.len())?;
        }
        Ok(())
    }

    fn read_strips<S: Source>(&mut self, element: &Element, source: &mut S) -> Result<(), LoadError> {
        let (list, count_kind, index_kind) = index_list(element)?;
        for _ in 0..element.count {
            source.row()?;
            skip(source, element, 0..list)?;
            let mut strip = [0; 2];
            let mut length = 0_usize;
            for _ in 0..source.list(count_kind, index_kind)? {
                let index = source.value(index_kind)?;
                if index == -1.0 {
                    length = 0;
                    continue;
                }
                let next = self.vertex(index).ok_or_else(|| self.no_vertex(source, index))?;
                length += 1;
                let [a, b] = strip;
                // A vertex given twice only moves the strip along.
                if length >= 3 && a != b && b != next && a != next {
                    self.corners.extend(if length % 2 == 1 { [a, b, next] } else { [b, a, next] });
                    self.ends.push(self.corners.len());
                }
                strip = [b, next];
            }
            skip(source, element, list + 1..element.properties.len())?;
        }
        Ok(())
    }

    /// The number as that of a vertex, if it is one.
    fn vertex(&self, index: f64) -> Option<u32> {
        let vertex = index as u32;
        (vertex < self.vertex_count && f64::from(vertex) == index).then_some(vertex)
    }

    fn no_vertex<S: Source>(&self, source: &S, index: f64) -> LoadError {
        source.error(format_args!("vertex {index} is named, but there are {}, numbered from 0", self.vertex_count))
    }

    fn into_scene(mut self) -> Result<Loaded, LoadError> {
        let mut triangles = Vec::with_capacity(self.ends.len());
        let mut triangulator = Triangulator::default();
        let mut polygon = Vec::new();
        let mut start = 0;
        for &end in &self.ends {
            match self.corners[start..end] {
                [a, b, c] => triangles.push([a, b, c]),
                ref corners => {
                    polygon.clear();
                    polygon.extend(corners.iter().map(|&v| self.positions[v as usize]));
                    triangles.extend(triangulator.cut(&polygon).iter().map(|t| t.map(|i| corners[i as usize])));
                }
            }
            start = end;
        }
        if triangles.is_empty() {
            return Err(LoadError::Malformed { format: FORMAT, detail: "none of its faces has an area".into() });
        }
        self.warnings.add_count("faces with fewer than 3 corners, left out", self.too_small);
        self.warnings.add_count(BAD_POLYGONS, triangulator.bad);

        let transparent = self.colors.iter().any(|color| color.w < 1.0);
        let alpha_mode = if transparent { AlphaMode::Blend } else { AlphaMode::Opaque };
        let mut mesh = Mesh::new(self.positions, triangles)?;
        mesh = if self.has_normals { repair_normals(mesh, self.normals)? } else { mesh.with_smooth_normals() };
        if self.has_tex_coords {
            mesh = mesh.with_tex_coords(self.tex_coords)?;
        }
        if self.has_colors {
            mesh = mesh.with_colors(self.colors)?;
        }
        let mut scene = Scene::new();
        let mesh = scene.add_mesh(mesh)?;
        let material = scene.add_material(Material { alpha_mode, ..Material::default() })?;
        scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY })?;
        Ok(Loaded { scene, warnings: self.warnings.into_list() })
    }
}

/// Which property of an element lists vertices, and the types of its count and of its items.
fn index_list(element: &Element) -> Result<(usize, Kind, Kind), LoadError> {
    let named = |p: &header::Property| matches!(p.name.as_str(), "vertex_indices" | "vertex_index");
    element
        .properties
        .iter()
        .enumerate()
        .find_map(|(i, p)| p.count.filter(|_| named(p)).map(|count| (i, count, p.value)))
        .ok_or_else(|| LoadError::Malformed {
            format: FORMAT,
            detail: format!("element '{}' has no list 'vertex_indices'", element.name),
        })
}

/// Reads past some properties of a row.
fn skip<S: Source>(source: &mut S, element: &Element, range: std::ops::Range<usize>) -> Result<(), LoadError> {
    for property in &element.properties[range] {
        let count = match property.count {
            Some(count) => source.list(count, property.value)?,
            None => 1,
        };
        for _ in 0..count {
            source.value(property.value)?;
        }
    }
    Ok(())
}

static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb8(i as u8)));

/// A colour channel as linear light, or alpha as it is, in 0..=1.
fn linear(value: f64, kind: Kind, is_alpha: bool) -> f32 {
    let share = |largest: f64| (value / largest) as f32;
    let unit = match kind {
        // `as` clamps to 0..=255 and turns NaN into 0.
        Kind::U8 | Kind::I8 | Kind::I32 | Kind::U32 if !is_alpha => return LINEAR[usize::from(value as u8)],
        Kind::U8 | Kind::I8 | Kind::I32 | Kind::U32 => share(255.0),
        Kind::U16 | Kind::I16 => share(65_535.0),
        Kind::F32 | Kind::F64 => share(1.0),
    };
    // Not `clamp`: NaN becomes 0.
    let unit = if unit > 0.0 { unit.min(1.0) } else { 0.0 };
    if is_alpha || matches!(kind, Kind::F32 | Kind::F64) { unit } else { linear_from_srgb(unit) }
}
