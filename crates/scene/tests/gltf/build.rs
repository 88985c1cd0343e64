//! Builds small glTF documents.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use pellucid_core::Mesh;
use pellucid_scene::{LoadError, Loaded, NoAssets, gltf};
use serde_json::{Value, json};

pub(crate) const U8: u32 = 5121;
pub(crate) const I8: u32 = 5120;
pub(crate) const I16: u32 = 5122;
pub(crate) const U16: u32 = 5123;
pub(crate) const U32: u32 = 5125;
pub(crate) const F32: u32 = 5126;

/// A document and its one buffer.
pub(crate) struct Doc {
    pub(crate) json: Value,
    pub(crate) bin: Vec<u8>,
}

impl Doc {
    pub(crate) fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"},
            "bufferViews": [], "accessors": [], "meshes": [], "nodes": [], "scenes": [{"nodes": []}],
            "materials": [], "textures": [], "images": [], "samplers": [], "cameras": [],
        });
        Self { json, bin: Vec::new() }
    }

    /// One triangle at (0,0,0), (1,0,0), (0,1,0), drawn by one node: accessor 0, mesh 0, node 0.
    pub(crate) fn triangle() -> Self {
        let mut doc = Self::new();
        let positions = doc.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        doc.draw(json!({"attributes": {"POSITION": positions}}));
        doc
    }

    /// The triangle with texture coordinates (0,0), (1,0), (0,1) and material 0.
    pub(crate) fn textured_triangle(material: Value) -> Self {
        let mut doc = Self::triangle();
        let tex_coords = doc.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        let primitive = &mut doc.json["meshes"][0]["primitives"][0];
        primitive["attributes"]["TEXCOORD_0"] = json!(tex_coords);
        primitive["material"] = json!(0);
        doc.push("materials", material);
        doc.push("textures", json!({"source": 0}));
        doc
    }

    /// Adds to one of the document's lists.
    pub(crate) fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// Adds a mesh of one primitive, and a root node that draws it.
    pub(crate) fn draw(&mut self, primitive: Value) -> usize {
        let mesh = self.push("meshes", json!({"primitives": [primitive]}));
        self.root(json!({"mesh": mesh}))
    }

    pub(crate) fn root(&mut self, node: Value) -> usize {
        let node = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(node));
        node
    }

    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0xee);
        let offset = self.bin.len();
        self.bin.extend(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    pub(crate) fn accessor(&mut self, shape: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.push("accessors", json!({"bufferView": view, "componentType": component, "count": count, "type": shape}))
    }

    pub(crate) fn floats(&mut self, shape: &str, numbers: &[f32]) -> usize {
        let width = shape.strip_prefix("VEC").map_or(1, |width| width.parse().unwrap());
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        self.accessor(shape, F32, numbers.len() / width, &bytes)
    }

    pub(crate) fn indices(&mut self, component: u32, indices: &[u32]) -> usize {
        let size = match component {
            U8 => 1,
            U16 => 2,
            _ => 4,
        };
        let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes().into_iter().take(size)).collect();
        self.accessor("SCALAR", component, indices.len(), &bytes)
    }

    fn with_buffer(&self, uri: Option<&str>) -> Vec<u8> {
        let mut json = self.json.clone();
        if json.get("buffers").is_none() {
            json["buffers"] = match uri {
                Some(uri) => json!([{"byteLength": self.bin.len(), "uri": uri}]),
                None => json!([{"byteLength": self.bin.len()}]),
            };
        }
        serde_json::to_vec(&json).unwrap()
    }

    pub(crate) fn glb(&self) -> Vec<u8> {
        let mut json = self.with_buffer(None);
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let length = 12 + 8 + json.len() + 8 + bin.len();
        let word = |number: usize| (number as u32).to_le_bytes();
        [
            b"glTF",
            word(2).as_slice(),
            &word(length),
            &word(json.len()),
            b"JSON",
            &json,
            &word(bin.len()),
            b"BIN\0",
            &bin,
        ]
        .concat()
    }

    /// The document as JSON, its buffer in a data URI.
    pub(crate) fn embedded(&self) -> Vec<u8> {
        self.with_buffer(Some(&format!("data:application/octet-stream;base64,{}", STANDARD.encode(&self.bin))))
    }

    /// The document as JSON, its buffer at `uri`.
    pub(crate) fn external(&self, uri: &str) -> Vec<u8> {
        self.with_buffer(Some(uri))
    }

    pub(crate) fn load(&self) -> Loaded {
        self.try_load().unwrap_or_else(|error| panic!("{error}\n{:#}", self.json))
    }

    pub(crate) fn try_load(&self) -> Result<Loaded, LoadError> {
        gltf::parse(&self.glb(), &NoAssets)
    }

    /// The first mesh, loaded without a warning.
    pub(crate) fn mesh(&self) -> Mesh {
        let loaded = self.load();
        assert_eq!(loaded.warnings, [""; 0]);
        loaded.scene.meshes()[0].clone()
    }

    pub(crate) fn error(&self) -> String {
        self.try_load().map(|loaded| loaded.warnings).unwrap_err().to_string()
    }
}

/// A data URI of a 2 x 1 PNG with these texels.
pub(crate) fn png_uri(texels: [[u8; 4]; 2]) -> String {
    let picture = image::RgbaImage::from_raw(2, 1, texels.concat()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    format!("data:image/png;base64,{}", STANDARD.encode(bytes.into_inner()))
}
