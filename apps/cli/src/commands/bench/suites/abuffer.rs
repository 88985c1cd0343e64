//! Crassin, Fast and Accurate Single-Pass A-Buffer using OpenGL 4.0+: against plain rasterization.

use pellucid::Technique;

use super::{DRAGON, built_in};
use crate::commands::bench::pace::Work;
use crate::commands::bench::suite::{Axis, Point, Published, Series, Show, Suite};
use crate::commands::bench::variant::Variant;

pub(super) const SUITE: Suite = Suite {
    name: "abuffer",
    summary: "the A-buffer against plain rasterization: 8 to 64 layers, in buffers and in textures",
    wants_software_gpu: false,
    series: |_| vec![dragon(), layers()],
};

const PUBLISHED: Published = Published {
    source: "Crassin: Fast and Accurate Single-Pass A-Buffer using OpenGL 4.0+ (2010)",
    hardware: "GeForce GTX 480, Stanford dragon, room for 32 layers at every pixel",
    heading: &["", "A-buffer"],
    rows: &[&["frames a second", "400 to 500"], &["over plain rasterization", "1.05 to 1.2 times the time"]],
    remarks: &["More than twice as fast as a k-buffer of 16 layers. The size of the picture is not told."],
};

fn variants() -> Vec<Variant> {
    let [alpha, abuffer, cpu] = [Technique::Alpha, Technique::ABuffer, Technique::Cpu].map(Variant::of);
    vec![alpha, abuffer, Variant::in_textures(), cpu]
}

fn dragon() -> Series {
    let point = Point::new("dragon", DRAGON, Work::new(0.56e6, 871_414.0, 10.0)).opacity(0.3);
    Series {
        name: "dragon",
        title: "The article's dragon",
        about: "Every pixel has room for as many fragments as the deepest one; plain rasterization is alpha, blending in draw \
                order.",
        axis: None,
        variants: variants(),
        points: vec![point.between([-0.005, 0.125, 0.36], [-0.005, 0.125, 0.0])],
        shows: &[Show::Rates, Show::Ratios, Show::Steps, Show::Memory],
        published: Some(PUBLISHED),
    }
}

fn layers() -> Series {
    const COVERAGE: f64 = 0.25;
    let point = |layers: u32| {
        let fragments = f64::from(layers) * COVERAGE * 1280.0 * 720.0;
        let scene = built_in(format!("@grids:layers={layers},tessellation=20,coverage={COVERAGE}"));
        let work = Work::new(fragments, 800.0 * f64::from(layers), layers.into());
        Point::new(format!("{layers} layers"), scene, work).at(layers.into())
    };
    Series {
        name: "layers",
        title: "8 to 64 layers",
        about: "Grids before a quarter of the picture: room is taken at every pixel of the other three too.",
        axis: Some(Axis { name: "layers", unit: "layer", is_log: true }),
        variants: variants(),
        points: [8, 16, 24, 32, 48, 64].map(point).to_vec(),
        shows: &[Show::Times, Show::Ratios, Show::Memory],
        published: Some(PUBLISHED),
    }
}
