//! `pellucid info`: what is in a scene, and how many layers lie behind the pixels of a view.

use pellucid::{AlphaMode, Scene, Stats, View};
use serde::Serialize;

use crate::commands::{warn_about, warn_about_dropped};
use crate::plan::InfoPlan;
use crate::progress::Progress;
use crate::report::{SCHEMA, to_json};
use crate::terminal;
use crate::words::{columns, full_count};

#[derive(Serialize)]
struct Report {
    schema: u32,
    scene: String,
    warnings: Vec<String>,
    #[serde(flatten)]
    content: Content,
    view: FromView,
}

/// What is in the scene, from wherever one looks.
#[derive(Serialize)]
struct Content {
    meshes: u64,
    instances: u64,
    materials: Materials,
    textures: u64,
    triangles: u64,
    triangles_stored: u64,
    vertices_stored: u64,
    cameras: u64,
    bounding_box: Option<BoundingBox>,
}

#[derive(Serialize)]
struct Materials {
    transparent: u64,
    masked: u64,
    opaque: u64,
}

#[derive(Serialize)]
struct BoundingBox {
    min: [f32; 3],
    max: [f32; 3],
}

/// What is seen from the view.
#[derive(Serialize)]
struct FromView {
    width: u32,
    height: u32,
    opacity: f32,
    technique: &'static str,
    fragments: u64,
    max_depth_complexity: u32,
    mean_depth_complexity: f64,
    dropped_triangles: u64,
}

pub(crate) fn run(plan: &InfoPlan) -> anyhow::Result<()> {
    let progress = Progress::new(None, plan.quiet);
    progress.stage("loading");
    let loaded = plan.scene.load()?;
    let view = plan.view.of(&loaded.scene)?;
    progress.stage("counting layers");
    let stats = plan.capture.open()?.renderer.layers(&loaded.scene, &view, |_| ())?;
    drop(progress);

    if !plan.quiet {
        warn_about(&loaded.warnings);
        warn_about_dropped(&stats);
    }
    let report = Report {
        schema: SCHEMA,
        scene: plan.scene.to_string(),
        content: Content::of(&loaded.scene),
        view: FromView::of(&view, &stats),
        warnings: loaded.warnings,
    };
    let text = if plan.json { to_json(&report)? } else { report.to_text() };
    Ok(terminal::print(&text)?)
}

impl Content {
    fn of(scene: &Scene) -> Self {
        let (mut triangles_stored, mut vertices_stored) = (0, 0);
        for mesh in scene.meshes() {
            triangles_stored += mesh.triangles().len() as u64;
            vertices_stored += mesh.positions().len() as u64;
        }
        let mut materials = Materials { transparent: 0, masked: 0, opaque: 0 };
        for material in scene.materials() {
            *match material.alpha_mode {
                AlphaMode::Blend => &mut materials.transparent,
                AlphaMode::Mask { .. } => &mut materials.masked,
                AlphaMode::Opaque => &mut materials.opaque,
            } += 1;
        }
        Self {
            meshes: scene.meshes().len() as u64,
            instances: scene.instances().len() as u64,
            materials,
            textures: scene.textures().len() as u64,
            triangles: scene.primitive_count().into(),
            triangles_stored,
            vertices_stored,
            cameras: scene.cameras().len() as u64,
            bounding_box: scene
                .bounding_box()
                .map(|(min, max)| BoundingBox { min: min.to_array(), max: max.to_array() }),
        }
    }
}

impl FromView {
    fn of(view: &View, stats: &Stats) -> Self {
        Self {
            width: view.width,
            height: view.height,
            opacity: view.opacity,
            technique: stats.technique.name(),
            fragments: stats.fragments,
            max_depth_complexity: stats.max_depth_complexity,
            mean_depth_complexity: stats.mean_depth_complexity,
            dropped_triangles: stats.dropped_triangles,
        }
    }
}

impl Report {
    fn to_text(&self) -> String {
        let Content { materials, .. } = &self.content;
        let content = columns([
            ("meshes", full_count(self.content.meshes)),
            ("instances", full_count(self.content.instances)),
            ("triangles", with_note(self.content.triangles, self.content.triangles_stored, "stored, then instanced")),
            ("vertices", full_count(self.content.vertices_stored)),
            ("materials", materials.to_text()),
            ("textures", full_count(self.content.textures)),
            ("cameras", full_count(self.content.cameras)),
            ("bounding box", self.content.bounding_box.as_ref().map_or("nothing to see".into(), BoundingBox::to_text)),
        ]);
        let view = columns([
            ("fragments", full_count(self.view.fragments)),
            ("depth complexity", self.view.depth_complexity()),
            ("dropped triangles", full_count(self.view.dropped_triangles)),
        ]);
        let FromView { width, height, .. } = self.view;
        format!("{}\n{content}\nFrom this view, {width} x {height} pixels\n{view}", self.scene)
    }
}

impl FromView {
    fn depth_complexity(&self) -> String {
        if self.fragments == 0 {
            return "0: no transparent surface is seen".into();
        }
        let FromView { max_depth_complexity: max, mean_depth_complexity: mean, .. } = self;
        format!("at most {}, on average {mean:.2} where there is any", full_count((*max).into()))
    }
}

impl Materials {
    fn to_text(&self) -> String {
        let parts = [(self.transparent, "transparent"), (self.masked, "masked"), (self.opaque, "opaque")];
        let parts = parts.map(|(count, kind)| format!("{} {kind}", full_count(count)));
        format!("{} ({})", full_count(self.transparent + self.masked + self.opaque), parts.join(", "))
    }
}

impl BoundingBox {
    fn to_text(&self) -> String {
        let Self { min: [a, b, c], max: [x, y, z] } = self;
        format!("({a:.4}, {b:.4}, {c:.4}) to ({x:.4}, {y:.4}, {z:.4}), size {:.4} x {:.4} x {:.4}", x - a, y - b, z - c)
    }
}

/// A count, and another in brackets if it differs.
fn with_note(count: u64, other: u64, note: &str) -> String {
    if count == other { full_count(count) } else { format!("{} ({} {note})", full_count(count), full_count(other)) }
}
