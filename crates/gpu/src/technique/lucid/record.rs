//! The records of triangles that the device cannot set up: those that reach in front of the camera or beyond the guard band
//! are clipped in f64, which WGSL has not. Twin: `shaders/technique/lucid/record.wesl`.

use pellucid_core::pixel_grid::Viewport;
use pellucid_core::primitive::{Corners, Draw, Fold, Piece};

/// Four words, in which everything is sent.
pub(super) type Words = [u32; 4];

/// Groups of words of a record.
const GROUPS: u32 = 4;

/// Twins: `TURNED` and `CLIPPED_ORIGIN`.
const TURNED: u32 = 4;
const CLIPPED_ORIGIN: u32 = 8;

/// Records of clipped triangles, and which of them are triangles: the others are weights.
#[derive(Debug, Default)]
pub(super) struct Clipped {
    pub(super) words: Vec<Words>,
    pub(super) triangles: Vec<u32>,
}

impl Clipped {
    /// What the triangles listed, by draw and number in the draw, become, in records from `first_record` on.
    pub(super) fn new(draws: &[Draw<'_>], viewport: &Viewport, listed: &[[u32; 2]], first_record: u32) -> Self {
        let mut clipped = Self::default();
        for &[number, triangle] in listed {
            let draw = &draws[number as usize];
            // What is not finite is dropped, and counted by the surfaces.
            let pieces = draw.pieces(triangle as usize, viewport).unwrap_or_default();
            let primitive = draw.first_primitive + triangle;
            for (before, piece) in (0..).zip(&pieces) {
                // Pieces of a primitive follow each other.
                clipped.triangles.push(first_record + clipped.records());
                clipped.push(piece, [number, primitive], before);
            }
            let weights_start = (first_record + clipped.records()) * GROUPS;
            clipped.push_weights(&pieces, weights_start);
        }
        clipped
    }

    /// How many records it takes.
    pub(super) fn records(&self) -> u32 {
        self.words.len() as u32 / GROUPS
    }

    fn push(&mut self, piece: &Piece, [draw, primitive]: [u32; 2], before: u32) {
        let corners = piece.triangle.vertices.map(|v| [v.x as u32, v.y as u32, v.depth.to_bits(), v.inv_w.to_bits()]);
        self.words.extend(corners);
        let origin = match piece.corners {
            Corners::Whole { swapped } => u32::from(swapped) * TURNED,
            Corners::Clipped(_) => CLIPPED_ORIGIN,
        };
        let fold = match piece.fold {
            Fold::None => 0,
            Fold::TakesOff => 1,
            Fold::Adds => 2,
        };
        self.words.push([draw, primitive, origin, fold | before << 2]);
    }

    /// The weights of the corners of the pieces pushed last, and where they are.
    fn push_weights(&mut self, pieces: &[Piece], start: u32) {
        let first = self.words.len() - pieces.len() * GROUPS as usize;
        for (i, piece) in pieces.iter().enumerate() {
            if let Corners::Clipped(weights) = piece.corners {
                self.words[first + i * GROUPS as usize + 3][2] = CLIPPED_ORIGIN + start + i as u32 * GROUPS;
                self.words.extend(weights.map(|w| [w.x.to_bits(), w.y.to_bits(), w.z.to_bits(), 0]));
                self.words.push([0; 4]);
            } else {
                self.words.extend([[0; 4]; GROUPS as usize]);
            }
        }
    }
}
