//! Techniques of the GPU from the command line. Only where one is asked for with `PELLUCID_REQUIRE_GPU=1`: the tests of the
//! library take any real one.

mod common;

use common::Workplace;
use serde_json::Value;

fn is_required() -> bool {
    let is_required = std::env::var("PELLUCID_REQUIRE_GPU").as_deref() == Ok("1");
    if !is_required {
        eprintln!("skipped: PELLUCID_REQUIRE_GPU is not 1");
    }
    is_required
}

fn figures(work: &Workplace, options: &str) -> Value {
    let line = format!("render @boxes:n=3 -o a.png --size 48x32 --stats - -q {options}");
    serde_json::from_str(&work.succeed(&line).stdout).unwrap()
}

#[test]
fn the_backend_has_a_technique_of_its_own_and_others_by_name() {
    if !is_required() {
        return;
    }
    let work = Workplace::new();
    let figures = |options: &str| figures(&work, options);
    let usual = figures("--backend gpu");
    assert_eq!(
        (&usual["backend"], &usual["technique"], &usual["exact"]),
        (&"gpu".into(), &"linear".into(), &true.into())
    );
    let cpu = figures("--backend cpu");
    for options in ["--technique list", "--technique abuffer --storage texture", "--technique pages --presort"] {
        let named = figures(options);
        assert!(options.contains(named["technique"].as_str().unwrap()) && named["backend"] == "gpu", "{options}");
        assert_eq!(named["fragments"], cpu["fragments"], "{options}");
    }
    let limited = figures("--technique linear --budget 4K");
    assert!(limited["windows"].as_u64().unwrap() > 1 && limited["peak_bytes"].as_u64().unwrap() <= 4096, "{limited}");
    assert_eq!(limited["fragments"], cpu["fragments"]);
}

#[test]
fn peeling_that_stops_early_says_where_it_is_not_exact() {
    if !is_required() {
        return;
    }
    let work = Workplace::new();
    let whole = figures(&work, "--technique peel");
    assert_eq!((&whole["exact"], &whole["cut_pixels"]), (&true.into(), &0.into()));
    let cut = figures(&work, "--technique peel --layers 2");
    assert_eq!(cut["exact"], false);
    assert!(cut["cut_pixels"].as_u64().unwrap() > 0 && cut["max_depth_complexity"] == 2, "{cut}");
    let outcome = work.succeed("render @boxes:n=3 -o a.png --size 48x32 --technique peel --layers 2");
    assert!(outcome.stderr.starts_with("warning: not exact: "), "{}", outcome.stderr);
}
