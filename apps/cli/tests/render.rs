//! `pellucid render`: pictures, turntables and figures.

mod common;

use common::Workplace;
use serde_json::Value;

#[test]
fn a_png_has_the_size_asked_for_and_stderr_says_what_was_rendered() {
    let work = Workplace::new();
    let outcome = work.succeed("render @boxes:n=2 -o a.png --size 64x48 --threads 2 --backend cpu");
    assert_eq!(work.names(), ["a.png"]);
    let image = work.png("a.png");
    assert_eq!((image.width(), image.height()), (64, 48));
    assert!(!image.color().has_alpha(), "nothing shines through the default background");
    assert_eq!(outcome.stdout, "");
    let line = outcome.stderr.trim_end();
    assert!(line.starts_with("a.png: 64 x 48, ") && line.ends_with(" ms (cpu, 2 threads)"), "{line}");
}

#[test]
fn without_a_background_a_png_is_transparent_where_nothing_is() {
    let work = Workplace::new();
    work.succeed("render @boxes:n=2 -o a.png --size 64x48 --background none");
    let image = work.png("a.png").into_rgba8();
    assert_eq!(image.get_pixel(0, 0).0, [0, 0, 0, 0]);
    let middle = image.get_pixel(32, 24)[3];
    assert!(middle > 0 && middle < 255, "alpha {middle} amid translucent boxes");
}

#[test]
fn a_background_is_what_is_seen_where_nothing_is() {
    let work = Workplace::new();
    work.succeed("render @boxes:n=2 -o a.png --size 64x48 --background #336699");
    assert_eq!(work.png("a.png").into_rgb8().get_pixel(0, 0).0, [0x33, 0x66, 0x99]);
}

#[test]
fn an_exr_holds_linear_light_with_premultiplied_alpha() {
    let work = Workplace::new();
    work.succeed("render @boxes:n=2 -o a.exr --size 64x48 --background #80000080");
    let image = exr::prelude::read_first_rgba_layer_from_file(
        work.path("a.exr"),
        |size, _| vec![[0f32; 4]; size.area()],
        |pixels, position, (r, g, b, a): (f32, f32, f32, f32)| {
            pixels[position.y() * 64 + position.x()] = [r, g, b, a];
        },
    )
    .unwrap();
    assert_eq!(image.layer_data.size, exr::math::Vec2(64, 48));
    let [r, g, b, a] = image.layer_data.channel_data.pixels[0];
    assert!((a - 128.0 / 255.0).abs() < 1e-6 && (r - 0.215_86 * a).abs() < 1e-5 && g == 0.0 && b == 0.0);
}

#[test]
fn options_change_the_picture() {
    let work = Workplace::new();
    work.succeed("render @boxes:n=2 -o plain.png --size 64x48");
    let plain = work.png("plain.png");
    for option in [
        "--view top",
        "--eye 0,0,9",
        "--target 0,1,0",
        "--up 1,0,0",
        "--fov 60 --eye 3,3,3",
        "--near 6",
        "--opacity 0.3",
        "--shading unlit",
        "--background white",
        "--resolve gelly",
        "--resolve nearest",
        "--resolve layer:2",
        "--resolve complexity",
        "--resolve gelly --thickness 0.1",
    ] {
        work.succeed(&format!("render @boxes:n=2 -o other.png --size 64x48 --backend cpu {option}"));
        assert!(work.png("other.png") != plain, "{option} changes nothing");
    }
    for option in ["--threads 1", "--technique oracle", "--budget 1M"] {
        work.succeed(&format!("render @boxes:n=2 -o same.png --size 64x48 --backend cpu {option}"));
        assert!(work.png("same.png") == plain, "{option} changes the picture");
    }
}

#[test]
fn a_file_renders_like_a_built_in_and_its_warnings_are_shown() {
    let work = Workplace::new();
    work.write("a.obj", "mtllib missing.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\n");
    let outcome = work.succeed("render a.obj -o a.png --size 64x48");
    let lines: Vec<&str> = outcome.stderr.lines().collect();
    assert_eq!(lines.len(), 3, "{lines:?}");
    assert!(lines[0].starts_with("warning: ") && lines[0].contains("missing.mtl"), "{lines:?}");
    assert!(lines[1].starts_with("warning: 1 triangle left out"), "{lines:?}");
    assert!(lines[2].starts_with("a.png: "), "{lines:?}");
    assert_eq!(work.succeed("render a.obj -o a.png --size 64x48 -q").stderr, "");
}

#[test]
fn a_turntable_writes_numbered_pictures_from_all_sides() {
    let work = Workplace::new();
    work.succeed("render @boxes:n=2 -o still.png --size 64x48 --opacity 0.5");
    let line = "render @boxes:n=2 -o t.png --size 64x48 --opacity 0.5 --frames 3 --stats t.json";
    let outcome = work.succeed(line);
    assert_eq!(work.names(), ["still.png", "t-0001.png", "t-0002.png", "t-0003.png", "t.json"]);
    assert!(outcome.stderr.starts_with("t-0001.png to t-0003.png: 3 pictures, 64 x 48, "), "{}", outcome.stderr);
    let [first, second, third] = ["t-0001.png", "t-0002.png", "t-0003.png"].map(|name| work.png(name));
    assert!(first == work.png("still.png"), "it starts where the still picture is taken from");
    assert!(first != second && second != third && third != first);

    let stats: Value = serde_json::from_slice(&std::fs::read(work.path("t.json")).unwrap()).unwrap();
    let frames = stats["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 3);
    assert_eq!(frames[1]["file"], "t-0002.png");
    assert!(frames.iter().all(|frame| frame["fragments"].as_u64().unwrap() > 0));
}

#[test]
fn a_turntable_about_the_line_of_sight_is_refused_before_the_first_picture() {
    let work = Workplace::new();
    let outcome = work.run("render @boxes:n=2 -o t.png --size 64x48 --frames 3 --view front --up 0,0,1");
    assert_eq!(outcome.code, 2);
    assert!(outcome.error().contains("--up"));
    assert!(work.names().is_empty());
}

#[test]
fn figures_have_every_key_of_the_schema() {
    let work = Workplace::new();
    work.succeed("render @boxes:n=2 -o a.png --size 64x48 --stats s.json --resolve layer:2 --backend cpu");
    let text = std::fs::read_to_string(work.path("s.json")).unwrap();
    let stats: Value = serde_json::from_str(&text).unwrap();
    let mut keys: Vec<&str> = stats.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    let mut schema = [
        "schema",
        "scene",
        "resolve",
        "backend",
        "technique",
        "device",
        "width",
        "height",
        "triangles",
        "dropped_triangles",
        "fragments",
        "max_depth_complexity",
        "mean_depth_complexity",
        "steps",
        "total_ms",
        "peak_bytes",
        "windows",
        "rerenders",
        "cut_pixels",
        "repaired_pixels",
        "half_block_parts",
        "lone_share",
        "exact",
    ];
    schema.sort_unstable();
    assert_eq!(keys, schema);
    assert_eq!(stats["schema"], 1);
    assert_eq!(stats["scene"], "@boxes:n=2");
    assert_eq!(stats["resolve"], "layer:2");
    assert_eq!((&stats["backend"], &stats["technique"], &stats["exact"]), (&"cpu".into(), &"cpu".into(), &true.into()));
    assert_eq!((&stats["width"], &stats["height"], &stats["triangles"]), (&64.into(), &48.into(), &96.into()));
    let steps = stats["steps"].as_array().unwrap();
    assert!(!steps.is_empty() && steps.iter().all(|step| step["name"].is_string() && step["ms"].is_f64()));
}

#[test]
fn figures_go_to_stdout_for_a_dash() {
    let work = Workplace::new();
    let outcome = work.succeed("render @boxes:n=2 -o a.png --size 64x48 --stats - --quiet");
    let stats: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert!(stats["fragments"].as_u64().unwrap() > 0);
    assert_eq!(outcome.stderr, "");
}

#[test]
fn a_heat_map_has_a_legend_and_a_tiny_one_says_its_scale() {
    let work = Workplace::new();
    let large = work.succeed("render @boxes:n=2 -o large.png --size 320x240 --resolve complexity");
    let tiny = work.succeed("render @boxes:n=2 -o tiny.png --size 64x48 --resolve complexity");
    assert!(!large.stderr.contains("legend"));
    assert!(tiny.stderr.contains("the scale is 0 (black) to "), "{}", tiny.stderr);
    // The panel's frame, where the picture itself is black.
    let image = work.png("large.png").into_rgb8();
    assert_ne!(image.get_pixel(6, 240 - 7).0, [0, 0, 0]);
    assert_eq!(image.get_pixel(319, 0).0, [0, 0, 0]);
}
