//! `pellucid render`: one picture, or a turntable of pictures.

use std::path::{Path, PathBuf};

use anyhow::Context;
use pellucid::core::heat_map;
use pellucid::{Camera, Canvas, Renderer, Resolve, Scene, Stats, View, files};

use crate::commands::{multi_pass, warn_about, warn_about_cut, warn_about_dropped};
use crate::plan::{Opened, RenderPlan, StatsTarget};
use crate::progress::Progress;
use crate::report::{self, Figures, Run};
use crate::words::{duration, plural, short_count};
use crate::{UsageError, camera, legend, terminal};

pub(crate) fn run(plan: &RenderPlan) -> anyhow::Result<()> {
    // What cannot be written is better known before a long render than after.
    match plan.frames {
        None => files::check_writable(&plan.output)?,
        Some(_) => files::check_writable(&numbered(&plan.output, 1))?,
    }
    if let Some(StatsTarget::File(path)) = &plan.stats {
        files::check_writable(path)?;
    }

    let progress = Progress::new(plan.frames, plan.quiet);
    progress.stage("loading");
    let loaded = plan.scene.load()?;
    let view = plan.view.of(&loaded.scene)?;
    if !plan.quiet {
        progress.suspend(|| warn_about(&loaded.warnings));
    }
    if let Some(multi_pass) = &plan.multi_pass {
        return multi_pass::run(plan, multi_pass, &loaded.scene, &view, &progress);
    }
    let Opened { renderer, misses_gpu } = plan.capture.open()?;
    let job = Job { plan, scene: &loaded.scene, renderer, misses_gpu, progress: &progress };
    match plan.frames {
        None => job.picture(&view),
        Some(count) => job.turntable(&view, count),
    }
}

/// What every picture of a run needs.
struct Job<'a> {
    plan: &'a RenderPlan,
    scene: &'a Scene,
    renderer: Renderer,
    misses_gpu: bool,
    progress: &'a Progress,
}

impl Job<'_> {
    fn picture(&self, view: &View) -> anyhow::Result<()> {
        self.progress.stage("rendering");
        let stats = self.render_to(&self.plan.output, view, &mut Canvas::new())?;
        if let Some(target) = &self.plan.stats {
            report::write(&report::single(&self.run_of(&stats), &Figures::from(&stats))?, target)?;
        }
        self.say(|| {
            warn_about_dropped(&stats);
            warn_about_cut(&stats);
            terminal::note(&summary(&self.plan.output, &stats, self.misses_gpu));
        });
        Ok(())
    }

    fn turntable(&self, view: &View, count: u32) -> anyhow::Result<()> {
        let cameras = cameras_around(&view.camera, count)?;
        let mut pictures: Vec<(String, Figures)> = Vec::new();
        let mut canvas = Canvas::new();
        let mut last = None;
        let mut total_ms = 0.0;
        for (number, camera) in (1..).zip(cameras) {
            let path = numbered(&self.plan.output, number);
            self.progress.stage("rendering");
            let mut result = self.render_to(&path, &View { camera, ..view.clone() }, &mut canvas);
            if number > 1 {
                result = result.with_context(|| format!("stopped at picture {number}; those before it are whole"));
            }
            let stats = result?;
            self.progress.picture_done();
            total_ms += stats.total_ms;
            pictures.push((path.display().to_string(), Figures::from(&stats)));
            last = Some(stats);
        }
        let (Some(stats), Some((first, _))) = (last, pictures.first()) else { return Ok(()) };
        if let Some(target) = &self.plan.stats {
            report::write(&report::turntable(&self.run_of(&stats), &pictures)?, target)?;
        }
        self.say(|| {
            warn_about_dropped(&stats);
            warn_about_cut(&stats);
            let Stats { width, height, .. } = &stats;
            let mean = duration(total_ms / f64::from(count));
            let last = numbered(&self.plan.output, count);
            let pictures = plural(count.into(), "picture");
            terminal::note(&format!(
                "{first} to {}: {pictures}, {width} x {height}, {mean} each ({})",
                last.display(),
                rendered_by(&stats, self.misses_gpu)
            ));
        });
        Ok(())
    }

    /// Renders a picture into a file, by way of a canvas.
    fn render_to(&self, path: &Path, view: &View, canvas: &mut Canvas) -> anyhow::Result<Stats> {
        let stats = self.renderer.render_into(self.scene, view, self.plan.resolve, canvas)?;
        if let Resolve::Complexity(asked) = self.plan.resolve {
            let mut image = std::mem::take(canvas).into_image();
            let full_scale = heat_map::full_scale(asked, stats.max_depth_complexity);
            if !legend::draw(&mut image, legend::FRAGMENTS, full_scale, stats.max_depth_complexity > full_scale) {
                let scale = format!("{}: too small for a legend; the scale is {}", path.display(), words(full_scale));
                self.say(|| terminal::note(&scale));
            }
            canvas.put(image);
        }
        self.progress.stage("writing");
        pellucid::save(canvas.image(), path)?;
        Ok(stats)
    }

    fn run_of(&self, stats: &Stats) -> Run {
        Run::new(self.plan.scene.to_string(), self.plan.resolve.to_string(), stats)
    }

    fn say(&self, write: impl FnOnce()) {
        if !self.plan.quiet {
            self.progress.suspend(write);
        }
    }
}

/// So many cameras round the target, evenly, from where the first one is.
fn cameras_around(start: &Camera, count: u32) -> anyhow::Result<Vec<Camera>> {
    let parts = (0..count).map(|number| f64::from(number) / f64::from(count));
    let cameras: Option<_> = parts.map(|part| camera::around(start, part)).collect();
    cameras.ok_or_else(|| {
        let reason = "the camera looks along its up axis, and going round it shows nothing new";
        UsageError(format!("--frames: {reason}; choose another --view or --up")).into()
    })
}

fn words(full_scale: u32) -> String {
    format!("0 (black) to {full_scale} (pale yellow) fragments per pixel")
}

/// `gallery.png: 1280 x 720, 1.2 M fragments, at most 23 behind a pixel, 35 ms (cpu, 2 threads)`
fn summary(path: &Path, stats: &Stats, misses_gpu: bool) -> String {
    let Stats { width, height, .. } = stats;
    let layers = match stats.fragments {
        0 => "no transparent fragments".to_owned(),
        count => format!("{} fragments, at most {} behind a pixel", short_count(count), stats.max_depth_complexity),
    };
    let took = duration(stats.total_ms);
    format!("{}: {width} x {height}, {layers}, {took} ({})", path.display(), rendered_by(stats, misses_gpu))
}

/// `cpu, 2 threads; no GPU found`
fn rendered_by(stats: &Stats, misses_gpu: bool) -> String {
    // That the technique runs on the CPU is in its name already.
    let device = stats.device.strip_prefix("CPU, ").unwrap_or(&stats.device);
    format!("{}, {device}{}", stats.technique, if misses_gpu { "; no GPU found" } else { "" })
}

/// `out.png` as `out-0001.png`.
fn numbered(path: &Path, number: u32) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{number:04}."));
    name.push(path.extension().unwrap_or_default());
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_a_turntable_are_numbered_before_their_extension() {
        assert_eq!(numbered(Path::new("a/b.c.png"), 7), Path::new("a/b.c-0007.png"));
        assert_eq!(numbered(Path::new("b.EXR"), 9999), Path::new("b-9999.EXR"));
    }
}
