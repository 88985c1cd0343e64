//! Jakubowski, LucidRaster: the rasterizer in compute against unsorted blending by the hardware, its depth filter and its
//! threshold of alpha.

use pellucid::Technique;

use super::{ATRIUM, DRAGON, built_in};
use crate::args::Side;
use crate::commands::bench::pace::Work;
use crate::commands::bench::suite::{Point, Published, Series, Show, Source, Suite};
use crate::commands::bench::variant::Variant;

pub(super) const SUITE: Suite = Suite {
    name: "lucid",
    summary: "LucidRaster in compute against unsorted blending; its depth filter of 3, 8 and 12; its alpha threshold",
    wants_software_gpu: false,
    series: |_| vec![scenes("1080", (1920, 1080)), scenes("1440", (2560, 1440))],
};

const SOURCE: &str = "Jakubowski: LucidRaster, GPU Software Rasterizer for Exact Order-Independent Transparency (2025)";
const HARDWARE: &str = "GeForce GTX 3050 Ti, Windows 10, 2560 x 1330; times in microseconds";

const PUBLISHED: Published = Published {
    source: SOURCE,
    hardware: HARDWARE,
    heading: &[
        "scene",
        "lucid over alpha",
        "set-up",
        "binning",
        "raster, low",
        "raster, high",
        "samples a half-block",
        "wrong at 3, 8, 12",
    ],
    rows: &[
        &["boxes", "4.26", "24", "53", "1609", "4", "17.91", "3, 0, 0"],
        &["bunny", "4.49", "53", "38", "234", "4", "3.33", "1, 0, 0"],
        &["conference", "5.12", "58", "76", "1002", "4", "16.75", "19, 0, 0"],
        &["dragon", "3.38", "328", "51", "302", "136", "1.25", "0, 0, 0"],
        &["gallery", "3.87", "771", "78", "1427", "324", "3.07", "70, 1, 0"],
        &["hairball", "3.23", "1756", "244", "355", "9146", "2.89", "14100, 1530, 660"],
        &["powerplant", "2.13", "2720", "346", "838", "6201", "3.60", "1800, 15, 3"],
        &["san miguel", "2.52", "2391", "216", "2261", "4349", "6.57", "17112, 4513, 2828"],
        &["scrub pine", "2.98", "15", "61", "474", "4", "24.44", "190, 0, 0"],
        &["sponza", "2.31", "98", "130", "3658", "3", "19.80", "290, 4, 1"],
        &["teapot", "3.36", "23", "40", "285", "4", "8.53", "9, 0, 0"],
        &["white oak", "2.15", "37", "189", "12759", "3", "26.95", "34780, 2850, 905"],
    ],
    remarks: &[
        "On average 3.32 times the time of alpha; on a Radeon RX 6700 XT at 1920 x 1031 2.16 (white oak) to 4.25 (scrub pine) \
         times. Wrong pixels stay wrong: 0.17 %, 0.02 % and 0.01 % on average. Filters of 8 and 12 take 2 % and 17 % longer.",
        "With the threshold of alpha boxes take 3.21 (opacity 0.5) and 2.92 (0.8) times the time of alpha, the hairball 2.75, \
         the power plant 1.98, the white oak 2.17 and 1.83.",
    ],
};

fn scenes(name: &'static str, size: (u32, u32)) -> Series {
    let file = |path, stand_in| Source::File { path, stand_in };
    // Fragments are told for 1280 x 720, and grow with the picture.
    let scale = f64::from(size.0) * f64::from(size.1) / (1280.0 * 720.0);
    let point = |label: &str, source: Source, fragments: f64, triangles: f64, layers: f64| {
        let work = Work::new(scale * fragments, triangles, layers);
        Point::new(label, source, work).size(size.0, size.1).opacity(0.5)
    };
    let bunny = file("stanford_bunny/bunny_144k.ply", "@spheres:n=112");
    let hair = file("sintel_hair/sintel_hair_tubes.ply", "@hairball:strands=7000,segments=24");
    let conference = file("conference_room/conference.glb", "@boxes:n=30");
    let oak = file("oak_tree/oak_tree.glb", "@tree");
    let pine = file("scrub_pine/scrubPine.obj", "@tree:leaves=200");
    let teapot = file("utah_teapot/teapot.obj", "@teapot");
    let [alpha, lucid, linear, cpu] =
        [Technique::Alpha, Technique::Lucid, Technique::Linear, Technique::Cpu].map(Variant::of);
    Series {
        name,
        title: match name {
            "1080" => "Scenes at 1920 x 1080",
            _ => "Scenes at 2560 x 1440",
        },
        about: "Every material's alpha times 0.5; Sponza with the camera inside. The depth filter holds 3 fragments of a pixel, \
                8 or 12; with the threshold a pixel is left when less than 1/128 of the light gets through. Wrong pixels are \
                counted twice: those that leave the filter out of order, and those of the finished picture that differ from \
                one of fragments that are all sorted.",
        axis: None,
        variants: vec![alpha, lucid, Variant::filter(8), Variant::filter(12), Variant::leaving_early(), linear, cpu],
        points: vec![
            point("boxes", built_in("@boxes:n=10"), 1.4e6, 12_000.0, 20.0),
            point("teapot", teapot, 0.3e6, 16_000.0, 8.0),
            point("bunny", bunny, 0.3e6, 144_046.0, 8.0).seen_from(Side::Front),
            point("scrub pine", pine, 0.5e6, 527.0, 20.0),
            point("dragon", DRAGON, 0.3e6, 871_414.0, 14.0).seen_from(Side::Front),
            point("oak", oak, 2e6, 36_006.0, 60.0),
            point("hairball", built_in("@hairball"), 2e6, 192_000.0, 60.0),
            point("hair", hair, 3.5e6, 1_026_000.0, 154.0).seen_from(Side::Front),
            point("conference", conference, 4e6, 331_179.0, 40.0),
            point("Sponza", ATRIUM, 9e6, 262_267.0, 30.0).between([-6.0, 2.0, 0.0], [2.0, 3.0, 0.0]),
        ],
        shows: &[Show::Ratios, Show::Times, Show::Steps, Show::HalfBlocks, Show::Wrong, Show::Memory],
        published: Some(PUBLISHED),
    }
}
