//! `pellucid bench`: figures, the page, and runs that go on where others stopped. Times are never judged.

mod common;

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use common::{Workplace, names_in};
use serde_json::Value;

const QUICK: &str = "--quick --backend cpu";

fn json(work: &Workplace, folder: &str) -> Value {
    serde_json::from_slice(&std::fs::read(work.path(folder).join("bench.json")).unwrap()).unwrap()
}

fn points(document: &Value) -> Vec<&Value> {
    let suites = document["suites"].as_array().unwrap();
    let series = suites.iter().flat_map(|suite| suite["series"].as_array().unwrap());
    series.flat_map(|series| series["points"].as_array().unwrap()).collect()
}

/// All keys of all objects within.
fn keys<'a>(value: &'a Value, found: &mut BTreeSet<&'a str>) {
    match value {
        Value::Object(object) => object.iter().for_each(|(key, value)| {
            found.insert(key);
            keys(value, found);
        }),
        Value::Array(array) => array.iter().for_each(|value| keys(value, found)),
        _ => {}
    }
}

#[test]
fn every_suite_says_what_it_will_do_and_leaves_figures_and_a_page() {
    let work = Workplace::new();
    let outcome = work.succeed(&format!("bench {QUICK} -o out"));
    assert_eq!(names_in(&work.path("out")), ["bench.csv", "bench.json", "index.html"]);
    for part in ["\nTo measure, 2 frames ", "\nlfb: Steps of a frame ", "\nin all ", "the same command goes on"] {
        assert!(outcome.stderr.contains(part), "{part}: {}", outcome.stderr);
    }
    assert!(outcome.stderr.trim_end().ends_with("index.html: open it in a browser"), "{}", outcome.stderr);

    let report = json(&work, "out");
    assert_eq!((&report["schema"], &report["command"]), (&1.into(), &"bench".into()));
    assert_eq!((&report["complete"], &report["plan"]["quick"]), (&true.into(), &true.into()));
    let suites: Vec<&str> = report["suites"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(suites, ["lfb", "peel", "abuffer", "fbuffer", "lucid", "scale", "peers"]);
    let points = points(&report);
    assert!(points.len() > 20);
    for point in &points {
        assert!(outcome.stdout.contains(&format!("\n{} ", point["label"].as_str().unwrap())), "{point}");
        for result in point["results"].as_array().unwrap() {
            match result["outcome"].as_str().unwrap() {
                "measured" => {
                    let samples = result["samples_ms"].as_array().unwrap();
                    assert_eq!((samples.len(), &result["frames"]), (2, &2.into()));
                    // A framebuffer keeps the results of one fragment a pixel.
                    assert_eq!(result["exact"], result["technique"] != "framebuffer");
                    let of = |key: &str| result[key].as_f64().unwrap();
                    let order = ["least_ms", "lower_ms", "median_ms", "upper_ms", "greatest_ms"].map(of);
                    assert!(order.is_sorted() && order[0] > 0.0, "{order:?}");
                }
                _ => assert_eq!((&result["outcome"], &result["backend"]), (&"skipped".into(), &"gpu".into())),
            }
        }
    }
    assert!(outcome.stdout.contains("--backend cpu leaves the GPU out"), "{}", outcome.stdout);
    // The published figures stand beside, with what they were measured on.
    for hardware in
        ["GeForce GTX 460", "GeForce GTX 660 Ti", "GeForce GTX 480", "ATI Radeon X800 series", "GeForce GTX 3050 Ti"]
    {
        assert!(outcome.stdout.contains(&format!("; {hardware}")), "{hardware}");
    }

    let mut reader = csv::Reader::from_path(work.path("out/bench.csv")).unwrap();
    let lines: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let results: usize = points.iter().map(|point| point["results"].as_array().unwrap().len()).sum();
    assert_eq!(lines.len(), results);
}

#[test]
fn a_software_gpu_is_measured_if_asked_for_and_told_apart_from_exact() {
    if std::env::var("PELLUCID_REQUIRE_GPU").as_deref() != Ok("1") {
        return eprintln!("skipped: set PELLUCID_REQUIRE_GPU=1 to test on this machine's GPU, or a software one");
    }
    let work = Workplace::new();
    let outcome = work.succeed("bench --suite peel,abuffer --quick --backend gpu -o out");
    assert!(!outcome.stdout.contains("not measured"), "{}", outcome.stdout);
    let report = json(&work, "out");
    let points = points(&report);
    let of = |point: usize, name: &str| {
        let results = points[point]["results"].as_array().unwrap();
        results.iter().find(|result| result["name"] == name).unwrap()
    };
    assert!(
        points.iter().all(|point| point["results"][0]["alpha_ratio"] == 1.0 && point["results"][0]["exact"] == false)
    );
    let (cut, exact) = (of(1, "peel (4 layers)"), of(1, "peel"));
    assert_eq!((&cut["max_layers"], &cut["exact"]), (&4.into(), &false.into()));
    assert!(cut["cut_pixels"].as_u64().unwrap() > of(1, "peel (8 layers)")["cut_pixels"].as_u64().unwrap());
    assert_eq!((&exact["exact"], &exact["cut_pixels"]), (&true.into(), &0.into()));
    let (buffers, textures) = (of(2, "abuffer"), of(2, "abuffer (textures)"));
    assert_eq!((&buffers["storage"], &textures["storage"]), (&"buffer".into(), &"texture".into()));
    // Sorted in registers, fragments take as much in textures as in buffers; references to them would come on top.
    assert!(textures["peak_bytes"].as_u64() >= buffers["peak_bytes"].as_u64());
}

#[test]
fn a_depth_filter_leaves_wrong_pixels_that_the_finished_picture_has_not() {
    if std::env::var("PELLUCID_REQUIRE_GPU").as_deref() != Ok("1") {
        return eprintln!("skipped: set PELLUCID_REQUIRE_GPU=1 to test on this machine's GPU, or a software one");
    }
    let work = Workplace::new();
    let outcome = work.succeed("bench --suite lucid --quick --backend gpu -o out");
    for part in ["Samples of a triangle in a half-block", "Wrong pixels: ", "Time over that of alpha"] {
        assert!(outcome.stdout.contains(part), "{part}: {}", outcome.stdout);
    }
    let report = json(&work, "out");
    let mut filters = 0;
    for result in points(&report).iter().flat_map(|point| point["results"].as_array().unwrap()) {
        let has_filter = result["technique"] == "lucid";
        assert_eq!((result["filter_size"].is_u64(), result["repaired_pixels"].is_u64()), (has_filter, has_filter));
        if has_filter && result["alpha_threshold"] == 0.0 {
            assert_eq!((&result["wrong_pixels"], &result["exact"]), (&0.into(), &true.into()), "{result}");
            assert!(result["half_block_parts"].as_u64().unwrap() > 0);
            filters += 1;
        }
    }
    // Three sizes at two points of two series.
    assert_eq!(filters, 12);
}

#[test]
fn f_buffers_take_the_windows_of_the_formula_on_either_backend() {
    let gpu = std::env::var("PELLUCID_REQUIRE_GPU").as_deref() == Ok("1");
    let backends: &[&str] = if gpu { &["cpu", "gpu"] } else { &["cpu"] };
    let work = Workplace::new();
    let outcome = work.succeed(&format!("bench --suite fbuffer --quick --backend {} -o out", backends.last().unwrap()));
    for part in [
        "Windows of slots, and how often geometry is drawn",
        "Time through an F-Buffer over that through a framebuffer",
        "64 x 64          162                       489",
        "figure 3       23                        69",
    ] {
        assert!(outcome.stdout.contains(part), "{part}: {}", outcome.stdout);
    }
    let report = json(&work, "out");
    let shaded: Vec<&Value> = points(&report).into_iter().filter(|point| !point["shader"].is_null()).collect();
    assert_eq!(shaded.len(), 8);
    for point in shaded {
        let (fragments, side) = (point["fragments"].as_u64().unwrap(), point["fbuffer"].as_u64().unwrap());
        let passes = if point["shader"] == "lighting" { 2 } else { 3 };
        let windows = fragments.div_ceil(side * side).max(1);
        let of = |name: String| point["results"].as_array().unwrap().iter().find(|result| result["name"] == *name);
        for backend in backends {
            let ours = of(format!("{backend} fbuffer")).unwrap();
            assert_eq!((&ours["slot_windows"], &ours["submissions"]), (&windows.into(), &(passes * windows).into()));
            assert_eq!((&ours["technique"], &ours["backend"]), (&"fbuffer".into(), &(*backend).into()));
            let steps: Vec<&str> =
                ours["steps"].as_array().unwrap().iter().map(|step| step["name"].as_str().unwrap()).collect();
            assert!(steps.contains(&"geometry") && steps.contains(&"passes"), "{steps:?}");
            if let Some(plain) = of(format!("{backend} framebuffer")) {
                assert_eq!((&plain["submissions"], &plain["technique"]), (&passes.into(), &"framebuffer".into()));
            }
        }
    }
}

#[test]
fn figures_have_every_key_of_the_schema() {
    let work = Workplace::new();
    work.succeed(&format!("bench --suite scale,peel {QUICK} -o out"));
    let report = json(&work, "out");
    let schema = include_str!("../../../docs/schema.md");
    let section = |name: &str| schema.split("\n## ").find(|section| section.starts_with(name)).unwrap();
    let documented: BTreeSet<&str> = section("`bench.json`").split('`').skip(1).step_by(2).collect();
    let mut used = BTreeSet::new();
    keys(&report, &mut used);
    let undocumented: Vec<_> = used.difference(&documented).collect();
    assert!(undocumented.is_empty(), "not in docs/schema.md: {undocumented:?}");

    let csv = std::fs::read_to_string(work.path("out/bench.csv")).unwrap();
    let columns: Vec<&str> = section("`bench.csv`").split('`').skip(3).step_by(2).collect();
    assert_eq!(csv.lines().next().unwrap(), columns.join(","));
}

#[test]
fn the_page_is_one_file_that_needs_no_other() {
    let work = Workplace::new();
    work.succeed(&format!("bench --suite scale {QUICK} -o out -q"));
    let page = std::fs::read_to_string(work.path("out/index.html")).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.contains("<svg ") && page.contains("R²"));
    let page = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for elsewhere in ["src=", "http:", "https:", "@import", "<script"] {
        assert!(!page.contains(elsewhere), "{elsewhere}");
    }
}

#[test]
fn measured_points_are_not_measured_again() {
    let work = Workplace::new();
    let line = format!("bench --suite peel {QUICK} -o out");
    work.succeed(&line);
    // A time that no frame ever took marks what was measured before; the other point is taken away.
    let mut report = json(&work, "out");
    let points = report["suites"][0]["series"][0]["points"].as_array_mut().unwrap();
    let taken = points.remove(1)["label"].clone();
    let measured = points[0]["results"].as_array_mut().unwrap().iter_mut().find(|r| r["name"] == "cpu").unwrap();
    measured["median_ms"] = 123_456.789_012_345_67.into();
    work.write("out/bench.json", &report.to_string());

    let outcome = work.succeed(&line);
    assert!(outcome.stderr.contains("Going on: 1 of 2 points are measured already"), "{}", outcome.stderr);
    let after = json(&work, "out");
    let points = after["suites"][0]["series"][0]["points"].as_array().unwrap();
    assert_eq!(points[0], report["suites"][0]["series"][0]["points"][0], "to the last bit");
    assert_eq!((points.len(), &points[1]["label"]), (2, &taken));
    assert!(points[1]["results"][5]["median_ms"].is_number() && after["complete"] == true);

    // With nothing left to do, nothing changes; started over, everything does.
    let again = work.succeed(&line);
    assert!(again.stderr.contains("Going on: 2 of 2") && !again.stderr.contains("To measure"), "{}", again.stderr);
    assert_eq!(json(&work, "out"), after);
    work.succeed(&format!("{line} --fresh -q"));
    assert!(!std::fs::read_to_string(work.path("out/bench.json")).unwrap().contains("123456.789"));
}

/// Runs until the folder holds a measured point, and ends it as a user would who has no patience.
fn run_and_stop(work: &Workplace, line: &str, folder: &Path) {
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("pellucid"))
        .current_dir(work.path("."))
        .args(line.split_whitespace())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let start = Instant::now();
    loop {
        let written = std::fs::read_to_string(folder.join("bench.json")).unwrap_or_default();
        if written.contains("\"samples_ms\"") {
            break;
        }
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        assert!(start.elapsed() < Duration::from_secs(120), "it measured nothing");
        std::thread::sleep(Duration::from_millis(10));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn a_run_that_was_stopped_leaves_valid_results_and_goes_on() {
    let work = Workplace::new();
    let line = "bench --suite abuffer --backend cpu --time-limit 1 -o out";
    run_and_stop(&work, line, &work.path("out"));
    let first = json(&work, "out");
    let before = points(&first);
    assert!(first["complete"] == false && !before.is_empty());
    let page = std::fs::read_to_string(work.path("out/index.html")).unwrap();
    assert!(page.contains("Unfinished") && page.trim_end().ends_with("</html>"));
    let mut reader = csv::Reader::from_path(work.path("out/bench.csv")).unwrap();
    assert!(reader.records().all(|line| line.is_ok()));

    // The second run begins with what the first one measured.
    run_and_stop(&work, line, &work.path("out"));
    let second = json(&work, "out");
    let after = points(&second);
    assert!(before.iter().all(|point| after.contains(point)));
}

#[test]
fn results_of_other_devices_and_plans_are_not_mixed() {
    let work = Workplace::new();
    let line = format!("bench --suite peel {QUICK} -o out");
    work.succeed(&line);
    let report = json(&work, "out");
    let refused = |line: &str, says: &str| {
        let outcome = work.run(line);
        assert_eq!((outcome.code, outcome.stdout.as_str()), (1, ""), "{line}");
        let error = outcome.stderr.lines().last().unwrap();
        assert!(error.starts_with("error: ") && error.contains(says) && error.contains("--fresh"), "{error}");
    };
    refused(&line.replace("peel", "abuffer"), "another plan (--suite peel, now abuffer)");
    refused(&format!("{line} --repeats 1"), "another plan (--repeats 2, now 1)");
    refused(&format!("{line} --threads 1"), "another plan (--threads 0, now 1)");
    for (key, value, says) in [
        ("hardware", serde_json::json!({ "cpu": "8086" }), "another device (8086, "),
        ("version", "0.0.1".into(), "version 0.0.1"),
    ] {
        let mut other = report.clone();
        match &value {
            Value::Object(changes) => other[key]["cpu"] = changes["cpu"].clone(),
            value => other[key] = value.clone(),
        }
        work.write("out/bench.json", &other.to_string());
        refused(&line, says);
    }
    work.write("out/bench.json", "[]");
    refused(&line, "is not what this command writes");
    assert_eq!(std::fs::read_to_string(work.path("out/bench.json")).unwrap(), "[]", "left alone");
    work.succeed(&format!("{line} --fresh"));
    assert_eq!(points(&json(&work, "out")).len(), 2);
}

#[test]
fn real_scenes_are_taken_from_their_folder_and_a_broken_one_is_told() {
    let work = Workplace::new();
    let file = work.path("scenes/stanford_dragon/dragon_871k.ply");
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    std::fs::write(&file, "no mesh").unwrap();
    let line = format!("bench --suite lfb {QUICK} --scenes scenes -o out");
    let outcome = work.run(&line);
    assert_eq!(outcome.code, 1, "{}", outcome.stderr);
    assert!(outcome.stderr.contains("error: 1 point could not be measured"), "{}", outcome.stderr);
    assert!(outcome.stdout.contains("dragon_871k.ply"), "{}", outcome.stdout);
    assert!(outcome.stdout.contains("atrium: @boxes:n=28 stands in"), "{}", outcome.stdout);
    let report = json(&work, "out");
    assert_eq!(points(&report)[0]["results"][1]["outcome"], "failed");
    assert_eq!(points(&report)[1]["results"][1]["outcome"], "measured");

    let vertices = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let mesh = "element face 1\nproperty list uchar int vertex_indices\nend_header\n-1 -1 0\n1 -1 0\n0 1 0\n3 0 1 2\n";
    std::fs::write(&file, format!("{vertices}{mesh}")).unwrap();
    work.succeed(&line);
    let mended = json(&work, "out");
    let (dragon, atrium) = (points(&mended)[0], points(&mended)[1]);
    assert_eq!((&dragon["scene"], &dragon["stands_in"]), (&"stanford_dragon/dragon_871k.ply".into(), &false.into()));
    assert_eq!((&dragon["triangles"], &dragon["results"][1]["outcome"]), (&1.into(), &"measured".into()));
    assert_eq!(atrium, points(&report)[1], "only what failed is tried again");
}

#[test]
fn what_cannot_be_done_is_said_and_leaves_nothing_behind() {
    let work = Workplace::new();
    work.write("file", "");
    for (line, code, says) in [
        ("bench --quick -o nowhere/out", 1, "no folder 'nowhere'"),
        ("bench --quick -o file", 1, "is a file"),
        ("bench --quick -o out --scenes missing", 1, "scenes folder 'missing'"),
        ("bench --quick -o out --scenes file", 1, "is a file"),
        ("bench -o out --repeats 0", 2, "from 1 to 10000"),
        ("bench -o out --time-limit soon", 2, "from 1 to 86400"),
        ("bench -o out --budget lots", 2, "512M"),
        ("bench -o out --threads -1", 2, "whole number"),
    ] {
        let outcome = work.run(line);
        assert_eq!(outcome.code, code, "{line}: {}", outcome.stderr);
        assert!(outcome.error().contains(says), "{line}: {}", outcome.stderr);
        assert_eq!(work.names(), ["file"], "{line}");
    }
    for (line, says) in [
        ("bench --suite lfb", "--output"),
        ("bench -o out --suite lfbb", "'lfb'"),
        ("bench @boxes -o out", "unexpected"),
    ] {
        let outcome = work.run(line);
        assert_eq!(outcome.code, 2, "{line}");
        assert!(outcome.stderr.contains(says), "{line}: {}", outcome.stderr);
    }
}
