//! `pellucid verify`: this device against the oracle.

use std::time::Instant;

use anyhow::bail;
use pellucid::{Error, Technique};
use pellucid_conformance::images::Comparison;
use pellucid_conformance::suite::{CASES, Candidate, Case, Check, prepare_all};
use serde::Serialize;

use crate::plan::VerifyPlan;
use crate::progress::Progress;
use crate::report::{SCHEMA, to_json};
use crate::terminal;
use crate::words::{duration, full_count, plural};

#[derive(Serialize)]
struct Report {
    schema: u32,
    command: &'static str,
    version: &'static str,
    passes: bool,
    checks: u64,
    failures: u64,
    techniques: Vec<&'static str>,
    results: Vec<Row>,
}

/// One check of one technique.
#[derive(Serialize)]
struct Row {
    scene: &'static str,
    view: &'static str,
    width: u32,
    height: u32,
    technique: &'static str,
    check: String,
    /// `None` if it could not even render.
    #[serde(flatten)]
    counts: Option<Counts>,
    error: Option<String>,
    passes: bool,
}

#[derive(Serialize)]
struct Counts {
    agreeing: u64,
    ambiguous: u64,
    unexplained: u64,
    covered: u64,
    worst: Option<Worst>,
}

#[derive(Serialize)]
struct Worst {
    x: u32,
    y: u32,
    /// In 0..=1; `None` if the fragments themselves are not the same.
    difference: Option<f32>,
}

pub(crate) fn run(plan: VerifyPlan) -> anyhow::Result<()> {
    let start = Instant::now();
    let devices =
        plan.device.open(&plan.techniques, |technique| technique.is_exact() && technique != Technique::Oracle)?;
    let mut results = Vec::new();
    if !plan.json {
        terminal::print(&heading())?;
    }
    let progress = Progress::new(None, plan.json);
    progress.stage("asking the oracle");
    let prepared = prepare_all()?;
    drop(progress);

    let mut candidate = Candidate::new(Technique::Cpu, devices.renderer);
    for &technique in &devices.techniques {
        candidate = candidate.technique(technique);
        for (case, prepared) in &prepared {
            for check in Check::ALL {
                let row = Row::new(case, technique, check, prepared.run(check, &candidate));
                if !plan.json {
                    terminal::print(&row.to_text())?;
                }
                results.push(row);
            }
        }
    }

    let (checks, failures) = (results.len() as u64, results.iter().filter(|row| !row.passes).count() as u64);
    let techniques: Vec<&str> = devices.techniques.iter().map(|technique| technique.name()).collect();
    if plan.json {
        let version = env!("CARGO_PKG_VERSION");
        let passes = failures == 0;
        let report =
            Report { schema: SCHEMA, command: "verify", version, passes, checks, failures, techniques, results };
        terminal::print(&to_json(&report)?)?;
    } else {
        let took = duration(start.elapsed().as_secs_f64() * 1e3);
        let passed = full_count(checks - failures);
        let names = techniques.join(", ");
        terminal::print(&format!("\n{passed} of {} passed in {took} ({names})\n", plural(checks, "check")))?;
    }
    if let Some(reason) = devices.without_gpu {
        terminal::note(&format!("the GPU was not verified: {reason}"));
    }
    if failures > 0 {
        bail!("{} failed: this device or build does not keep the contract", plural(failures, "check"));
    }
    Ok(())
}

impl Row {
    fn new(case: &Case, technique: Technique, check: Check, outcome: Result<Comparison, Error>) -> Self {
        let (counts, error, passes) = match outcome {
            Ok(comparison) => (Some(Counts::from(&comparison)), None, comparison.passes()),
            Err(error) => (None, Some(error.to_string()), false),
        };
        let Case { source: scene, view, size: (width, height), .. } = *case;
        Self {
            scene,
            view,
            width,
            height,
            technique: technique.name(),
            check: check.to_string(),
            counts,
            error,
            passes,
        }
    }

    fn to_text(&self) -> String {
        let verdict = if self.passes { "pass" } else { "FAIL" };
        let [agreeing, ambiguous, unexplained] = match &self.counts {
            Some(Counts { agreeing, ambiguous, unexplained, .. }) => {
                [agreeing, ambiguous, unexplained].map(|&n| full_count(n))
            }
            None => ["-"; 3].map(str::to_owned),
        };
        let detail = match &self.counts {
            Some(Counts { worst: Some(worst), .. }) if !self.passes => format!("  worst at {}, {}", worst.x, worst.y),
            _ => self.error.as_ref().map_or_else(String::new, |error| format!("  {error}")),
        };
        let size = format!("{} x {}", self.width, self.height);
        line([self.scene, self.view, &size, self.technique, &self.check, &agreeing, &ambiguous, &unexplained])
            + &format!("  {verdict}{detail}\n")
    }
}

impl From<&Comparison> for Counts {
    fn from(comparison: &Comparison) -> Self {
        let Comparison { agreeing, ambiguous, unexplained, covered, worst } = *comparison;
        let worst =
            worst.map(|(x, y, difference)| Worst { x, y, difference: Some(difference).filter(|d| d.is_finite()) });
        Self { agreeing, ambiguous, unexplained, covered, worst }
    }
}

fn heading() -> String {
    line(["scene", "view", "size", "technique", "check", "agreeing", "ambiguous", "unexplained"]) + "\n"
}

fn line([scene, view, size, technique, check, agreeing, ambiguous, unexplained]: [&str; 8]) -> String {
    let longest = |names: &mut dyn Iterator<Item = &'static str>| names.map(str::len).max().unwrap_or(0);
    let scenes = longest(&mut CASES.iter().map(|case| case.source));
    let views = longest(&mut CASES.iter().map(|case| case.view));
    format!(
        "{scene:scenes$}  {view:views$}  {size:8}  {technique:9}  {check:15}  {agreeing:>8}  {ambiguous:>9}  {unexplained:>11}"
    )
}
