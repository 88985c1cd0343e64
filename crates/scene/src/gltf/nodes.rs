//! The node hierarchy: what is placed where in the world.
//!
//! Walked with a stack of its own, so that depth costs no call stack; world matrices are composed in f64.

use std::rc::Rc;

use glam::{DAffine3, DMat4, DQuat, DVec3, DVec4};
use pellucid_core::{Camera, Instance, MaterialId, MeshId, Projection};

use super::document::{self, Document, Node};
use super::{Loader, malformed};
use crate::LoadError;

impl Loader<'_> {
    /// Places meshes and cameras of the default scene, else of the first one, else of all nodes.
    pub(super) fn place_nodes(&mut self) -> Result<(), LoadError> {
        let document = self.document;
        let parents = parents(document)?;
        let roots = roots(document, &parents)?;
        let mut stack: Vec<(usize, DAffine3)> = roots.iter().rev().map(|&root| (root, DAffine3::IDENTITY)).collect();
        while let Some((index, world_from_parent)) = stack.pop() {
            let node = &document.nodes[index];
            let world_from_node = world_from_parent * parent_from_node(node, index)?;
            if let Some(mesh) = node.mesh {
                self.place_mesh(mesh, node, index, world_from_node)?;
            }
            if let Some(camera) = node.camera {
                self.place_camera(camera, index, world_from_node)?;
            }
            stack.extend(node.children.iter().rev().map(|&child| (child, world_from_node)));
        }
        Ok(())
    }

    fn place_mesh(
        &mut self,
        mesh: usize,
        node: &Node,
        index: usize,
        world_from_node: DAffine3,
    ) -> Result<(), LoadError> {
        if node.skin.is_some() {
            self.warnings.add("skins are not supported: their meshes are shown as they were modelled");
        }
        if node.extensions.gpu_instancing.is_some() {
            self.warnings.add("EXT_mesh_gpu_instancing is not supported: its meshes are drawn once");
        }
        let world_from_mesh = world_from_node.as_affine3a();
        if !world_from_mesh.is_finite() {
            return Err(malformed(format!("node {index}: its world transform is not finite")));
        }
        let parts = self.drawn_mesh(mesh, index)?;
        self.budget.charge(parts.len(), size_of::<Instance>(), || format!("node {index}"))?;
        for &(mesh, material) in parts.iter() {
            self.scene.add_instance(Instance { mesh, material, world_from_mesh })?;
        }
        Ok(())
    }

    /// All primitives of a mesh that can be drawn.
    fn drawn_mesh(&mut self, index: usize, node: usize) -> Result<Rc<[(MeshId, MaterialId)]>, LoadError> {
        if let Some(known) = self.drawn_meshes.get(&index) {
            return Ok(known.clone());
        }
        let Some(source) = self.document.meshes.get(index) else {
            let count = self.document.meshes.len();
            return Err(malformed(format!("node {node}: mesh {index} does not exist; there are {count}")));
        };
        let mut parts = Vec::with_capacity(source.primitives.len());
        for (number, primitive) in source.primitives.iter().enumerate() {
            let place = format!("mesh {index}, primitive {number}");
            let material = self.material(primitive.material, &place)?;
            if let Some(mesh) = self.mesh(primitive, material.tex_coord_set, &place)? {
                parts.push((mesh, material.id));
            }
        }
        let parts: Rc<[_]> = parts.into();
        self.drawn_meshes.insert(index, parts.clone());
        Ok(parts)
    }

    fn place_camera(&mut self, index: usize, node: usize, world_from_node: DAffine3) -> Result<(), LoadError> {
        let Some(source) = self.document.cameras.get(index) else {
            let count = self.document.cameras.len();
            return Err(malformed(format!("node {node}: camera {index} does not exist; there are {count}")));
        };
        match camera(source, world_from_node) {
            Ok(camera) => self.scene.add_camera(camera),
            Err(reason) => self.warnings.add(format!("camera {index} at node {node} is left out: {reason}")),
        }
        Ok(())
    }
}

/// The parent of each node. Whoever follows children from a node without parent meets every node once at most.
fn parents(document: &Document) -> Result<Vec<Option<usize>>, LoadError> {
    let count = document.nodes.len();
    let mut parents = vec![None; count];
    for (index, node) in document.nodes.iter().enumerate() {
        for &child in &node.children {
            let Some(parent) = parents.get_mut(child) else {
                return Err(malformed(format!("node {index}: child {child} does not exist; there are {count} nodes")));
            };
            if let Some(other) = parent.replace(index) {
                return Err(malformed(format!("node {child} is a child of node {other} and again of node {index}")));
            }
        }
    }
    let mut stack: Vec<usize> = (0..count).filter(|&node| parents[node].is_none()).collect();
    let mut is_reached = vec![false; count];
    while let Some(node) = stack.pop() {
        is_reached[node] = true;
        stack.extend(&document.nodes[node].children);
    }
    match is_reached.iter().position(|reached| !reached) {
        Some(node) => Err(malformed(format!("node {node} is its own ancestor, or below one that is"))),
        None => Ok(parents),
    }
}

/// Nodes to start from, each once and none below another.
fn roots(document: &Document, parents: &[Option<usize>]) -> Result<Vec<usize>, LoadError> {
    let number = document.scene.unwrap_or(0);
    let Some(scene) = document.scenes.get(number) else {
        if let Some(number) = document.scene {
            let count = document.scenes.len();
            return Err(malformed(format!("scene {number} does not exist; there are {count}")));
        }
        return Ok((0..parents.len()).filter(|&node| parents[node].is_none()).collect());
    };
    let mut is_listed = vec![false; parents.len()];
    for &node in &scene.nodes {
        match parents.get(node) {
            None => {
                let count = parents.len();
                return Err(malformed(format!("scene {number}: node {node} does not exist; there are {count}")));
            }
            Some(Some(parent)) => {
                return Err(malformed(format!("scene {number}: node {node} is no root, but a child of node {parent}")));
            }
            Some(None) => {}
        }
        if std::mem::replace(&mut is_listed[node], true) {
            return Err(malformed(format!("scene {number}: node {node} is listed twice")));
        }
    }
    Ok(scene.nodes.clone())
}

fn parent_from_node(node: &Node, index: usize) -> Result<DAffine3, LoadError> {
    if let Some(columns) = &node.matrix {
        let matrix = DMat4::from_cols_array(columns);
        // Exporters that work in f32 leave a little beside the zeros.
        if !matrix.row(3).abs_diff_eq(DVec4::W, 1e-5) {
            return Err(malformed(format!("node {index}: a matrix whose last row is not 0 0 0 1")));
        }
        return Ok(DAffine3::from_mat4(matrix));
    }
    let translation = DVec3::from(node.translation.unwrap_or_default());
    let scale = DVec3::from(node.scale.unwrap_or([1.0; 3]));
    let rotation = DVec4::from(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    let Some(rotation) = rotation.try_normalize() else {
        return Err(malformed(format!("node {index}: a rotation that is no quaternion")));
    };
    Ok(DAffine3::from_scale_rotation_translation(scale, DQuat::from_vec4(rotation), translation))
}

/// A camera looks along -z of its node, with +y up; its node's scale does not count (glTF 2.0, section 3.10).
fn camera(source: &document::Camera, world_from_node: DAffine3) -> Result<Camera, String> {
    let eye = world_from_node.translation;
    let forward = world_from_node.transform_vector3(DVec3::NEG_Z).normalize_or_zero();
    let up = world_from_node.transform_vector3(DVec3::Y).normalize_or_zero();
    // Far enough off not to fall together with the eye when both are rounded.
    let target = eye + forward * (1.0 + eye.abs().max_element());
    let projection = match (&source.perspective, &source.orthographic) {
        (Some(lens), _) => Projection::Perspective { fov_y: lens.yfov, near: lens.znear },
        (None, Some(lens)) => Projection::Orthographic { height: 2.0 * lens.ymag, near: lens.znear, far: lens.zfar },
        (None, None) => return Err("it is neither perspective nor orthographic".into()),
    };
    let camera = Camera { eye: eye.as_vec3(), target: target.as_vec3(), up: up.as_vec3(), projection };
    camera.clip_from_world(1.0).map_err(|error| error.to_string())?;
    Ok(camera)
}
