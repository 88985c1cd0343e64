//! Pictures by shaders of several passes, through an F-Buffer or, to see what goes wrong, through a framebuffer: the
//! figures of the F-Buffer paper (Houston, Preetham and Segal 2005).
//!
//! Surfaces are blended in draw order, as the paper has it: its scenes draw what is farther first. For order-independent
//! blending there is the technique `fbuffer`.

mod glass;
#[cfg(feature = "gpu")]
mod gpu;

use std::fmt;
use std::str::FromStr;
use std::time::Instant;

use glam::Vec4;
use pellucid_core::fbuffer::order::Geometry;
use pellucid_core::fbuffer::{Drawn, Output, RasterOrder, Size, Windows};
use pellucid_core::primitive::Pass;
use pellucid_core::stats::Step;
use pellucid_core::{Error, Image, Scene, View};
use pellucid_cpu::fbuffer::{FBuffer, Program, Target, Verdict, draw_through_framebuffer};

pub use glass::{PASSES as GLASS_PASSES, environment};
#[cfg(feature = "gpu")]
pub use gpu::GpuMultiPass;

/// A shader of several passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shader {
    /// Two passes: the first saves a surface's colour, the second restores it (figure 1).
    #[default]
    Lighting,
    /// Three passes: bumps, refraction and reflection, and what is seen of both (figure 3).
    PittedGlass,
}

impl Shader {
    /// Names, as on the command line, with what they are.
    pub const NAMES: [(&str, &str); 2] = [
        ("lighting", "saves the colour in one pass, restores it in another"),
        ("pitted-glass", "bumps, then refraction and reflection, then both"),
    ];

    /// How many passes it has.
    pub fn passes(self) -> u64 {
        match self {
            Self::Lighting => 2,
            Self::PittedGlass => GLASS_PASSES,
        }
    }
}

impl fmt::Display for Shader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Lighting => "lighting",
            Self::PittedGlass => "pitted-glass",
        })
    }
}

impl FromStr for Shader {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        match name {
            "lighting" => Ok(Self::Lighting),
            "pitted-glass" => Ok(Self::PittedGlass),
            _ => Err(Error::UnknownName {
                kind: "shader",
                name: name.to_owned(),
                known: Self::NAMES.map(|(name, _)| name).join(", "),
            }),
        }
    }
}

/// Where intermediate results are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Through {
    /// One for each fragment, in a buffer of this size.
    FBuffer(Size),
    /// One for each pixel: wrong where surfaces overlap.
    Framebuffer,
}

/// A picture, and what it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Linear light, premultiplied alpha.
    pub image: Image,
    /// Windows, submissions of geometry and fragments of the transparent surfaces.
    pub drawn: Drawn,
    /// Bytes that intermediate results took.
    pub bytes: u64,
    /// Timed parts, in order: `geometry` (on the pixel grid, and its slots), `opaque` surfaces, `passes` with tests and
    /// blending.
    pub steps: Vec<Step>,
}

impl Picture {
    /// All timed parts together, in milliseconds.
    pub fn total_ms(&self) -> f64 {
        self.steps.iter().map(|step| step.ms).sum()
    }
}

/// Renders a view on the CPU: opaque surfaces first, lit in one pass, then transparent ones in draw order.
///
/// # Errors
/// If the view is invalid.
pub fn render(scene: &Scene, view: &View, shader: Shader, through: Through) -> Result<Picture, Error> {
    let start = Instant::now();
    let mut target = opaque(scene, view)?;
    let opaque = step("opaque", start);
    let start = Instant::now();
    let order = order(scene, view)?;
    let geometry = step("geometry", start);
    let start = Instant::now();
    let (drawn, bytes) = match shader {
        Shader::Lighting => run(&order, &lighting(), through, &mut target),
        Shader::PittedGlass => run(&order, &glass::program(), through, &mut target),
    };
    let steps = vec![geometry, opaque, step("passes", start)];
    Ok(Picture { image: target.color, drawn, bytes, steps })
}

/// The memory of an F-Buffer after its first window of a view, slot by slot and row by row: each holds the colour of its
/// fragment, or `background` (figure 2). And the windows that the whole view takes.
///
/// # Errors
/// If the view is invalid.
pub fn slots(scene: &Scene, view: &View, shader: Shader, size: Size) -> Result<(Image, Windows), Error> {
    let order = order(scene, view)?;
    let mut target = Target::new(view.width, view.height, Vec4::ZERO);
    let windows = Windows::new(order.fragments(), size);
    let mut image = Image::filled(size.width(), size.height(), view.background);
    let colors: Vec<Vec4> = match shader {
        Shader::Lighting => {
            let mut fbuffer = FBuffer::<Vec4>::new(size);
            fbuffer.window(&order, &lighting(), 0, Output::default(), &mut target);
            windows.slots(0).map(|slot| *fbuffer.state(slot)).collect()
        }
        Shader::PittedGlass => {
            let mut fbuffer = FBuffer::<glass::Slot>::new(size);
            fbuffer.window(&order, &glass::program(), 0, Output::default(), &mut target);
            windows.slots(0).map(|slot| fbuffer.state(slot).refracted).collect()
        }
    };
    for (pixel, color) in image.pixels_mut().iter_mut().zip(colors) {
        *pixel = over(color, *pixel);
    }
    Ok((image, windows))
}

/// Fragments of the transparent surfaces of a view: how many slots they take.
///
/// # Errors
/// If the view is invalid.
pub fn fragments(scene: &Scene, view: &View) -> Result<u64, Error> {
    Ok(order(scene, view)?.fragments())
}

/// Pixels that differ, by more than an 8-bit picture shows.
pub fn differing_pixels(a: &Image, b: &Image) -> u64 {
    let pairs = a.pixels().iter().zip(b.pixels());
    pairs.filter(|(a, b)| (**a - **b).abs().max_element() > 1.0 / 512.0).count() as u64
}

fn over(color: Vec4, background: Vec4) -> Vec4 {
    color + background * (1.0 - color.w)
}

fn step(name: &'static str, start: Instant) -> Step {
    Step { name, ms: start.elapsed().as_secs_f64() * 1e3 }
}

fn order<'a>(scene: &'a Scene, view: &View) -> Result<RasterOrder<'a>, Error> {
    Ok(RasterOrder::new(Geometry::new(scene, view, Pass::Transparent)?))
}

fn opaque(scene: &Scene, view: &View) -> Result<Target, Error> {
    let mut target = Target::new(view.width, view.height, view.background);
    let order = RasterOrder::new(Geometry::new(scene, view, Pass::Opaque)?);
    let lit = Program::new(|fragment, ()| fragment.color());
    FBuffer::new(Size::holding(order.fragments())).draw(&order, &lit, Output::OPAQUE, &mut target);
    Ok(target)
}

fn lighting() -> Program<'static, Vec4> {
    Program::new(|_, saved: &Vec4| Some(*saved)).pass(|fragment, saved| match fragment.color() {
        Some(color) => {
            *saved = color;
            Verdict::Keep
        }
        None => Verdict::Kill,
    })
}

fn run<S: Copy + Default>(
    order: &RasterOrder<'_>,
    program: &Program<'_, S>,
    through: Through,
    target: &mut Target,
) -> (Drawn, u64) {
    let output = Output { depth_test: true, ..Output::default() };
    match through {
        Through::FBuffer(size) => {
            let mut fbuffer = FBuffer::new(size);
            (fbuffer.draw(order, program, output, target), fbuffer.bytes())
        }
        Through::Framebuffer => {
            draw_through_framebuffer(order, program, output, target);
            let (submissions, fragments) = (program.pass_count(), order.fragments());
            (Drawn { windows: 1, submissions, fragments }, (target.depth.len() * size_of::<S>()) as u64)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(source: &str, size: u32) -> (Scene, View) {
        let scene = crate::load(source).unwrap().scene;
        let view = View::of(&scene).size(size, size).background(Vec4::ONE);
        (scene, view)
    }

    fn square(side: u32) -> Through {
        Through::FBuffer(Size::square(side).unwrap())
    }

    #[test]
    fn figure_1_is_right_through_an_f_buffer_and_wrong_through_a_framebuffer() {
        let (scene, view) = figure("@fbuffer", 200);
        let [right, wrong] = [square(256), Through::Framebuffer]
            .map(|through| render(&scene, &view, Shader::Lighting, through).unwrap().image);
        let one_pass = crate::Renderer::new().render(&scene, &view, crate::Resolve::Blend).unwrap();
        assert_eq!(differing_pixels(&right, &one_pass.image), 0);
        let overlapping = one_pass.stats.fragments
            - (one_pass.stats.fragments as f64 / one_pass.stats.mean_depth_complexity).round() as u64;
        assert_eq!(differing_pixels(&wrong, &right), overlapping, "where the triangles overlap, and nowhere else");
    }

    #[test]
    fn figure_2_fills_slots_from_the_first() {
        let (scene, view) = figure("@fbuffer:figure=rainbow", 512);
        for side in [64, 128, 256, 512] {
            let (image, windows) = slots(&scene, &view, Shader::Lighting, Size::square(side).unwrap()).unwrap();
            let used = windows.slots(0).end as usize;
            assert!(image.pixels()[..used].iter().all(|&pixel| pixel != Vec4::ONE), "{side}");
            assert!(image.pixels()[used..].iter().all(|&pixel| pixel == Vec4::ONE), "{side}");
            assert_eq!(used == image.pixels().len(), side < 256, "it overflows buffers of 64 and 128 slots a side");
        }
    }

    #[test]
    fn figure_3_is_the_same_in_any_buffer_and_not_through_a_framebuffer() {
        let (scene, view) = figure("@fbuffer:figure=sphere,sides=32", 64);
        let expected = render(&scene, &view, Shader::PittedGlass, square(2048)).unwrap();
        assert_eq!(expected.drawn.submissions, 3);
        for side in [32, 64] {
            let picture = render(&scene, &view, Shader::PittedGlass, square(side)).unwrap();
            assert!(picture.image == expected.image, "{side}");
            assert!(picture.drawn.windows > 1);
        }
        let wrong = render(&scene, &view, Shader::PittedGlass, Through::Framebuffer).unwrap();
        assert!(differing_pixels(&wrong.image, &expected.image) > 1000);
    }
}
