//! Primitives become meshes (glTF 2.0, section 3.7.2).

use glam::{Vec2, Vec3, Vec4};
use pellucid_core::{Mesh, MeshId};

use super::accessor::{Accessor, Component};
use super::document::Primitive;
use super::{Loader, malformed, unsupported};
use crate::LoadError;

const TRIANGLES: u32 = 4;
const TRIANGLE_STRIP: u32 = 5;
const TRIANGLE_FAN: u32 = 6;

/// The accessors a mesh is made of. Primitives that agree in all of them, and differ in material, share one mesh.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Geometry {
    mode: u32,
    indices: Option<usize>,
    positions: usize,
    normals: Option<usize>,
    tex_coords: Option<usize>,
    colors: Option<usize>,
}

impl<'a> Loader<'a> {
    /// The mesh of a primitive whose material wants texture coordinates of `tex_coord_set`; `None` if there is nothing
    /// to draw.
    pub(super) fn mesh(
        &mut self,
        primitive: &Primitive,
        tex_coord_set: Option<u32>,
        place: &str,
    ) -> Result<Option<MeshId>, LoadError> {
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        match mode {
            0..=3 => {
                self.warnings.add("points and lines are not supported, and are left out");
                return Ok(None);
            }
            TRIANGLES | TRIANGLE_STRIP | TRIANGLE_FAN => {}
            _ => return Err(malformed(format!("{place}: unknown mode {mode}"))),
        }
        let Some(&positions) = primitive.attributes.get("POSITION") else {
            self.warnings.add("primitives without positions are left out");
            return Ok(None);
        };
        if !primitive.targets.is_empty() {
            self.warnings.add("morph targets are not supported: meshes are shown without them");
        }
        let tex_coords = tex_coord_set.and_then(|set| primitive.attributes.get(&format!("TEXCOORD_{set}")).copied());
        if tex_coord_set.is_some() && tex_coords.is_none() {
            self.warnings.add("textured primitives without texture coordinates are drawn in their base colour");
        }
        let attribute = |name: &str| primitive.attributes.get(name).copied();
        let geometry = Geometry {
            mode,
            indices: primitive.indices,
            positions,
            normals: attribute("NORMAL"),
            tex_coords,
            colors: attribute("COLOR_0"),
        };
        if let Some(&known) = self.meshes.get(&geometry) {
            return Ok(known);
        }
        let is_compressed = primitive.extensions.draco.is_some();
        let id = match self.build(geometry, is_compressed, place)? {
            Some(mesh) => Some(self.scene.add_mesh(mesh)?),
            None => None,
        };
        self.meshes.insert(geometry, id);
        Ok(id)
    }

    fn build(&mut self, geometry: Geometry, is_compressed: bool, place: &str) -> Result<Option<Mesh>, LoadError> {
        let positions = self.attribute(geometry.positions, "POSITION", &[3], place)?;
        if is_compressed && !positions.has_data() {
            return Err(unsupported(format!("{place}: only there in KHR_draco_mesh_compression")));
        }
        let corners = self.corners(geometry.indices, positions.count, place)?;
        let triangle_count = match geometry.mode {
            TRIANGLES => corners.len() / 3,
            _ => corners.len().saturating_sub(2),
        };
        self.budget.charge(triangle_count, size_of::<[u32; 3]>(), || place.to_owned())?;
        if geometry.mode == TRIANGLES && !corners.len().is_multiple_of(3) {
            self.warnings.add("triangle lists that end within a triangle lose that one");
        }
        let mut triangles = assemble(geometry.mode, &corners);
        if triangles.is_empty() {
            return Ok(None);
        }

        // A buffer shared by many primitives: take out only the vertices this one draws.
        let chosen = (positions.count > corners.len()).then(|| {
            let mut used = corners.clone();
            used.sort_unstable();
            used.dedup();
            for vertex in triangles.as_flattened_mut() {
                *vertex = used.partition_point(|&other| other < *vertex) as u32;
            }
            used
        });
        let vertex_count = chosen.as_ref().map_or(positions.count, Vec::len);
        let source = |vertex: usize| chosen.as_ref().map_or(vertex, |used| used[vertex] as usize);

        let (vec2, vec3, vec4) = (size_of::<Vec2>(), size_of::<Vec3>(), size_of::<Vec4>());
        let vertex_bytes = vec3
            + geometry.normals.map_or(0, |_| vec3)
            + geometry.tex_coords.map_or(0, |_| vec2)
            + geometry.colors.map_or(0, |_| vec4);
        self.budget.charge(vertex_count, vertex_bytes, || place.to_owned())?;
        let places: Vec<Vec3> = (0..vertex_count).map(|v| positions.floats(source(v)).into()).collect();
        let mut mesh = Mesh::new(places, triangles)?;

        if let Some(index) = geometry.normals {
            let accessor = self.vertex_attribute(index, "NORMAL", &[3], positions.count, place)?;
            let normals: Vec<Vec3> = (0..vertex_count).map(|v| accessor.floats(source(v)).into()).collect();
            mesh = with_normals(mesh, normals)?;
        }
        if let Some(index) = geometry.tex_coords {
            let accessor = self.vertex_attribute(index, "TEXCOORD", &[2], positions.count, place)?;
            mesh = mesh.with_tex_coords((0..vertex_count).map(|v| accessor.floats(source(v)).into()).collect())?;
        }
        if let Some(index) = geometry.colors {
            let mut accessor = self.vertex_attribute(index, "COLOR_0", &[3, 4], positions.count, place)?;
            accessor.normalized = true;
            mesh = mesh.with_colors((0..vertex_count).map(|v| color(&accessor, source(v))).collect())?;
        }
        Ok(Some(mesh))
    }

    /// The vertices in drawing order.
    fn corners(&mut self, indices: Option<usize>, vertex_count: usize, place: &str) -> Result<Vec<u32>, LoadError> {
        let Some(index) = indices else {
            self.budget.charge(vertex_count, size_of::<u32>(), || place.to_owned())?;
            let count = u32::try_from(vertex_count).map_err(|_| {
                unsupported(format!("{place}: {vertex_count} vertices; at most 2^32 - 1 can be numbered"))
            })?;
            return Ok((0..count).collect());
        };
        let indices = Accessor::open(self.document, self.buffers, &mut self.budget, index, place)?;
        if indices.width != 1 || !matches!(indices.component, Component::U8 | Component::U16 | Component::U32) {
            return Err(malformed(format!("accessor {index}: {place} wants indices, unsigned scalars")));
        }
        self.budget.charge(indices.count, size_of::<u32>(), || format!("accessor {index}"))?;
        (0..indices.count)
            .map(|at| {
                let vertex = indices.unsigned(at);
                if (vertex as usize) < vertex_count {
                    return Ok(vertex);
                }
                Err(malformed(format!(
                    "accessor {index}: index {at} of {place} names vertex {vertex}, but there are only {vertex_count}"
                )))
            })
            .collect()
    }

    fn vertex_attribute(
        &mut self,
        index: usize,
        name: &str,
        widths: &[usize],
        vertex_count: usize,
        place: &str,
    ) -> Result<Accessor<'a>, LoadError> {
        let accessor = self.attribute(index, name, widths, place)?;
        if accessor.count == vertex_count {
            return Ok(accessor);
        }
        let count = accessor.count;
        Err(malformed(format!("accessor {index}: {count} elements, but {place} has {vertex_count} vertices")))
    }

    fn attribute(
        &mut self,
        index: usize,
        name: &str,
        widths: &[usize],
        place: &str,
    ) -> Result<Accessor<'a>, LoadError> {
        let accessor = Accessor::open(self.document, self.buffers, &mut self.budget, index, place)?;
        if !widths.contains(&accessor.width) || accessor.component == Component::U32 {
            let (component, width) = (accessor.component, accessor.width);
            return Err(malformed(format!("accessor {index}: {name} of {place} cannot be {width} x {component:?}")));
        }
        Ok(accessor)
    }
}

/// Triangles out of vertices in drawing order (glTF 2.0, section 3.7.2.1).
fn assemble(mode: u32, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        TRIANGLE_STRIP => corners
            .array_windows()
            .enumerate()
            .map(|(number, &[a, b, c])| if number % 2 == 0 { [a, b, c] } else { [a, c, b] })
            .collect(),
        TRIANGLE_FAN => match corners.split_first() {
            Some((&hub, rim)) => rim.array_windows().map(|&[a, b]| [a, b, hub]).collect(),
            None => Vec::new(),
        },
        _ => corners.as_chunks().0.to_vec(),
    }
}

/// Vertices whose normal has no direction get the mean of their triangles'.
fn with_normals(mesh: Mesh, mut normals: Vec<Vec3>) -> Result<Mesh, LoadError> {
    let has_direction = |normal: &Vec3| normal.is_finite() && normal.length_squared() > 0.0;
    if !normals.iter().all(has_direction) {
        let smooth = mesh.clone().with_smooth_normals();
        for (normal, &other) in normals.iter_mut().zip(smooth.normals().unwrap_or_default()) {
            if !has_direction(normal) {
                *normal = other;
            }
        }
    }
    Ok(mesh.with_normals(normals)?)
}

/// Linear light, straight alpha, each in 0..=1 as section 3.7.2.1 wants; NaN is 0.
fn color(accessor: &Accessor<'_>, index: usize) -> Vec4 {
    let [r, g, b, a] = accessor.floats(index);
    let a = if accessor.width == 4 { a } else { 1.0 };
    Vec4::from([r, g, b, a].map(|channel| if channel.is_nan() { 0.0 } else { channel.clamp(0.0, 1.0) }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_the_winding() {
        assert_eq!(assemble(TRIANGLE_STRIP, &[10, 11, 12, 13, 14]), [[10, 11, 12], [11, 13, 12], [12, 13, 14]]);
        assert_eq!(assemble(TRIANGLE_FAN, &[10, 11, 12, 13]), [[11, 12, 10], [12, 13, 10]]);
        assert_eq!(assemble(TRIANGLES, &[0, 1, 2, 3, 4, 5, 6]), [[0, 1, 2], [3, 4, 5]]);
        for mode in [TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN] {
            assert!(assemble(mode, &[]).is_empty());
            assert!(assemble(mode, &[1, 2]).is_empty());
        }
    }
}
