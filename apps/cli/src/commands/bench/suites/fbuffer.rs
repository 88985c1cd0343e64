//! Houston, Preetham and Segal, A Hardware F-Buffer Implementation: windows and passes of figures 1 to 3, time over the
//! buffer's size (figure 4), and multi-pass shading through an F-Buffer against the same through a framebuffer.

use pellucid::Technique;
use pellucid::multi_pass::Shader;

use super::built_in;
use crate::commands::bench::pace::Work;
use crate::commands::bench::suite::{Axis, Point, Published, Series, Show, Suite};
use crate::commands::bench::variant::{Passes, Variant};

pub(super) const SUITE: Suite = Suite {
    name: "fbuffer",
    summary: "F-Buffers of 64 x 64 to 2048 x 2048 slots, and against framebuffers (Houston, Preetham and Segal)",
    wants_software_gpu: false,
    series: |_| vec![figures(), one_window(), sizes_low(), sizes_high(), ordered()],
};

const SOURCE: &str = "Houston, Preetham and Segal: A Hardware F-Buffer Implementation (2005)";
const HARDWARE: &str = "ATI Radeon X800 series";
const GLASS_PASSES: f64 = 3.0;

fn through(is_through_fbuffer: bool) -> [Variant; 2] {
    [false, true].map(|is_on_gpu| Variant::passes(Passes { is_through_fbuffer, is_on_gpu }))
}

/// The glass sphere of figure 4, before 1024 x 1024 pixels.
fn sphere(label: String, sides: u32, side: u32) -> Point {
    let work = Work::new(GLASS_PASSES * 667_000.0, GLASS_PASSES * f64::from(sides * sides), 2.0);
    let scene = built_in(format!("@fbuffer:figure=sphere,sides={sides},fill=0.636"));
    Point::new(label, scene, work).size(1024, 1024).shaded(Shader::PittedGlass, side)
}

/// Of figure 3.
fn small_sphere(label: &str, side: u32) -> Point {
    let work = Work::new(GLASS_PASSES * 372_000.0, GLASS_PASSES * 4096.0, 2.0);
    let scene = built_in("@fbuffer:figure=sphere");
    Point::new(label, scene, work).size(512, 512).shaded(Shader::PittedGlass, side)
}

fn figures() -> Series {
    let triangles = Point::new("figure 1", built_in("@fbuffer"), Work::new(6e4, 2.0, 2.0)).size(300, 300);
    let rainbow = |side: u32| {
        let scene = built_in("@fbuffer:figure=rainbow");
        let point = Point::new(format!("figure 2, {side} x {side}"), scene, Work::new(6.4e4, 1.0, 1.0));
        point.size(512, 512).shaded(Shader::Lighting, side)
    };
    let mut points = vec![triangles.shaded(Shader::Lighting, 256)];
    points.extend([512, 256, 128, 64].map(rainbow));
    points.push(small_sphere("figure 3", 128));
    Series {
        name: "figures",
        title: "Windows and passes of figures 1 to 3",
        about: "Two triangles and a shader of two passes; a triangle in all colours in buffers of four sizes; a sphere of \
                pitted glass, three passes, 512 x 512 pixels, a buffer of 128 x 128 slots.",
        axis: None,
        variants: through(true).to_vec(),
        points,
        shows: &[Show::Submissions, Show::Times, Show::Memory],
        published: Some(Published {
            source: SOURCE,
            hardware: HARDWARE,
            heading: &["", "windows", "passes over the geometry"],
            rows: &[&["figure 3", "23", "69"]],
            remarks: &["Figure 2 overflows buffers of 64 x 64 and 128 x 128 slots, and fits 256 x 256 and 512 x 512."],
        }),
    }
}

fn one_window() -> Series {
    let triangles = Point::new("two triangles", built_in("@fbuffer"), Work::new(1e6, 2.0, 2.0)).size(1024, 1024);
    let layers = Point::new("4 grids", built_in("@grids:layers=4,tessellation=20"), Work::new(2e6, 6400.0, 4.0));
    let mut variants = through(true).to_vec();
    variants.extend(through(false));
    Series {
        name: "one-window",
        title: "Through an F-Buffer, and through a framebuffer",
        about: "All fragments fit the buffer. The same passes with one intermediate result a pixel are what they were before \
                F-Buffers, and wrong where surfaces overlap. Two triangles and grids have a shader of two passes, spheres \
                one of three. On both ways the GPU sorts final colours by pixel before it blends them.",
        axis: None,
        variants,
        points: vec![
            triangles.shaded(Shader::Lighting, 1024),
            small_sphere("sphere, 12,288 vertices, 512 x 512", 1024),
            sphere("sphere, 12,288 vertices".into(), 64, 1024),
            sphere("sphere, 196,608 vertices".into(), 256, 1024),
            layers.size(512, 512).shaded(Shader::Lighting, 1024),
        ],
        shows: &[Show::Through, Show::Times, Show::Steps, Show::Memory],
        published: Some(Published {
            source: SOURCE,
            hardware: HARDWARE,
            heading: &[],
            rows: &[],
            remarks: &[
                "\u{201c}The performance of rendering to F-Buffers with no overflow is equivalent to using traditional \
                        framebuffer methods.\u{201d}",
            ],
        }),
    }
}

const PUBLISHED_SIZES: Published = Published {
    source: SOURCE,
    hardware: HARDWARE,
    heading: &["buffer", "overflows", "passes over the geometry"],
    rows: &[&["64 x 64", "162", "489"], &["256 x 256", "10", "33"]],
    remarks: &[
        "Times are a curve without numbers. The sphere of 12,288 vertices is bound by vertices where the buffer is small, and by \
         fragments where it is large; that of 196,608 vertices by vertices at nearly all sizes.",
    ],
};

fn sizes(name: &'static str, title: &'static str, sides: u32) -> Series {
    let point = |side: u32| sphere(format!("{side} x {side}"), sides, side).at(side.into());
    Series {
        name,
        title,
        about: "Three passes of pitted glass, 1024 x 1024 pixels. The hardware sent all vertices again in each pass of each \
                window; here a window begins where its first slot is, so that only fragments are found again.",
        axis: Some(Axis { name: "slots along each side of the buffer", unit: "slot along each side", is_log: true }),
        variants: through(true).to_vec(),
        points: [2048, 1024, 512, 256, 128, 64].map(point).to_vec(),
        shows: &[Show::Times, Show::Submissions, Show::Memory],
        published: Some(PUBLISHED_SIZES),
    }
}

fn sizes_low() -> Series {
    sizes("low", "A sphere of 12,288 vertices in buffers of all sizes (figure 4)", 64)
}

fn sizes_high() -> Series {
    sizes("high", "A sphere of 196,608 vertices in buffers of all sizes (figure 4)", 256)
}

fn ordered() -> Series {
    use Technique::{Alpha, Cpu, FBuffer, Linear};
    let spheres = [64, 256].map(|sides| {
        let vertices = if sides == 64 { "12,288" } else { "196,608" };
        Point { shaded: None, ..sphere(format!("sphere, {vertices} vertices"), sides, 1024) }
    });
    let grids = |layers: u32| {
        let work = Work::new(0.25 * f64::from(layers) * 1024.0 * 1024.0, 800.0 * f64::from(layers), layers.into());
        let scene = built_in(format!("@grids:layers={layers},tessellation=20,coverage=0.25"));
        Point::new(format!("{layers} grids"), scene, work).size(1024, 1024)
    };
    Series {
        name: "ordered",
        title: "Order-independent blending by sorting an F-Buffer",
        about: "The technique of section 5.1, one pass of plain shading, against one that sorts pixel by pixel.",
        axis: None,
        variants: [Alpha, FBuffer, Linear, Cpu].map(Variant::of).to_vec(),
        points: spheres.into_iter().chain([4, 16].map(grids)).collect(),
        shows: &[Show::Ratios, Show::Times, Show::Memory],
        published: Some(Published {
            source: SOURCE,
            hardware: HARDWARE,
            heading: &[],
            rows: &[],
            remarks: &["Proposed, not measured: O(log\u{b2} n) passes of a stable sort; across windows \
                        \u{201c}non-trivial and expensive\u{201d}."],
        }),
    }
}
