//! The under operator: layers blended front to back (Porter and Duff 1984; called under-blending in the depth peeling
//! article).

use glam::{Vec3, Vec4};

/// Layers blended so far, nearest first, in linear light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Composite {
    /// Light that reaches the eye from the layers so far.
    pub color: Vec3,
    /// Share of the light from behind that still gets through.
    pub transmittance: f32,
}

impl Default for Composite {
    fn default() -> Self {
        Self { color: Vec3::ZERO, transmittance: 1.0 }
    }
}

impl Composite {
    /// Puts a layer, premultiplied, behind those so far.
    #[inline(always)]
    pub fn under(&mut self, layer: Vec4) {
        self.color += layer.truncate() * self.transmittance;
        self.transmittance *= 1.0 - layer.w;
    }

    /// The pixel that results with `behind`, premultiplied, behind everything.
    #[inline(always)]
    pub fn over(self, behind: Vec4) -> Vec4 {
        let color = self.color + behind.truncate() * self.transmittance;
        color.extend((1.0 - self.transmittance) + behind.w * self.transmittance)
    }
}
