//! `pellucid info`, `scenes` and `techniques`.

mod common;

use common::Workplace;
use serde_json::Value;

#[test]
fn info_counts_what_is_there_and_what_is_seen() {
    let work = Workplace::new();
    let text = work.succeed("info @boxes:n=2 --size 64x48").stdout;
    let value = |name: &str| {
        let line = text.lines().find(|line| line.trim_start().starts_with(name));
        line.unwrap_or_else(|| panic!("{name}: {text}")).trim_start()[name.len()..].trim().to_owned()
    };
    assert!(value("triangles").starts_with("96"));
    assert!(value("materials").contains("0 opaque"));
    assert!(value("bounding box").contains(" to "));
    assert!(value("depth complexity").starts_with("at most "));

    let report: Value = serde_json::from_str(&work.succeed("info @boxes:n=2 --size 64x48 --json").stdout).unwrap();
    assert_eq!((&report["schema"], &report["triangles"]), (&1.into(), &96.into()));
    assert!(report["view"]["fragments"].as_u64().unwrap() > 0);
    assert!(report["bounding_box"]["min"][0].as_f64().unwrap() < 0.0);
}

#[test]
fn info_and_render_count_alike() {
    let work = Workplace::new();
    let options = "--size 64x48 --view top --opacity 0.5";
    let info = work.succeed(&format!("info @boxes:n=3 --json {options}")).stdout;
    let render = work.succeed(&format!("render @boxes:n=3 -o a.png --stats - {options}")).stdout;
    let [info, render] = [info, render].map(|text| serde_json::from_str::<Value>(&text).unwrap());
    for key in ["fragments", "max_depth_complexity", "mean_depth_complexity", "dropped_triangles"] {
        assert_eq!(info["view"][key], render[key], "{key}");
    }
}

#[test]
fn scenes_are_listed_with_their_parameters() {
    let work = Workplace::new();
    let text = work.succeed("scenes").stdout;
    assert!(text.contains("\n@boxes\n") && text.contains("n=10  a whole number from 1 to "), "{text}");
    let list: Value = serde_json::from_str(&work.succeed("scenes --json").stdout).unwrap();
    let scenes = list["scenes"].as_array().unwrap();
    let boxes = scenes.iter().find(|scene| scene["name"] == "boxes").unwrap();
    assert_eq!((&boxes["parameters"][0]["name"], &boxes["parameters"][0]["default"]), (&"n".into(), &"10".into()));
}

#[test]
fn techniques_are_listed_with_exactness_and_memory() {
    let work = Workplace::new();
    let text = work.succeed("techniques").stdout;
    let line = text.lines().find(|line| line.starts_with("oracle")).unwrap();
    assert!(line.contains("yes") && line.contains("32 B x fragments"), "{line}");
    let list: Value = serde_json::from_str(&work.succeed("techniques --json").stdout).unwrap();
    assert_eq!(list["techniques"][0]["name"], "cpu");
}

#[test]
fn help_and_version_go_to_stdout() {
    let work = Workplace::new();
    for line in ["--help", "render --help", "--version"] {
        let outcome = work.succeed(line);
        assert!(!outcome.stdout.is_empty() && outcome.stderr.is_empty(), "{line}");
    }
    let help = work.succeed("render --help").stdout;
    for name in ["blend:corrected", "gelly", "layer:N", "complexity"] {
        assert!(help.contains(name), "{name}");
    }
}
