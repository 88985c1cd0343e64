//! Knowles, Leach and Zambetta, Efficient Layered Fragment Buffer Techniques (OpenGL Insights, chapter 20): table 20.1,
//! figures 20.11 and 20.12, and the memory of each layout.

use pellucid::Technique;

use super::{ATRIUM, DRAGON, built_in};
use crate::commands::bench::pace::Work;
use crate::commands::bench::suite::{Axis, Point, Published, Series, Show, Suite};
use crate::commands::bench::variant::Variant;

pub(super) const SUITE: Suite = Suite {
    name: "lfb",
    summary: "layered fragment buffers: steps, fragments, depth complexity, memory (LFB chapter)",
    wants_software_gpu: false,
    series: |_| vec![steps(), fragments(), depth()],
};

/// The size of all the chapter's pictures.
const SIZE: (u32, u32) = (1920, 1080);
const PIXELS: f64 = 1920.0 * 1080.0;
const SOURCE: &str =
    "Knowles, Leach, Zambetta: Efficient Layered Fragment Buffer Techniques (OpenGL Insights, chapter 20)";
const HARDWARE: &str = "GeForce GTX 460, 1920 x 1080";

/// Those whose steps are told apart are also sorted in a step of its own.
fn variants_in_steps() -> Vec<Variant> {
    let presorted = [Technique::Linear, Technique::List].map(Variant::presorted);
    [variants(), presorted.to_vec()].concat()
}

fn variants() -> Vec<Variant> {
    use Technique::{ABuffer, Alpha, Cpu, Linear, List, Pages};
    [Alpha, Cpu, Linear, List, Pages, ABuffer].map(Variant::of).to_vec()
}

fn steps() -> Series {
    let dragon = Point::new("dragon", DRAGON, Work::new(1.3e6, 871_414.0, 10.0)).opacity(0.3);
    let atrium = Point::new("atrium", ATRIUM, Work::new(17.5e6, 262_267.0, 30.0)).opacity(0.5);
    Series {
        name: "steps",
        title: "Steps of a frame (table 20.1)",
        about: "The chapter's two meshes, all of them translucent, from views with about as many fragments as it had: the \
                dragon with few layers in a part of the picture, the atrium with many everywhere.",
        axis: None,
        variants: variants_in_steps(),
        points: vec![
            dragon.size(SIZE.0, SIZE.1).between([-0.005, 0.125, 0.36], [-0.005, 0.125, 0.0]),
            atrium.size(SIZE.0, SIZE.1).between([-6.0, 2.0, 0.0], [0.0, 3.0, 0.0]),
        ],
        shows: &[Show::Steps, Show::Times, Show::Ratios, Show::Memory],
        published: Some(Published {
            source: SOURCE,
            hardware: HARDWARE,
            heading: &["step, ms", "dragon, linear", "dragon, list", "atrium, linear", "atrium, list"],
            rows: &[
                &["zero tables or pointers", "0.02", "3.0", "0.02", "3.00"],
                &["fragment count render", "3.97", "", "10.60", ""],
                &["compute prefix sums", "4.47", "", "4.67", ""],
                &["main LFB render", "3.79", "5.99", "30.00", "30.99"],
                &["read and blend fragments", "8.52", "10.16", "95.05", "88.08"],
                &["sort in shader", "1.3", "0.93", "43.68", "42.14"],
                &["total", "22.07", "20.10", "177.05", "171.24"],
            ],
            remarks: &[
                "Dragon 1.3 M fragments, atrium 17.5 M. A list takes about a quarter more memory than a linear array.",
            ],
        }),
    }
}

fn fragments() -> Series {
    const LAYERS: f64 = 10.0;
    let point = |coverage: f64| {
        let fragments = LAYERS * coverage * PIXELS;
        let scene = built_in(format!("@grids:layers=10,tessellation=100,coverage={coverage}"));
        let label = format!("{:.0} % covered", 100.0 * coverage);
        Point::new(label, scene, Work::new(fragments, 200_000.0, LAYERS)).size(SIZE.0, SIZE.1).at(fragments)
    };
    Series {
        name: "fragments",
        title: "Time over total fragments (figure 20.11)",
        about: "Ten layers of grids of 20,000 triangles each, which cover more and more of the picture.",
        axis: Some(Axis { is_log: false, ..Axis::FRAGMENTS }),
        variants: variants(),
        points: [0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0].map(point).to_vec(),
        shows: &[Show::Times, Show::Ratios, Show::UnitCosts, Show::Memory],
        published: Some(Published {
            source: SOURCE,
            hardware: HARDWARE,
            heading: &[],
            rows: &[],
            remarks: &[
                "Time grows linearly with the fragments.",
                "Brute force (here: abuffer) is the fastest, and takes by far the most memory.",
            ],
        }),
    }
}

fn depth() -> Series {
    const FRAGMENTS: f64 = 8e6;
    let point = |layers: u32| {
        let coverage = FRAGMENTS / (f64::from(layers) * PIXELS);
        // 500 to 1000 triangles in all.
        let tessellation = (375.0 / f64::from(layers)).sqrt().round().max(1.0);
        let triangles = 2.0 * f64::from(layers) * tessellation.powi(2);
        let scene = built_in(format!("@grids:layers={layers},tessellation={tessellation},coverage={coverage:.6}"));
        Point::new(format!("{layers} layers"), scene, Work::new(FRAGMENTS, triangles, f64::from(layers)))
            .size(SIZE.0, SIZE.1)
            .at(f64::from(layers))
    };
    Series {
        name: "depth",
        title: "Depth complexity at a constant number of fragments (figure 20.12)",
        about: "More and more layers of grids that cover less and less of the picture: about 8 million fragments and 500 to \
                1000 triangles throughout.",
        axis: Some(Axis { name: "layers", unit: "layer", is_log: true }),
        variants: variants_in_steps(),
        points: [4, 8, 16, 32, 64, 128, 256].map(point).to_vec(),
        shows: &[Show::Times, Show::Ratios, Show::SortShares, Show::Memory],
        published: Some(Published {
            source: SOURCE,
            hardware: HARDWARE,
            heading: &[],
            rows: &[],
            remarks: &[
                "Linear and list take about the same, as sorting is common to both.",
                "From about 50 layers on sorting takes most of the time.",
                "Insertion sort is the fastest up to 32 fragments.",
                "Declaring and filling a local array for 256 fragments alone makes reading 3 to 4 times slower.",
            ],
        }),
    }
}
