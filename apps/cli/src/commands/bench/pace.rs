//! How long a frame will take, told from those before it: the last one of the same technique, scaled by what there is to
//! do. Rough, and good enough to say what a run will take and to leave out what would take hours.

use pellucid::Technique;

use super::variant::{Passes, Variant};

/// About how much there is to do at a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Work {
    pub(super) fragments: f64,
    pub(super) triangles: f64,
    /// Greatest depth complexity.
    pub(super) layers: f64,
}

/// Milliseconds by technique and unit of work.
#[derive(Debug, Default)]
pub(super) struct Pace {
    known: Vec<(Kind, f64)>,
}

/// What has a pace of its own.
type Kind = (Technique, Option<Passes>);

fn kind(variant: Variant) -> Kind {
    (variant.technique, variant.passes)
}

impl Work {
    pub(super) const fn new(fragments: f64, triangles: f64, layers: f64) -> Self {
        Self { fragments, triangles, layers }
    }

    /// In units of what one fragment takes.
    fn units(&self, variant: Variant, pixels: f64) -> f64 {
        /// A triangle is transformed, clipped and set up.
        const TRIANGLE: f64 = 2.0;
        /// A pixel is cleared and written.
        const PIXEL: f64 = 0.5;
        let once = self.fragments + TRIANGLE * self.triangles + PIXEL * pixels;
        match variant.technique {
            // Once for each layer, and once to see that there are no more.
            Technique::Peel => {
                once * (variant.max_layers.map_or(self.layers, |most| self.layers.min(most.into())) + 1.0)
            }
            _ => once / variant.threads.map_or(1.0, |threads| threads as f64),
        }
    }
}

impl Pace {
    /// Milliseconds that a frame will take, if there was one of the same technique.
    pub(super) fn predict(&self, variant: Variant, work: &Work, pixels: f64) -> Option<f64> {
        let known = self.known.iter().find(|(known, _)| *known == kind(variant));
        known.map(|(_, ms_per_unit)| ms_per_unit * work.units(variant, pixels))
    }

    /// Takes note of what a frame took.
    pub(super) fn learn(&mut self, variant: Variant, work: &Work, pixels: f64, ms: f64) {
        let rate = ms / work.units(variant, pixels);
        match self.known.iter_mut().find(|(known, _)| *known == kind(variant)) {
            Some((_, known)) => *known = rate,
            None => self.known.push((kind(variant), rate)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twice_the_work_takes_twice_the_time_and_peeling_goes_by_layers() {
        let mut pace = Pace::default();
        let cpu = Variant::of(Technique::Cpu);
        let small = Work::new(1e6, 1e3, 10.0);
        assert_eq!(pace.predict(cpu, &small, 0.0), None);
        pace.learn(cpu, &small, 0.0, 10.0);
        let large = Work::new(2e6, 2e3, 10.0);
        assert!((pace.predict(cpu, &large, 0.0).unwrap() - 20.0).abs() < 1e-9);
        pace.learn(Variant::layers(4), &small, 0.0, 10.0);
        assert!((pace.predict(Variant::of(Technique::Peel), &small, 0.0).unwrap() - 22.0).abs() < 1e-9);
    }
}
