//! The report: one page with everything in it, that needs no network, no script and no other file.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::document::{CSV, Chapter, JSON, Session};
use super::exhibit::{Exhibit, exhibits, remarks};
use super::plot::{self, Key};
use super::suite::Published;
use crate::words::plural;

const STYLE: &str = include_str!("style.css");

/// The page of what was measured so far.
pub(super) fn page(session: &Session) -> anyhow::Result<String> {
    let hardware = &session.hardware;
    let names: Vec<&str> = session.terms.suites.iter().map(String::as_str).collect();
    let title = format!("Pellucid bench: {}", names.join(", "));
    let chapters = session.chapters.iter().map(chapter).collect::<anyhow::Result<Vec<_>>>()?;
    let (done, planned) = (session.done(), session.planned());
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                link rel="icon" href="data:,";
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    p.overline { "Pellucid bench" }
                    h1 { (names.join(", ")) }
                    p.facts { (hardware.in_words()) }
                    @if done < planned {
                        p.unfinished { "Unfinished: " (done) " of " (plural(planned as u64, "point")) " measured. The same command goes on." }
                    }
                    (contents(session))
                }
                main { @for chapter in &chapters { (chapter) } }
                footer {
                    p {
                        "Made by pellucid " (env!("CARGO_PKG_VERSION")) ". Up to " (session.terms.repeats)
                        " frames of each technique at a point, in turns with the others, after frames that warm up; at most "
                        (session.terms.time_limit_s) " s of each. Times are of whole frames, without loading and without \
                        reading the picture back. The figures are in " (JSON) " and " (CSV) " beside this page."
                    }
                }
            }
        }
    };
    Ok(page.into_string())
}

fn contents(session: &Session) -> Markup {
    html! {
        nav aria-label="Contents" {
            ul {
                @for chapter in &session.chapters {
                    li { a href={ "#" (anchor(chapter)) } { span.suite { (chapter.suite.name) } " " (chapter.series.title) } }
                }
            }
        }
    }
}

fn anchor(chapter: &Chapter) -> String {
    format!("{}-{}", chapter.suite.name, chapter.series.name)
}

fn chapter(chapter: &Chapter) -> anyhow::Result<Markup> {
    let series = &chapter.series;
    let names = chapter.names();
    let mut shown = Vec::new();
    for exhibit in exhibits(chapter) {
        let plot = exhibit.plot.as_ref().map(|plot| plot::draw(plot, &names)).transpose()?;
        shown.push((exhibit, plot));
    }
    let remarks = remarks(chapter);
    Ok(html! {
        section id=(anchor(chapter)) {
            p.overline { (chapter.suite.name) }
            h2 { (series.title) }
            p.about { (series.about) }
            @if chapter.results.is_empty() { p.note { "Not measured yet." } }
            @for (exhibit, plot) in &shown { (figure(exhibit, plot.as_ref())) }
            @if !remarks.is_empty() {
                ul.remarks { @for remark in &remarks { li { (remark) } } }
            }
            @if let Some(published) = &series.published { (others(published)) }
        }
    })
}

fn figure(exhibit: &Exhibit, plot: Option<&(String, Vec<Key>)>) -> Markup {
    html! {
        figure {
            h3 { (exhibit.title) }
            @if let Some((svg, keys)) = plot {
                ul.keys { @for (name, color) in keys { li { span style={ "background:" (color) } {} (name) } } }
                div.plot role="img" aria-label={ "Plot: " (exhibit.title) } { (PreEscaped(svg)) }
            }
            (table(&exhibit.table))
        }
    }
}

fn table(rows: &[Vec<String>]) -> Markup {
    html! {
        div.scroll tabindex="0" {
            table {
                @if let Some(heading) = rows.first() {
                    thead { tr { @for cell in heading { th scope="col" { (cell) } } } }
                }
                tbody {
                    @for row in rows.iter().skip(1) {
                        tr {
                            @for (i, cell) in row.iter().enumerate() {
                                @if i == 0 { th scope="row" { (cell) } } @else { td { (cell) } }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// What others published, on a ground of its own.
fn others(published: &Published) -> Markup {
    let rows: Vec<Vec<String>> = [published.heading]
        .into_iter()
        .chain(published.rows.iter().copied())
        .map(|row| row.iter().map(|cell| (*cell).to_owned()).collect())
        .collect();
    html! {
        aside {
            h3 { "As published, on other hardware" }
            p.note { (published.source) ". " strong { (published.hardware) } "." }
            @if !published.rows.is_empty() { (table(&rows)) }
            ul.remarks { @for remark in published.remarks { li { (remark) } } }
        }
    }
}
