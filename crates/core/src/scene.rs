//! What is drawn: meshes, their instances, materials and textures, and the cameras a file brought along.
//!
//! A [`Scene`] is valid by construction: every index is checked when a part is added, so renderers never have to.
//! Vertex positions may still be NaN or infinite, as files hold such things; primitives that touch them are dropped and
//! counted by the renderers.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::{Affine2, Affine3A, Vec2, Vec3, Vec4};

use crate::meshlets::Meshlets;
use crate::shading::GREATEST_COLOR;
use crate::{Camera, Error, Texture};

/// A mesh of a [`Scene`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct MeshId(u32);

/// A material of a [`Scene`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct MaterialId(u32);

/// A texture of a [`Scene`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct TextureId(u32);

impl MeshId {
    /// Position in [`Scene::meshes`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl MaterialId {
    /// Position in [`Scene::materials`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl TextureId {
    /// Position in [`Scene::textures`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Indexed triangles with optional attributes, one value a vertex.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Option<Vec<Vec3>>,
    tex_coords: Option<Vec<Vec2>>,
    colors: Option<Vec<Vec4>>,
    meshlets: OnceLock<Meshlets>,
}

impl Mesh {
    /// A mesh of `triangles`, each three positions in `positions`, counter-clockwise seen from outside.
    ///
    /// Without normals it is lit flat: each triangle by its geometric normal.
    ///
    /// # Errors
    /// [`Error::Mesh`] if a triangle names a vertex that is not there.
    pub fn new(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, Error> {
        let vertex_count = positions.len();
        if let Some((number, triangle)) =
            triangles.iter().enumerate().find(|(_, t)| t.iter().any(|&v| v as usize >= vertex_count))
        {
            return Err(Error::Mesh(format!(
                "triangle {number} has vertices {triangle:?} but there are only {vertex_count}"
            )));
        }
        Ok(Self { positions, triangles, ..Self::default() })
    }

    /// Adds one normal a vertex, of any length but zero; lighting interpolates and normalises them.
    ///
    /// # Errors
    /// [`Error::Mesh`] if there is not exactly one for each vertex.
    pub fn with_normals(mut self, normals: Vec<Vec3>) -> Result<Self, Error> {
        self.check_count("normals", normals.len())?;
        self.set_normals(normals);
        Ok(self)
    }

    /// Adds one texture coordinate a vertex; (0, 0) is the top left corner of the texture, (1, 1) the bottom right one.
    ///
    /// # Errors
    /// [`Error::Mesh`] if there is not exactly one for each vertex.
    pub fn with_tex_coords(mut self, tex_coords: Vec<Vec2>) -> Result<Self, Error> {
        self.check_count("texture coordinates", tex_coords.len())?;
        self.tex_coords = Some(tex_coords);
        Ok(self)
    }

    /// Adds one colour a vertex: linear light, straight alpha. It multiplies the material's base colour.
    ///
    /// # Errors
    /// [`Error::Mesh`] if there is not exactly one for each vertex.
    pub fn with_colors(mut self, colors: Vec<Vec4>) -> Result<Self, Error> {
        self.check_count("colours", colors.len())?;
        self.colors = Some(colors);
        Ok(self)
    }

    /// Replaces the normals by smooth ones: at each vertex the mean of its triangles' normals, weighted by area.
    #[must_use]
    pub fn with_smooth_normals(mut self) -> Self {
        let mut normals = vec![Vec3::ZERO; self.positions.len()];
        // Areas of a mesh about 1 large, so that they stay within f32 at any scale.
        let largest =
            self.positions.iter().filter(|p| p.is_finite()).fold(0.0, |m: f32, p| m.max(p.abs().max_element()));
        let scale = 1.0 / largest.max(f32::MIN_POSITIVE);
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|v| self.positions[v as usize] * scale);
            let twice_area = (b - a).cross(c - a);
            if twice_area.is_finite() {
                for &vertex in triangle {
                    normals[vertex as usize] += twice_area;
                }
            }
        }
        for normal in &mut normals {
            *normal = normal.normalize_or(Vec3::Z);
        }
        self.set_normals(normals);
        self
    }

    fn set_normals(&mut self, normals: Vec<Vec3>) {
        self.normals = Some(normals);
        self.meshlets.take();
    }

    fn check_count(&self, what: &str, count: usize) -> Result<(), Error> {
        if count == self.positions.len() {
            return Ok(());
        }
        Err(Error::Mesh(format!("{count} {what} for {} vertices", self.positions.len())))
    }

    /// Vertex positions in the mesh's own space.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Three vertex numbers a triangle, all in range.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// One normal a vertex; `None`: lit flat.
    pub fn normals(&self) -> Option<&[Vec3]> {
        self.normals.as_deref()
    }

    /// One texture coordinate a vertex.
    pub fn tex_coords(&self) -> Option<&[Vec2]> {
        self.tex_coords.as_deref()
    }

    /// One colour a vertex: linear light, straight alpha.
    pub fn colors(&self) -> Option<&[Vec4]> {
        self.colors.as_deref()
    }

    /// The mesh cut into meshlets, which is done when they are first asked for; they are kept.
    pub fn meshlets(&self) -> &Meshlets {
        self.meshlets.get_or_init(|| Meshlets::new(self))
    }
}

/// How a material's alpha is meant (glTF 2.0, section 3.9.4).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum AlphaMode {
    /// Alpha is ignored; the surface hides what is behind it.
    #[default]
    Opaque,
    /// Fully there where alpha is at least the cutoff, not there elsewhere.
    Mask {
        /// Alpha below it is not there.
        cutoff: f32,
    },
    /// Transparent.
    Blend,
}

/// Which texture colours a material, and how its coordinates are moved first (KHR_texture_transform).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaterialTexture {
    /// The texture, whose RGBA multiplies the base colour.
    pub texture: TextureId,
    /// Applied to the mesh's texture coordinates before sampling.
    pub transform: Affine2,
}

/// What a surface looks like.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name in the file, for messages.
    pub name: String,
    /// Linear light, straight alpha.
    pub base_color: Vec4,
    /// Multiplies the base colour where the mesh has texture coordinates.
    pub texture: Option<MaterialTexture>,
    /// What alpha means.
    pub alpha_mode: AlphaMode,
    /// Seen from behind too. If not, back faces are culled.
    pub double_sided: bool,
    /// Not lit: base colour as it is (KHR_materials_unlit).
    pub unlit: bool,
}

impl Default for Material {
    /// Opaque white, lit, double sided.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec4::ONE,
            texture: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: true,
            unlit: false,
        }
    }
}

impl Material {
    /// A transparent, double-sided material of one colour: linear light, straight alpha.
    pub fn translucent(name: impl Into<String>, base_color: Vec4) -> Self {
        Self { name: name.into(), base_color, alpha_mode: AlphaMode::Blend, ..Self::default() }
    }

    /// An opaque, double-sided material of one colour: linear light.
    pub fn opaque(name: impl Into<String>, color: Vec3) -> Self {
        Self { name: name.into(), base_color: color.extend(1.0), ..Self::default() }
    }
}

/// A mesh placed in the world with a material. Its triangles are drawn in the mesh's order, after those of earlier
/// instances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instance {
    /// What is drawn.
    pub mesh: MeshId,
    /// What it looks like.
    pub material: MaterialId,
    /// Where it is. A negative determinant flips the winding.
    pub world_from_mesh: Affine3A,
}

/// Everything that is drawn. Valid by construction: ids refer to parts that are there.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    meshes: Vec<Mesh>,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    instances: Vec<Instance>,
    cameras: Vec<Camera>,
    primitive_count: u32,
    revision: u64,
}

/// Coordinates beyond it do not count for a scene's bounds. Squares of sums of them are still finite.
pub const BOUNDS_LIMIT: f32 = 1e18;

/// The sphere a camera is fitted to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundingSphere {
    /// Centre of the bounding box, in world space.
    pub center: Vec3,
    /// Half the box's diagonal; 1 for a scene without extent.
    pub radius: f32,
}

impl Scene {
    /// A scene with nothing in it.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a texture.
    ///
    /// # Errors
    /// [`Error::Scene`] for more than 2^32 of them.
    pub fn add_texture(&mut self, texture: Texture) -> Result<TextureId, Error> {
        self.change();
        let id = TextureId(next_id("textures", self.textures.len())?);
        self.textures.push(texture);
        Ok(id)
    }

    /// Adds a material.
    ///
    /// # Errors
    /// [`Error::Scene`] if its texture is not one of this scene, or its base colour is negative, not a number or above
    /// [`GREATEST_COLOR`].
    pub fn add_material(&mut self, material: Material) -> Result<MaterialId, Error> {
        let color = material.base_color;
        if !(color.cmpge(Vec4::ZERO) & color.cmple(GREATEST_COLOR)).all() {
            return Err(Error::Scene(format!(
                "material '{}' has the colour {color}; channels go from 0 to 65504",
                material.name
            )));
        }
        if let Some(texture) = material.texture
            && texture.texture.index() >= self.textures.len()
        {
            return Err(Error::Scene(format!("material '{}' names a texture that is not there", material.name)));
        }
        self.change();
        let id = MaterialId(next_id("materials", self.materials.len())?);
        self.materials.push(material);
        Ok(id)
    }

    /// Adds a mesh; it is drawn once an instance places it.
    ///
    /// # Errors
    /// [`Error::Scene`] for more than 2^32 of them.
    pub fn add_mesh(&mut self, mesh: Mesh) -> Result<MeshId, Error> {
        self.change();
        let id = MeshId(next_id("meshes", self.meshes.len())?);
        self.meshes.push(mesh);
        Ok(id)
    }

    /// Places a mesh in the world, drawn after all earlier instances.
    ///
    /// # Errors
    /// [`Error::Scene`] if mesh or material are not there, or if the scene would have 2^32 primitives or more.
    pub fn add_instance(&mut self, instance: Instance) -> Result<(), Error> {
        let Some(mesh) = self.meshes.get(instance.mesh.index()) else {
            return Err(Error::Scene("an instance names a mesh that is not there".into()));
        };
        if instance.material.index() >= self.materials.len() {
            return Err(Error::Scene("an instance names a material that is not there".into()));
        }
        let total = u64::from(self.primitive_count) + mesh.triangles.len() as u64;
        self.primitive_count = u32::try_from(total).map_err(|_| {
            Error::Scene(format!("{total} triangles after instancing; at most 2^32 - 1 can be numbered"))
        })?;
        self.instances.push(instance);
        self.change();
        Ok(())
    }

    /// Adds a camera that the file brought along; the first is used unless the user names another view.
    pub fn add_camera(&mut self, camera: Camera) {
        self.cameras.push(camera);
        self.change();
    }

    fn change(&mut self) {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        self.revision = NEXT.fetch_add(1, Ordering::Relaxed);
    }

    /// All meshes.
    pub fn meshes(&self) -> &[Mesh] {
        &self.meshes
    }

    /// All materials.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// All textures.
    pub fn textures(&self) -> &[Texture] {
        &self.textures
    }

    /// All instances in draw order.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// The file's own cameras.
    pub fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    /// The mesh of an instance or id.
    pub fn mesh(&self, id: MeshId) -> &Mesh {
        &self.meshes[id.index()]
    }

    /// The material of an id.
    pub fn material(&self, id: MaterialId) -> &Material {
        &self.materials[id.index()]
    }

    /// The texture of an id.
    pub fn texture(&self, id: TextureId) -> &Texture {
        &self.textures[id.index()]
    }

    /// Changes whenever the scene does, and differs between scenes that were made apart: what a renderer keeps of a
    /// scene is still good while this number is the same.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Triangles after instancing.
    pub fn primitive_count(&self) -> u32 {
        self.primitive_count
    }

    /// The smallest box, as its two extreme corners in world space, around all vertices that a triangle uses; `None` if
    /// there are none. Vertices that are NaN, infinite or farther than [`BOUNDS_LIMIT`] from the origin do not count: a
    /// camera fitted to them would see nothing else.
    pub fn bounding_box(&self) -> Option<(Vec3, Vec3)> {
        let mut bounds: Option<(Vec3, Vec3)> = None;
        for instance in &self.instances {
            let mesh = self.mesh(instance.mesh);
            for &vertex in mesh.triangles.as_flattened() {
                let position = instance.world_from_mesh.transform_point3(mesh.positions[vertex as usize]);
                if position.abs().cmple(Vec3::splat(BOUNDS_LIMIT)).all() {
                    let (low, high) = bounds.unwrap_or((position, position));
                    bounds = Some((low.min(position), high.max(position)));
                }
            }
        }
        bounds
    }

    /// The sphere around [`Self::bounding_box`]; a unit sphere at the origin for an empty scene.
    pub fn bounding_sphere(&self) -> BoundingSphere {
        let Some((low, high)) = self.bounding_box() else {
            return BoundingSphere { center: Vec3::ZERO, radius: 1.0 };
        };
        let radius = (high - low).length() * 0.5;
        BoundingSphere { center: (low + high) * 0.5, radius: if radius > 0.0 { radius } else { 1.0 } }
    }
}

fn next_id(what: &str, count: usize) -> Result<u32, Error> {
    u32::try_from(count).map_err(|_| Error::Scene(format!("more than 2^32 {what}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_with_a_vertex_out_of_range_is_refused() {
        let error = Mesh::new(vec![Vec3::ZERO; 3], vec![[0, 1, 2], [0, 1, 3]]).unwrap_err();
        assert!(error.to_string().contains("triangle 1"), "{error}");
    }

    #[test]
    fn attributes_must_match_the_vertices() {
        let mesh = Mesh::new(vec![Vec3::ZERO; 3], vec![[0, 1, 2]]).unwrap();
        assert!(mesh.clone().with_normals(vec![Vec3::X; 2]).is_err());
        assert!(mesh.with_colors(vec![Vec4::ONE; 3]).is_ok());
    }

    #[test]
    fn bounds_ignore_what_is_not_finite_or_not_drawn() {
        let positions = vec![
            Vec3::ZERO,
            Vec3::X,
            Vec3::Y,
            Vec3::splat(f32::NAN),
            Vec3::splat(1e9), // used by no triangle
        ];
        let mut scene = Scene::new();
        let mesh = scene.add_mesh(Mesh::new(positions, vec![[0, 1, 2], [0, 1, 3]]).unwrap()).unwrap();
        let material = scene.add_material(Material::default()).unwrap();
        scene.add_instance(Instance { mesh, material, world_from_mesh: Affine3A::IDENTITY }).unwrap();
        assert_eq!(scene.bounding_box(), Some((Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0))));
    }
}
