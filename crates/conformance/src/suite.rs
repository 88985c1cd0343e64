//! What is verified: small built-in scenes, each from a view that has a reason, and how a technique is run through them.
//!
//! The oracle captures each case once; resolves of its capture cost little. What is held against it is a [`Subject`], so
//! that tests can put broken ones in the place of a renderer.

use std::fmt;

use glam::Vec4;
use pellucid::core::oracle;
use pellucid::core::view::direction;
use pellucid::{Camera, Error, Image, Layers, Renderer, Resolve, Scene, Technique, View};
use rayon::prelude::*;

use crate::images::{self, Comparison};
use crate::layers;

/// A scene and a view of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// The scene, as on the command line.
    pub source: &'static str,
    /// What the view is of, in a word or two.
    pub view: &'static str,
    /// From where.
    pub eye: Eye,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// As [`View::opacity`].
    pub opacity: f32,
}

/// Where the camera is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Eye {
    /// Where the scene's own camera is, or where all of the scene is seen.
    Usual,
    /// In a direction from the middle of the scene, at a distance from it in radii; it looks the opposite way.
    At {
        /// In degrees, 0 is the front.
        azimuth: f32,
        /// In degrees above the horizon.
        elevation: f32,
        /// Over the radius of the scene; below 1 is inside.
        distance: f32,
    },
}

const fn usual(source: &'static str, size: (u32, u32)) -> Case {
    Case { source, view: "whole", eye: Eye::Usual, size, opacity: 1.0 }
}

const fn translucent(source: &'static str, size: (u32, u32), opacity: f32) -> Case {
    Case { source, view: "translucent", eye: Eye::Usual, size, opacity }
}

const fn from(
    source: &'static str,
    view: &'static str,
    (azimuth, elevation, distance): (f32, f32, f32),
    size: (u32, u32),
    opacity: f32,
) -> Case {
    Case { source, view, eye: Eye::At { azimuth, elevation, distance }, size, opacity }
}

/// The suite. Sizes are no multiples of a tile; every built-in scene is in it, as large as the oracle can take: all of them
/// together are less than two hundred million triangles against pixels.
pub const CASES: &[Case] = &[
    // Everything at once, as it comes.
    usual("@gallery", (19, 11)),
    usual("@boxes:n=4", (131, 75)),
    usual("@grids:layers=5,tessellation=12", (65, 65)),
    usual("@blocks:n=40", (77, 61)),
    usual("@hairball:strands=40,segments=12", (63, 47)),
    usual("@glass:shells=2,sides=12", (23, 17)),
    // No order of whole primitives is right.
    usual("@cyclic", (119, 83)),
    usual("@fbuffer", (61, 47)),
    usual("@fbuffer:figure=rainbow", (47, 61)),
    usual("@fbuffer:figure=sphere,sides=12", (53, 51)),
    // Opaque before, between and behind translucent; alpha-masked leaves; nothing but opaque.
    usual("@spheres:n=24,subdivisions=2", (67, 49)),
    usual("@tree:leaves=100", (17, 23)),
    usual("@teapot:tessellation=5", (67, 45)),
    // Opaque and masked surfaces become layers.
    translucent("@tree:leaves=100", (17, 23), 0.4),
    translucent("@teapot:tessellation=5", (67, 45), 0.3),
    translucent("@spheres:n=24,subdivisions=2", (67, 49), 0.6),
    // Depth complexity beyond any fixed number of layers.
    usual("@planes:n=1000", (19, 13)),
    usual("@planes:n=64", (33, 67)),
    // Inside geometry: triangles cross the near plane and leave the picture on all sides.
    from("@boxes:n=3", "from inside", (45.0, 90.0, 0.0), (67, 45), 0.7),
    from("@boxes:n=3", "from within", (200.0, -35.0, 0.3), (67, 45), 0.7),
    from("@blocks:n=40", "from inside", (90.0, 0.0, 0.0), (53, 67), 0.8),
    from("@spheres:n=24,subdivisions=2", "from inside", (30.0, 10.0, 0.1), (45, 35), 0.5),
    from("@hairball:strands=40,segments=12", "from inside", (10.0, 5.0, 0.2), (63, 47), 1.0),
    // Along the planes: slivers, and surfaces without any area.
    from("@planes:n=16", "edge-on", (90.0, 0.0, 2.0), (67, 45), 1.0),
    from("@grids:layers=4,tessellation=4", "edge-on", (90.0, 0.0, 3.0), (47, 35), 1.0),
    // Far away, where triangles are smaller than pixels; and the smallest pictures there are.
    from("@boxes:n=4", "far away", (30.0, 20.0, 60.0), (49, 49), 0.9),
    usual("@boxes:n=2", (1, 1)),
    usual("@boxes:n=2", (257, 3)),
];

/// One of the things a case is checked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Check {
    /// The fragments of every pixel and their order.
    Layers,
    /// The picture that a resolve makes of them.
    Picture(Resolve),
}

impl Check {
    /// All there are.
    pub const ALL: [Self; 7] = [
        Self::Layers,
        Self::Picture(Resolve::Blend),
        Self::Picture(Resolve::BlendCorrected),
        Self::Picture(Resolve::Gelly),
        Self::Picture(Resolve::Nearest),
        Self::Picture(Resolve::Layer(2)),
        Self::Picture(Resolve::Complexity(0)),
    ];
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Layers => f.pad("layers"),
            Self::Picture(resolve) => f.pad(&resolve.to_string()),
        }
    }
}

/// What is held against the oracle.
pub trait Subject {
    /// The layers of a whole view.
    ///
    /// # Errors
    /// What keeps it from capturing; not a difference.
    fn layers(&self, scene: &Scene, view: &View) -> Result<Layers, Error>;

    /// A picture.
    ///
    /// # Errors
    /// What keeps it from rendering; not a difference.
    fn picture(&self, scene: &Scene, view: &View, resolve: Resolve) -> Result<Image, Error>;

    /// Whether its rounding may show where the oracle says that another device's may. Not on the CPU.
    fn has_own_rounding(&self) -> bool;
}

/// A technique as the library runs it.
#[derive(Debug)]
pub struct Candidate {
    technique: Technique,
    renderer: Renderer,
}

impl Candidate {
    /// A renderer with the technique it was made for.
    pub fn new(technique: Technique, renderer: Renderer) -> Self {
        Self { technique, renderer: renderer.technique(technique) }
    }

    /// The same renderer, with what it holds on to, for another technique.
    #[must_use]
    pub fn technique(self, technique: Technique) -> Self {
        Self::new(technique, self.renderer)
    }
}

impl Subject for Candidate {
    fn layers(&self, scene: &Scene, view: &View) -> Result<Layers, Error> {
        layers::gather(&self.renderer, scene, view)
    }

    fn picture(&self, scene: &Scene, view: &View, resolve: Resolve) -> Result<Image, Error> {
        Ok(self.renderer.render(scene, view, resolve)?.image)
    }

    fn has_own_rounding(&self) -> bool {
        self.technique.backend() != "cpu"
    }
}

/// A case with its scene loaded and what the oracle says of it.
#[derive(Debug)]
pub struct Prepared {
    /// The scene.
    pub scene: Scene,
    /// The view.
    pub view: View,
    /// What the oracle captured.
    pub capture: oracle::Capture,
}

/// All of [`CASES`], in their order; the oracle works on all cores.
///
/// # Errors
/// None, unless the table of cases is wrong.
pub fn prepare_all() -> Result<Vec<(&'static Case, Prepared)>, Error> {
    CASES.par_iter().with_max_len(1).map(|case| Ok((case, case.prepare()?))).collect()
}

impl Case {
    /// The scene, and the view of it.
    ///
    /// # Errors
    /// None, unless the table of cases is wrong.
    pub fn load(&self) -> Result<(Scene, View), Error> {
        let scene = pellucid::load(self.source)?.scene;
        let (width, height) = self.size;
        let background = Vec4::new(0.02, 0.03, 0.05, 1.0);
        let mut view = View::of(&scene).size(width, height).opacity(self.opacity).background(background);
        if let Eye::At { azimuth, elevation, distance } = self.eye {
            let sphere = scene.bounding_sphere();
            let towards_eye = direction(azimuth, elevation);
            let fitted = Camera::fitted(sphere, towards_eye, 1.0, view.aspect() as f32);
            let eye = sphere.center + towards_eye * (sphere.radius * distance);
            view.camera = Camera { eye, target: eye - towards_eye, ..fitted };
        }
        Ok((scene, view))
    }

    /// Loads the scene and has the oracle capture it.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn prepare(&self) -> Result<Prepared, Error> {
        let (scene, view) = self.load()?;
        let capture = oracle::capture(&scene, &view)?;
        Ok(Prepared { scene, view, capture })
    }
}

impl Prepared {
    /// Runs one check.
    ///
    /// # Errors
    /// As the subject's.
    pub fn run(&self, check: Check, subject: &impl Subject) -> Result<Comparison, Error> {
        let Self { scene, view, capture } = self;
        let never = vec![false; capture.ambiguous.len()];
        let ambiguous = if subject.has_own_rounding() { &capture.ambiguous } else { &never };
        Ok(match check {
            Check::Layers => layers::compare(&capture.layers, ambiguous, &subject.layers(scene, view)?),
            Check::Picture(resolve) => {
                let (expected, _) = oracle::resolve_capture(capture, scene, view, resolve);
                let image = subject.picture(scene, view, resolve)?;
                images::compare(&expected, ambiguous, |x, y| layers::is_covered(&capture.layers, x, y), &image)
            }
        })
    }
}
