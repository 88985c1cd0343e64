//! The CPU renderer against what people have on machines without a GPU: techniques on a GPU made of software.

use pellucid::Technique;

use super::{ATRIUM, DRAGON, built_in};
use crate::args::Side;
use crate::commands::bench::pace::Work;
use crate::commands::bench::suite::{Point, Published, Series, Show, Source, Suite};
use crate::commands::bench::variant::Variant;

pub(super) const SUITE: Suite = Suite {
    name: "peers",
    summary: "the CPU renderer against unsorted blending, and all exact techniques, on a software GPU",
    wants_software_gpu: true,
    series: |_| vec![scenes()],
};

fn scenes() -> Series {
    use Technique::{ABuffer, Alpha, Cpu, Linear, List, Lucid, Pages, Peel};
    let file = |path, stand_in| Source::File { path, stand_in };
    // Seen from two sides each.
    let around = |label: &str, source: Source, work: Work| {
        [(Side::Front, "front"), (Side::Iso, "iso")].map(|(side, name)| {
            Point::new(format!("{label}, {name}"), source.clone(), work).opacity(0.3).seen_from(side)
        })
    };
    let atrium = |name: &str, eye, target| {
        let work = Work::new(9e6, 262_267.0, 30.0);
        Point::new(format!("Sponza, {name}"), ATRIUM, work).opacity(0.5).between(eye, target)
    };
    let bunny = file("stanford_bunny/bunny_144k.ply", "@spheres:n=112");
    let hair = file("sintel_hair/sintel_hair_tubes.ply", "@hairball:strands=7000,segments=24");
    let conference = file("conference_room/conference.glb", "@boxes:n=30");
    let oak = file("oak_tree/oak_tree.glb", "@tree");
    let brain = file("brain/brain_fsaverage5.glb", "@glass");
    let mut points = Vec::new();
    points.extend(around("bunny", bunny, Work::new(0.3e6, 144_046.0, 8.0)));
    points.extend(around("dragon", DRAGON, Work::new(0.3e6, 871_414.0, 10.0)));
    points.extend(around("hair", hair, Work::new(3.5e6, 1_026_000.0, 356.0)));
    points.push(atrium("along", [-6.0, 2.0, 0.0], [2.0, 3.0, 0.0]));
    points.push(atrium("across", [3.0, 2.0, -3.0], [-6.0, 3.0, 2.0]));
    points.extend(around("conference", conference, Work::new(4e6, 331_179.0, 40.0)));
    points.extend(around("oak", oak, Work::new(2e6, 36_006.0, 60.0)));
    points.extend(around("brain", brain, Work::new(2e6, 81_920.0, 20.0)));
    points.extend(around("boxes", built_in("@boxes:n=20"), Work::new(2.8e6, 96_000.0, 40.0)));
    Series {
        name: "scenes",
        title: "Eight scenes from two views each",
        about: "Every material's alpha times 0.3 (Sponza: 0.5, the camera inside), 1280 x 720. How many times longer than the \
                CPU renderer the others take: above 1 the CPU renderer is faster.",
        axis: None,
        variants: [Cpu, Alpha, Linear, List, Pages, Lucid, ABuffer, Peel].map(Variant::of).to_vec(),
        points,
        shows: &[Show::Peers, Show::Times],
        published: Some(Published {
            source: "Measured with other programs",
            hardware: "a 2-core machine, lavapipe and llvmpipe (Mesa 22.3), 1280 x 720",
            heading: &["ms a frame", "bunny", "dragon", "hair", "Sponza"],
            rows: &[
                &["VTK, unsorted", "25", "108", "253", "695"],
                &["Bevy 0.19, unsorted", "42", "122", "191", "232"],
                &["VTK, dual depth peeling", "241", "828", "18,166", "12,541"],
                &["Bevy 0.19, linked list", "70", "161", "692", "400"],
                &["NVIDIA's sample, its best method", "48", "161", "574", ""],
                &["Embree, all hits, no shading", "67", "101", "660", ""],
                &["a scalar tile renderer, bare colour", "8.7", "34", "104", ""],
            ],
            remarks: &["The first two do not order fragments. Bevy: with a bare material and lists long enough."],
        }),
    }
}
