//! What a command line means: every value checked, defaults in place, nothing left to interpret but the scene.

mod bench;
mod capture;
mod compare;
mod multi_pass;
mod verify;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use glam::Vec4;
use pellucid::core::view::THICKNESS_OVER_RADIUS;
use pellucid::{ImageFormat, Loaded, Resolve, Scene, Shading, View};

use crate::UsageError;
use crate::args::{InfoArgs, RenderArgs, ShadingArg, ViewArgs};
use crate::camera::CameraPlan;
use crate::values;

pub(crate) use bench::BenchPlan;
pub(crate) use capture::{CapturePlan, Opened};
pub(crate) use compare::{ComparePlan, Compared};
pub(crate) use multi_pass::{MultiPassPlan, Show};
pub(crate) use verify::VerifyPlan;

/// A picture or turntable to render.
#[derive(Debug)]
pub(crate) struct RenderPlan {
    pub(crate) scene: SceneName,
    pub(crate) output: PathBuf,
    pub(crate) resolve: Resolve,
    pub(crate) view: ViewPlan,
    pub(crate) capture: CapturePlan,
    /// A shader of several passes in place of resolve and capture.
    pub(crate) multi_pass: Option<MultiPassPlan>,
    /// Pictures of a turntable; `None` for a single picture.
    pub(crate) frames: Option<u32>,
    pub(crate) stats: Option<StatsTarget>,
    pub(crate) quiet: bool,
}

/// A scene to look into.
#[derive(Debug)]
pub(crate) struct InfoPlan {
    pub(crate) scene: SceneName,
    pub(crate) view: ViewPlan,
    pub(crate) capture: CapturePlan,
    pub(crate) json: bool,
    pub(crate) quiet: bool,
}

/// A file or built-in scene, as named by the user.
#[derive(Debug)]
pub(crate) struct SceneName(OsString);

/// Where the figures of a frame go.
#[derive(Debug, PartialEq)]
pub(crate) enum StatsTarget {
    Stdout,
    File(PathBuf),
}

/// Everything about the picture but the scene.
#[derive(Debug)]
pub(crate) struct ViewPlan {
    width: u32,
    height: u32,
    camera: CameraPlan,
    opacity: f32,
    shading: Shading,
    background: Vec4,
    thickness: Option<f32>,
}

/// Most pictures of a turntable: four digits in their names.
const MAX_FRAMES: u32 = 9999;

/// More threads than any machine has cores; beyond it systems refuse to start them.
pub(crate) const MAX_THREADS: u32 = 1024;

impl RenderPlan {
    pub(crate) fn new(args: RenderArgs) -> anyhow::Result<Self> {
        if ImageFormat::of(&args.output).is_none() {
            return Err(usage(format!(
                "--output '{}': a picture is a .png or .exr file; give it one of these extensions",
                args.output.display()
            )));
        }
        let multi_pass = MultiPassPlan::new(&args)?;
        let stats = args.stats.map(|path| match path.as_os_str() {
            name if name == "-" => StatsTarget::Stdout,
            _ => StatsTarget::File(path),
        });
        if stats.as_ref().is_some_and(|stats| *stats == StatsTarget::File(args.output.clone())) {
            return Err(usage("--stats and --output name the same file; give them different ones".into()));
        }
        Ok(Self {
            scene: SceneName(args.scene),
            resolve: match &multi_pass {
                Some(_) => Resolve::Blend,
                None => args.resolve.parse().map_err(|error| usage(format!("{error}")))?,
            },
            multi_pass,
            view: ViewPlan {
                background: option("--background", &args.background, values::color)?,
                thickness: optional("--thickness", args.thickness.as_ref(), values::length)?,
                ..ViewPlan::new(&args.view)?
            },
            frames: optional("--frames", args.frames.as_ref(), |text| values::whole(text, 1, MAX_FRAMES))?,
            capture: CapturePlan::new(&args.capture, multi_pass.is_some())?,
            output: args.output,
            stats,
            quiet: args.quiet,
        })
    }
}

impl InfoPlan {
    pub(crate) fn new(args: InfoArgs) -> anyhow::Result<Self> {
        Ok(Self {
            scene: SceneName(args.scene),
            view: ViewPlan::new(&args.view)?,
            capture: CapturePlan::new(&args.capture, false)?,
            json: args.json,
            quiet: args.quiet,
        })
    }
}

impl SceneName {
    pub(crate) fn load(&self) -> Result<Loaded, pellucid::Error> {
        match self.0.to_str() {
            Some(name) => pellucid::load(name),
            // No built-in scene has a name that is not Unicode.
            None => pellucid::load_file(Path::new(&self.0)),
        }
    }
}

impl std::fmt::Display for SceneName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.display().fmt(f)
    }
}

impl ViewPlan {
    fn new(args: &ViewArgs) -> anyhow::Result<Self> {
        let (width, height) = option("--size", &args.size, values::size)?;
        let camera = CameraPlan {
            side: args.view,
            eye: optional("--eye", args.eye.as_ref(), values::vector)?,
            target: optional("--target", args.target.as_ref(), values::vector)?,
            up: optional("--up", args.up.as_ref(), values::direction)?,
            fov_y: optional("--fov", args.fov.as_ref(), values::angle)?,
            near: optional("--near", args.near.as_ref(), values::length)?,
        };
        let shading = match args.shading {
            ShadingArg::Lit => Shading::Lit,
            ShadingArg::Unlit => Shading::Unlit,
        };
        let opacity = option("--opacity", &args.opacity, values::opacity)?;
        Ok(Self { width, height, camera, opacity, shading, background: Vec4::ZERO, thickness: None })
    }

    /// The view of a scene.
    pub(crate) fn of(&self, scene: &Scene) -> anyhow::Result<View> {
        let aspect = self.width as f32 / self.height as f32;
        let view = View {
            width: self.width,
            height: self.height,
            camera: self.camera.camera(scene, aspect),
            shading: self.shading,
            opacity: self.opacity,
            background: self.background,
            thickness_unit: self.thickness.unwrap_or_else(|| scene.bounding_sphere().radius * THICKNESS_OVER_RADIUS),
        };
        match view.check() {
            // What was typed makes no sense with this scene: an eye in the very middle of it, say.
            Err(error) if self.camera.is_chosen() => Err(usage(error.to_string())),
            result => Ok(result.map(|()| view)?),
        }
    }
}

fn usage(message: String) -> anyhow::Error {
    UsageError(message).into()
}

pub(crate) fn option<T>(name: &str, text: &str, parse: impl Fn(&str) -> Result<T, values::Wrong>) -> anyhow::Result<T> {
    parse(text).map_err(|wrong| usage(format!("{name} '{text}': {wrong}")))
}

pub(crate) fn optional<T>(
    name: &str,
    text: Option<&String>,
    parse: impl Fn(&str) -> Result<T, values::Wrong>,
) -> anyhow::Result<Option<T>> {
    text.map(|text| option(name, text, parse)).transpose()
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::{Args, Command};

    fn render(line: &str) -> anyhow::Result<RenderPlan> {
        let words = ["pellucid", "render", "@boxes"].into_iter().chain(line.split_whitespace());
        match Args::try_parse_from(words)?.command {
            Command::Render(args) => RenderPlan::new(*args),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn defaults_are_those_of_the_library() {
        let plan = render("-o a.png").unwrap();
        let scene = Scene::new();
        let view = plan.view.of(&scene).unwrap();
        let library = View::of(&scene);
        assert_eq!(View { background: library.background, ..view }, library);
        assert_eq!((plan.resolve, plan.frames, plan.stats, plan.quiet), (Resolve::Blend, None, None, false));
    }

    #[test]
    fn every_option_reaches_the_plan() {
        let plan = render(
            "-o a.exr --resolve layer:2 --size 64x48 --eye -1,2,3 --target 0,0,-1 --up 0,0,1 --fov 45 --near 0.5 \
             --opacity 0.5 --shading unlit --background none --thickness 2 --technique oracle --threads 3 --frames 8 \
             --stats - -q --budget 512M --backend cpu",
        )
        .unwrap();
        let view = plan.view.of(&Scene::new()).unwrap();
        assert_eq!((view.width, view.height, view.opacity, view.thickness_unit), (64, 48, 0.5, 2.0));
        assert_eq!((view.shading, view.background), (Shading::Unlit, Vec4::ZERO));
        assert_eq!(view.camera.eye, glam::Vec3::new(-1.0, 2.0, 3.0));
        assert_eq!((plan.resolve, plan.frames, plan.stats), (Resolve::Layer(2), Some(8), Some(StatsTarget::Stdout)));
        assert!(plan.quiet);
    }

    #[test]
    fn what_has_no_meaning_is_a_usage_error_that_names_the_option() {
        for line in [
            "-o a.png --size 0x10",
            "-o a.png --size abc",
            "-o a.png --size -1x5",
            "-o a.png --opacity 2",
            "-o a.png --opacity -1",
            "-o a.png --eye 1,2",
            "-o a.png --up 0,0,0",
            "-o a.png --fov 180",
            "-o a.png --near 0",
            "-o a.png --threads -1",
            "-o a.png --budget lots",
            "-o a.png --frames 0",
            "-o a.png --thickness 0",
            "-o a.png --background bleu",
            "-o a.png --layers 0",
            "-o a.png --layers 4 --technique linear",
            "-o a.png --storage texture --technique list",
            "-o a.png --presort --technique peel",
            "-o a.png --technique linear --backend cpu",
            "-o a.png --technique oracle --backend gpu",
        ] {
            let error = render(line).unwrap_err();
            assert!(error.is::<UsageError>(), "{line}");
            let option = line.split_whitespace().nth(2).unwrap();
            assert!(error.to_string().starts_with(option), "{line}: {error}");
        }
        for line in ["-o a.jpg", "-o a", "-o a.png --resolve sum", "-o a.png --stats a.png"] {
            assert!(render(line).unwrap_err().is::<UsageError>(), "{line}");
        }
    }

    #[test]
    fn a_camera_in_the_middle_of_what_it_looks_at_is_a_usage_error() {
        let plan = render("-o a.png --eye 0,0,0").unwrap();
        assert!(plan.view.of(&Scene::new()).unwrap_err().is::<UsageError>());
    }
}
