//! `pellucid techniques`: how fragments can be captured and ordered, and what this machine offers for it.

use pellucid::Technique;
use pellucid::gpu::{AdapterSummary, adapter_summaries};
use serde::Serialize;

use crate::report::{SCHEMA, to_json};
use crate::terminal;
use crate::words::memory;

#[derive(Serialize)]
struct List {
    schema: u32,
    techniques: Vec<Entry>,
    adapters: Vec<Adapter>,
}

/// A GPU of this machine, or software in the place of one.
#[derive(Serialize)]
struct Adapter {
    name: String,
    api: String,
    driver: String,
    software: bool,
    features: Vec<&'static str>,
    max_binding_bytes: u64,
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
    let techniques = Technique::ALL.into_iter().map(Entry::of).collect();
    let adapters = adapter_summaries().into_iter().map(Adapter::from).collect();
    let list = List { schema: SCHEMA, techniques, adapters };
    let text = if json { to_json(&list)? } else { list.to_text() };
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

impl From<AdapterSummary> for Adapter {
    fn from(adapter: AdapterSummary) -> Self {
        Self {
            name: adapter.name,
            api: adapter.backend,
            driver: adapter.driver,
            software: adapter.is_software,
            features: adapter.features,
            max_binding_bytes: adapter.max_binding_bytes,
        }
    }
}

impl List {
    fn to_text(&self) -> String {
        let header = ["technique", "backend", "exact", "passes", "memory besides scene and picture"].map(str::to_owned);
        let rows = self.techniques.iter().map(|entry| {
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
        for entry in &self.techniques {
            text += &format!("{:width$}  {}\n", entry.name, entry.description, width = widths[0]);
        }
        text += "\nGPUs of this machine, the one that is used first:\n";
        for adapter in &self.adapters {
            text += &adapter.to_text();
        }
        if self.adapters.is_empty() {
            text += "  none; install a driver for Vulkan, Metal or DirectX 12 to use techniques of the GPU\n";
        }
        text
    }
}

impl Adapter {
    fn to_text(&self) -> String {
        let Self { name, api, driver, .. } = self;
        let kind =
            if self.software { ", software: used only when asked for by --backend gpu or a technique" } else { "" };
        let features = match self.features.as_slice() {
            [] => "no optional features".to_owned(),
            features => features.join(", "),
        };
        let binding = memory(self.max_binding_bytes);
        format!("  {name} ({api}, {driver}{kind})\n    {features}; at most {binding} a binding\n")
    }
}
