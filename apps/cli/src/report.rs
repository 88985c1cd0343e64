//! The figures of a frame as JSON. Keys are stable: a change of their meaning raises [`SCHEMA`].

use std::io::Write;

use pellucid::{Stats, Technique, files};
use serde::Serialize;

use crate::plan::StatsTarget;
use crate::terminal;

/// Version of every JSON document that the command line writes.
pub(crate) const SCHEMA: u32 = 1;

/// What is the same for all pictures of a run.
#[derive(Debug, Serialize)]
pub(crate) struct Run {
    schema: u32,
    scene: String,
    resolve: String,
    backend: &'static str,
    technique: &'static str,
    exact: bool,
    device: String,
    width: u32,
    height: u32,
}

/// What one picture took and held.
#[derive(Debug, Serialize)]
pub(crate) struct Figures {
    triangles: u64,
    dropped_triangles: u64,
    fragments: u64,
    max_depth_complexity: u32,
    mean_depth_complexity: f64,
    steps: Vec<Step>,
    total_ms: f64,
    peak_bytes: u64,
    windows: u32,
    rerenders: u32,
    cut_pixels: u64,
    repaired_pixels: u64,
    half_block_parts: u64,
    lone_share: f64,
}

/// A timed part of a frame.
#[derive(Debug, Serialize)]
pub(crate) struct Step {
    name: &'static str,
    ms: f64,
}

impl Step {
    /// All of a frame, in order.
    pub(crate) fn all(stats: &Stats) -> Vec<Self> {
        stats.steps.iter().map(|step| Self { name: step.name, ms: step.ms }).collect()
    }
}

/// A single picture.
#[derive(Debug, Serialize)]
struct Single<'a> {
    #[serde(flatten)]
    run: &'a Run,
    #[serde(flatten)]
    figures: &'a Figures,
}

/// The pictures of a turntable.
#[derive(Debug, Serialize)]
struct Turntable<'a> {
    #[serde(flatten)]
    run: &'a Run,
    frames: Vec<Numbered<'a>>,
}

#[derive(Debug, Serialize)]
struct Numbered<'a> {
    file: String,
    #[serde(flatten)]
    figures: &'a Figures,
}

impl Run {
    pub(crate) fn new(scene: String, resolve: String, stats: &Stats) -> Self {
        let technique: Technique = stats.technique;
        Self {
            schema: SCHEMA,
            scene,
            resolve,
            backend: technique.backend(),
            technique: technique.name(),
            exact: stats.is_exact(),
            device: stats.device.clone(),
            width: stats.width,
            height: stats.height,
        }
    }
}

impl From<&Stats> for Figures {
    fn from(stats: &Stats) -> Self {
        Self {
            triangles: stats.triangles,
            dropped_triangles: stats.dropped_triangles,
            fragments: stats.fragments,
            max_depth_complexity: stats.max_depth_complexity,
            mean_depth_complexity: stats.mean_depth_complexity,
            steps: Step::all(stats),
            total_ms: stats.total_ms,
            peak_bytes: stats.peak_bytes,
            windows: stats.windows,
            rerenders: stats.rerenders,
            cut_pixels: stats.cut_pixels,
            repaired_pixels: stats.repaired_pixels,
            half_block_parts: stats.half_block_parts,
            lone_share: stats.lone_share,
        }
    }
}

/// The document for a single picture.
pub(crate) fn single(run: &Run, figures: &Figures) -> anyhow::Result<String> {
    to_json(&Single { run, figures })
}

/// The document for a turntable: the figures of each picture with its file.
pub(crate) fn turntable(run: &Run, pictures: &[(String, Figures)]) -> anyhow::Result<String> {
    let frames = pictures.iter().map(|(file, figures)| Numbered { file: file.clone(), figures }).collect();
    to_json(&Turntable { run, frames })
}

/// Any document, indented, with a line break at its end.
pub(crate) fn to_json(document: &impl Serialize) -> anyhow::Result<String> {
    Ok(serde_json::to_string_pretty(document)? + "\n")
}

/// Writes a document to where it was asked for.
pub(crate) fn write(document: &str, target: &StatsTarget) -> anyhow::Result<()> {
    match target {
        StatsTarget::Stdout => Ok(terminal::print(document)?),
        StatsTarget::File(path) => Ok(files::write_whole(path, |writer| writer.write_all(document.as_bytes()))?),
    }
}
