//! From faces read to meshes, materials and instances.

use std::collections::HashMap;

use glam::{Affine3A, Vec2, Vec3};
use pellucid_core::scene::MaterialTexture;
use pellucid_core::{AlphaMode, Instance, Material, Mesh, Scene};

use super::mtl::{Definition, Map};
use super::texture::{Alpha, Textures};
use super::{Corner, FORMAT, NONE, Part, Reader, linear};
use crate::mesh_parts::repair_normals;
use crate::polygon::BAD_POLYGONS;
use crate::text::shown;
use crate::warnings::Warnings;
use crate::{Assets, LoadError, Loaded};

impl Reader<'_> {
    /// Builds the scene.
    pub(super) fn finish(mut self, bytes: &[u8]) -> Result<Loaded, LoadError> {
        let invalid = |detail: &str| LoadError::Malformed { format: FORMAT, detail: detail.into() };
        if bytes.is_empty() {
            return Err(invalid("the file is empty"));
        }
        if self.parts.is_empty() {
            return Err(invalid("it has no faces"));
        }
        if self.parts.iter().any(|part| part.corners.len() > NONE as usize) {
            return Err(invalid("a material has more than 2^32 vertices"));
        }
        self.warnings.add_count("lines and points, left out", self.skipped_elements);
        self.warnings.add_count("free-form curves and surfaces, left out", self.skipped_surfaces);
        self.warnings.add_count(BAD_POLYGONS, self.triangulator.bad);
        if !self.colors.is_empty() {
            self.colors.resize(self.positions.len(), glam::Vec4::ONE);
        }

        let smooth = smooth_normals(&self.positions, &self.parts);
        let mut scene = Scene::new();
        let mut textures = Textures::default();
        let mut made = HashMap::new();
        for part in std::mem::take(&mut self.parts) {
            let material = match made.get(&part.material) {
                Some(&id) => id,
                None => {
                    let definition = self.definition(&part.material);
                    let name = String::from_utf8_lossy(&part.material).into_owned();
                    let material =
                        make_material(name, &definition, &mut textures, self.assets, &mut scene, &mut self.warnings)?;
                    let id = scene.add_material(material)?;
                    made.insert(part.material.clone(), id);
                    id
                }
            };
            let mesh = scene.add_mesh(self.mesh(part, &smooth)?)?;
            scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY })?;
        }
        Ok(Loaded { scene, warnings: self.warnings.into_list() })
    }

    /// What the libraries say about a material; the default if nothing.
    fn definition(&mut self, name: &[u8]) -> Definition {
        let found = self.materials.remove(name);
        if found.is_none() && !name.is_empty() {
            self.warnings.add(format!("the material '{}' is not defined; it is drawn white", shown(name)));
        }
        found.unwrap_or_default()
    }

    fn mesh(&self, part: Part, smooth: &HashMap<(u32, u32), Vec3>) -> Result<Mesh, LoadError> {
        let Part { corners, triangles, flat, .. } = part;
        let has_tex_coords = corners.iter().any(|corner| corner.tex_coord != NONE);
        let positions = corners.iter().map(|corner| self.positions[corner.position as usize]).collect();
        let mut mesh = Mesh::new(positions, triangles)?;
        if !flat {
            let normal = |corner: &Corner| match self.normals.get(corner.normal as usize) {
                Some(&normal) => normal,
                None => smooth.get(&smooth_key(corner)).copied().unwrap_or(Vec3::Z),
            };
            mesh = repair_normals(mesh, corners.iter().map(normal).collect())?;
        }
        if has_tex_coords {
            let tex_coord =
                |corner: &Corner| self.tex_coords.get(corner.tex_coord as usize).copied().unwrap_or(Vec2::ZERO);
            mesh = mesh.with_tex_coords(corners.iter().map(tex_coord).collect())?;
        }
        if !self.colors.is_empty() {
            let colors = corners.iter().map(|corner| self.colors[corner.position as usize]).collect();
            mesh = mesh.with_colors(colors)?;
        }
        Ok(mesh)
    }
}

/// Corners of the same key share a smooth normal, whatever their texture coordinates: a seam of the texture is none of
/// the surface.
fn smooth_key(corner: &Corner) -> (u32, u32) {
    (corner.position, corner.smoothing)
}

/// Normals of the corners that have none of their own and are not lit flat.
fn smooth_normals(positions: &[Vec3], parts: &[Part]) -> HashMap<(u32, u32), Vec3> {
    let mut numbers = HashMap::new();
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for part in parts.iter().filter(|p| !p.flat && p.corners.iter().any(|corner| corner.normal == NONE)) {
        let vertices: Vec<u32> = part
            .corners
            .iter()
            .map(|corner| {
                *numbers.entry(smooth_key(corner)).or_insert_with(|| {
                    points.push(positions[corner.position as usize]);
                    (points.len() - 1) as u32
                })
            })
            .collect();
        triangles.extend(part.triangles.iter().map(|t| t.map(|v| vertices[v as usize])));
    }
    let normals = Mesh::new(points, triangles).map(Mesh::with_smooth_normals).unwrap_or_default();
    let normals = normals.normals().unwrap_or_default();
    numbers.into_iter().filter_map(|(key, n)| Some((key, *normals.get(n as usize)?))).collect()
}

/// Transparent where `d` or `Tr` say so or where the texture has graded alpha; masked where the texture is a cut-out.
fn make_material(
    name: String,
    definition: &Definition,
    textures: &mut Textures,
    assets: &dyn Assets,
    scene: &mut Scene,
    warnings: &mut Warnings,
) -> Result<Material, LoadError> {
    let alpha = definition.alpha();
    let texture = textures.texture(definition, assets, scene, warnings)?;
    let alpha_mode = match texture {
        _ if alpha < 1.0 => AlphaMode::Blend,
        Some((_, Alpha::Graded)) => AlphaMode::Blend,
        Some((_, Alpha::CutOut)) => AlphaMode::Mask { cutoff: 0.5 },
        Some((_, Alpha::None)) | None => AlphaMode::Opaque,
    };
    let map = definition.color_map.as_ref().or(definition.alpha_map.as_ref());
    let transform = map.map(Map::transform).unwrap_or_default();
    Ok(Material {
        name,
        base_color: definition.color.map_or(Vec3::ONE, linear).extend(alpha),
        texture: texture.map(|(texture, _)| MaterialTexture { texture, transform }),
        alpha_mode,
        ..Material::default()
    })
}
