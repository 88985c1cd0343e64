//! `pellucid compare`: one view rendered with several techniques, what they show, take and hold, and a report to look at.
//!
//! In order: the reference (`reference`), what its layers alone show (`observation`), each technique's picture and
//! figures (`measure`), and what is said of them: `document` as JSON, CSV and text, `report` as a page.

mod document;
mod measure;
mod observation;
mod pictures;
mod reference;
mod report;
mod spots;

use anyhow::Context;
use pellucid::{Image, Resolve, Technique};

use crate::args::UNSORTED;
use crate::commands::folder::Folder;
use crate::commands::{warn_about, warn_about_dropped};
use crate::plan::{ComparePlan, Compared};
use crate::progress::Progress;
use crate::report::to_json;
use crate::words::plural;
use crate::{legend, terminal};
use document::Document;
use measure::{Measured, measure};
use observation::Observation;
use reference::Reference;

pub(crate) fn run(plan: &ComparePlan) -> anyhow::Result<()> {
    let folder = Folder::open(&plan.output)?;
    let progress = Progress::new(None, plan.quiet);
    progress.stage("loading");
    let loaded = plan.scene.load()?;
    let view = plan.view.of(&loaded.scene)?;
    let scene = &loaded.scene;
    if !plan.quiet {
        progress.suspend(|| warn_about(&loaded.warnings));
    }

    let named: Vec<Technique> = plan.compared.iter().filter_map(|compared| compared.technique()).collect();
    let is_usual = |technique| {
        let serves = Compared::Technique(technique).serves(plan.resolve);
        plan.compared.is_empty() && technique != Technique::Oracle && serves
    };
    let devices = plan.device.open(&named, is_usual)?;
    let mut compared = plan.compared.clone();
    if compared.is_empty() {
        compared.extend(Some(Compared::Unsorted).filter(|unsorted| unsorted.serves(plan.resolve)));
        compared.extend(devices.techniques.iter().map(|&technique| Compared::Technique(technique)));
    }

    let technique = plan.reference.unwrap_or_else(|| reference::usual(scene, &view));
    let minutes = reference::oracle_minutes(scene, &view);
    if technique == Technique::Oracle && minutes > 0 {
        let sentence = format!(
            "the oracle tests every triangle against every pixel, here for some {}; `--reference cpu` is as exact",
            plural(minutes, "minute")
        );
        progress.suspend(|| terminal::warn(&sentence));
    }
    progress.stage(format!("rendering the reference ({technique})"));
    let reference = Reference::capture(technique, plan.device.cpu(), scene, &view, plan.resolve)?;
    progress.stage("looking at its layers");
    let observation = Observation::of(&reference, scene, &view)?;

    folder.save("reference.png", reference.image())?;
    let mut measured: Vec<Measured> = Vec::new();
    let mut renderer = devices.renderer;
    for compared in compared {
        progress.stage(format!("rendering: {}", compared.name()));
        if let Compared::Technique(technique) = compared {
            renderer = renderer.technique(technique);
        }
        let result = measure(compared, &renderer, (scene, &view, plan.resolve), &reference, &observation);
        let result = result.with_context(|| format!("technique '{}' could not render this view", compared.name()))?;
        folder.save(&format!("{}.png", compared.name()), &result.image)?;
        folder.save(&format!("{}-error.png", compared.name()), &pictures::error_map(&result))?;
        measured.push(result);
    }

    progress.stage("writing");
    let exact = reference.technique().name();
    folder.save(
        "split.png",
        &pictures::split(left_of(&measured, &observation, plan.resolve), (reference.image(), exact)),
    )?;
    folder.save("complexity.png", &pictures::complexity(&observation, legend::FRAGMENTS))?;
    folder.save("layers.png", &observation.layers.strip())?;

    let document =
        Document::new((&plan.scene.to_string(), scene), &view, plan.resolve, &reference, &observation, &measured)?;
    let json = to_json(&document)?;
    folder.write("compare.json", json.as_bytes())?;
    folder.write("compare.csv", document.to_csv().as_bytes())?;
    folder.write("index.html", report::page(&document, &folder)?.as_bytes())?;
    drop(progress);

    terminal::print(&document.to_text())?;
    if !plan.quiet {
        warn_about_dropped(reference.stats());
        if let Some(reason) = devices.without_gpu {
            terminal::note(&format!("GPU techniques were left out: {reason}"));
        }
        terminal::note(&format!("{}: open it in a browser", plan.output.join("index.html").display()));
    }
    Ok(())
}

/// What stands on the left of the split picture: hardware blending where it was rendered, else its equal. What is not
/// blended has nothing unsorted to show; then it is the first technique.
fn left_of<'a>(measured: &'a [Measured], observation: &'a Observation, resolve: Resolve) -> (&'a Image, &'static str) {
    let is_alpha = |measured: &&Measured| measured.compared == Compared::Technique(Technique::Alpha);
    let left = measured.iter().find(is_alpha).or(measured.first().filter(|_| resolve != Resolve::Blend));
    left.map_or((&observation.unsorted, UNSORTED), |measured| (&measured.image, measured.compared.name()))
}
