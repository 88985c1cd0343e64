//! Built-in scenes: made by a rule, the same bits on every machine for the same parameters.
//!
//! [`all`] lists them with their parameters; [`make`] makes one from its description.

mod bezier;
mod blocks;
mod boxes;
mod cyclic;
mod fbuffer;
mod gallery;
mod glass;
mod grids;
mod hairball;
mod painting;
mod palette;
mod parameters;
mod planes;
mod random;
mod shapes;
mod spheres;
mod stage;
mod suggestion;
mod teapot;
#[cfg(test)]
mod tests;
mod tree;
mod tube;

use pellucid_core::Scene;

use crate::LoadError;
use parameters::Values;
pub use parameters::{Kind, Parameter};

/// A scene that needs no file.
#[derive(Debug, Clone, Copy)]
pub struct BuiltIn {
    /// What stands after the `@`.
    pub name: &'static str,
    /// One line on what it shows.
    pub summary: &'static str,
    /// What can be chosen, all of it optional.
    pub parameters: &'static [Parameter],
    make: fn(&Values) -> Result<Scene, LoadError>,
}

const ALL: &[BuiltIn] = &[
    BuiltIn {
        name: "gallery",
        summary: "translucent things of every kind that run through each other, in a room of their own",
        parameters: gallery::PARAMETERS,
        make: gallery::make,
    },
    BuiltIn {
        name: "boxes",
        summary: "a lattice of translucent boxes, as in LucidRaster's test scene",
        parameters: boxes::PARAMETERS,
        make: boxes::make,
    },
    BuiltIn {
        name: "spheres",
        summary: "translucent and opaque spheres, as in NVIDIA's order-independent transparency sample",
        parameters: spheres::PARAMETERS,
        make: spheres::make,
    },
    BuiltIn {
        name: "grids",
        summary: "layers of tessellated grids under parallel rays, as in the LFB chapter's figures 20.10 to 20.12",
        parameters: grids::PARAMETERS,
        make: grids::make,
    },
    BuiltIn {
        name: "blocks",
        summary: "equally sized cubes anywhere and anyhow, as in the depth peeling demo",
        parameters: blocks::PARAMETERS,
        make: blocks::make,
    },
    BuiltIn {
        name: "planes",
        summary: "parallel planes that fill the picture: n of opacity a leave (1-a)^n of the background",
        parameters: planes::PARAMETERS,
        make: planes::make,
    },
    BuiltIn {
        name: "cyclic",
        summary: "bars that each lie over the next, all the way round: no order of drawing is right (figure 20.2)",
        parameters: cyclic::PARAMETERS,
        make: cyclic::make,
    },
    BuiltIn {
        name: "hairball",
        summary: "a ball of curling translucent hair, many layers deep",
        parameters: hairball::PARAMETERS,
        make: hairball::make,
    },
    BuiltIn {
        name: "tree",
        summary: "alpha-masked leaves on an opaque tree, with textures",
        parameters: tree::PARAMETERS,
        make: tree::make,
    },
    BuiltIn {
        name: "glass",
        summary: "vases, goblet and spheres within each other, all of them closed, with a liquid inside",
        parameters: glass::PARAMETERS,
        make: glass::make,
    },
    BuiltIn {
        name: "teapot",
        summary: "Martin Newell's teapot from its Bézier patches, opaque",
        parameters: teapot::PARAMETERS,
        make: teapot::make,
    },
    BuiltIn {
        name: "fbuffer",
        summary: "what the figures of the F-Buffer paper show: two triangles, one in all colours, a sphere of thin glass",
        parameters: fbuffer::PARAMETERS,
        make: fbuffer::make,
    },
];

/// All built-in scenes, the show piece first.
pub fn all() -> &'static [BuiltIn] {
    ALL
}

/// Makes the scene that `description` means: `name` or `name:key=value,...`, without the `@`.
///
/// # Errors
/// [`LoadError::BuiltIn`] if there is no such scene, it has no such parameter, or a value is out of range; the message
/// says what there is instead.
pub fn make(description: &str) -> Result<Scene, LoadError> {
    let (name, parameters) = match description.split_once(':') {
        Some((name, parameters)) => (name.trim(), Some(parameters)),
        None => (description.trim(), None),
    };
    let Some(scene) = ALL.iter().find(|scene| scene.name == name) else {
        let names: Vec<&str> = ALL.iter().map(|scene| scene.name).collect();
        let hint = suggestion::did_you_mean(name, &names);
        let known = names.iter().map(|name| format!("@{name}")).collect::<Vec<_>>().join(", ");
        return Err(LoadError::BuiltIn(format!("no built-in scene is called '@{name}'{hint}; known are {known}")));
    };
    (scene.make)(&Values::parse(scene.name, scene.parameters, parameters)?)
}
