//! `pellucid verify`: this device against the oracle.

mod common;

use common::Workplace;
use serde_json::Value;

#[test]
fn every_check_of_the_cpu_passes_and_has_a_line() {
    let work = Workplace::new();
    let outcome = work.succeed("verify --backend cpu");
    let lines: Vec<&str> = outcome.stdout.lines().collect();
    assert!(lines[0].starts_with("scene "), "{}", lines[0]);
    let (checks, summary) = (&lines[1..lines.len() - 2], lines[lines.len() - 1]);
    assert!(checks.len() > 100);
    for line in checks {
        assert!(line.starts_with('@') && line.ends_with("  pass") && line.contains("  cpu  "), "{line}");
    }
    assert!(checks.iter().any(|line| line.starts_with("@planes:n=1000 ") && line.contains(" layers ")));
    assert!(summary.starts_with(&format!("{0} of {0} checks passed in ", checks.len())), "{summary}");
    assert_eq!(outcome.stderr, "");
    assert!(work.names().is_empty());
}

#[test]
fn json_has_every_key_of_the_schema() {
    let outcome = Workplace::new().succeed("verify --technique cpu --json");
    let report: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!((&report["schema"], &report["command"], &report["passes"]), (&1.into(), &"verify".into(), &true.into()));
    assert_eq!((&report["failures"], &report["techniques"]), (&0.into(), &vec!["cpu"].into()));
    let results = report["results"].as_array().unwrap();
    assert_eq!(report["checks"].as_u64().unwrap(), results.len() as u64);
    for result in results {
        let mut keys: Vec<&str> = result.as_object().unwrap().keys().map(String::as_str).collect();
        keys.sort_unstable();
        let expected = [
            "agreeing",
            "ambiguous",
            "check",
            "covered",
            "error",
            "height",
            "passes",
            "scene",
            "technique",
            "unexplained",
            "view",
            "width",
            "worst",
        ];
        assert_eq!(keys, expected);
        let pixels = result["width"].as_u64().unwrap() * result["height"].as_u64().unwrap();
        assert_eq!(result["agreeing"], pixels);
    }
}

#[test]
fn what_is_not_exact_or_runs_elsewhere_is_refused() {
    let work = Workplace::new();
    for (line, says) in [
        ("verify --technique alpha", "possible values"),
        ("verify --technique cpuu", "'cpu'"),
        ("verify --backend gpu --technique cpu", "runs on the cpu"),
        ("verify --backend cpu --technique linear", "runs on the gpu"),
        ("verify --threads many", "whole number"),
        ("verify @boxes", "unexpected argument"),
    ] {
        let outcome = work.run(line);
        assert_eq!(outcome.code, 2, "{line}: {}", outcome.stderr);
        assert!(outcome.stderr.contains(says) && outcome.stdout.is_empty(), "{line}: {}", outcome.stderr);
    }
}
