//! What the command line does when something is wrong: exit code, one clear line, nothing left behind.

mod common;

use common::Workplace;

#[test]
fn values_without_meaning_are_usage_errors() {
    let work = Workplace::new();
    for (line, says) in [
        ("-o a.png --size 0x10", "between 1 and 16384"),
        ("-o a.png --size abc", "1280x720"),
        ("-o a.png --size 1000000x1000000", "between 1 and 16384"),
        ("-o a.png --opacity 2", "0"),
        ("-o a.png --opacity nan", "0"),
        ("-o a.png --eye 1,2", "three numbers"),
        ("-o a.png --eye 1,1,1 --target 1,1,1", "same point"),
        ("-o a.png --fov 180", "180"),
        ("-o a.png --background bleu", "CSS"),
        ("-o a.png --budget 5X", "512M"),
        ("-o a.png --frames 0", "1 to 9999"),
        ("-o a.png --threads 99999", "0 to 1024"),
        ("-o a.png --resolve sum", "blend"),
        ("-o a.jpg", ".png or .exr"),
        ("-o folder", ".png or .exr"),
    ] {
        let outcome = work.run(&format!("render @boxes:n=2 {line}"));
        assert_eq!(outcome.code, 2, "{line}: {}", outcome.stderr);
        assert!(outcome.error().contains(says), "{line}: {}", outcome.stderr);
        assert_eq!(outcome.stdout, "");
    }
    assert!(work.names().is_empty(), "{:?}", work.names());
}

#[test]
fn what_was_mistyped_is_said_with_what_was_meant() {
    let work = Workplace::new();
    for (line, hint) in [
        ("render @boxes -o a.png --opacty 1", "--opacity"),
        ("render @boxes -o a.png --technique cpuu", "'cpu'"),
        ("render @boxes -o a.png --view frnt", "'front'"),
        ("rendr @boxes -o a.png", "'render'"),
        ("render @boxes", "--output"),
        ("", "Usage"),
    ] {
        let outcome = work.run(line);
        assert_eq!(outcome.code, 2, "{line}");
        assert!(outcome.stderr.contains(hint) && outcome.stdout.is_empty(), "{line}: {}", outcome.stderr);
    }
    let outcome = work.run("render @boxs -o a.png");
    assert_eq!(outcome.code, 1);
    assert!(outcome.error().contains("@boxes"), "{}", outcome.stderr);
}

#[test]
fn failures_are_one_line_and_leave_nothing_behind() {
    let work = Workplace::new();
    work.write("broken.glb", "no glTF");
    work.write("scene.xyz", "");
    std::fs::create_dir(work.path("folder.png")).unwrap();
    let before = work.names();
    for (line, says) in [
        ("render missing.obj -o a.png", "missing.obj"),
        ("render broken.glb -o a.png", "broken.glb"),
        ("render scene.xyz -o a.png", ".gltf"),
        ("render @boxes:n=none -o a.png", "whole number"),
        ("render @boxes:n=2 -o folder.png", "is a folder"),
        ("render @boxes:n=2 -o nowhere/a.png", "no folder 'nowhere'"),
        ("render @boxes:n=2 -o broken.glb/a.png", "not a folder"),
        ("render @boxes:n=2 -o a.png --stats nowhere/s.json", "no folder 'nowhere'"),
        ("render @boxes:n=2 -o nowhere/a.png --frames 2", "no folder 'nowhere'"),
        ("info missing.obj", "missing.obj"),
    ] {
        let outcome = work.run(line);
        assert_eq!(outcome.code, 1, "{line}: {}", outcome.stderr);
        assert!(outcome.error().contains(says), "{line}: {}", outcome.stderr);
        assert!(outcome.error().matches("os error").count() <= 1, "told twice: {}", outcome.stderr);
        assert_eq!(work.names(), before, "{line}");
    }
}

#[test]
fn what_cannot_be_written_is_said_before_anything_is_loaded() {
    let work = Workplace::new();
    let outcome = work.run("render missing.obj -o nowhere/a.png");
    assert!(outcome.error().contains("nowhere"), "{}", outcome.stderr);
}

#[test]
fn a_failed_render_leaves_the_old_picture_alone() {
    let work = Workplace::new();
    work.write("a.png", "old");
    work.run("render missing.obj -o a.png");
    assert_eq!(std::fs::read(work.path("a.png")).unwrap(), b"old");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_failure() {
    let work = Workplace::new();
    let outcome = work.run("render @boxes:n=2 -o a.png --size 64x48 --stats /dev/full -q");
    assert_eq!(outcome.code, 1);
    assert!(outcome.error().contains("/dev/full"), "{}", outcome.stderr);

    for line in ["scenes", "techniques", "--help", "info @boxes:n=2 --size 64x48"] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let status = std::process::Command::new(env!("CARGO_BIN_EXE_pellucid"))
            .args(line.split_whitespace())
            .stdout(full)
            .stderr(std::process::Stdio::null())
            .status()
            .unwrap();
        assert_eq!(status.code(), Some(1), "{line}");
    }
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    for line in ["scenes", "techniques --json", "--help", "info @boxes:n=2 --size 64x48"] {
        let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_pellucid"))
            .args(line.split_whitespace())
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{line}");
        assert_eq!(String::from_utf8_lossy(&output.stderr), "", "{line}");
    }
}
