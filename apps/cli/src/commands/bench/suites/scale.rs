//! How cost grows: with fragments, triangles, pixels, depth complexity and threads.

use pellucid::Technique;

use super::built_in;
use crate::commands::bench::pace::Work;
use crate::commands::bench::suite::{Axis, Point, Series, Show, Suite};
use crate::commands::bench::variant::Variant;

pub(super) const SUITE: Suite = Suite {
    name: "scale",
    summary: "how cost grows: fragments, triangles, pixels, depth complexity, threads, with fitted exponents",
    wants_software_gpu: false,
    series: |cores| vec![fragments(), triangles(), pixels(), depth(), threads(cores)],
};

fn variants() -> Vec<Variant> {
    use Technique::{ABuffer, Alpha, Cpu, Linear, List, Pages, Peel};
    [Cpu, Alpha, Linear, List, Pages, ABuffer, Peel].map(Variant::of).to_vec()
}

/// Sides of square pictures, each with four times the pixels of the one before.
const SIDES: [u32; 6] = [256, 512, 1024, 2048, 4096, 8192];

/// Planes that fill a square picture.
fn planes(label: String, layers: u32, side: u32) -> Point {
    let pixels = f64::from(side).powi(2);
    let work = Work::new(f64::from(layers) * pixels, 2.0 * f64::from(layers), layers.into());
    Point::new(label, built_in(format!("@planes:n={layers},alpha=0.1")), work).size(side, side)
}

fn square(side: u32) -> String {
    format!("{side} x {side}")
}

fn fragments() -> Series {
    const LAYERS: u32 = 16;
    let point = |side: u32| planes(square(side), LAYERS, side).at(f64::from(LAYERS) * f64::from(side).powi(2));
    Series {
        name: "fragments",
        title: "1 M to 1 G fragments",
        about: "Sixteen planes before every pixel of pictures that grow.",
        axis: Some(Axis::FRAGMENTS),
        variants: variants(),
        points: SIDES.map(point).to_vec(),
        shows: &[Show::Times, Show::UnitCosts, Show::Exponents, Show::Memory],
        published: None,
    }
}

fn triangles() -> Series {
    const LAYERS: u32 = 50;
    let point = |tessellation: u32| {
        let triangles = f64::from(2 * LAYERS * tessellation.pow(2));
        let scene = built_in(format!("@grids:layers={LAYERS},tessellation={tessellation},coverage=0.01"));
        let work = Work::new(0.01 * f64::from(LAYERS) * 1280.0 * 720.0, triangles, LAYERS.into());
        Point::new(format!("50 x {}", 2 * tessellation.pow(2)), scene, work).at(triangles)
    };
    Series {
        name: "triangles",
        title: "100 K to 100 M triangles",
        about: "Fifty instances of a mesh before a hundredth of the picture: 0.46 million fragments throughout, of ever \
                smaller triangles, most of which cover no pixel in the end.",
        axis: Some(Axis { name: "triangles", unit: "triangle", is_log: true }),
        variants: variants(),
        points: [32, 100, 316, 1000].map(point).to_vec(),
        shows: &[Show::Times, Show::UnitCosts, Show::Exponents, Show::Memory],
        published: None,
    }
}

fn pixels() -> Series {
    let point = |side: u32| planes(square(side), 1, side).at(f64::from(side).powi(2));
    Series {
        name: "pixels",
        title: "256 x 256 to 8192 x 8192 pixels",
        about: "A single plane before every pixel.",
        axis: Some(Axis::PIXELS),
        variants: variants(),
        points: SIDES.map(point).to_vec(),
        shows: &[Show::Times, Show::UnitCosts, Show::Exponents],
        published: None,
    }
}

fn depth() -> Series {
    let point = |layers: u32| planes(format!("{layers} layers"), layers, 512).at(layers.into());
    Series {
        name: "depth",
        title: "Depth complexity 1 to 4096",
        about: "More and more planes, drawn in any order, before each of 512 x 512 pixels.",
        axis: Some(Axis { name: "layers", unit: "layer", is_log: true }),
        variants: variants(),
        points: [1, 4, 16, 64, 256, 1024, 4096].map(point).to_vec(),
        shows: &[Show::Times, Show::UnitCosts, Show::Exponents, Show::Memory],
        published: None,
    }
}

fn threads(cores: usize) -> Series {
    // 1, 2, 4 ... and all.
    let mut counts: Vec<usize> =
        std::iter::successors(Some(1), |count| Some(2 * count)).take_while(|&count| count < cores).collect();
    counts.push(cores);
    let boxes = Work::new(2.8e6, 96_000.0, 40.0);
    Series {
        name: "threads",
        title: "One thread to all",
        about: "The CPU renderer alone, on scenes with many triangles and with many fragments.",
        axis: None,
        variants: counts.into_iter().map(Variant::threads).collect(),
        points: vec![
            Point::new("boxes", built_in("@boxes:n=20"), boxes).opacity(0.3),
            planes("planes".into(), 16, 1024),
            Point::new("spheres", built_in("@spheres:n=680"), Work::new(2.2e6, 870_400.0, 30.0)).opacity(0.3),
        ],
        shows: &[Show::Times, Show::Speedups],
        published: None,
    }
}
