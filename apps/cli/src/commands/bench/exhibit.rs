//! How results are shown: tables, for the terminal and the page alike, and what is plotted beside them.

use super::document::Chapter;
use super::fit::{PowerLaw, power_law};
use super::results::{Figures, PointResult};
use super::samples::geometric_mean;
use super::suite::Show;
use crate::words::{figure, full_count, memory, short_count};

/// One table, with a plot where that says more.
pub(super) struct Exhibit {
    pub(super) title: String,
    /// The first row is the heading.
    pub(super) table: Vec<Vec<String>>,
    pub(super) plot: Option<Plot>,
}

/// What is drawn.
pub(super) struct Plot {
    /// What the values are.
    pub(super) values: String,
    /// Whether values span powers of ten.
    pub(super) is_log: bool,
    pub(super) form: Form,
}

pub(super) enum Form {
    /// Values over an axis, a line for each name.
    Lines { axis: String, is_log_axis: bool, lines: Vec<(String, Vec<(f64, f64)>)> },
    /// A row for each label, with a value of each name.
    Rows { rows: Vec<(String, Vec<(String, f64)>)> },
    /// A bar for each label, made of parts with names.
    Bars { bars: Vec<(String, Vec<(String, f64)>)> },
}

const NONE: &str = "-";

/// All that is shown of a series.
pub(super) fn exhibits(chapter: &Chapter) -> Vec<Exhibit> {
    let has_figures = |result: &PointResult| result.results.iter().any(|result| result.figures().is_some());
    if !chapter.results.iter().any(has_figures) {
        return Vec::new();
    }
    chapter.series.shows.iter().flat_map(|&show| exhibit(chapter, show)).collect()
}

/// What is to be said besides: why figures are missing, what stands in for what, what was captured in parts.
pub(super) fn remarks(chapter: &Chapter) -> Vec<String> {
    let stand_ins = chapter.results.iter().filter(|point| point.stands_in);
    let stand_ins =
        stand_ins.map(|point| format!("{}: {} stands in for a file that is not there", point.label, point.scene));
    missing(chapter).into_iter().chain(stand_ins).chain(chapter.results.iter().filter_map(windows)).collect()
}

/// Why figures are missing, each reason once.
fn missing(chapter: &Chapter) -> Vec<String> {
    let mut reasons: Vec<&str> = Vec::new();
    for reason in chapter.results.iter().flat_map(|point| &point.results).filter_map(|result| result.reason()) {
        if !reasons.contains(&reason) {
            reasons.push(reason);
        }
    }
    let labels = |name: &str, reason: &str| -> Vec<&str> {
        let is_so = |point: &&PointResult| {
            point.results.iter().any(|result| result.name == name && result.reason() == Some(reason))
        };
        chapter.results.iter().filter(is_so).map(|point| &*point.label).collect()
    };
    let sentence = |reason: &str| {
        let what = chapter.names().into_iter().filter_map(|name| match labels(&name, reason) {
            labels if labels.is_empty() => None,
            labels if labels.len() == chapter.results.len() => Some(name),
            labels => Some(format!("{name} at {}", labels.join(", "))),
        });
        format!("not measured: {}: {reason}", what.collect::<Vec<_>>().join("; "))
    };
    reasons.into_iter().map(sentence).collect()
}

/// Which techniques captured a point in windows of the picture.
fn windows(point: &PointResult) -> Option<String> {
    let windows = point.results.iter().filter_map(|result| Some((&result.name, result.figures()?.windows)));
    let split: Vec<String> =
        windows.filter(|(_, count)| *count > 1).map(|(name, count)| format!("{name} in {count}")).collect();
    (!split.is_empty()).then(|| format!("{}: captured in windows of the picture: {}", point.label, split.join("; ")))
}

/// The power laws of time over the axis, by the variant's name.
pub(super) fn laws(chapter: &Chapter) -> Vec<(String, PowerLaw)> {
    if !chapter.series.shows.contains(&Show::Exponents) {
        return Vec::new();
    }
    let lines = chapter.lines(|figures, _| figures.median_ms);
    lines.into_iter().filter_map(|(name, points)| Some((name, power_law(&points)?))).collect()
}

fn exhibit(chapter: &Chapter, show: Show) -> Vec<Exhibit> {
    match show {
        Show::Times => vec![times(chapter)],
        Show::Ratios => ratios(chapter),
        Show::Rates => vec![rates(chapter)],
        Show::Steps => chapter.results.iter().filter_map(|point| steps(chapter, point)).collect(),
        Show::SortShares => sort_shares(chapter),
        Show::Memory => vec![bytes(chapter)],
        Show::UnitCosts => unit_costs(chapter),
        Show::Cuts => cuts(chapter),
        Show::HalfBlocks => half_blocks(chapter),
        Show::Wrong => wrong(chapter),
        Show::Exponents => exponents(chapter),
        Show::Speedups => speedups(chapter),
        Show::Peers => peers(chapter),
        Show::Submissions => submissions(chapter),
        Show::Through => through(chapter),
    }
}

fn times(chapter: &Chapter) -> Exhibit {
    let mut table = vec![chapter.heading("point", &["fragments", "deepest"])];
    for point in &chapter.results {
        let facts = [
            point.fragments.map_or_else(none, short_count),
            point.max_depth_complexity.map_or_else(none, |count| full_count(count.into())),
        ];
        let cell = |figures: &Figures| format!("{} ±{:.0} %", figure(figures.median_ms), 100.0 * figures.spread());
        table.push(chapter.row(point, &facts, cell));
    }
    let title = "Milliseconds a frame, median and half the distance of the quartiles".into();
    Exhibit { title, table, plot: chapter.plot("milliseconds a frame", true, |figures, _| Some(figures.median_ms)) }
}

fn ratios(chapter: &Chapter) -> Vec<Exhibit> {
    let any = chapter.results.iter().any(|point| point.figures("alpha").is_some());
    let cell = |figures: &Figures| figures.alpha_ratio.map_or_else(none, |ratio| format!("{} x", figure(ratio)));
    let exhibit = || Exhibit {
        title: "Time over that of alpha, which blends without sorting".into(),
        table: chapter.matrix(cell),
        plot: chapter.plot("time over that of alpha", true, |figures, _| figures.alpha_ratio),
    };
    any.then(exhibit).into_iter().collect()
}

fn rates(chapter: &Chapter) -> Exhibit {
    let rate = |figures: &Figures| 1e3 / figures.median_ms;
    Exhibit {
        title: "Frames a second".into(),
        table: chapter.matrix(|figures| figure(rate(figures))),
        plot: chapter.plot("frames a second", true, |figures, _| Some(rate(figures))),
    }
}

fn steps(chapter: &Chapter, point: &PointResult) -> Option<Exhibit> {
    let measured: Vec<(&str, &Figures)> =
        point.results.iter().filter_map(|result| Some((&*result.name, result.figures()?))).collect();
    let mut names: Vec<&str> = Vec::new();
    for (_, figures) in &measured {
        for step in &figures.steps {
            if !names.contains(&&*step.name) {
                names.push(&step.name);
            }
        }
    }
    names.sort_by_key(|name| STEP_ORDER.iter().position(|known| known == name).unwrap_or(STEP_ORDER.len()));
    let time = |figures: &Figures, name: &str| figures.steps.iter().find(|step| step.name == name).map(|step| step.ms);
    let mut table = vec![heading(&point.label, measured.iter().map(|(name, _)| (*name).to_owned()))];
    for name in &names {
        let cells = measured.iter().map(|(_, figures)| time(figures, name).map_or_else(String::new, figure));
        table.push(heading(name, cells));
    }
    table.push(heading("whole frame", measured.iter().map(|(_, figures)| figure(figures.median_ms))));
    let bar = |(name, figures): &(&str, &Figures)| {
        let parts = names.iter().filter_map(|step| Some(((*step).to_owned(), time(figures, step)?)));
        ((*name).to_owned(), parts.collect::<Vec<_>>())
    };
    let bars = measured.iter().map(bar).collect();
    let title = match chapter.results.len() {
        1 => "Steps, milliseconds".into(),
        _ => format!("Steps of {}, milliseconds", point.label),
    };
    let plot = Plot { values: "milliseconds".into(), is_log: false, form: Form::Bars { bars } };
    (!measured.is_empty()).then_some(Exhibit { title, table, plot: Some(plot) })
}

/// Steps in the order of a frame, whichever technique has them.
const STEP_ORDER: [&str; 25] = [
    "transform, setup and bin",
    "raster",
    "order",
    "shade and resolve",
    "geometry",
    "opaque",
    "set-up",
    "bins",
    "lists",
    "hide",
    "cover",
    "shade",
    "passes",
    "blend",
    "compose",
    "zero",
    "count render",
    "prefix sums",
    "main render",
    "greatest count",
    "gather",
    "sort",
    "classify",
    "read and blend",
    "repair",
];

fn sort_shares(chapter: &Chapter) -> Vec<Exhibit> {
    let share = |figures: &Figures| {
        let all: f64 = figures.steps.iter().map(|step| step.ms).sum();
        let sort = figures.steps.iter().find(|step| step.name == "sort").map(|step| step.ms);
        sort.map(|sort| 100.0 * sort / all)
    };
    let any = chapter.results.iter().flat_map(|point| &point.results).filter_map(|result| result.figures());
    let exhibit = || Exhibit {
        title: "Share of sorting in the timed steps".into(),
        table: chapter.matrix(|figures| share(figures).map_or_else(none, |share| format!("{share:.0} %"))),
        plot: chapter.plot("sorting, percent of the steps", false, |figures, _| share(figures)),
    };
    any.filter_map(share).next().map(|_| exhibit()).into_iter().collect()
}

fn bytes(chapter: &Chapter) -> Exhibit {
    Exhibit {
        title: "Most memory held besides scene and picture".into(),
        table: chapter.matrix(|figures| memory(figures.peak_bytes)),
        plot: chapter
            .plot("MiB", true, |figures, _| Some(figures.peak_bytes as f64 / f64::from(1 << 20)).filter(|v| *v > 0.0)),
    }
}

fn unit_costs(chapter: &Chapter) -> Vec<Exhibit> {
    let Some(axis) = chapter.series.axis else { return Vec::new() };
    let cost = |figures: &Figures, x: f64| figures.median_ms * 1e6 / x;
    let mut table = vec![chapter.heading(axis.name, &[])];
    for point in &chapter.results {
        let x = point.x.unwrap_or(f64::NAN);
        let mut row = chapter.row(point, &[], |figures| figure(cost(figures, x)));
        row[0] = short_count(x as u64);
        table.push(row);
    }
    let title = format!("Nanoseconds a {}", axis.unit);
    let plot = chapter.plot(&format!("nanoseconds a {}", axis.unit), true, |figures, x| Some(cost(figures, x?)));
    vec![Exhibit { title, table, plot }]
}

fn cuts(chapter: &Chapter) -> Vec<Exhibit> {
    let cell = |figures: &Figures| match (figures.exact, figures.cut_pixels) {
        (_, cut @ 1..) => full_count(cut),
        (true, 0) => "exact".to_owned(),
        (false, 0) => "unsorted".to_owned(),
    };
    vec![Exhibit { title: "Pixels where layers were cut off".into(), table: chapter.matrix(cell), plot: None }]
}

fn half_blocks(chapter: &Chapter) -> Vec<Exhibit> {
    let mut table = vec![heading("point", ["fragments", "parts of triangles", "samples a part"].map(str::to_owned))];
    for point in &chapter.results {
        let parts = point.results.iter().filter_map(|result| result.figures()?.half_block_parts).next();
        if let (Some(fragments), Some(parts)) = (point.fragments, parts) {
            let samples = format!("{:.2}", fragments as f64 / parts.max(1) as f64);
            table.push(heading(&point.label, [short_count(fragments), short_count(parts), samples]));
        }
    }
    let title = "Samples of a triangle in a half-block of 8 x 4 pixels".into();
    if table.len() < 2 { Vec::new() } else { vec![Exhibit { title, table, plot: None }] }
}

/// Of variants with a depth filter: pixels that it leaves out of order, before they are mended and after.
fn wrong(chapter: &Chapter) -> Vec<Exhibit> {
    let has_filter = |name: &String| {
        let mut figures = chapter.results.iter().filter_map(|point| point.figures(name));
        figures.any(|figures| figures.repaired_pixels.is_some())
    };
    let names: Vec<String> = chapter.names().into_iter().filter(has_filter).collect();
    let mut table = vec![heading("point", names.iter().map(|name| format!("{name}: before, after")))];
    for point in &chapter.results {
        let pixels = f64::from(point.width) * f64::from(point.height);
        let cell = |name: &String| {
            let counts = point.figures(name).and_then(|figures| figures.repaired_pixels.zip(figures.wrong_pixels));
            counts.map_or_else(none, |(before, after)| {
                let percent = 100.0 * before as f64 / pixels;
                format!("{} ({percent:.3} %), {}", full_count(before), full_count(after))
            })
        };
        table.push(heading(&point.label, names.iter().map(cell)));
    }
    let title = "Wrong pixels: out of order after the depth filter, and in the finished picture".into();
    if names.is_empty() { Vec::new() } else { vec![Exhibit { title, table, plot: None }] }
}

fn exponents(chapter: &Chapter) -> Vec<Exhibit> {
    let (laws, Some(axis)) = (laws(chapter), chapter.series.axis) else { return Vec::new() };
    let mut table = vec![heading("technique", ["exponent", "R²", "points"].map(str::to_owned))];
    let points = chapter.lines(|figures, _| figures.median_ms);
    for (name, law) in &laws {
        let count = points.iter().find(|(line, _)| line == name).map_or(0, |(_, points)| points.len());
        let cells = [format!("{:.2}", law.exponent), format!("{:.4}", law.r_squared), count.to_string()];
        table.push(heading(name, cells));
    }
    let title = format!("Time grows with the {} to the power of", axis.name);
    if laws.is_empty() { Vec::new() } else { vec![Exhibit { title, table, plot: None }] }
}

fn speedups(chapter: &Chapter) -> Vec<Exhibit> {
    let mut table = vec![chapter.heading("point", &[])];
    for point in &chapter.results {
        let first = chapter.names().first().and_then(|name| point.figures(name)).map(|figures| figures.median_ms);
        table.push(chapter.row(point, &[], |figures| {
            first.map_or_else(none, |first| format!("{} x", figure(first / figures.median_ms)))
        }));
    }
    vec![Exhibit { title: "How many times as fast as one thread".into(), table, plot: None }]
}

fn peers(chapter: &Chapter) -> Vec<Exhibit> {
    let others: Vec<String> = chapter.names().into_iter().filter(|name| name != "cpu").collect();
    let over_cpu =
        |point: &PointResult, name: &str| Some(point.figures(name)?.median_ms / point.figures("cpu")?.median_ms);
    let fastest_exact = |point: &PointResult| {
        let exact = others.iter().filter(|name| point.figures(name).is_some_and(|figures| figures.exact));
        exact.filter_map(|name| over_cpu(point, name)).min_by(f64::total_cmp)
    };
    let columns = |point: &PointResult| -> Vec<Option<f64>> {
        others.iter().map(|name| over_cpu(point, name)).chain([fastest_exact(point)]).collect()
    };
    let last = "fastest exact";
    let names = ["cpu, ms".to_owned()].into_iter().chain(others.iter().cloned()).chain([last.to_owned()]);
    let mut table = vec![heading("point", names)];
    let mut all: Vec<Vec<f64>> = vec![Vec::new(); others.len() + 1];
    let mut rows = Vec::new();
    for point in &chapter.results {
        let Some(cpu) = point.figures("cpu") else { continue };
        let ratios = columns(point);
        all.iter_mut().zip(&ratios).for_each(|(column, ratio)| column.extend(*ratio));
        let cells = ratios.iter().map(|ratio| ratio.map_or_else(none, |ratio| format!("{} x", figure(ratio))));
        table.push(heading(&point.label, [figure(cpu.median_ms)].into_iter().chain(cells)));
        let values = others.iter().zip(&ratios).filter_map(|(name, ratio)| Some((name.clone(), (*ratio)?)));
        rows.push((point.label.clone(), values.collect::<Vec<_>>()));
    }
    if all.iter().all(Vec::is_empty) {
        return Vec::new();
    }
    let summary = |title: &str, of: &dyn Fn(&[f64]) -> Option<f64>| {
        let cells = all.iter().map(|column| of(column).map_or_else(none, |value| format!("{} x", figure(value))));
        heading(title, [String::new()].into_iter().chain(cells))
    };
    table.push(summary("geometric mean", &geometric_mean));
    let counts = all.iter().map(|column| column.len().to_string());
    table.push(heading("of so many points", [String::new()].into_iter().chain(counts)));
    table.push(summary("least", &|column| column.iter().copied().min_by(f64::total_cmp)));
    let plot = Plot { values: "time over that of the CPU renderer".into(), is_log: true, form: Form::Rows { rows } };
    vec![Exhibit { title: "Time over that of the CPU renderer".into(), table, plot: Some(plot) }]
}

/// What an F-Buffer of each size takes: the same on any backend, and for any of the variants.
fn submissions(chapter: &Chapter) -> Vec<Exhibit> {
    let mut table = vec![heading(
        "point",
        ["fragments", "slots", "windows", "overflows", "passes over the geometry"].map(str::to_owned),
    )];
    for point in &chapter.results {
        let through_fbuffer = point.results.iter().filter(|result| result.technique == "fbuffer");
        let figures = through_fbuffer.filter_map(|result| result.figures()).next();
        let counts = figures.and_then(|figures| Some((figures.slot_windows?, figures.submissions?)));
        let (Some(fragments), Some(side), Some((windows, submissions))) = (point.fragments, point.fbuffer, counts)
        else {
            continue;
        };
        let cells = [
            full_count(fragments),
            format!("{side} x {side}"),
            full_count(windows),
            full_count(windows - 1),
            full_count(submissions),
        ];
        table.push(heading(&point.label, cells));
    }
    let title = "Windows of slots, and how often geometry is drawn".into();
    if table.len() < 2 { Vec::new() } else { vec![Exhibit { title, table, plot: None }] }
}

fn through(chapter: &Chapter) -> Vec<Exhibit> {
    let passes_ms = |figures: &Figures| figures.steps.iter().find(|step| step.name == "passes").map(|step| step.ms);
    let ratios = |point: &PointResult, backend: &str| -> [Option<f64>; 2] {
        let of = |way: &str| point.figures(&format!("{backend} {way}"));
        let (Some(ours), Some(plain)) = (of("fbuffer"), of("framebuffer")) else { return [None; 2] };
        let passes = passes_ms(ours).zip(passes_ms(plain)).map(|(ours, plain)| ours / plain);
        [Some(ours.median_ms / plain.median_ms), passes]
    };
    let backends = ["cpu", "gpu"];
    let measured: Vec<&str> = backends
        .into_iter()
        .filter(|backend| chapter.results.iter().any(|point| ratios(point, backend)[0].is_some()))
        .collect();
    let columns: Vec<String> =
        measured.iter().flat_map(|backend| [format!("{backend}, frame"), format!("{backend}, passes alone")]).collect();
    let mut table = vec![heading("point", columns.iter().cloned())];
    let mut rows = Vec::new();
    for point in &chapter.results {
        let values: Vec<Option<f64>> = measured.iter().flat_map(|backend| ratios(point, backend)).collect();
        let cells = values.iter().map(|ratio| ratio.map_or_else(none, |ratio| format!("{ratio:.2} x")));
        table.push(heading(&point.label, cells));
        let named = columns.iter().cloned().zip(values).filter_map(|(name, value)| Some((name, value?)));
        rows.push((point.label.clone(), named.collect::<Vec<_>>()));
    }
    let title = "Time through an F-Buffer over that through a framebuffer".to_owned();
    let plot = Plot { values: title.to_lowercase(), is_log: false, form: Form::Rows { rows } };
    if measured.is_empty() { Vec::new() } else { vec![Exhibit { title, table, plot: Some(plot) }] }
}

impl Chapter {
    /// Names of the variants, in their order.
    pub(super) fn names(&self) -> Vec<String> {
        self.series.variants.iter().map(|variant| variant.name()).collect()
    }

    /// Those with figures anywhere: a column that would be empty is left out.
    fn columns(&self) -> Vec<String> {
        let has_figures = |name: &String| self.results.iter().any(|point| point.figures(name).is_some());
        self.names().into_iter().filter(has_figures).collect()
    }

    fn heading(&self, first: &str, facts: &[&str]) -> Vec<String> {
        heading(first, facts.iter().map(|fact| (*fact).to_owned()).chain(self.columns()))
    }

    fn row(&self, point: &PointResult, facts: &[String], cell: impl Fn(&Figures) -> String) -> Vec<String> {
        let cells = self.columns().into_iter().map(|name| point.figures(&name).map_or_else(none, &cell));
        heading(&point.label, facts.iter().cloned().chain(cells))
    }

    /// A row for each point, a column for each variant.
    fn matrix(&self, cell: impl Fn(&Figures) -> String) -> Vec<Vec<String>> {
        let rows = self.results.iter().map(|point| self.row(point, &[], &cell));
        [self.heading("point", &[])].into_iter().chain(rows).collect()
    }

    /// A line for each variant, over the axis.
    fn lines(&self, value: impl Fn(&Figures, f64) -> f64) -> Vec<(String, Vec<(f64, f64)>)> {
        let points = |name: &String| {
            let at = |point: &PointResult| Some((point.x?, value(point.figures(name)?, point.x?)));
            self.results.iter().filter_map(at).collect::<Vec<_>>()
        };
        self.columns().into_iter().map(|name| (name.clone(), points(&name))).collect()
    }

    /// Lines where there is an axis, else rows of dots.
    fn plot(&self, values: &str, is_log: bool, value: impl Fn(&Figures, Option<f64>) -> Option<f64>) -> Option<Plot> {
        let form = match self.series.axis {
            Some(axis) => {
                let lines = self.lines(|figures, x| value(figures, Some(x)).unwrap_or(f64::NAN));
                let lines: Vec<_> = lines
                    .into_iter()
                    .map(|(name, points)| (name, points.into_iter().filter(|(_, y)| y.is_finite()).collect::<Vec<_>>()))
                    .filter(|(_, points)| !points.is_empty())
                    .collect();
                if lines.iter().all(|(_, points)| points.len() < 2) {
                    return None;
                }
                let is_log = is_log && axis.is_log;
                let form = Form::Lines { axis: axis.name.to_owned(), is_log_axis: axis.is_log, lines };
                return Some(Plot { values: values.to_owned(), is_log, form });
            }
            None => {
                let row = |point: &PointResult| {
                    let values = self.columns().into_iter().filter_map(|name| {
                        let figures = point.figures(&name)?;
                        Some((name, value(figures, None)?))
                    });
                    (point.label.clone(), values.collect())
                };
                Form::Rows { rows: self.results.iter().map(row).collect() }
            }
        };
        Some(Plot { values: values.to_owned(), is_log, form })
    }
}

fn heading(first: &str, others: impl IntoIterator<Item = String>) -> Vec<String> {
    [first.to_owned()].into_iter().chain(others).collect()
}

fn none() -> String {
    NONE.to_owned()
}
