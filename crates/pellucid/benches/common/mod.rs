//! What the benchmarks share: scenes, and views of them.
//!
//! Real scenes are taken from the folder in `PELLUCID_SCENES`, else from `shared/scenes` beside or above the project;
//! where they are missing, built-in scenes of like size stand in.

use std::path::{Path, PathBuf};

use glam::Vec3;
use pellucid::core::view::direction;
use pellucid::{Camera, Scene, View};

/// A view of a scene.
pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) file: &'static str,
    pub(crate) stand_in: &'static str,
    pub(crate) size: (u32, u32),
    pub(crate) opacity: f32,
    /// Eye and target; seen from the front without.
    pub(crate) between: Option<[Vec3; 2]>,
}

pub(crate) const fn case(name: &'static str, file: &'static str, stand_in: &'static str) -> Case {
    Case { name, file, stand_in, size: (1280, 720), opacity: 0.3, between: None }
}

const ATRIUM: [Vec3; 2] = [Vec3::new(-6.0, 2.0, 0.0), Vec3::new(2.0, 3.0, 0.0)];

/// What is measured with real meshes, and beside them.
pub(crate) const SCENES: [Case; 8] = [
    case("bunny_144k", "stanford_bunny/bunny_144k.ply", "@spheres:n=112"),
    case("dragon_871k", "stanford_dragon/dragon_871k.ply", "@spheres:n=680"),
    case("sintel_hair_tubes", "sintel_hair/sintel_hair_tubes.ply", "@hairball:strands=7000,segments=24"),
    Case { opacity: 0.5, between: Some(ATRIUM), ..case("Sponza", "crytek_sponza/crytek_sponza.glb", "@gallery") },
    case("conference", "conference_room/conference.glb", "@boxes:n=30"),
    case("oak_tree", "oak_tree/oak_tree.glb", "@tree"),
    case("brain", "brain/brain_fsaverage5.glb", "@glass"),
    case("boxes", "", "@boxes:n=20"),
];

impl Case {
    /// A file, or a built-in scene.
    pub(crate) fn source(&self) -> String {
        let file =
            scene_folder().map(|folder| folder.join(self.file)).filter(|file| !self.file.is_empty() && file.exists());
        file.map_or(self.stand_in.to_owned(), |file| file.display().to_string())
    }

    pub(crate) fn load(&self) -> (Scene, View) {
        let scene = match pellucid::load(&self.source()) {
            Ok(loaded) => loaded.scene,
            Err(error) => panic!("{}: {error}", self.name),
        };
        let (width, height) = self.size;
        let mut view = View::of(&scene).size(width, height).opacity(self.opacity);
        if let Some([eye, target]) = self.between {
            (view.camera.eye, view.camera.target) = (eye, target);
        } else if scene.cameras().is_empty() {
            let sphere = scene.bounding_sphere();
            view.camera = Camera::fitted(sphere, direction(0.0, 0.0), 30f32.to_radians(), view.aspect() as f32);
        }
        (scene, view)
    }
}

/// Those of `cases` that the command line names, or all.
pub(crate) fn wanted(cases: impl IntoIterator<Item = Case>) -> Vec<Case> {
    let names: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    let is_wanted = |case: &Case| names.is_empty() || names.iter().any(|name| case.name.contains(name));
    cases.into_iter().filter(is_wanted).collect()
}

/// Where real scenes are; `None` without any.
fn scene_folder() -> Option<PathBuf> {
    if let Some(folder) = std::env::var_os("PELLUCID_SCENES") {
        return Some(folder.into());
    }
    let mut folder = Some(Path::new(env!("CARGO_MANIFEST_DIR")));
    while let Some(here) = folder {
        let scenes = here.join("shared/scenes");
        if scenes.is_dir() {
            return Some(scenes);
        }
        folder = here.parent();
    }
    None
}
