//! What a comparison found, as `compare.json` (described in docs/schema.md), `compare.csv` and a table.

use pellucid::{Resolve, Scene, View};
use serde::Serialize;

use super::measure::Measured;
use super::observation::Observation;
use super::reference::Reference;
use super::spots::{Spot, spots};
use crate::report::{SCHEMA, Step};
use crate::words::{duration, full_count, memory, plural, table};

#[derive(Serialize)]
pub(super) struct Document {
    schema: u32,
    command: &'static str,
    version: &'static str,
    scene: String,
    resolve: String,
    width: u32,
    height: u32,
    camera: Camera,
    triangles: u64,
    dropped_triangles: u64,
    fragments: u64,
    max_depth_complexity: u32,
    mean_depth_complexity: f64,
    reference: ReferenceEntry,
    techniques: Vec<Entry>,
    pictures: Pictures,
    /// Pixels by depth complexity, from 0 on.
    depth_complexity: Vec<u64>,
    layers: Vec<Layer>,
    spots: Vec<Spot>,
}

#[derive(Serialize)]
struct Camera {
    eye: [f32; 3],
    target: [f32; 3],
    up: [f32; 3],
}

#[derive(Serialize)]
struct ReferenceEntry {
    technique: &'static str,
    picture: &'static str,
    knows_ambiguous_pixels: bool,
}

#[derive(Serialize)]
struct Pictures {
    split: &'static str,
    complexity: &'static str,
    layers: &'static str,
}

#[derive(Serialize)]
struct Layer {
    number: u32,
    pixels: u64,
}

/// A technique; what no device rendered has no times and bytes.
#[derive(Serialize)]
struct Entry {
    name: &'static str,
    exact: bool,
    backend: Option<&'static str>,
    device: Option<String>,
    picture: String,
    error_map: String,
    total_ms: Option<f64>,
    steps: Vec<Step>,
    peak_bytes: Option<u64>,
    windows: Option<u32>,
    rerenders: Option<u32>,
    fragments: Option<u64>,
    /// In steps of 1/255.
    max_error: u8,
    differing: u64,
    /// `None`: infinite.
    psnr: Option<f64>,
    ssim: Option<f64>,
    flip: f64,
    ambiguous: Option<u64>,
    unexplained: Option<u64>,
    /// Whether the contract's comparison with the oracle holds.
    agrees: Option<bool>,
}

impl Document {
    pub(super) fn new(
        (name, scene): (&str, &Scene),
        view: &View,
        resolve: Resolve,
        reference: &Reference,
        observation: &Observation,
        measured: &[Measured],
    ) -> anyhow::Result<Self> {
        let stats = reference.stats();
        let camera = &view.camera;
        let knows_ambiguous_pixels = reference.ambiguous().is_some();
        let layers = observation.layers.pixels.iter().zip(1..).map(|(&pixels, number)| Layer { number, pixels });
        Ok(Self {
            schema: SCHEMA,
            command: "compare",
            version: env!("CARGO_PKG_VERSION"),
            scene: name.to_owned(),
            resolve: resolve.to_string(),
            width: view.width,
            height: view.height,
            camera: Camera { eye: camera.eye.to_array(), target: camera.target.to_array(), up: camera.up.to_array() },
            triangles: stats.triangles,
            dropped_triangles: stats.dropped_triangles,
            fragments: stats.fragments,
            max_depth_complexity: stats.max_depth_complexity,
            mean_depth_complexity: stats.mean_depth_complexity,
            reference: ReferenceEntry {
                technique: reference.technique().name(),
                picture: "reference.png",
                knows_ambiguous_pixels,
            },
            techniques: measured.iter().map(|measured| Entry::new(measured, knows_ambiguous_pixels)).collect(),
            pictures: Pictures { split: "split.png", complexity: "complexity.png", layers: "layers.png" },
            depth_complexity: observation.histogram(),
            layers: layers.collect(),
            spots: spots(scene, view, reference, observation, measured)?,
        })
    }

    pub(super) fn max_depth_complexity(&self) -> u32 {
        self.max_depth_complexity
    }

    pub(super) fn scene(&self) -> &str {
        &self.scene
    }

    /// The files of all pictures.
    pub(super) fn pictures(&self) -> Vec<&str> {
        let Pictures { split, complexity, layers } = self.pictures;
        let techniques = self.techniques.iter().flat_map(|entry| [&*entry.picture, &*entry.error_map]);
        [self.reference.picture].into_iter().chain(techniques).chain([split, complexity, layers]).collect()
    }

    /// One line a technique, with the keys of the JSON.
    pub(super) fn to_csv(&self) -> String {
        let mut csv = String::from(
            "technique,exact,backend,device,total_ms,peak_bytes,fragments,max_error,differing,psnr,ssim,flip,ambiguous,\
             unexplained\n",
        );
        for entry in &self.techniques {
            let cells = [
                entry.name.to_owned(),
                entry.exact.to_string(),
                cell(entry.backend),
                quoted(entry.device.as_deref().unwrap_or_default()),
                cell(entry.total_ms),
                cell(entry.peak_bytes),
                cell(entry.fragments),
                entry.max_error.to_string(),
                entry.differing.to_string(),
                entry.psnr.map_or_else(|| "inf".to_owned(), |psnr| psnr.to_string()),
                cell(entry.ssim),
                entry.flip.to_string(),
                cell(entry.ambiguous),
                cell(entry.unexplained),
            ];
            csv += &(cells.join(",") + "\n");
        }
        csv
    }

    /// The table on stdout.
    pub(super) fn to_text(&self) -> String {
        let Self { scene, resolve, width, height, reference, .. } = self;
        let fragments = plural(self.fragments, "fragment");
        let deepest = full_count(self.max_depth_complexity.into());
        let mut text = format!(
            "{scene}: {resolve}, {width} x {height}, {fragments}, at most {deepest} behind a pixel; reference: {}\n\n",
            reference.technique
        );
        let heading = [
            "technique",
            "time",
            "memory",
            "fragments",
            "max error",
            "PSNR",
            "SSIM",
            "FLIP",
            "differing",
            "ambiguous",
            "unexplained",
        ];
        let mut rows = vec![heading.map(str::to_owned).to_vec()];
        rows.extend(self.techniques.iter().map(|entry| entry.cells().to_vec()));
        text += &table(&rows);
        text
    }
}

impl Entry {
    fn new(measured: &Measured, knows_ambiguous_pixels: bool) -> Self {
        let name = measured.compared.name();
        let technique = measured.compared.technique();
        let stats = measured.stats.as_ref();
        let comparison = &measured.comparison;
        let known = |value: u64| Some(value).filter(|_| knows_ambiguous_pixels);
        Self {
            name,
            exact: technique.is_some_and(|technique| technique.is_exact()),
            backend: technique.map(|technique| technique.backend()),
            device: stats.map(|stats| stats.device.clone()),
            picture: format!("{name}.png"),
            error_map: format!("{name}-error.png"),
            total_ms: stats.map(|stats| stats.total_ms),
            steps: stats.map_or_else(Vec::new, Step::all),
            peak_bytes: stats.map(|stats| stats.peak_bytes),
            windows: stats.map(|stats| stats.windows),
            rerenders: stats.map(|stats| stats.rerenders),
            // What captures none has none to count.
            fragments: stats.filter(|stats| stats.technique.is_exact()).map(|stats| stats.fragments),
            max_error: measured.max_error(),
            differing: measured.differing(),
            psnr: Some(measured.psnr).filter(|psnr| psnr.is_finite()),
            ssim: measured.ssim,
            flip: measured.flip,
            ambiguous: known(comparison.ambiguous),
            unexplained: known(comparison.unexplained),
            agrees: knows_ambiguous_pixels.then(|| comparison.passes()),
        }
    }

    fn cells(&self) -> [String; 11] {
        let dash = || "-".to_owned();
        [
            self.name.to_owned(),
            self.total_ms.map_or_else(dash, duration),
            self.peak_bytes.map_or_else(dash, memory),
            self.fragments.map_or_else(dash, full_count),
            format!("{}/255", self.max_error),
            self.psnr.map_or_else(|| "inf".to_owned(), |psnr| format!("{psnr:.2}")),
            self.ssim.map_or_else(dash, |ssim| format!("{ssim:.4}")),
            format!("{:.4}", self.flip),
            full_count(self.differing),
            self.ambiguous.map_or_else(dash, full_count),
            self.unexplained.map_or_else(dash, full_count),
        ]
    }
}

fn cell(value: Option<impl ToString>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}
