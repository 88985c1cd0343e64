//! The records of triangles that the device cannot set up: those that reach in front of the camera or beyond the guard band
//! are clipped in f64, which WGSL has not. Twin: `shaders/technique/lucid/record.wesl`.

use pellucid_core::pixel_grid::Viewport;
use pellucid_core::primitive::{Corners, Draw, Fold, Piece};

use crate::gpu_data::DrawData;
use crate::table::Group;

/// Groups of words of a record.
pub(super) const GROUPS: u32 = 5;

/// Twin: `CLIPPED_ORIGIN`.
const CLIPPED_ORIGIN: u32 = 1;

/// Records of clipped triangles, and which of them are triangles: the others are weights.
#[derive(Debug, Default)]
pub(super) struct Clipped {
    pub(super) groups: Vec<Group>,
    pub(super) triangles: Vec<u32>,
}

impl Clipped {
    /// What the triangles listed, by draw and number in the draw, become, in records from `first_record` on.
    /// `data` tells where each draw has its vertices.
    pub(super) fn new(
        (draws, data): (&[Draw<'_>], &[DrawData]),
        viewport: &Viewport,
        listed: &[[u32; 2]],
        first_record: u32,
    ) -> Self {
        let mut clipped = Self::default();
        for &[number, triangle] in listed {
            let draw = &draws[number as usize];
            // What is not finite is dropped, and counted by the surfaces.
            let pieces = draw.pieces(triangle as usize, viewport).unwrap_or_default();
            let primitive = draw.first_primitive + triangle;
            let first_vertex = data[number as usize].first_vertex;
            let vertices = draw.mesh.triangles()[triangle as usize].map(|vertex| first_vertex + vertex);
            for (before, piece) in (0..).zip(&pieces) {
                // Pieces of a primitive follow each other.
                clipped.triangles.push(first_record + clipped.records());
                clipped.push(piece, [number, primitive], vertices, before);
            }
            let weights_start = (first_record + clipped.records()) * GROUPS;
            clipped.push_weights(&pieces, weights_start);
        }
        clipped
    }

    /// How many records it takes.
    pub(super) fn records(&self) -> u32 {
        self.groups.len() as u32 / GROUPS
    }

    fn push(&mut self, piece: &Piece, [draw, primitive]: [u32; 2], [a, b, c]: [u32; 3], before: u32) {
        let corners = piece.triangle.vertices.map(|v| [v.x as u32, v.y as u32, v.depth.to_bits(), v.inv_w.to_bits()]);
        self.groups.extend(corners);
        let vertices = match piece.corners {
            Corners::Whole { swapped: true } => [a, c, b, 0],
            Corners::Whole { swapped: false } | Corners::Clipped(_) => [a, b, c, 0],
        };
        let fold = match piece.fold {
            Fold::None => 0,
            Fold::TakesOff => 1,
            Fold::Adds => 2,
        };
        self.groups.extend([[draw, primitive, 0, fold | before << 2], vertices]);
    }

    /// The weights of the corners of the pieces pushed last, and where they are.
    fn push_weights(&mut self, pieces: &[Piece], start: u32) {
        let first = self.groups.len() - pieces.len() * GROUPS as usize;
        for (i, piece) in pieces.iter().enumerate() {
            if let Corners::Clipped(weights) = piece.corners {
                self.groups[first + i * GROUPS as usize + 3][2] = CLIPPED_ORIGIN + start + i as u32 * GROUPS;
                self.groups.extend(weights.map(|w| [w.x.to_bits(), w.y.to_bits(), w.z.to_bits(), 0]));
                self.groups.extend([[0; 4]; GROUPS as usize - 3]);
            } else {
                self.groups.extend([[0; 4]; GROUPS as usize]);
            }
        }
    }
}
