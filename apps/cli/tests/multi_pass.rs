//! `pellucid render --shader`: the figures of the F-Buffer paper from the command line.

mod common;

use common::Workplace;
use serde_json::Value;

fn figures(work: &Workplace, line: &str) -> Value {
    serde_json::from_str(&work.succeed(&format!("render {line} --stats - -q")).stdout).unwrap()
}

#[test]
fn both_ways_stand_beside_each_other() {
    let work = Workplace::new();
    let both = figures(&work, "@fbuffer -o both.png --size 100x80 --shader lighting --through both");
    assert_eq!((&both["width"], &both["passes"], &both["windows"]), (&200.into(), &2.into(), &1.into()));
    assert!(both["wrong_pixels"].as_u64().unwrap() > 100);
    for (through, left) in [("framebuffer", 0), ("fbuffer", 100)] {
        work.succeed(&format!("render @fbuffer -o one.png --size 100x80 --shader lighting --through {through}"));
        let half = work.png("both.png").crop_imm(left, 0, 100, 80);
        assert!(half == work.png("one.png"), "{through}");
    }
    work.succeed("render @fbuffer -o blend.png --size 100x80");
    assert!(work.png("blend.png") == work.png("one.png"), "these triangles are drawn back to front");
}

#[test]
fn a_buffer_of_any_size_gives_the_same_picture_in_more_windows() {
    let work = Workplace::new();
    let line = "@fbuffer:figure=sphere,sides=24 --size 90x90 --shader pitted-glass -o";
    let whole = figures(&work, &format!("{line} whole.png"));
    let small = figures(&work, &format!("{line} small.png --fbuffer 32"));
    assert!(work.png("whole.png") == work.png("small.png"));
    let windows = small["windows"].as_u64().unwrap();
    assert_eq!(windows, small["fragments"].as_u64().unwrap().div_ceil(1024));
    assert_eq!((&whole["submissions"], &small["submissions"]), (&3.into(), &(3 * windows).into()));
    assert!(small["bytes"].as_u64() < whole["bytes"].as_u64());
}

#[test]
fn slots_draw_the_memory_of_the_buffer() {
    let work = Workplace::new();
    let outcome =
        work.succeed("render @fbuffer:figure=rainbow -o slots.png --size 256x256 --resolve slots --fbuffer 64");
    assert!(outcome.stderr.contains("windows of 64x64 slots"), "{}", outcome.stderr);
    let image = work.png("slots.png");
    assert_eq!((image.width(), image.height()), (64, 64));
}

#[test]
fn a_gpu_gives_the_same_pictures() {
    if std::env::var("PELLUCID_REQUIRE_GPU").as_deref() != Ok("1") {
        return eprintln!("skipped: set PELLUCID_REQUIRE_GPU=1 to test on this machine's GPU, or a software one");
    }
    let work = Workplace::new();
    for line in [
        "@fbuffer --size 100x80 --shader lighting --through both",
        "@fbuffer:figure=rainbow --size 256x256 --resolve slots --fbuffer 64",
    ] {
        let on_cpu = figures(&work, &format!("{line} -o cpu.png --backend cpu"));
        let mut on_gpu = figures(&work, &format!("{line} -o gpu.png --backend gpu"));
        assert_eq!((&on_cpu["backend"], &on_gpu["backend"]), (&"cpu".into(), &"gpu".into()));
        for key in ["backend", "bytes", "total_ms"] {
            on_gpu[key] = on_cpu[key].clone();
        }
        assert_eq!(on_gpu, on_cpu);
        let differs = |(have, want): (u8, u8)| have.abs_diff(want) > 1;
        let (have, want) = (work.png("gpu.png").to_rgba8(), work.png("cpu.png").to_rgba8());
        let pairs = have.as_raw().iter().copied().zip(want.as_raw().iter().copied());
        assert_eq!(pairs.filter(|&pair| differs(pair)).count(), 0, "{line}");
    }
    let outcome = work.run("render @tree -o a.png --size 8x8 --shader lighting --backend gpu");
    assert_eq!(outcome.code, 1);
    assert!(outcome.error().contains("textures"), "{}", outcome.stderr);
}

#[test]
fn what_does_not_go_together_is_refused() {
    let work = Workplace::new();
    for line in [
        "--shader lighting --technique cpu",
        "--shader lighting --frames 3",
        "--shader lighting --resolve gelly",
        "--through both",
        "--resolve slots --through both",
        "--shader lighting --fbuffer 33",
        "--fbuffer 64",
        "--shader toon",
    ] {
        let outcome = work.run(&format!("render @fbuffer -o a.png --size 8x8 {line}"));
        assert_eq!(outcome.code, 2, "{line}: {}", outcome.stderr);
        outcome.error();
    }
    assert!(work.names().is_empty());
}
