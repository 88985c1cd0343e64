//! The suite finds what is broken: renderers with one fault each, run through the code behind `pellucid verify`.

use glam::Vec3;
use pellucid::core::resolve::{PixelResolver, finish};
use pellucid::{Camera, Error, Image, Layers, Projection, Renderer, Resolve, Scene, Stats, Technique, View};
use pellucid_conformance::layers;
use pellucid_conformance::suite::{CASES, Candidate, Case, Check, Subject};

/// The CPU renderer with a fault, judged as leniently as a GPU is.
struct Broken {
    renderer: Renderer,
    /// Changes the view before anything is captured.
    misplace: fn(&mut View),
    /// Changes what was captured.
    spoil: fn(&mut Layers),
}

impl Broken {
    fn new(misplace: fn(&mut View), spoil: fn(&mut Layers)) -> Self {
        Self { renderer: Renderer::new().threads(1), misplace, spoil }
    }
}

impl Subject for Broken {
    fn layers(&self, scene: &Scene, view: &View) -> Result<Layers, Error> {
        let mut view = view.clone();
        (self.misplace)(&mut view);
        let mut layers = layers::gather(&self.renderer, scene, &view)?;
        (self.spoil)(&mut layers);
        Ok(layers)
    }

    fn picture(&self, scene: &Scene, view: &View, resolve: Resolve) -> Result<Image, Error> {
        let layers = self.layers(scene, view)?;
        let resolver = PixelResolver::new(resolve, view);
        let mut image = Image::filled(view.width, view.height, view.background);
        let mut stats = Stats::new(Technique::Cpu, String::new(), view.width, view.height);
        for (i, pixel) in image.pixels_mut().iter_mut().enumerate() {
            let (x, y) = (i as u32 % view.width, i as u32 / view.width);
            *pixel = resolver.pixel(layers.pixel(x, y), layers.opaque(x, y));
            stats.max_depth_complexity = stats.max_depth_complexity.max(layers.depth_complexity(x, y));
        }
        finish(resolve, &mut image, &stats);
        Ok(image)
    }

    fn has_own_rounding(&self) -> bool {
        true
    }
}

fn case(source: &str) -> &'static Case {
    CASES.iter().find(|case| case.source == source).expect("it is in the suite")
}

fn passes(case: &Case, check: Check, subject: &impl Subject) -> bool {
    case.prepare().unwrap().run(check, subject).unwrap().passes()
}

/// Where each pixel's fragments are.
fn spans(layers: &Layers) -> Vec<std::ops::Range<usize>> {
    let starts = [0].into_iter().chain(layers.ends.iter().copied());
    starts.zip(&layers.ends).map(|(start, &end)| start as usize..end as usize).collect()
}

fn nothing(_: &mut View) {}

fn keep(_: &mut Layers) {}

#[test]
fn without_a_fault_everything_passes() {
    let sound = Broken::new(nothing, keep);
    for source in ["@boxes:n=4", "@spheres:n=24,subdivisions=2", "@cyclic"] {
        let prepared = case(source).prepare().unwrap();
        for check in Check::ALL {
            assert!(prepared.run(check, &sound).unwrap().passes(), "{source}, {check}");
        }
    }
}

#[test]
fn a_flipped_order_fails() {
    let flipped = Broken::new(nothing, |layers| {
        for span in spans(layers) {
            layers.fragments[span].reverse();
        }
    });
    for source in ["@boxes:n=4", "@hairball:strands=40,segments=12", "@cyclic"] {
        let checks = [Check::Layers, Check::Picture(Resolve::Blend), Check::Picture(Resolve::Nearest)];
        for check in checks {
            assert!(!passes(case(source), check, &flipped), "{source}, {check}");
        }
    }
}

/// One fragment of one pixel, among a thousand: nothing that a picture could show.
#[test]
fn a_dropped_fragment_fails() {
    let dropping = Broken::new(nothing, |layers| {
        let pixel = spans(layers).iter().position(|span| span.len() > 1).expect("translucent surfaces overlap");
        layers.fragments.remove(layers.ends[pixel] as usize - 1);
        for end in &mut layers.ends[pixel..] {
            *end -= 1;
        }
    });
    for source in ["@planes:n=1000", "@boxes:n=4"] {
        assert!(!passes(case(source), Check::Layers, &dropping), "{source}");
    }
    assert!(!passes(case("@boxes:n=4"), Check::Picture(Resolve::Complexity(0)), &dropping));
}

/// The oracle excuses samples within 1/256 pixel of an edge; that so many of them differ is what gives a grid away that is
/// off by as much.
#[test]
fn a_grid_shifted_by_a_256th_of_a_pixel_fails() {
    let shifted = Broken::new(
        |view| {
            let Camera { eye, target, up, projection } = view.camera;
            let Projection::Perspective { fov_y, .. } = projection else { return };
            let distance = eye.distance(target);
            let pixel = 2.0 * (fov_y * 0.5).tan() * distance / view.height as f32;
            // A turn of the camera; on so small a part of the picture, a shift.
            let right: Vec3 = (target - eye).cross(up).normalize();
            view.camera.target += right * (pixel / 256.0);
        },
        keep,
    );
    for source in ["@boxes:n=4", "@hairball:strands=40,segments=12", "@teapot:tessellation=5"] {
        assert!(!passes(case(source), Check::Layers, &shifted), "{source}");
    }
}

/// And as loosely as that is, the CPU renderer is not judged: one pixel is enough.
#[test]
fn the_cpu_has_no_excuse() {
    assert!(!Candidate::new(Technique::Cpu, Renderer::new()).has_own_rounding());
}
