//! `pellucid render --shader`: a picture by a shader of several passes, through an F-Buffer or a framebuffer.

use std::time::Instant;

use pellucid::core::fbuffer::{Drawn, Size, Windows};
use pellucid::gpu::{Context, ContextOptions};
use pellucid::multi_pass::{self, GpuMultiPass, Picture, Through, differing_pixels};
use pellucid::{Image, Scene, View};
use serde::Serialize;

use crate::args::ThroughArg;
use crate::plan::{MultiPassPlan, RenderPlan, Show};
use crate::progress::Progress;
use crate::report::{self, SCHEMA};
use crate::terminal;
use crate::words::{duration, plural, short_count};

/// What `--stats` writes.
#[derive(Debug, Serialize)]
struct Figures {
    schema: u32,
    scene: String,
    shader: String,
    backend: &'static str,
    width: u32,
    height: u32,
    fragments: u64,
    passes: u64,
    /// Slots along each side; none for a framebuffer.
    fbuffer: Option<u32>,
    windows: u64,
    submissions: u64,
    bytes: u64,
    /// Pixels that differ between both ways.
    wrong_pixels: Option<u64>,
    total_ms: f64,
}

pub(crate) fn run(
    plan: &RenderPlan,
    multi_pass: &MultiPassPlan,
    scene: &Scene,
    view: &View,
    progress: &Progress,
) -> anyhow::Result<()> {
    progress.stage("rendering");
    let start = Instant::now();
    let shader = multi_pass.shader;
    let fragments = multi_pass::fragments(scene, view)?;
    let size = multi_pass.size.unwrap_or(Size::holding(fragments));
    let mut gpu = match multi_pass.is_on_gpu {
        true => {
            let options = ContextOptions { allow_software: true, ..ContextOptions::default() };
            Some(GpuMultiPass::new(Context::new(&options)?))
        }
        false => None,
    };
    let mut draw = |through| match &mut gpu {
        Some(gpu) => gpu.render(scene, view, shader, through),
        None => Ok(multi_pass::render(scene, view, shader, through)?),
    };
    let mut wrong_pixels = None;
    let picture = match multi_pass.show {
        Show::Slots => {
            let (image, windows) = match &mut gpu {
                Some(gpu) => gpu.slots(scene, view, shader, size)?,
                None => multi_pass::slots(scene, view, shader, size)?,
            };
            // Of all its windows, the first is shown.
            let drawn =
                Drawn { windows: windows.count(), submissions: windows.submissions(shader.passes()), fragments };
            Picture { image, drawn, bytes: 0, steps: Vec::new() }
        }
        Show::View(ThroughArg::Fbuffer) => draw(Through::FBuffer(size))?,
        Show::View(ThroughArg::Framebuffer) => draw(Through::Framebuffer)?,
        Show::View(ThroughArg::Both) => {
            let (wrong, right) = (draw(Through::Framebuffer)?, draw(Through::FBuffer(size))?);
            wrong_pixels = Some(differing_pixels(&wrong.image, &right.image));
            Picture { image: beside(&wrong.image, &right.image), ..right }
        }
    };
    let total_ms = start.elapsed().as_secs_f64() * 1e3;
    progress.stage("writing");
    pellucid::save(&picture.image, &plan.output)?;

    let (width, height) = (picture.image.width(), picture.image.height());
    let has_buffer = multi_pass.show != Show::View(ThroughArg::Framebuffer);
    let Drawn { windows, submissions, .. } = picture.drawn;
    if let Some(target) = &plan.stats {
        let figures = Figures {
            schema: SCHEMA,
            scene: plan.scene.to_string(),
            shader: shader.to_string(),
            backend: if multi_pass.is_on_gpu { "gpu" } else { "cpu" },
            width,
            height,
            fragments,
            passes: shader.passes(),
            fbuffer: has_buffer.then_some(size.width()),
            windows,
            submissions,
            bytes: picture.bytes,
            wrong_pixels,
            total_ms,
        };
        report::write(&report::to_json(&figures)?, target)?;
    }
    if !plan.quiet {
        let what = match has_buffer {
            true => {
                let remaining = Windows::new(fragments, size).remaining(0);
                format!("{} of {size} slots ({} overflows)", plural(windows, "window"), short_count(remaining))
            }
            false => "through a framebuffer".to_owned(),
        };
        let wrong = wrong_pixels.map_or(String::new(), |pixels| {
            format!(", {} wrong through a framebuffer, on the left", plural(pixels, "pixel"))
        });
        progress.suspend(|| {
            terminal::note(&format!(
                "{}: {width} x {height}, {} fragments, {what}, geometry drawn {}{wrong}, {} ({})",
                plan.output.display(),
                short_count(fragments),
                plural(submissions, "time"),
                duration(total_ms),
                gpu.as_ref().map_or("cpu", |gpu| gpu.context().name()),
            ));
        });
    }
    Ok(())
}

/// Two pictures of one size in one.
fn beside(left: &Image, right: &Image) -> Image {
    let width = left.width() as usize;
    let mut both = Image::filled(left.width() * 2, left.height(), glam::Vec4::ZERO);
    let rows = left.pixels().chunks_exact(width).zip(right.pixels().chunks_exact(width));
    for (pixels, (left, right)) in both.pixels_mut().chunks_exact_mut(2 * width).zip(rows) {
        pixels[..width].copy_from_slice(left);
        pixels[width..].copy_from_slice(right);
    }
    both
}
