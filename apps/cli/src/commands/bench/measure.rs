//! One point: every variant warmed up, then measured in turns, so that a machine that grows warm or busy treats all of
//! them alike.

use std::time::{Duration, Instant};

use pellucid::{Error, Scene, View};

use super::machine::Machine;
use super::pace::Pace;
use super::results::{Figures, Measurement, Outcome, PointResult, Timed};
use super::suite::{Point, Series, Shaded, Show, Suite};
use super::variant::Variant;
use crate::words::duration;

/// How much is measured.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// Frames of a variant.
    pub(super) repeats: u32,
    /// Most that a variant may take.
    pub(super) time_limit: Duration,
}

/// Turns in which the frames of a variant are measured.
const TURNS: u32 = 3;
/// Frames without which nothing is measured: one to warm up, one to settle in at the beginning of a turn, one that counts.
const LEAST_FRAMES: u32 = 3;

/// A variant while it is measured.
struct Candidate {
    variant: Variant,
    shaded: Option<Shaded>,
    frames: Vec<Timed>,
    /// Of a frame, as last seen.
    ms: f64,
    spent: Duration,
    /// Why it is over before its time.
    end: Option<Outcome>,
    /// Of the finished picture, where that is asked.
    wrong_pixels: Option<u64>,
}

impl Effort {
    /// About how long a variant will take, given its frames.
    pub(super) fn expected(&self, frame_ms: f64) -> Duration {
        let frames = f64::from(1 + TURNS + self.repeats);
        let all = frame_ms * frames / 1e3;
        let limit = self.time_limit.as_secs_f64();
        Duration::from_secs_f64(if self.is_too_slow(frame_ms) { 0.0 } else { all.min(limit) })
    }

    fn is_too_slow(&self, frame_ms: f64) -> bool {
        frame_ms * f64::from(LEAST_FRAMES) > self.time_limit.as_secs_f64() * 1e3
    }

    fn skipped(&self, frame_ms: f64, how: &str) -> Outcome {
        let (frame, limit) = (duration(frame_ms), duration(self.time_limit.as_secs_f64() * 1e3));
        Outcome::Skipped {
            reason: format!("{how} {frame} a frame, and {LEAST_FRAMES} of them have to fit into the limit of {limit}"),
        }
    }
}

/// Measures all variants of a series at a point, in a scene that is loaded.
pub(super) fn measure(
    (suite, series, point): (&Suite, &Series, &Point),
    machine: &mut Machine,
    (scene, view): (&Scene, &View),
    effort: Effort,
    pace: &mut Pace,
    result: &mut PointResult,
) {
    let mut candidates: Vec<Candidate> =
        series.variants.iter().map(|&variant| Candidate::new(variant, point.shaded)).collect();
    for candidate in &mut candidates {
        let variant = candidate.variant;
        let predicted = pace.predict(variant, &point.work, point.pixels()).unwrap_or(0.0);
        if let Some(reason) = machine.refuses(suite, variant) {
            candidate.end = Some(Outcome::Skipped { reason });
        } else if effort.is_too_slow(predicted) {
            candidate.end = Some(effort.skipped(predicted, "would take some"));
        } else if let Some(frame) = candidate.warm_up(machine, (scene, view), effort) {
            result.learn(&frame);
            if effort.is_too_slow(frame.stats.total_ms) {
                candidate.end = Some(effort.skipped(frame.stats.total_ms, "took"));
            }
        }
    }
    let mut last = candidates.iter().rev().find(|candidate| candidate.end.is_none()).map(|last| last.variant);
    for turn in 0..TURNS {
        for candidate in candidates.iter_mut().filter(|candidate| candidate.end.is_none()) {
            let wanted = share_of(effort.repeats, turn);
            // What a GPU technique keeps is gone once another has had its turn.
            if wanted > 0 && last.replace(candidate.variant) != Some(candidate.variant) && candidate.has_time(effort, 2)
            {
                candidate.render(machine, scene, view);
            }
            for _ in 0..wanted {
                // One frame at least, whatever it takes.
                if candidate.end.is_some() || !(candidate.frames.is_empty() || candidate.has_time(effort, 1)) {
                    break;
                }
                let frame = candidate.render(machine, scene, view);
                candidate.frames.extend(frame);
            }
        }
    }
    if series.shows.contains(&Show::Wrong) {
        for candidate in candidates.iter_mut().filter(|candidate| candidate.end.is_none()) {
            match machine.wrong_pixels(candidate.variant, scene, view) {
                Ok(pixels) => candidate.wrong_pixels = pixels,
                Err(error) => candidate.end = Some(Outcome::Failed { reason: error.to_string() }),
            }
        }
    }
    for candidate in candidates {
        let variant = candidate.variant;
        let outcome = candidate.outcome();
        if let Outcome::Measured(figures) = &outcome {
            pace.learn(variant, &point.work, point.pixels(), figures.median_ms);
        }
        result.results.push(Measurement::new(variant, outcome));
    }
    result.compare_with_alpha();
}

/// The part of so many frames that is measured in a turn.
fn share_of(repeats: u32, turn: u32) -> u32 {
    (repeats + TURNS - 1 - turn) / TURNS
}

impl Candidate {
    fn new(variant: Variant, shaded: Option<Shaded>) -> Self {
        Self { variant, shaded, frames: Vec::new(), ms: 0.0, spent: Duration::ZERO, end: None, wrong_pixels: None }
    }

    /// Renders a frame. `None`: it failed, and that is the end.
    fn render(&mut self, machine: &mut Machine, scene: &Scene, view: &View) -> Option<Timed> {
        let start = Instant::now();
        let rendered: Result<Timed, Error> = machine.render(self.variant, self.shaded, scene, view);
        let took = start.elapsed();
        self.spent += took;
        self.ms = took.as_secs_f64() * 1e3;
        match rendered {
            Ok(frame) => Some(frame),
            Err(error) => {
                self.end = Some(Outcome::Failed { reason: error.to_string() });
                None
            }
        }
    }

    /// The first frame; if it was slow, another one where there is time: the first also compiles and allocates.
    fn warm_up(&mut self, machine: &mut Machine, (scene, view): (&Scene, &View), effort: Effort) -> Option<Timed> {
        let first = self.render(machine, scene, view)?;
        if effort.is_too_slow(first.stats.total_ms) && self.has_time(effort, 1) {
            return self.render(machine, scene, view);
        }
        Some(first)
    }

    /// Whether so many frames more fit into the time.
    fn has_time(&self, effort: Effort, frames: u32) -> bool {
        self.spent + Duration::from_secs_f64(self.ms * 1e-3) * frames <= effort.time_limit
    }

    fn outcome(self) -> Outcome {
        let nothing = Outcome::Skipped { reason: "no frame was measured".into() };
        self.end.unwrap_or_else(|| {
            Figures::new(&self.frames, self.wrong_pixels)
                .map_or(nothing, |figures| Outcome::Measured(Box::new(figures)))
        })
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use pellucid::Technique;

    use super::*;
    use crate::args::{Args, Command};
    use crate::commands::bench::pace::Work;
    use crate::commands::bench::suite::Source;
    use crate::commands::bench::suites::SUITES;
    use crate::plan::BenchPlan;

    #[test]
    fn turns_share_the_frames() {
        for repeats in [1, 2, 3, 7, 15] {
            assert_eq!((0..TURNS).map(|turn| share_of(repeats, turn)).sum::<u32>(), repeats);
        }
    }

    /// What is measured of a small scene by a machine whose CPU renderer took so long for it before.
    fn measured(known_ms: f64, scene: &str) -> PointResult {
        let Command::Bench(args) =
            Args::try_parse_from(["pellucid", "bench", "-o", "out", "--backend", "cpu"]).unwrap().command
        else {
            unreachable!()
        };
        let plan = BenchPlan::new(*args).unwrap();
        let scene = pellucid::load(scene).unwrap().scene;
        let work = Work::new(1e5, 100.0, 10.0);
        let point = Point::new("point", Source::BuiltIn("@boxes:n=2".into()), work).size(32, 16);
        let variants = [Technique::Cpu, Technique::Alpha].map(Variant::of).to_vec();
        let series = Series {
            name: "series",
            title: "",
            about: "",
            axis: None,
            variants,
            points: vec![point.clone()],
            shows: &[],
            published: None,
        };
        let mut pace = Pace::default();
        pace.learn(Variant::of(Technique::Cpu), &work, point.pixels(), known_ms);
        let mut result = PointResult::new(&point, "@boxes:n=2".into(), false);
        let effort = Effort { repeats: 5, time_limit: Duration::from_secs(30) };
        let view = View::new(&scene, 32, 16);
        let mut machine = Machine::open(&plan).unwrap();
        measure((&SUITES[0], &series, &point), &mut machine, (&scene, &view), effort, &mut pace, &mut result);
        result
    }

    #[test]
    fn as_many_frames_as_asked_for_count_and_none_without_a_device() {
        let result = measured(1.0, "@boxes:n=2");
        let [cpu, alpha] = &result.results[..] else { panic!() };
        assert_eq!(cpu.figures().map(|figures| (figures.frames, figures.samples_ms.len())), Some((5, 5)));
        assert!(matches!(&alpha.outcome, Outcome::Skipped { reason } if reason.contains("--backend cpu")));
        assert_eq!(result.triangles, Some(96));
    }

    #[test]
    fn what_would_take_too_long_is_skipped_unseen_with_a_reason() {
        let result = measured(20_000.0, "@boxes:n=2");
        let Outcome::Skipped { reason } = &result.results[0].outcome else { panic!() };
        assert!(reason.starts_with("would take some 20.0 s a frame"), "{reason}");
        // Nothing was rendered at all.
        assert_eq!(result.triangles, None);
    }

    #[test]
    fn what_cannot_do_a_few_frames_in_time_is_left_out() {
        let effort = Effort { repeats: 15, time_limit: Duration::from_secs(30) };
        assert!(!effort.is_too_slow(10_000.0) && effort.is_too_slow(10_001.0));
        assert_eq!(effort.expected(10_001.0), Duration::ZERO);
        assert_eq!(effort.expected(100.0), Duration::from_secs_f64(1.9));
        assert_eq!(effort.expected(5_000.0), Duration::from_secs(30));
    }
}
