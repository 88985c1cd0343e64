use pellucid::gpu::{ContextOptions, GpuRenderer};
use pellucid::{Renderer, Technique};
use pellucid_conformance::suite::CASES;
use pellucid_conformance::layers;
fn main() {
    let want = std::env::args().nth(1).unwrap();
    let gpu = GpuRenderer::new(&ContextOptions { floor: false, allow_software: true }).unwrap();
    let r = Renderer::new().gpu(gpu).technique(Technique::Linear);
    for case in CASES.iter().filter(|c| format!("{c:?}").contains(&want)) {
        println!("{case:?}");
        let p = case.prepare().unwrap();
        let have = layers::gather(&r, &p.scene, &p.view).unwrap();
        let e = &p.capture.layers;
        for y in 0..e.height { for x in 0..e.width {
            let (w, h) = (e.pixel(x, y), have.pixel(x, y));
            let pw: Vec<u32> = w.iter().map(|f| f.primitive).collect();
            let ph: Vec<u32> = h.iter().map(|f| f.primitive).collect();
            if pw == ph { continue }
            println!("pixel {x},{y} ambiguous {} counts {} {}", p.capture.ambiguous[(y * e.width + x) as usize], pw.len(), ph.len());
            let lost: Vec<_> = w.iter().filter(|f| !ph.contains(&f.primitive)).collect();
            let more: Vec<_> = h.iter().filter(|f| !pw.contains(&f.primitive)).collect();
            println!("  lost {} of primitives {:?}\n  more {:?}", lost.len(), lost.iter().map(|f| f.primitive).collect::<Vec<_>>(), more.iter().map(|f|f.primitive).collect::<Vec<_>>());
            if lost.is_empty() && more.is_empty() {
                for (a, b) in w.iter().zip(h) { if a.primitive != b.primitive { println!("  order {} {} {:?} {:?}", a.primitive, b.primitive, a.depth, b.depth); } }
            }
        } }
    }
}
