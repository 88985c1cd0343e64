//! The command line as it is typed. What it means, and whether it means anything, is `plan`'s affair.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::{Parser, Subcommand, ValueEnum};
use pellucid::multi_pass::Shader;
use pellucid::{Resolve, Technique};

use crate::commands::bench;

/// Exact transparency in any order of submission, no GPU needed.
#[derive(Debug, Parser)]
#[command(name = "pellucid", version, arg_required_else_help = true, after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
}

const EXAMPLES: &str = "\
SCENE is a file (.glb .gltf .obj .ply .stl) or a built-in scene: @name or @name:key=value,key=value.

Examples:
  pellucid render @gallery -o gallery.png
  pellucid render model.glb -o model.png --opacity 0.4 --view right
  pellucid render @boxes:n=8 -o depth.png --resolve complexity
  pellucid info model.glb
  pellucid compare @gallery -o report
  pellucid bench --suite lfb -o results
  pellucid verify

Exit codes: 0 done, 1 failed, 2 the command line is wrong.";

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render a picture, or a turntable of pictures
    Render(Box<RenderArgs>),
    /// Show what is in a scene, and how many layers lie behind the pixels of a view
    Info(Box<InfoArgs>),
    /// Render a view with several techniques, and report them side by side
    Compare(Box<CompareArgs>),
    /// Time techniques on this device, suite by suite, beside the figures that were published
    Bench(Box<BenchArgs>),
    /// Hold this device against the oracle
    Verify(VerifyArgs),
    /// List the built-in scenes and their parameters
    Scenes(ListArgs),
    /// List the techniques: how fragments are captured and ordered
    Techniques(ListArgs),
}

#[derive(Debug, clap::Args)]
pub(crate) struct RenderArgs {
    /// A file (.glb .gltf .obj .ply .stl), or a built-in: @name or @name:key=value,key=value
    pub(crate) scene: OsString,

    /// The picture: .png (8 bit, sRGB) or .exr (float, linear light, premultiplied alpha)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,

    #[arg(long, value_name = "NAME", default_value = "blend", hide_default_value = true, help = resolve_help())]
    pub(crate) resolve: String,

    /// Colour behind everything: a CSS name, hex (#rgb, #rrggbb, #rrggbbaa), or none for a transparent picture
    #[arg(long, value_name = "COLOUR", default_value = DEFAULT_BACKGROUND)]
    pub(crate) background: String,

    /// Length in world units over which a material shows its stated opacity in gelly and blend:corrected [default: a
    /// quarter of the scene's radius]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub(crate) thickness: Option<String>,

    #[arg(long, value_name = "NAME", help = shader_help())]
    pub(crate) shader: Option<String>,

    /// Where the passes of --shader keep intermediate results: one for each fragment, one for each pixel, or both beside
    /// each other [default: fbuffer]
    #[arg(long, value_name = "WHERE")]
    pub(crate) through: Option<ThroughArg>,

    /// A turntable: N pictures, FILE-0001.png and so on, the camera going once round its target about the up axis
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(crate) frames: Option<String>,

    /// Write the figures of the frame as JSON; - for stdout
    #[arg(long, value_name = "FILE")]
    pub(crate) stats: Option<PathBuf>,

    /// Say nothing but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,

    #[command(flatten)]
    pub(crate) view: ViewArgs,

    #[command(flatten)]
    pub(crate) capture: CaptureArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct InfoArgs {
    /// A file (.glb .gltf .obj .ply .stl), or a built-in: @name or @name:key=value,key=value
    pub(crate) scene: OsString,

    /// As JSON
    #[arg(long)]
    pub(crate) json: bool,

    /// Say nothing but the result and errors
    #[arg(short, long)]
    pub(crate) quiet: bool,

    #[command(flatten)]
    pub(crate) view: ViewArgs,

    #[command(flatten)]
    pub(crate) capture: CaptureArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct CompareArgs {
    /// A file (.glb .gltf .obj .ply .stl), or a built-in: @name or @name:key=value,key=value
    pub(crate) scene: OsString,

    /// The folder for pictures, figures and report; made if only it is missing. Open its index.html in a browser
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,

    /// What is compared, separated by commas: `unsorted`, which is blending in draw order, and names from `pellucid
    /// techniques` [default: unsorted, and all that run on the backend but the oracle; those that do not order fragments
    /// only for the resolve blend]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = PossibleValuesParser::new(compared_names()))]
    pub(crate) techniques: Vec<String>,

    #[arg(long, value_name = "NAME", default_value = "blend", hide_default_value = true, help = resolve_help())]
    pub(crate) resolve: String,

    /// What they are held against; only the oracle knows where pixels are ambiguous, and it is slow [default: the oracle
    /// where it takes seconds, else the CPU renderer, which equals it]
    #[arg(long, value_name = "NAME")]
    pub(crate) reference: Option<ReferenceArg>,

    /// Colour behind everything: a CSS name, hex (#rgb, #rrggbb, #rrggbbaa), or none for a transparent picture
    #[arg(long, value_name = "COLOUR", default_value = DEFAULT_BACKGROUND)]
    pub(crate) background: String,

    /// Length in world units over which a material shows its stated opacity in gelly and blend:corrected [default: a
    /// quarter of the scene's radius]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub(crate) thickness: Option<String>,

    /// Say nothing but the table and errors
    #[arg(short, long)]
    pub(crate) quiet: bool,

    #[command(flatten)]
    pub(crate) view: ViewArgs,

    #[command(flatten)]
    pub(crate) device: DeviceArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct BenchArgs {
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = PossibleValuesParser::new(bench::suite_names()),
        hide_possible_values = true, help = suite_help())]
    pub(crate) suite: Vec<String>,

    /// The folder of the real scenes; built-in ones of like size stand in for those that are not in it
    #[arg(long, value_name = "DIR")]
    pub(crate) scenes: Option<PathBuf>,

    /// The folder for figures and report; made if only it is missing. What is finished is kept in it: the same command
    /// goes on where it was stopped
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,

    /// What is measured; auto: the CPU, and a real GPU if there is one; gpu: the GPU in any case, a software one too,
    /// beside the CPU. The suite `peers` takes a software GPU by itself, unless this is cpu
    #[arg(long, value_name = "NAME", default_value = "auto")]
    pub(crate) backend: Backend,

    /// Threads of the CPU renderer; 0 is one for each core
    #[arg(long, value_name = "N", default_value = "0", allow_hyphen_values = true)]
    pub(crate) threads: String,

    /// Bytes that a capture may hold, such as 512M
    #[arg(long, value_name = "BYTES", allow_hyphen_values = true)]
    pub(crate) budget: Option<String>,

    /// Frames measured of a technique at a point, besides those that warm it up
    #[arg(long, value_name = "N", default_value = "15", allow_hyphen_values = true)]
    pub(crate) repeats: String,

    /// Most seconds that one technique may take at one point; what would take longer gets fewer frames, and what cannot
    /// do a few in that time is skipped, with a word on it
    #[arg(long, value_name = "SECONDS", default_value = "60", allow_hyphen_values = true)]
    pub(crate) time_limit: String,

    /// Only the first points of each series, small and with few frames, to see what there would be
    #[arg(long)]
    pub(crate) quick: bool,

    /// Start over, whatever is in the folder
    #[arg(long)]
    pub(crate) fresh: bool,

    /// Say nothing but the tables and errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct VerifyArgs {
    /// An exact technique; can be given more than once [default: all that run on the backend but the oracle]
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = PossibleValuesParser::new(exact_names()))]
    pub(crate) technique: Vec<String>,

    /// As JSON
    #[arg(long)]
    pub(crate) json: bool,

    #[command(flatten)]
    pub(crate) device: DeviceArgs,
}

/// What techniques run on.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Rendering")]
pub(crate) struct DeviceArgs {
    /// What renders; auto takes a real GPU if there is one, else the CPU
    #[arg(long, value_name = "NAME", default_value = "auto")]
    pub(crate) backend: Backend,

    /// Threads; 0 is one for each core. The picture is the same on any number
    #[arg(long, value_name = "N", default_value = "0", allow_hyphen_values = true)]
    pub(crate) threads: String,

    /// Bytes that a capture may hold, such as 512M
    #[arg(long, value_name = "BYTES", allow_hyphen_values = true)]
    pub(crate) budget: Option<String>,
}

/// From where, and how large.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "View")]
pub(crate) struct ViewArgs {
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", allow_hyphen_values = true)]
    pub(crate) size: String,

    /// The whole scene from a side, whatever camera it brought along [default: the scene's own camera, else iso, which is
    /// azimuth 30, elevation 20]
    #[arg(long, value_name = "SIDE", conflicts_with = "eye")]
    pub(crate) view: Option<Side>,

    /// Where the camera is; without --target it looks at the middle of the scene
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) eye: Option<String>,

    /// What the camera looks at; without --eye it keeps its direction and distance and moves along
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) target: Option<String>,

    /// What is up in the picture; the turntable's axis [default: 0,1,0, or the scene camera's own]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) up: Option<String>,

    /// Full vertical angle of view in degrees [default: 30, or the scene camera's own]
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true)]
    pub(crate) fov: Option<String>,

    /// Distance of the near plane; nothing nearer is seen [default: a thousandth of the scene's radius, or the scene
    /// camera's own]
    #[arg(long, value_name = "DISTANCE", allow_hyphen_values = true)]
    pub(crate) near: Option<String>,

    /// Multiplies every material's alpha, 0 to 1; below 1 opaque materials become transparent
    #[arg(long, value_name = "ALPHA", default_value = "1", allow_hyphen_values = true)]
    pub(crate) opacity: String,

    /// Head light on surfaces, or their base colour alone
    #[arg(long, value_name = "HOW", default_value = "lit")]
    pub(crate) shading: ShadingArg,
}

/// With what.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Rendering")]
pub(crate) struct CaptureArgs {
    /// How fragments are captured and ordered; see `pellucid techniques` [default: the backend's best]
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(Technique::ALL.map(Technique::name)))]
    pub(crate) technique: Option<String>,

    /// Where abuffer keeps fragments [default: buffer]
    #[arg(long, value_name = "WHERE")]
    pub(crate) storage: Option<StorageArg>,

    /// Stop peel after so many layers: faster, and not exact where there are more
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(crate) layers: Option<String>,

    /// Slots along each side of an F-Buffer (fbuffer, --shader), a power of two from 32 to 2048: it slides over the fragments
    /// as a window if there are more. The picture is the same at any [default: one slot for each fragment]
    #[arg(long, value_name = "SIDE", allow_hyphen_values = true)]
    pub(crate) fbuffer: Option<String>,

    /// Fragments of a pixel that lucid lets wait for nearer ones, from 1 to 12: with more of them, fewer pixels have to be
    /// sorted. The picture is the same at any [default: 3]
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(crate) filter_size: Option<String>,

    /// Let lucid leave pixels through which less than this share of light gets, from 0 to 1: faster, and not exact above 0
    /// [default: 0]
    #[arg(long, value_name = "SHARE", allow_hyphen_values = true)]
    pub(crate) alpha_threshold: Option<String>,

    /// Put all fragments in order in memory before they are resolved (linear, list, pages, abuffer): pays only where they
    /// are read more than once
    #[arg(long)]
    pub(crate) presort: bool,

    #[command(flatten)]
    pub(crate) device: DeviceArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct ListArgs {
    /// As JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Backend {
    Auto,
    Cpu,
    Gpu,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Side {
    Iso,
    Front,
    Back,
    Left,
    Right,
    Top,
    Bottom,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum StorageArg {
    Buffer,
    Texture,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ThroughArg {
    Fbuffer,
    Framebuffer,
    Both,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ShadingArg {
    Lit,
    Unlit,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ReferenceArg {
    Oracle,
    Cpu,
}

/// The name, among techniques, of blending in draw order on no device at all.
pub(crate) const UNSORTED: &str = "unsorted";

/// Dark and neutral, so that every colour of glass stands out before it.
const DEFAULT_BACKGROUND: &str = "#1b1d22";

fn resolve_help() -> String {
    let width = Resolve::NAMES.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let names = Resolve::NAMES.iter().map(|(name, meaning)| format!("\n  {name:width$}  {meaning}"));
    format!("What the ordered layers become [default: blend]:{}", names.collect::<String>())
}

fn suite_help() -> String {
    let width = bench::SUITES.iter().map(|suite| suite.name.len()).max().unwrap_or(0);
    let suites = bench::SUITES.iter().map(|suite| format!("\n  {:width$}  {}", suite.name, suite.summary));
    format!("What is measured, separated by commas [default: all]:{}", suites.collect::<String>())
}

fn shader_help() -> String {
    let width = Shader::NAMES.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let names = Shader::NAMES.iter().map(|(name, meaning)| format!("\n  {name:width$}  {meaning}"));
    let what = "A shader of several passes, on the CPU unless --backend gpu, blended in draw order; --resolve slots shows its \
         F-Buffer's memory:";
    what.to_owned() + &names.collect::<String>()
}

fn compared_names() -> Vec<&'static str> {
    [UNSORTED].into_iter().chain(Technique::ALL.map(Technique::name)).collect()
}

fn exact_names() -> Vec<&'static str> {
    Technique::ALL.into_iter().filter(|technique| technique.is_exact()).map(Technique::name).collect()
}
