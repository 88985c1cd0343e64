//! Geometry on the pixel grid, as it is sent to the device. Twin: `shaders/fbuffer/geometry.wesl`.

use pellucid_core::fbuffer::order::{Bounds, Geometry, Primitive};
use pellucid_core::primitive::{Corners, Fold, Piece};

/// Four words, in which everything is sent.
pub(crate) type Words = [u32; 4];

/// The geometry of a view without the scene that it came from. Kept while scene and view are the same.
#[derive(Debug)]
pub(crate) struct GridGeometry {
    draw_count: usize,
    primitives: Vec<Primitive>,
    pieces: Vec<Piece>,
}

/// Geometry for a part of the picture, ready to be sent.
#[derive(Debug)]
pub(crate) struct SentGeometry {
    pub(crate) words: Vec<Words>,
    /// Rows of pixels that primitives may cover.
    pub(crate) runs: u64,
    primitives: u32,
}

/// Words of the header.
const HEADER: usize = 3;

impl GridGeometry {
    pub(crate) fn new(geometry: Geometry<'_>) -> Self {
        Self { draw_count: geometry.draws.len(), primitives: geometry.primitives, pieces: geometry.pieces }
    }

    /// Instances of the scene, drawn or not.
    pub(crate) fn draw_count(&self) -> u64 {
        self.draw_count as u64
    }

    /// What of it lies within `bounds`, in the order of the whole.
    pub(crate) fn within(&self, bounds: Bounds) -> SentGeometry {
        let (mut primitives, mut pieces, mut weights) = (Vec::new(), Vec::new(), Vec::new());
        let mut draws = vec![[0; 2]; self.draw_count];
        let mut runs = 0u64;
        let mut next_draw = 0;
        // A draw's runs end where those of the next start, drawn or not.
        let mut start_draws = |up_to: usize, runs: u64| {
            while next_draw < up_to {
                draws[next_draw][0] = runs as u32;
                if next_draw > 0 {
                    draws[next_draw - 1][1] = runs as u32;
                }
                next_draw += 1;
            }
        };
        for primitive in &self.primitives {
            let Some(seen) = primitive.bounds.intersection(&bounds) else { continue };
            start_draws(primitive.draw as usize + 1, runs);
            let (count, top) = (primitive.piece_count, seen.top as u32);
            primitives.push([runs as u32, pieces.len() as u32 / 4, count, top]);
            runs += (seen.bottom - seen.top + 1) as u64 * u64::from(2 * count - 1);
            let range = primitive.first_piece as usize..(primitive.first_piece + count) as usize;
            for piece in &self.pieces[range] {
                push_piece(piece, primitive, &mut pieces, &mut weights);
            }
        }
        start_draws(self.draw_count, runs);
        if let Some(last) = draws.last_mut() {
            last[1] = runs as u32;
        }

        let sections = [draws.len(), primitives.len(), pieces.len()];
        let starts = sections.iter().scan(HEADER, |start, length| {
            *start += length;
            Some(*start as u32)
        });
        let starts: Vec<u32> = std::iter::once(HEADER as u32).chain(starts).collect();
        let Bounds { left, top, right, bottom } = bounds;
        let mut words = vec![
            [0, 0, runs as u32, primitives.len() as u32],
            [left, top, right, bottom].map(|edge| edge as u32),
            [starts[0], starts[1], starts[2], starts[3]],
        ];
        words.extend(draws.into_iter().map(|[first, end]| [first, end, 0, 0]));
        let count = primitives.len() as u32;
        words.extend(primitives);
        words.extend(pieces);
        words.extend(weights);
        SentGeometry { words, runs, primitives: count }
    }
}

impl SentGeometry {
    /// The words with which the header starts, for a window of slots.
    pub(crate) fn window(&self, slots: &std::ops::Range<u64>) -> Words {
        [slots.start as u32, slots.end as u32, self.runs as u32, self.primitives]
    }

    /// Bytes on the device.
    pub(crate) fn bytes(&self) -> u64 {
        size_of_val(self.words.as_slice()) as u64
    }
}

/// Adds the four words of a piece, and the three of its corners' weights if it is clipped.
fn push_piece(piece: &Piece, primitive: &Primitive, pieces: &mut Vec<Words>, weights: &mut Vec<Words>) {
    let vertices = piece.triangle.vertices;
    pieces.extend(vertices.map(|v| [v.x as u32, v.y as u32, v.depth.to_bits(), v.inv_w.to_bits()]));
    let origin = match piece.corners {
        Corners::Whole { swapped } => u32::from(swapped),
        Corners::Clipped(corners) => {
            let number = weights.len() as u32 / 3;
            weights.extend(corners.map(|w| [w.x.to_bits(), w.y.to_bits(), w.z.to_bits(), 0]));
            2 + number
        }
    };
    pieces.push([primitive.draw, primitive.triangle, origin, u32::from(piece.fold == Fold::TakesOff)]);
}
