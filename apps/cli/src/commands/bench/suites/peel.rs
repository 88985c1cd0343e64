//! Wellings, Depth Peeling Order Independent Transparency in Vulkan: blocks by layers.

use pellucid::Technique;

use super::built_in;
use crate::commands::bench::pace::Work;
use crate::commands::bench::suite::{Axis, Point, Published, Series, Show, Suite};
use crate::commands::bench::variant::Variant;

pub(super) const SUITE: Suite = Suite {
    name: "peel",
    summary: "depth peeling: 100 to 2000 blocks, 4 and 8 layers, and all of them",
    wants_software_gpu: false,
    series: |_| vec![blocks()],
};

fn blocks() -> Series {
    // Of the picture, fragments of one block.
    const SHARE: f64 = 0.0085;
    let point = |n: u32| {
        let fragments = f64::from(n) * SHARE * 1920.0 * 1080.0;
        // The most at a pixel grows with their number.
        let layers = 0.07 * f64::from(n) + 12.0;
        Point::new(
            format!("{n} blocks"),
            built_in(format!("@blocks:n={n}")),
            Work::new(fragments, 12.0 * f64::from(n), layers),
        )
        .size(1920, 1080)
        .at(n.into())
    };
    let [alpha, peel, linear, cpu] =
        [Technique::Alpha, Technique::Peel, Technique::Linear, Technique::Cpu].map(Variant::of);
    Series {
        name: "blocks",
        title: "Blocks by layers",
        about: "Equally sized cubes anywhere and anyhow, a draw each, peeled to 4 layers, to 8 and to the last: what is cut \
                off is counted. Two techniques that need one or two passes for all layers stand beside.",
        axis: Some(Axis { name: "blocks", unit: "block", is_log: true }),
        variants: vec![alpha, Variant::layers(4), Variant::layers(8), peel, linear, cpu],
        points: [100, 250, 500, 1000, 2000].map(point).to_vec(),
        shows: &[Show::Rates, Show::Ratios, Show::Cuts],
        published: Some(Published {
            source: "Wellings: Depth Peeling Order Independent Transparency in Vulkan (2016)",
            hardware: "GeForce GTX 660 Ti (1200 MHz, PCIe 1.0 x16), driver 364.19, Linux, 1920 x 1080",
            heading: &["frames a second", "peel, 4 layers", "peel, 8 layers"],
            rows: &[
                &["100 blocks", "740", "413"],
                &["250 blocks", "537", "292"],
                &["500 blocks", "395", "212"],
                &["1000 blocks", "209", "115"],
                &["2000 blocks", "132", "66"],
            ],
            remarks: &[
                "Command buffers recorded once, sub-passes with input attachments; nothing said of pixels cut off.",
            ],
        }),
    }
}
