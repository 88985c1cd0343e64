//! What the ordered layers of a pixel become.

use std::fmt;
use std::str::FromStr;

use glam::{Vec3, Vec4};

use crate::composite::Composite;
use crate::heat_map;
use crate::layers::OpaqueSurface;
use crate::{Camera, Error, Fragment, Image, Stats, View};

/// What ordered layers become. Every exact technique serves every resolve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Resolve {
    /// Blended front to back.
    #[default]
    Blend,
    /// Blended with alpha correction (Crassin 2010): layers pair up as entry and exit of a solid, and each gets the
    /// opacity that half the solid's thickness gives it, so that thick parts are denser than thin ones. A last layer
    /// without an exit, and no opaque surface behind it, keeps its own opacity.
    BlendCorrected,
    /// Gel (Crassin 2010): light is absorbed between entry and exit of a solid, by thickness; surfaces themselves
    /// neither absorb nor shine. A solid without an exit ends at the opaque surface behind it, or is not shown.
    Gelly,
    /// The nearest layer alone, over the opaque surface. Needs no order: the closest fragment of an unsorted capture.
    Nearest,
    /// The N-th layer alone, counted from 1, nearest first, over the background: without the opaque surface.
    Layer(
        /// Number of the layer.
        u32,
    ),
    /// Number of fragments as a heat map, up to the given full scale (0: the greatest of the picture).
    Complexity(
        /// Fragments at which the scale ends.
        u32,
    ),
    /// Blended, with those pixels in red that the technique's depth filter alone left out of order: none for techniques
    /// without one.
    Errors,
}

impl Resolve {
    /// Names, as on the command line, with what they are.
    pub const NAMES: [(&str, &str); 7] = [
        ("blend", "layers blended front to back"),
        ("blend:corrected", "blended, each layer's alpha corrected by the thickness of its solid"),
        ("gelly", "absorption by the thickness between surfaces"),
        ("nearest", "the nearest layer alone"),
        ("layer:N", "the N-th layer alone, 1 is the nearest"),
        ("complexity", "heat map of the number of fragments; complexity:N fixes the scale"),
        ("errors", "blended; in red, pixels that the depth filter of lucid alone leaves out of order"),
    ];
}

impl fmt::Display for Resolve {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Blend => f.write_str("blend"),
            Self::BlendCorrected => f.write_str("blend:corrected"),
            Self::Gelly => f.write_str("gelly"),
            Self::Nearest => f.write_str("nearest"),
            Self::Layer(number) => write!(f, "layer:{number}"),
            Self::Complexity(0) => f.write_str("complexity"),
            Self::Complexity(full_scale) => write!(f, "complexity:{full_scale}"),
            Self::Errors => f.write_str("errors"),
        }
    }
}

impl FromStr for Resolve {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        let number = |text: &str| text.parse().ok().filter(|&n: &u32| n >= 1);
        let resolve = match name.split_once(':') {
            None => match name {
                "blend" => Some(Self::Blend),
                "gelly" => Some(Self::Gelly),
                "nearest" => Some(Self::Nearest),
                "complexity" => Some(Self::Complexity(0)),
                "errors" => Some(Self::Errors),
                _ => None,
            },
            Some(("blend", "corrected")) => Some(Self::BlendCorrected),
            Some(("layer", text)) => number(text).map(Self::Layer),
            Some(("complexity", text)) => number(text).map(Self::Complexity),
            Some(_) => None,
        };
        resolve.ok_or_else(|| Error::UnknownName {
            kind: "resolve",
            name: name.to_owned(),
            known: Self::NAMES.map(|(name, _)| name).join(", "),
        })
    }
}

/// What a resolve needs to know besides the layers of its pixel.
#[derive(Debug, Clone, Copy)]
pub struct PixelResolver {
    resolve: Resolve,
    background: Vec4,
    camera: Camera,
    thickness_unit: f32,
}

impl PixelResolver {
    /// For the pixels of a view.
    pub fn new(resolve: Resolve, view: &View) -> Self {
        Self { resolve, background: view.background, camera: view.camera, thickness_unit: view.thickness_unit }
    }

    /// The pixel that ordered fragments and the opaque surface behind them become: linear light, premultiplied. Under
    /// [`Resolve::Complexity`] it is the number of fragments in every channel, for [`finish`] to colour.
    pub fn pixel(&self, fragments: &[Fragment], opaque: Option<OpaqueSurface>) -> Vec4 {
        let behind = opaque.map_or(self.background, |surface| surface.color);
        let mut composite = Composite::default();
        match self.resolve {
            Resolve::Blend | Resolve::Errors => {
                for fragment in fragments {
                    composite.under(fragment.color);
                }
            }
            Resolve::BlendCorrected => {
                for solid in fragments.chunks(2) {
                    let thickness = self.thickness(solid, opaque);
                    for surface in solid {
                        composite.under(match thickness {
                            Some(thickness) => self.absorbed(surface.color, 0.5 * thickness),
                            None => surface.color,
                        });
                    }
                }
            }
            Resolve::Gelly => {
                for solid in fragments.chunks(2) {
                    let mean = solid.iter().map(|f| f.color).sum::<Vec4>() / solid.len() as f32;
                    if let Some(thickness) = self.thickness(solid, opaque) {
                        composite.under(self.absorbed(mean, thickness));
                    }
                }
            }
            Resolve::Nearest => {
                if let Some(nearest) = fragments.first() {
                    composite.under(nearest.color);
                }
            }
            Resolve::Layer(number) => {
                if let Some(fragment) = (number as usize).checked_sub(1).and_then(|i| fragments.get(i)) {
                    composite.under(fragment.color);
                }
                return composite.over(self.background);
            }
            Resolve::Complexity(_) => return Vec4::splat(fragments.len() as f32),
        }
        composite.over(behind)
    }

    /// Distance along the line of sight from a solid's entry to its exit, in world units: to the opaque surface for a
    /// solid without exit, unknown if there is none.
    fn thickness(&self, solid: &[Fragment], opaque: Option<OpaqueSurface>) -> Option<f32> {
        let exit = match solid {
            [_, exit] => exit.depth,
            _ => opaque?.depth,
        };
        let length = self.camera.distance_from_depth(exit) - self.camera.distance_from_depth(solid[0].depth);
        // Infinite for a surface at depth 0, which is as thick as can be; never NaN, as 0 - 0 infinities are equal.
        Some(if length.is_nan() { 0.0 } else { length })
    }

    /// A premultiplied colour as it is after its material absorbed along `length` (Beer and Lambert): a length of one
    /// thickness unit leaves it as it is.
    fn absorbed(&self, color: Vec4, length: f32) -> Vec4 {
        let alpha = color.w;
        if alpha <= 0.0 || length <= 0.0 {
            return Vec4::ZERO;
        }
        let corrected = 1.0 - (1.0 - alpha).powf(length / self.thickness_unit);
        let straight: Vec3 = color.truncate() / alpha;
        (straight * corrected).extend(corrected)
    }
}

/// Turns what [`PixelResolver::pixel`] gave into the final picture, once the whole frame is known.
pub fn finish(resolve: Resolve, image: &mut Image, stats: &Stats) {
    if let Resolve::Complexity(full_scale) = resolve {
        heat_map::colorize(image, heat_map::full_scale(full_scale, stats.max_depth_complexity));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;

    fn resolver(resolve: Resolve) -> PixelResolver {
        let view = View { thickness_unit: 1.0, ..View::of(&Scene::new()) };
        PixelResolver::new(resolve, &view)
    }

    /// A red surface of alpha 0.5 at a distance.
    fn surface(resolver: &PixelResolver, distance: f32) -> Fragment {
        let crate::Projection::Perspective { near, .. } = resolver.camera.projection else { unreachable!() };
        Fragment { color: Vec4::new(0.5, 0.0, 0.0, 0.5), depth: near / distance, primitive: 0 }
    }

    #[test]
    fn n_planes_leave_the_nth_power_of_the_background() {
        let mut resolver = resolver(Resolve::Blend);
        resolver.background = Vec4::ONE;
        let black = Fragment { color: Vec4::new(0.0, 0.0, 0.0, 0.3), depth: 0.5, primitive: 0 };
        let pixel = resolver.pixel(&[black; 10], None);
        assert!((pixel.x - 0.7f32.powi(10)).abs() < 1e-6);
        assert!((pixel.w - 1.0).abs() < 1e-6);
    }

    #[test]
    fn gel_of_unit_thickness_has_its_stated_opacity_and_twice_that_absorbs_twice() {
        let resolver = resolver(Resolve::Gelly);
        let [near, middle, far] = [10.0, 11.0, 12.0].map(|d| surface(&resolver, d));
        assert!((resolver.pixel(&[near, middle], None).w - 0.5).abs() < 1e-3);
        assert!((resolver.pixel(&[near, far], None).w - 0.75).abs() < 1e-3);
        assert_eq!(resolver.pixel(&[near], None), Vec4::ZERO, "a solid without exit");
        let wall = OpaqueSurface { color: Vec4::new(0.0, 1.0, 0.0, 1.0), depth: middle.depth };
        assert!((resolver.pixel(&[near], Some(wall)).y - 0.5).abs() < 1e-3, "closed by the wall");
    }

    #[test]
    fn corrected_blend_of_both_surfaces_absorbs_like_the_solid() {
        let (gelly, blend) = (resolver(Resolve::Gelly), resolver(Resolve::BlendCorrected));
        let solid = [10.0, 11.7].map(|d| surface(&gelly, d));
        assert!((gelly.pixel(&solid, None).w - blend.pixel(&solid, None).w).abs() < 1e-5);
    }

    #[test]
    fn a_sheet_without_an_exit_keeps_its_opacity_when_corrected() {
        let resolver = resolver(Resolve::BlendCorrected);
        let sheet = surface(&resolver, 10.0);
        assert_eq!(resolver.pixel(&[sheet], None), sheet.color);
    }

    #[test]
    fn layers_that_are_not_there_are_the_background() {
        for number in [0, 2, u32::MAX] {
            let resolver = resolver(Resolve::Layer(number));
            assert_eq!(resolver.pixel(&[surface(&resolver, 10.0)], None), Vec4::ZERO);
        }
    }

    #[test]
    fn an_opaque_solid_of_no_thickness_is_not_a_number_nowhere() {
        for resolve in [Resolve::Gelly, Resolve::BlendCorrected] {
            let resolver = resolver(resolve);
            for (alpha, depth) in [(1.0, 0.5), (1.0, 0.0), (0.0, 0.0)] {
                let solid = [Fragment { color: Vec4::splat(alpha), depth, primitive: 0 }; 2];
                assert!(resolver.pixel(&solid, None).is_finite());
            }
        }
    }

    #[test]
    fn names_and_values_survive_the_round_trip() {
        for name in ["blend", "blend:corrected", "gelly", "nearest", "layer:3", "complexity", "complexity:8", "errors"]
        {
            assert_eq!(name.parse::<Resolve>().unwrap().to_string(), name);
        }
        for name in ["", "layer", "layer:0", "layer:-1", "layer:x", "blend:", "complexity:0", "gelly:2", "Blend"] {
            assert!(name.parse::<Resolve>().is_err(), "{name}");
        }
    }
}
