//! `pellucid scenes`: the built-in scenes and what can be chosen about them.

use pellucid::builtin;
use serde::Serialize;

use crate::report::{SCHEMA, to_json};
use crate::terminal;

#[derive(Serialize)]
struct List {
    schema: u32,
    scenes: Vec<Scene>,
}

#[derive(Serialize)]
struct Scene {
    name: &'static str,
    summary: &'static str,
    parameters: Vec<Parameter>,
}

#[derive(Serialize)]
struct Parameter {
    name: &'static str,
    default: &'static str,
    range: String,
    meaning: &'static str,
}

pub(crate) fn run(json: bool) -> anyhow::Result<()> {
    let scenes: Vec<Scene> = builtin::all().iter().map(Scene::of).collect();
    let text = if json { to_json(&List { schema: SCHEMA, scenes })? } else { to_text(&scenes) };
    Ok(terminal::print(&text)?)
}

impl Scene {
    fn of(scene: &builtin::BuiltIn) -> Self {
        let parameter = |parameter: &builtin::Parameter| Parameter {
            name: parameter.name,
            default: parameter.default,
            range: parameter.kind.to_string(),
            meaning: parameter.meaning,
        };
        Self { name: scene.name, summary: scene.summary, parameters: scene.parameters.iter().map(parameter).collect() }
    }
}

fn to_text(scenes: &[Scene]) -> String {
    let mut text = String::from("Built-in scenes, as @name or @name:key=value,key=value\n");
    for scene in scenes {
        text += &format!("\n@{}\n  {}\n", scene.name, scene.summary);
        let width = |part: fn(&Parameter) -> usize| scene.parameters.iter().map(part).max().unwrap_or(0);
        let settings = width(|parameter| parameter.name.len() + 1 + parameter.default.len());
        let ranges = width(|parameter| parameter.range.chars().count());
        for Parameter { name, default, range, meaning } in &scene.parameters {
            let setting = format!("{name}={default}");
            text += &format!("    {setting:settings$}  {range:ranges$}  {meaning}\n");
        }
    }
    text
}
