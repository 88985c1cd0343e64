//! The README names what there is: every option, resolve, command and built-in scene, and none besides.

mod common;

use std::collections::BTreeSet;

use common::Workplace;
use pellucid::{Resolve, Technique, builtin};

const README: &str = include_str!("../../../README.md");

/// The first cells of the table under a heading, less quotes.
fn first_column(heading: &str) -> BTreeSet<String> {
    let section = README.split(&format!("# {heading}\n")).nth(1).unwrap_or_else(|| panic!("no section '{heading}'"));
    let rows = section.lines().skip_while(|line| !line.starts_with("|---")).skip(1);
    rows.take_while(|line| line.starts_with('|')).map(|row| row.split('|').nth(1).unwrap().replace('`', "")).collect()
}

/// The long names of options in a text about them.
fn options<'a>(texts: impl IntoIterator<Item = &'a str>) -> BTreeSet<&'a str> {
    let words = texts.into_iter().flat_map(|text| text.split(|c: char| c.is_whitespace() || c == ','));
    words.filter(|word| word.starts_with("--")).collect()
}

#[test]
fn options_of_render_and_bench() {
    for command in ["render", "bench"] {
        let help = Workplace::new().succeed(&format!("{command} --help")).stdout;
        // An option's own line begins with its name, its description follows after two spaces.
        let lines = help.lines().map(str::trim_start).filter(|line| line.starts_with('-'));
        let mut there = options(lines.map(|line| line.split("  ").next().unwrap_or_default()));
        there.remove("--help");
        let column = first_column(&format!("Options of `{command}`"));
        assert_eq!(options(column.iter().map(String::as_str)), there);
    }
}

#[test]
fn suites() {
    let refusal = Workplace::new().run("bench --suite none -o out").stderr;
    let names = refusal.split("possible values: ").nth(1).unwrap().split(']').next().unwrap();
    assert_eq!(first_column("Benchmarks"), names.split(", ").map(|name| format!(" {name} ")).collect());
}

#[test]
fn resolves_scenes_techniques_and_commands() {
    let names = |column: &str| first_column(column).iter().map(|cell| cell.trim().to_owned()).collect::<BTreeSet<_>>();
    let resolves = Resolve::NAMES.iter().map(|(name, _)| (*name).to_owned()).collect();
    assert_eq!(names("Resolves"), resolves);
    assert_eq!(names("Built-in scenes"), builtin::all().iter().map(|scene| format!("@{}", scene.name)).collect());
    for technique in Technique::ALL {
        assert!(README.contains(&format!("`{technique}`")), "{technique}");
    }
    let help = Workplace::new().succeed("--help").stdout;
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    // A command's own line is indented by two; longer descriptions go on further to the right.
    let commands = commands.filter(|line| !line.starts_with("   ")).filter_map(|line| line.split_whitespace().next());
    for command in commands.filter(|command| *command != "help") {
        assert!(README.contains(&format!("`pellucid {command}")), "{command}");
    }
}
