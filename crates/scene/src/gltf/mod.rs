//! glTF 2.0, as JSON (`.gltf`) or binary (`.glb`).
//!
//! A file is read in stages, one module each: the `container` gives JSON and binary chunk, the `document` is the JSON as
//! structs, `buffers` holds the bytes, an `accessor` takes numbers out of them, and from these come the `mesh`es,
//! `material`s and `texture`s that the `nodes` place in the world. Only what the scene shows is built.
//!
//! The structs are our own, over serde: the `gltf` crate's accessors trust offsets, counts and strides, know no
//! quantised attributes and panic where a file lies, and its validation does not say what is wrong.
//!
//! Supported extensions: `KHR_texture_transform`, `KHR_mesh_quantization`, `KHR_materials_unlit`, and
//! `KHR_materials_transmission` as [`TRANSMISSION_CLARITY`] tells. Skins, animations and morph targets are left out with
//! a warning, as are points, lines and all optional extensions that are not listed here.

mod accessor;
mod budget;
mod buffers;
mod container;
mod document;
mod material;
mod mesh;
mod nodes;
mod texture;

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use pellucid_core::scene::{MaterialId, MeshId, Scene};

use self::budget::Budget;
use self::buffers::{Buffers, Uris, shown};
use self::document::{AssetOnly, Document};
use crate::warnings::Warnings;
use crate::{Assets, LoadError, Loaded};

/// How clear a fully transmissive material is: its alpha is multiplied by `1 - TRANSMISSION_CLARITY * factor`.
///
/// `KHR_materials_transmission` describes light that goes through a surface whatever its alpha; here it becomes
/// translucency, without refraction and roughness. Below 1, so that clear glass keeps a faint body. The material's
/// alpha mode becomes [`Blend`](pellucid_core::AlphaMode::Blend); what was opaque before, or passed its alpha test,
/// counts as alpha 1. Transmission textures are ignored.
pub const TRANSMISSION_CLARITY: f32 = 0.8;

const SUPPORTED_EXTENSIONS: [&str; 4] =
    ["KHR_texture_transform", "KHR_mesh_quantization", "KHR_materials_unlit", "KHR_materials_transmission"];

/// Extensions with a warning of their own, raised where they are met.
const SEPARATELY_WARNED: [&str; 2] = ["EXT_mesh_gpu_instancing", "KHR_materials_pbrSpecularGlossiness"];

/// Parses a glTF 2.0 file, `.gltf` or `.glb`; the content says which.
///
/// A texture that cannot be read is a warning, and its material keeps its base colour.
///
/// # Errors
/// [`LoadError::Malformed`] for content that breaks the rules, [`LoadError::Unsupported`] for another version, a required
/// extension that is not known or content out of all proportion to the file, [`LoadError::Asset`] for a buffer that
/// cannot be read, and [`LoadError::OutsideFolder`] for a buffer or texture outside the file's folder.
pub fn parse(bytes: &[u8], assets: &dyn Assets) -> Result<Loaded, LoadError> {
    let container = container::split(bytes)?;
    let document = parse_document(container.json)?;
    let mut uris = Uris::new(assets);
    let buffers = Buffers::read(&document, container.binary, &mut uris)?;
    let file_bytes = bytes.len() as u64;
    let mut loader = Loader {
        document: &document,
        buffers: &buffers,
        file_bytes,
        budget: Budget::new(file_bytes + uris.bytes_read),
        uris,
        warnings: Warnings::default(),
        scene: Scene::new(),
        drawn_meshes: HashMap::new(),
        meshes: HashMap::new(),
        materials: HashMap::new(),
        textures: HashMap::new(),
        failed_images: HashSet::new(),
        texels: 0,
    };
    if container.excess_bytes > 0 {
        loader.warnings.add(format!("{} bytes behind the end of the GLB are ignored", container.excess_bytes));
    }
    loader.warn_of_ignored_parts();
    loader.place_nodes()?;
    if loader.scene.primitive_count() == 0 {
        loader.warnings.add("the scene has no triangles");
    }
    Ok(Loaded { scene: loader.scene, warnings: loader.warnings.into_list() })
}

/// One file on its way to a scene. The maps hold what is already built, by its number in the document.
struct Loader<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    uris: Uris<'a>,
    file_bytes: u64,
    budget: Budget,
    warnings: Warnings,
    scene: Scene,
    drawn_meshes: HashMap<usize, Rc<[(MeshId, MaterialId)]>>,
    meshes: HashMap<mesh::Geometry, Option<MeshId>>,
    materials: HashMap<Option<usize>, material::Prepared>,
    textures: HashMap<texture::Use, pellucid_core::TextureId>,
    failed_images: HashSet<usize>,
    /// Texels of all textures so far.
    texels: u64,
}

impl Loader<'_> {
    fn warn_of_ignored_parts(&mut self) {
        const MAX_NAMES: usize = 8;
        let ignored: Vec<&str> = (self.document.extensions_used.iter().map(String::as_str))
            .filter(|name| !SUPPORTED_EXTENSIONS.contains(name) && !SEPARATELY_WARNED.contains(name))
            .collect();
        if !ignored.is_empty() {
            let mut names: Vec<String> = ignored.iter().take(MAX_NAMES).map(|name| shown(name)).collect();
            if ignored.len() > MAX_NAMES {
                names.push(format!("{} more", ignored.len() - MAX_NAMES));
            }
            self.warnings.add(format!("ignored extensions: {}", names.join(", ")));
        }
        if !self.document.animations.is_empty() {
            self.warnings.add("animations are not supported: everything is shown at rest");
        }
    }
}

fn parse_document(json: &[u8]) -> Result<Document, LoadError> {
    // Some exporters pad the chunk with zeros.
    let json = json.trim_ascii_end();
    let end = json.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
    let document: Document = match serde_json::from_slice(&json[..end]) {
        Ok(document) => document,
        Err(error) => {
            // Another version has another structure: the version is then the better thing to tell.
            if let Ok(other) = serde_json::from_slice::<AssetOnly>(&json[..end]) {
                check_version(&other.asset)?;
            }
            return Err(malformed(format!("JSON: {error}")));
        }
    };
    check_version(&document.asset)?;
    if let Some(name) = document.extensions_required.iter().find(|name| !SUPPORTED_EXTENSIONS.contains(&name.as_str()))
    {
        return Err(unsupported(format!("the file requires the extension {}", shown(name))));
    }
    Ok(document)
}

fn check_version(asset: &document::Asset) -> Result<(), LoadError> {
    let parts = |version: &str| -> Option<(u32, u32)> {
        let (major, minor) = version.split_once('.')?;
        Some((major.parse().ok()?, minor.parse().ok()?))
    };
    let version = &asset.version;
    match parts(version) {
        Some((2, _)) => {}
        Some(_) => return Err(unsupported(format!("glTF {}; only 2.0 can be read", shown(version)))),
        None => return Err(malformed(format!("asset: '{}' is no version", shown(version)))),
    }
    match asset.min_version.as_deref() {
        Some(least) if parts(least).is_none_or(|least| least > (2, 0)) => {
            Err(unsupported(format!("glTF {} is the least version that will do; only 2.0 can be read", shown(least))))
        }
        _ => Ok(()),
    }
}

fn malformed(detail: impl Into<String>) -> LoadError {
    LoadError::Malformed { format: "glTF", detail: detail.into() }
}

fn unsupported(detail: impl Into<String>) -> LoadError {
    LoadError::Unsupported { format: "glTF", detail: detail.into() }
}
