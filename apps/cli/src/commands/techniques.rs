//! `pellucid techniques`: how fragments can be captured and ordered.

use pellucid::Technique;
use serde::Serialize;

use crate::report::{SCHEMA, to_json};
use crate::terminal;

#[derive(Serialize)]
struct List {
    schema: u32,
    techniques: Vec<Entry>,
}

#[derive(Serialize)]
struct Entry {
    name: &'static str,
    backend: &'static str,
    exact: bool,
    passes: &'static str,
    memory: &'static str,
    description: &'static str,
}

pub(crate) fn run(json: bool) -> anyhow::Result<()> {
    let text = if json {
        let techniques = Technique::ALL.into_iter().map(Entry::of).collect();
        to_json(&List { schema: SCHEMA, techniques })?
    } else {
        to_text()
    };
    Ok(terminal::print(&text)?)
}

impl Entry {
    fn of(technique: Technique) -> Self {
        Self {
            name: technique.name(),
            backend: technique.backend(),
            exact: technique.is_exact(),
            passes: technique.passes(),
            memory: technique.memory_formula(),
            description: technique.description(),
        }
    }
}

fn to_text() -> String {
    let header = ["technique", "backend", "exact", "passes", "memory besides scene and picture"].map(str::to_owned);
    let rows = Technique::ALL.map(Entry::of).map(|entry| {
        [entry.name, entry.backend, if entry.exact { "yes" } else { "no" }, entry.passes, entry.memory]
            .map(str::to_owned)
    });
    let table: Vec<_> = [header].into_iter().chain(rows).collect();
    let widths: [usize; 5] =
        std::array::from_fn(|column| table.iter().map(|row| row[column].chars().count()).max().unwrap_or(0));
    let mut text = String::new();
    for row in &table {
        let cells: Vec<String> = row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}")).collect();
        text += cells.join("  ").trim_end();
        text.push('\n');
    }
    text.push('\n');
    for technique in Technique::ALL {
        text += &format!("{:width$}  {}\n", technique.name(), technique.description(), width = widths[0]);
    }
    text
}
