//! Surfaces whose colour is computed once it is known what is seen of them: opaque ones, and those whose colour varies.

use glam::{Vec3, Vec4};
use pellucid_core::pixel_grid::{Plane, ScreenTriangle};
use pellucid_core::primitive::Draw;
use pellucid_core::shading::{NormalPlane, Varying, color_at};

use crate::setup::{Chunk, Record};

/// No varying colour.
const NONE: u32 = u32::MAX;

/// In place of a varying colour: the surface is a single fragment, shaded when its alpha was tested. Its colour stands
/// where others have their normal.
const SHADED: u32 = u32::MAX - 1;

/// The pieces of primitives with a fragment in the tile.
#[derive(Debug, Default)]
pub(crate) struct Surfaces {
    surfaces: Vec<Surface>,
    varying: Vec<Varying>,
}

/// What it takes to shade a piece: one cache line.
#[derive(Debug, Clone, Copy)]
struct Surface {
    normal: NormalPlane,
    /// The piece's anchor: within the guard band, so that 16 bits hold it.
    anchor_px: [i16; 2],
    draw: u32,
    /// Place in the table of varying colours, [`NONE`] or [`SHADED`].
    varying: u32,
}

impl Surfaces {
    /// Adds the piece of a record; returns its place.
    #[inline(always)]
    pub(crate) fn add(
        &mut self,
        chunk: &Chunk,
        record: &Record,
        triangle: &ScreenTriangle,
        weights: [Plane; 2],
        draw: &Draw<'_>,
    ) -> u32 {
        let varying = if draw.varies() {
            let piece = chunk.piece(record, *triangle);
            self.varying.push(Varying::new(draw, record.triangle as usize, &piece, weights));
            self.varying.len() as u32 - 1
        } else {
            NONE
        };
        let [x, y] = triangle.anchor_px();
        self.surfaces.push(Surface {
            normal: NormalPlane::new(&record.normals, weights),
            anchor_px: [x as i16, y as i16],
            draw: record.draw,
            varying,
        });
        self.surfaces.len() as u32 - 1
    }

    /// Adds a surface that is one fragment of the surface at a place, if it passes the alpha test there.
    #[inline(always)]
    pub(crate) fn add_shaded(&mut self, place: u32, x: i32, y: i32, draws: &[Draw<'_>]) -> Option<u32> {
        let color = self.color(place, x, y, draws)?;
        let mut surface = self.surfaces[place as usize];
        surface.varying = SHADED;
        surface.normal.value = color.truncate().into();
        surface.normal.dx.x = color.w;
        self.surfaces.push(surface);
        Some(self.surfaces.len() as u32 - 1)
    }

    /// The colour of the surface at a place, at a pixel.
    #[inline(always)]
    pub(crate) fn color(&self, place: u32, x: i32, y: i32, draws: &[Draw<'_>]) -> Option<Vec4> {
        let surface = &self.surfaces[place as usize];
        if surface.varying == SHADED {
            return Some(Vec3::from(surface.normal.value).extend(surface.normal.dx.x));
        }
        let [anchor_x, anchor_y] = surface.anchor_px;
        let (x, y) = (x - i32::from(anchor_x), y - i32::from(anchor_y));
        let varying = if surface.varying == NONE { None } else { self.varying.get(surface.varying as usize) };
        color_at(&draws[surface.draw as usize], &surface.normal, varying, x, y)
    }

    /// Forgets all.
    pub(crate) fn clear(&mut self) {
        self.surfaces.clear();
        self.varying.clear();
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.surfaces.capacity() * size_of::<Surface>() + self.varying.capacity() * size_of::<Varying>()
    }
}
