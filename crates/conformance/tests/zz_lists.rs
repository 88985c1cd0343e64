//! Temporary.
use pellucid::gpu::{ContextOptions, GpuRenderer};
use pellucid::{Renderer, Technique};
use pellucid_conformance::suite::{CASES, Candidate, Check};
#[test]
fn zz() {
    let rss = || std::fs::read_to_string("/proc/self/status").unwrap().lines().find(|l| l.starts_with("VmRSS")).unwrap().to_owned();
    let skip: usize = std::env::var("SKIP").map_or(0, |s| s.parse().unwrap());
    let mut bad = 0;
    let names = std::env::var("TECH").unwrap();
    for floor in [false, true] {
        if std::env::var("FLOOR").is_ok_and(|f| (f == "1") != floor) { continue; }
        let all: Vec<_> = names.split(',').map(|n| n.parse::<Technique>().unwrap()).map(|t| (t, Candidate::new(t, Renderer::new().gpu(GpuRenderer::new(&ContextOptions { floor, allow_software: true }).unwrap())))).collect();
        for case in CASES.iter().skip(skip) {
            let start = std::time::Instant::now();
            let prepared = case.prepare().unwrap();
            for (technique, candidate) in &all {
                for check in Check::ALL {
                    let comparison = prepared.run(check, candidate).unwrap_or_else(|error| panic!("{case:?}: {error}"));
                    if !comparison.passes() { bad += 1; println!("BAD {technique} floor {floor}, {case:?}, {check}: {comparison:?}"); }
                }
            }
            println!("{} {} {:?} {:?} {}", case.source, case.view, case.size, start.elapsed(), rss());
        }
    }
    println!("bad {bad}");
    assert_eq!(bad, 0);
}
