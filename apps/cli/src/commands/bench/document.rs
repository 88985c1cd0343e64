//! `bench.json` and `bench.csv`, described in docs/schema.md. The JSON is also what a run that was stopped goes on from:
//! it is written whole after every point.

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};

use super::exhibit::laws;
use super::fit::PowerLaw;
use super::machine::Hardware;
use super::results::{Measurement, PointResult};
use super::suite::{Axis, Published, Series, Suite};
use crate::args::Backend;
use crate::commands::folder::Folder;
use crate::plan::BenchPlan;
use crate::report::{SCHEMA, to_json};

pub(super) const JSON: &str = "bench.json";
pub(super) const CSV: &str = "bench.csv";

/// All results so far, with what was to be measured.
pub(super) struct Session {
    pub(super) hardware: Hardware,
    pub(super) terms: Terms,
    pub(super) chapters: Vec<Chapter>,
}

/// A series of a suite with its results, as far as they go.
pub(super) struct Chapter {
    pub(super) suite: &'static Suite,
    pub(super) series: Series,
    pub(super) results: Vec<PointResult>,
}

/// What makes results of two runs comparable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Terms {
    pub(super) suites: Vec<String>,
    pub(super) scenes: Option<String>,
    pub(super) backend: String,
    pub(super) threads: usize,
    pub(super) budget_bytes: Option<u64>,
    pub(super) repeats: u32,
    pub(super) time_limit_s: u64,
    pub(super) quick: bool,
}

#[derive(Serialize)]
struct Document<'a> {
    schema: u32,
    command: &'static str,
    version: &'static str,
    /// Whether nothing is left to do.
    complete: bool,
    hardware: &'a Hardware,
    plan: &'a Terms,
    suites: Vec<SuiteEntry<'a>>,
}

#[derive(Serialize)]
struct SuiteEntry<'a> {
    name: &'static str,
    summary: &'static str,
    series: Vec<SeriesEntry<'a>>,
}

#[derive(Serialize)]
struct SeriesEntry<'a> {
    name: &'static str,
    title: &'static str,
    about: &'static str,
    axis: Option<Axis>,
    points: &'a [PointResult],
    laws: Vec<Law>,
    published: Option<Published>,
}

/// Time in milliseconds over the axis.
#[derive(Serialize)]
struct Law {
    name: String,
    #[serde(flatten)]
    law: PowerLaw,
}

/// What is read back of a document.
#[derive(Deserialize)]
struct Kept {
    schema: u32,
    version: String,
    hardware: Hardware,
    plan: Terms,
    suites: Vec<KeptSuite>,
}

#[derive(Deserialize)]
struct KeptSuite {
    name: String,
    series: Vec<KeptSeries>,
}

#[derive(Deserialize)]
struct KeptSeries {
    name: String,
    points: Vec<PointResult>,
}

const VERSION: &str = env!("CARGO_PKG_VERSION");

impl Terms {
    pub(super) fn of(plan: &BenchPlan) -> Self {
        let backend = match plan.backend {
            Backend::Auto => "auto",
            Backend::Cpu => "cpu",
            Backend::Gpu => "gpu",
        };
        Self {
            suites: plan.suites.iter().map(|suite| suite.name.to_owned()).collect(),
            scenes: plan.scenes.as_ref().map(|folder| folder.display().to_string()),
            backend: backend.to_owned(),
            threads: plan.threads,
            budget_bytes: plan.budget_bytes,
            repeats: plan.repeats,
            time_limit_s: plan.time_limit.as_secs(),
            quick: plan.quick,
        }
    }

    /// In what others differ, in the words of the command line.
    fn difference(&self, other: &Self) -> Option<String> {
        let optional = |value: &Option<String>| value.clone().unwrap_or_else(|| "none".into());
        let budget = |terms: &Self| terms.budget_bytes.map_or("none".into(), |bytes| bytes.to_string());
        let pairs = [
            ("--suite", self.suites.join(","), other.suites.join(",")),
            ("--scenes", optional(&self.scenes), optional(&other.scenes)),
            ("--backend", self.backend.clone(), other.backend.clone()),
            ("--threads", self.threads.to_string(), other.threads.to_string()),
            ("--budget", budget(self), budget(other)),
            ("--repeats", self.repeats.to_string(), other.repeats.to_string()),
            ("--time-limit", self.time_limit_s.to_string(), other.time_limit_s.to_string()),
            ("--quick", self.quick.to_string(), other.quick.to_string()),
        ];
        let different = pairs.into_iter().find(|(_, mine, others)| mine != others);
        different.map(|(option, mine, others)| format!("{option} {others}, now {mine}"))
    }
}

impl Session {
    /// The results that a folder holds already, if it holds any; how many points there are.
    pub(super) fn resume(&mut self, folder: &Folder) -> anyhow::Result<usize> {
        let path = folder.path(JSON);
        if !path.exists() {
            return Ok(0);
        }
        let advice = "choose another folder, or start over with --fresh";
        let text = folder.read(JSON)?;
        let kept: Kept = serde_json::from_slice(&text)
            .with_context(|| format!("'{}' is not what this command writes; {advice}", path.display()))?;
        let others = |what: &str| format!("'{}' holds results of {what}; {advice}", path.display());
        if (kept.schema, kept.version.as_str()) != (SCHEMA, VERSION) {
            bail!("{}", others(&format!("version {} of this program, which is {VERSION}", kept.version)));
        }
        if !kept.hardware.is_same_device(&self.hardware) {
            bail!("{}", others(&format!("another device ({})", kept.hardware.in_words())));
        }
        if let Some(difference) = self.terms.difference(&kept.plan) {
            bail!("{}", others(&format!("another plan ({difference})")));
        }
        for chapter in &mut self.chapters {
            let suite = kept.suites.iter().find(|suite| suite.name == chapter.suite.name);
            let series = suite.and_then(|suite| suite.series.iter().find(|series| series.name == chapter.series.name));
            let names = chapter.names();
            let is_planned = |result: &&PointResult| {
                let is_there = chapter.series.points.iter().any(|point| point.label == result.label);
                is_there && result.results.iter().map(|result| &result.name).eq(&names)
            };
            let points = series.map_or(&[][..], |series| &series.points);
            chapter.results = points.iter().filter(is_planned).filter(|result| result.is_final()).cloned().collect();
        }
        Ok(self.done())
    }

    /// Points that are measured.
    pub(super) fn done(&self) -> usize {
        self.chapters.iter().map(|chapter| chapter.results.len()).sum()
    }

    /// Points there are.
    pub(super) fn planned(&self) -> usize {
        self.chapters.iter().map(|chapter| chapter.series.points.len()).sum()
    }

    pub(super) fn is_complete(&self) -> bool {
        self.done() == self.planned()
    }

    /// What failed, with where.
    pub(super) fn failures(&self) -> usize {
        let results = self.chapters.iter().flat_map(|chapter| &chapter.results);
        results.filter(|result| !result.is_final()).count()
    }

    pub(super) fn to_json(&self) -> anyhow::Result<String> {
        let mut suites: Vec<SuiteEntry<'_>> = Vec::new();
        for chapter in &self.chapters {
            let Suite { name, summary, .. } = *chapter.suite;
            if suites.last().is_none_or(|last| last.name != name) {
                suites.push(SuiteEntry { name, summary, series: Vec::new() });
            }
            if let Some(suite) = suites.last_mut() {
                suite.series.push(SeriesEntry::new(chapter));
            }
        }
        to_json(&Document {
            schema: SCHEMA,
            command: "bench",
            version: VERSION,
            complete: self.is_complete(),
            hardware: &self.hardware,
            plan: &self.terms,
            suites,
        })
    }

    /// One line a measurement.
    pub(super) fn to_csv(&self) -> anyhow::Result<Vec<u8>> {
        let mut csv = csv::Writer::from_writer(Vec::new());
        for chapter in &self.chapters {
            for point in &chapter.results {
                for result in &point.results {
                    csv.serialize(Line::new(chapter, point, result))?;
                }
            }
        }
        csv.into_inner().context("cannot put figures in lines")
    }
}

impl Chapter {
    /// What was measured at a point.
    pub(super) fn result(&self, label: &str) -> Option<&PointResult> {
        self.results.iter().find(|result| result.label == label)
    }

    /// Puts a result in its place among the others.
    pub(super) fn insert(&mut self, result: PointResult) {
        self.results.retain(|other| other.label != result.label);
        self.results.push(result);
        let place = |label: &str| self.series.points.iter().position(|point| point.label == label);
        self.results.sort_by_key(|result| place(&result.label));
    }
}

impl<'a> SeriesEntry<'a> {
    fn new(chapter: &'a Chapter) -> Self {
        let Series { name, title, about, axis, published, .. } = chapter.series;
        let laws = laws(chapter).into_iter().map(|(name, law)| Law { name, law }).collect();
        Self { name, title, about, axis, points: &chapter.results, laws, published }
    }
}

#[derive(Serialize)]
struct Line<'a> {
    suite: &'a str,
    series: &'a str,
    point: &'a str,
    x: Option<f64>,
    scene: &'a str,
    width: u32,
    height: u32,
    opacity: f32,
    shader: Option<&'a str>,
    fbuffer: Option<u32>,
    triangles: Option<u64>,
    fragments: Option<u64>,
    max_depth_complexity: Option<u32>,
    name: &'a str,
    technique: &'a str,
    backend: &'a str,
    device: Option<&'a str>,
    exact: Option<bool>,
    frames: Option<usize>,
    median_ms: Option<f64>,
    lower_ms: Option<f64>,
    upper_ms: Option<f64>,
    least_ms: Option<f64>,
    greatest_ms: Option<f64>,
    alpha_ratio: Option<f64>,
    peak_bytes: Option<u64>,
    windows: Option<u32>,
    rerenders: Option<u32>,
    cut_pixels: Option<u64>,
    filter_size: Option<u32>,
    alpha_threshold: Option<f32>,
    repaired_pixels: Option<u64>,
    wrong_pixels: Option<u64>,
    half_block_parts: Option<u64>,
    slot_windows: Option<u64>,
    submissions: Option<u64>,
    reason: Option<&'a str>,
}

impl<'a> Line<'a> {
    fn new(chapter: &'a Chapter, point: &'a PointResult, result: &'a Measurement) -> Self {
        let figures = result.figures();
        Self {
            suite: chapter.suite.name,
            series: chapter.series.name,
            point: &point.label,
            x: point.x,
            scene: &point.scene,
            width: point.width,
            height: point.height,
            opacity: point.opacity,
            shader: point.shader.as_deref(),
            fbuffer: point.fbuffer,
            triangles: point.triangles,
            fragments: point.fragments,
            max_depth_complexity: point.max_depth_complexity,
            name: &result.name,
            technique: &result.technique,
            backend: &result.backend,
            device: figures.map(|figures| &*figures.device),
            exact: figures.map(|figures| figures.exact),
            frames: figures.map(|figures| figures.frames),
            median_ms: figures.map(|figures| figures.median_ms),
            lower_ms: figures.map(|figures| figures.lower_ms),
            upper_ms: figures.map(|figures| figures.upper_ms),
            least_ms: figures.map(|figures| figures.least_ms),
            greatest_ms: figures.map(|figures| figures.greatest_ms),
            alpha_ratio: figures.and_then(|figures| figures.alpha_ratio),
            peak_bytes: figures.map(|figures| figures.peak_bytes),
            windows: figures.map(|figures| figures.windows),
            rerenders: figures.map(|figures| figures.rerenders),
            cut_pixels: figures.map(|figures| figures.cut_pixels),
            filter_size: result.filter_size,
            alpha_threshold: result.alpha_threshold,
            repaired_pixels: figures.and_then(|figures| figures.repaired_pixels),
            wrong_pixels: figures.and_then(|figures| figures.wrong_pixels),
            half_block_parts: figures.and_then(|figures| figures.half_block_parts),
            slot_windows: figures.and_then(|figures| figures.slot_windows),
            submissions: figures.and_then(|figures| figures.submissions),
            reason: result.reason(),
        }
    }
}
