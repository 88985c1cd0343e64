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

#[test]
fn a_depth_filter_shows_what_it_leaves_out_of_order_and_is_for_lucid_alone() {
    let work = Workplace::new();
    for (options, says) in [
        ("--filter-size 3", "--filter-size"),
        ("--technique linear --alpha-threshold 0.1", "--alpha-threshold"),
        ("--technique lucid --filter-size 13", "from 1 to 12"),
        ("--technique lucid --alpha-threshold 1.5", "from 0 to 1"),
    ] {
        let outcome = work.run(&format!("render @boxes:n=3 -o a.png {options}"));
        assert!(outcome.code == 2 && outcome.stderr.contains(says), "{options}: {}", outcome.stderr);
    }
    if !is_required() {
        return;
    }
    let render = |name: &str, options: &str| -> Value {
        let scene = "@hairball:strands=60,segments=12 --size 93x71 --opacity 0.5";
        let line = format!("render {scene} -o {name}.png --technique lucid --stats - -q {options}");
        serde_json::from_str(&work.succeed(&line).stdout).unwrap()
    };
    let (least, most) = (render("a", "--filter-size 1"), render("b", "--filter-size 12"));
    let errors = render("errors", "--filter-size 1 --resolve errors");
    let read = |name: &str| std::fs::read(work.path(name)).unwrap();
    assert!(read("a.png") == read("b.png") && read("a.png") != read("errors.png"));
    assert!(least["repaired_pixels"].as_u64() > most["repaired_pixels"].as_u64(), "{least} {most}");
    assert_eq!(least["repaired_pixels"], errors["repaired_pixels"]);
    assert!(least["half_block_parts"].as_u64().unwrap() > 0 && least["exact"] == true);
    let left = render("left", "--alpha-threshold 0.9");
    assert!(left["exact"] == false && left["cut_pixels"].as_u64().unwrap() > 0, "{left}");
}
