//! `pellucid compare`: pictures, figures and the report.

mod common;

use std::collections::BTreeSet;

use common::{Workplace, names_in};
use serde_json::Value;

const SMALL: &str = "--size 96x64 --backend cpu";

fn json(work: &Workplace, path: &str) -> Value {
    serde_json::from_slice(&std::fs::read(work.path(path)).unwrap()).unwrap()
}

fn keys(value: &Value) -> BTreeSet<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

#[test]
fn the_folder_holds_pictures_figures_and_a_report() {
    let work = Workplace::new();
    let outcome = work.succeed(&format!("compare @boxes:n=3 -o out {SMALL}"));
    let expected = [
        "compare.csv",
        "compare.json",
        "complexity.png",
        "cpu-error.png",
        "cpu.png",
        "index.html",
        "layers.png",
        "reference.png",
        "split.png",
        "unsorted-error.png",
        "unsorted.png",
    ];
    assert_eq!(names_in(&work.path("out")), expected);
    assert!(outcome.stdout.starts_with("@boxes:n=3: blend, 96 x 64, "), "{}", outcome.stdout);
    assert!(outcome.stdout.contains("\nunsorted ") && outcome.stdout.contains("\ncpu "), "{}", outcome.stdout);
    assert!(outcome.stderr.trim_end().ends_with("index.html: open it in a browser"), "{}", outcome.stderr);
    for name in expected.iter().filter(|name| name.ends_with(".png") && **name != "layers.png") {
        let picture = work.png(&format!("out/{name}"));
        assert_eq!((picture.width(), picture.height()), (96, 64), "{name}");
    }
    let quiet = work.succeed(&format!("compare @boxes:n=3 -o out {SMALL} -q"));
    assert_eq!(quiet.stderr, "");
}

#[test]
fn exact_is_equal_and_unsorted_is_not() {
    let work = Workplace::new();
    work.succeed(&format!("compare @cyclic -o out {SMALL}"));
    work.succeed("render @cyclic -o plain.png --size 96x64");
    let plain = work.png("plain.png");
    assert!(work.png("out/cpu.png") == plain && work.png("out/reference.png") == plain);
    assert!(work.png("out/unsorted.png") != plain);
    let error = work.png("out/cpu-error.png").into_rgb8();
    assert_eq!(error.get_pixel(95, 0).0, [0, 0, 0], "black is equal");

    // Unsorted on the left, exact on the right.
    let (split, unsorted) = (work.png("out/split.png").into_rgb8(), work.png("out/unsorted.png").into_rgb8());
    for y in 25..64 {
        assert!((0..46).all(|x| split.get_pixel(x, y) == unsorted.get_pixel(x, y)));
        assert!((50..96).all(|x| split.get_pixel(x, y) == plain.to_rgb8().get_pixel(x, y)));
    }

    let report = json(&work, "out/compare.json");
    let [unsorted, cpu] = [&report["techniques"][0], &report["techniques"][1]];
    assert_eq!((&cpu["name"], &cpu["differing"], &cpu["max_error"]), (&"cpu".into(), &0.into(), &0.into()));
    assert_eq!((&cpu["psnr"], &cpu["ssim"], &cpu["flip"]), (&Value::Null, &1.0.into(), &0.0.into()));
    assert_eq!((&cpu["unexplained"], &cpu["agrees"]), (&0.into(), &true.into()));
    assert!(unsorted["unexplained"].as_u64().unwrap() > 0 && unsorted["total_ms"].is_null());
    assert!(unsorted["psnr"].as_f64().unwrap() < 60.0 && unsorted["flip"].as_f64().unwrap() > 0.0);
}

#[test]
fn every_resolve_is_compared() {
    let work = Workplace::new();
    for resolve in ["gelly", "blend:corrected", "nearest", "layer:2", "complexity"] {
        let line = format!("@boxes:n=3 {SMALL} --resolve {resolve} --opacity 0.5");
        work.succeed(&format!("compare {line} -o out --reference oracle"));
        // Unlike those of `render`, pictures of complexity bear no legend here.
        if resolve != "complexity" {
            work.succeed(&format!("render {line} -o plain.png"));
            let plain = work.png("plain.png");
            assert!(work.png("out/reference.png") == plain && work.png("out/cpu.png") == plain, "{resolve}");
        }
        let report = json(&work, "out/compare.json");
        assert_eq!(report["resolve"], resolve);
        let techniques = report["techniques"].as_array().unwrap();
        assert_eq!((techniques.len(), &techniques[0]["name"]), (1, &"cpu".into()), "what does not order is left out");
        assert_eq!((&techniques[0]["unexplained"], &techniques[0]["agrees"]), (&0.into(), &true.into()), "{resolve}");
    }
}

#[test]
fn the_worst_pixel_is_told_with_its_fragments_in_depth_order() {
    let work = Workplace::new();
    work.succeed(&format!("compare @boxes:n=3 -o out {SMALL}"));
    let report = json(&work, "out/compare.json");
    let spots = report["spots"].as_array().unwrap();
    let kinds: Vec<&str> = spots.iter().map(|spot| spot["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["worst", "deepest"]);
    assert_ne!(spots[0]["expected"], spots[0]["shown"]);
    assert_eq!(spots[1]["depth_complexity"], report["max_depth_complexity"]);
    for spot in spots {
        let fragments = spot["fragments"].as_array().unwrap();
        assert_eq!(spot["depth_complexity"], fragments.len());
        let numbers = |key: &str| fragments.iter().map(|f| f[key].as_f64().unwrap()).collect::<Vec<_>>();
        assert!(numbers("depth").is_sorted_by(|a, b| a >= b));
        assert!(numbers("distance").is_sorted());
        assert!(numbers("transmittance").is_sorted_by(|a, b| a >= b));
        assert_eq!(fragments.last().unwrap()["accumulated"], spot["expected"]);
    }
}

#[test]
fn figures_have_every_key_of_the_schema() {
    let work = Workplace::new();
    work.succeed(&format!("compare @boxes:n=2 -o out {SMALL} --techniques cpu,unsorted,cpu --reference cpu"));
    let report = json(&work, "out/compare.json");
    let schema = include_str!("../../../docs/schema.md");
    let section = schema.split("\n## ").find(|section| section.starts_with("`compare.json`")).unwrap();
    let documented: BTreeSet<&str> = section.split('`').skip(1).step_by(2).collect();
    let technique = &report["techniques"][0];
    let spot = report["spots"].as_array().unwrap().last().unwrap();
    for object in [&report, technique, &report["reference"], &report["layers"][0], spot, &spot["fragments"][0]] {
        let undocumented: Vec<_> = keys(object).difference(&documented).copied().collect();
        assert!(undocumented.is_empty(), "not in docs/schema.md: {undocumented:?}");
    }
    assert_eq!((&report["schema"], &report["command"]), (&1.into(), &"compare".into()));
    assert_eq!(technique["name"], "cpu", "in the order of --techniques, each once");
    assert_eq!(report["techniques"].as_array().unwrap().len(), 2);
    // Only the oracle knows.
    assert!(technique["ambiguous"].is_null() && technique["unexplained"].is_null() && technique["agrees"].is_null());
    let pixels: u64 = report["depth_complexity"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).sum();
    assert_eq!(pixels, 96 * 64);

    let csv = std::fs::read_to_string(work.path("out/compare.csv")).unwrap();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 3);
    assert!(lines[0].starts_with("technique,exact,") && lines[1].starts_with("cpu,true,cpu,\"CPU, "), "{csv}");
    assert!(lines[2].starts_with("unsorted,false,,"), "{csv}");
}

#[test]
fn the_report_is_one_file_that_needs_no_other() {
    let work = Workplace::new();
    work.write("a<b>&.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    work.succeed(&format!("compare a<b>&.obj -o out {SMALL} --opacity 0.5"));
    let page = std::fs::read_to_string(work.path("out/index.html")).unwrap();
    assert!(page.contains("<h1>a&lt;b&gt;&amp;.obj</h1>"));
    let data = page.split("type=\"application/json\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data: Value = serde_json::from_str(data).unwrap();
    assert_eq!(data["document"], json(&work, "out/compare.json"));
    for (name, source) in data["pictures"].as_object().unwrap() {
        let source = source.as_str().unwrap();
        assert!(source.starts_with("data:image/png;base64,") || data["pictures"][source].is_string(), "{name}");
    }
    for elsewhere in ["src=\"", "http:", "https:", "@import", "{{"] {
        assert!(!page.contains(elsewhere), "{elsewhere}");
    }
}

#[test]
fn scenes_without_layers_and_tiny_pictures_are_compared_too() {
    let work = Workplace::new();
    for line in ["@teapot --size 40x30", "@boxes:n=2 --size 1x1", "@planes:n=300 --size 7x5 --background none"] {
        work.succeed(&format!("compare {line} -o out --backend cpu"));
    }
}

#[test]
fn what_cannot_be_done_is_said_and_leaves_nothing_behind() {
    let work = Workplace::new();
    work.write("file", "");
    work.write("broken.glb", "no glTF");
    for (line, code, says) in [
        ("compare @boxes -o nowhere/out", 1, "no folder 'nowhere'"),
        ("compare @boxes -o file", 1, "is a file"),
        ("compare missing.obj -o out", 1, "missing.obj"),
        ("compare broken.glb -o out", 1, "broken.glb"),
        ("compare @boxes -o out --size 0x1", 2, "between 1 and 16384"),
        ("compare @boxes -o out --background bleu", 2, "CSS"),
        ("compare @boxes -o out --backend cpu --techniques alpha", 2, "runs on the gpu"),
        ("compare @boxes -o out --budget lots", 2, "512M"),
        ("compare @boxes -o out --resolve sum", 2, "'sum'"),
        ("compare @boxes -o out --resolve gelly --techniques unsorted", 2, "serves blend alone"),
        ("compare @boxes -o out --resolve nearest --techniques cpu,alpha", 2, "'alpha' does not order"),
        ("compare @boxes -o out --thickness 0", 2, "above 0"),
    ] {
        let outcome = work.run(line);
        assert_eq!(outcome.code, code, "{line}: {}", outcome.stderr);
        assert!(outcome.error().contains(says), "{line}: {}", outcome.stderr);
        assert_eq!(work.names(), ["broken.glb", "file"], "{line}");
    }
    for (line, says) in [
        ("compare @boxes", "--output"),
        ("compare @boxes -o out --techniques unsortd", "'unsorted'"),
        ("compare @boxes -o out --reference linear", "possible values"),
    ] {
        let outcome = work.run(line);
        assert_eq!(outcome.code, 2, "{line}");
        assert!(outcome.stderr.contains(says), "{line}: {}", outcome.stderr);
    }
}
