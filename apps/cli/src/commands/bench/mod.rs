//! `pellucid bench`: techniques timed on this device, suite by suite, beside what others published.
//!
//! A suite (`suites`, one file each) is made of series, a series of points, and at each point several variants of
//! techniques are measured in turns (`measure`) on the `machine`. After every point the `document` is written whole: a run
//! that is stopped leaves valid results, and the same command goes on from them. `exhibit` makes tables and plots of the
//! results, `report` a page.

mod document;
mod exhibit;
mod fit;
mod machine;
mod measure;
mod pace;
mod plot;
mod report;
mod results;
mod samples;
mod scale;
mod suite;
mod suites;
mod variant;

use std::path::{Path, PathBuf};

use anyhow::bail;
use pellucid::multi_pass::Shader;
use pellucid::{Scene, View};

use crate::commands::folder::Folder;
use crate::plan::BenchPlan;
use crate::progress::Progress;
use crate::terminal;
use crate::words::{plural, table};
use document::{CSV, Chapter, JSON, Session, Terms};
use machine::Machine;
use measure::{Effort, measure};
use pace::{Pace, Work};
use results::{Measurement, Outcome, PointResult};
pub(crate) use suite::Suite;
use suite::{Point, Published, Shaded};
pub(crate) use suites::SUITES;

const PAGE: &str = "index.html";

/// The names of all suites.
pub(crate) fn suite_names() -> Vec<&'static str> {
    SUITES.iter().map(|suite| suite.name).collect()
}

pub(crate) fn run(plan: &BenchPlan) -> anyhow::Result<()> {
    let folder = Folder::open(&plan.output)?;
    let mut machine = Machine::open(plan)?;
    let mut session = Session { hardware: machine.hardware(), terms: Terms::of(plan), chapters: chapters(plan) };
    let done = if plan.fresh { 0 } else { session.resume(&folder)? };
    let say = |line: &str| {
        if !plan.quiet {
            terminal::note(line);
        }
    };
    say(&format!("On {}.", session.hardware.in_words()));
    if done > 0 {
        let (planned, name) = (plural(session.planned() as u64, "point"), plan.output.display());
        say(&format!("Going on: {done} of {planned} are measured already, as {name} tells (--fresh starts over)."));
    }
    if !session.is_complete() && session.hardware.gpu_is_software && malloc_gives_back() {
        say(
            "The C library gives a software GPU's memory back between frames, which costs it time: before this command,",
        );
        say("MALLOC_TRIM_THRESHOLD_=2000000000 MALLOC_MMAP_THRESHOLD_=1000000000 lets it keep the memory.");
    }
    if !session.is_complete() {
        let mut pace = try_out(plan, &mut machine)?;
        let effort = Effort { repeats: plan.repeats, time_limit: plan.time_limit };
        let expected_s = announce(plan, &session, &machine, effort, &pace);
        write(&folder, &session)?;
        let progress = Progress::timed(expected_s, plan.quiet);
        measure_all(plan, &mut session, &mut machine, effort, &mut pace, &folder, &progress)?;
    }
    write(&folder, &session)?;

    for chapter in &session.chapters {
        terminal::print(&text(chapter))?;
    }
    say(&format!("{}: open it in a browser", plan.output.join(PAGE).display()));
    match session.failures() {
        0 => Ok(()),
        count => {
            bail!("{} could not be measured, see above; the same command tries again", plural(count as u64, "point"))
        }
    }
}

/// Whether the C library has its own way with memory that was freed: glibc's, unless it is told otherwise.
fn malloc_gives_back() -> bool {
    let is_told = |name| std::env::var_os(name).is_some();
    cfg!(all(target_os = "linux", target_env = "gnu"))
        && !(is_told("MALLOC_TRIM_THRESHOLD_") && is_told("MALLOC_MMAP_THRESHOLD_") || is_told("GLIBC_TUNABLES"))
}

/// What is to be measured, with no results yet.
fn chapters(plan: &BenchPlan) -> Vec<Chapter> {
    let series =
        plan.suites.iter().flat_map(|&suite| (suite.series)(machine::cores()).into_iter().map(move |s| (suite, s)));
    let whole_or_quick = |series: suite::Series| if plan.quick { series.quick() } else { series };
    series.map(|(suite, series)| Chapter { suite, series: whole_or_quick(series), results: Vec::new() }).collect()
}

/// Renders something small with every technique, to know the device's pace.
fn try_out(plan: &BenchPlan, machine: &mut Machine) -> anyhow::Result<Pace> {
    const LAYERS: f64 = 8.0;
    const SIZE: (u32, u32) = (320, 180);
    let progress = Progress::new(None, plan.quiet);
    progress.stage("trying out this device");
    let scene = pellucid::load("@grids:layers=8,tessellation=20")?.scene;
    let view = View::new(&scene, SIZE.0, SIZE.1);
    let pixels = f64::from(SIZE.0) * f64::from(SIZE.1);
    let work = Work::new(LAYERS * pixels, LAYERS * 800.0, LAYERS);
    let mut pace = Pace::default();
    for chapter in chapters(plan) {
        for variant in chapter.series.variants {
            if machine.refuses(chapter.suite, variant).is_some() || pace.predict(variant, &work, pixels).is_some() {
                continue;
            }
            // The first frames compile. What fails here fails at its points too, and is told there.
            let shaded = Some(Shaded { shader: Shader::PittedGlass, side: 512 });
            let frames: Result<Vec<_>, _> = (0..4).map(|_| machine.render(variant, shaded, &scene, &view)).collect();
            if let Some(ms) = frames.iter().flatten().map(|frame| frame.stats.total_ms).reduce(f64::min) {
                pace.learn(variant, &work, pixels, ms);
            }
        }
    }
    Ok(pace)
}

/// Says what will be done and how long it should take; the latter in seconds.
fn announce(plan: &BenchPlan, session: &Session, machine: &Machine, effort: Effort, pace: &Pace) -> f64 {
    let mut lines = Vec::new();
    let mut total_s = 0.0;
    for chapter in &session.chapters {
        let open: Vec<&Point> =
            chapter.series.points.iter().filter(|point| chapter.result(&point.label).is_none()).collect();
        let seconds: f64 = open.iter().map(|point| expected_s(chapter, point, machine, effort, pace)).sum();
        total_s += seconds;
        let name = format!("{}: {}", chapter.suite.name, chapter.series.title);
        let points = plural(open.len() as u64, "point");
        let left =
            if open.is_empty() { "measured already".to_owned() } else { format!("{points}, about {}", rough(seconds)) };
        lines.push(vec![name, left]);
    }
    if !plan.quiet {
        lines.push(vec!["in all".to_owned(), format!("about {}", rough(total_s))]);
        let limit = rough(effort.time_limit.as_secs_f64());
        let frames = plural(plan.repeats.into(), "frame");
        terminal::note(&format!("To measure, {frames} of each technique at each point, at most {limit} of each:"));
        terminal::note(table(&lines).trim_end());
        terminal::note("It can be stopped at any time; the same command goes on where it was.");
    }
    total_s
}

/// About how long a point takes.
fn expected_s(chapter: &Chapter, point: &Point, machine: &Machine, effort: Effort, pace: &Pace) -> f64 {
    /// Making or reading a scene.
    const LOADING_S: f64 = 0.5;
    let variants = chapter.series.variants.iter().filter(|&&variant| machine.refuses(chapter.suite, variant).is_none());
    let seconds = variants.map(|&variant| {
        let frame_ms = pace.predict(variant, &point.work, point.pixels()).unwrap_or(0.0);
        effort.expected(frame_ms).as_secs_f64()
    });
    LOADING_S + seconds.sum::<f64>()
}

/// `40 s`, `12 min`, `3.5 h`.
fn rough(seconds: f64) -> String {
    match seconds {
        ..90.0 => format!("{:.0} s", seconds.ceil()),
        ..5400.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}

/// Measures what is left to measure, and writes after each point.
fn measure_all(
    plan: &BenchPlan,
    session: &mut Session,
    machine: &mut Machine,
    effort: Effort,
    pace: &mut Pace,
    folder: &Folder,
    progress: &Progress,
) -> anyhow::Result<()> {
    let mut loaded: Option<(PathBuf, Scene)> = None;
    for number in 0..session.chapters.len() {
        for index in 0..session.chapters[number].series.points.len() {
            let chapter = &session.chapters[number];
            let point = &chapter.series.points[index];
            if chapter.result(&point.label).is_some() {
                continue;
            }
            progress.stage(format!("{} {}: {}", chapter.suite.name, chapter.series.name, point.label));
            let expected = expected_s(chapter, point, machine, effort, pace);
            let result = measure_point(plan, chapter, point, machine, effort, pace, &mut loaded);
            if !result.is_final() {
                // A device that failed is not trusted with more.
                machine.forget(true);
            }
            session.chapters[number].insert(result);
            write(folder, session)?;
            progress.advance(expected);
        }
        machine.forget(false);
    }
    Ok(())
}

/// Loads a point's scene, unless it is there from the point before, and measures.
fn measure_point(
    plan: &BenchPlan,
    chapter: &Chapter,
    point: &Point,
    machine: &mut Machine,
    effort: Effort,
    pace: &mut Pace,
    loaded: &mut Option<(PathBuf, Scene)>,
) -> PointResult {
    let (source, stands_in) = point.source.resolve(plan.scenes.as_deref());
    let mut result = PointResult::new(point, shown(&source, plan.scenes.as_deref()), stands_in);
    let prepared = scene(&source, loaded).and_then(|scene| Ok((view(point, scene, stands_in)?, scene)));
    match prepared {
        Ok((view, scene)) => {
            let chapter = (chapter.suite, &chapter.series, point);
            measure(chapter, machine, (scene, &view), effort, pace, &mut result);
        }
        Err(error) => {
            let failed = |&variant| Measurement::new(variant, Outcome::Failed { reason: error.to_string() });
            result.results = chapter.series.variants.iter().map(failed).collect();
        }
    }
    result
}

fn scene<'a>(source: &Path, loaded: &'a mut Option<(PathBuf, Scene)>) -> anyhow::Result<&'a Scene> {
    if loaded.as_ref().is_none_or(|(name, _)| name != source) {
        // Two scenes at once would take the memory of both.
        *loaded = None;
        let scene = match source.to_str() {
            Some(name) => pellucid::load(name)?.scene,
            None => pellucid::load_file(source)?.scene,
        };
        *loaded = Some((source.to_owned(), scene));
    }
    match loaded {
        Some((_, scene)) => Ok(scene),
        None => bail!("'{}' was not loaded", source.display()),
    }
}

fn view(point: &Point, scene: &Scene, stands_in: bool) -> anyhow::Result<View> {
    let (width, height) = point.size;
    let aspect = width as f32 / height as f32;
    // A place in one scene means nothing in another.
    let look = if stands_in && point.look.eye.is_some() { Default::default() } else { point.look };
    let camera = look.camera(scene, aspect);
    let view = View { camera, ..View::new(scene, width, height).opacity(point.opacity) };
    view.check()?;
    Ok(view)
}

/// The scene without the folder, which is another one on every machine.
fn shown(source: &Path, scenes: Option<&Path>) -> String {
    let inside = scenes.and_then(|folder| source.strip_prefix(folder).ok());
    inside.unwrap_or(source).display().to_string()
}

/// All documents, each whole or not at all.
fn write(folder: &Folder, session: &Session) -> anyhow::Result<()> {
    folder.write(JSON, session.to_json()?.as_bytes())?;
    folder.write(CSV, &session.to_csv()?)?;
    folder.write(PAGE, report::page(session)?.as_bytes())
}

/// A series as text.
fn text(chapter: &Chapter) -> String {
    let mut text = format!("{}: {}\n", chapter.suite.name, chapter.series.title);
    for exhibit in exhibit::exhibits(chapter) {
        text += &format!("\n{}\n{}", exhibit.title, table(&exhibit.table));
    }
    let remarks = exhibit::remarks(chapter);
    if !remarks.is_empty() {
        text += &format!("\n{}\n", remarks.join("\n"));
    }
    if let Some(published) = &chapter.series.published {
        text += &format!("\n{}", published_text(published));
    }
    text + "\n\n"
}

fn published_text(published: &Published) -> String {
    let Published { source, hardware, heading, rows, remarks } = published;
    let mut text = format!("As published, on other hardware: {source}; {hardware}\n");
    let cells = |row: &[&str]| row.iter().map(|cell| (*cell).to_owned()).collect::<Vec<String>>();
    if !rows.is_empty() {
        let rows: Vec<Vec<String>> = [*heading].into_iter().chain(rows.iter().copied()).map(cells).collect();
        text += &table(&rows);
    }
    for remark in *remarks {
        text += &format!("{remark}\n");
    }
    text
}
