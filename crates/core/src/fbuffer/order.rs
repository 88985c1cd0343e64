//! Rasterization order: the position of every fragment, by primitive, then row, then column.
//!
//! It follows from the pixel grid, that is from integers, so it is the same in every pass and on every device. A pass that
//! kills or masks fragments, or tests them, changes nothing in it.

use std::ops::Range;

use crate::pixel_grid::{SUBPIXELS, Viewport};
use crate::primitive::{Draw, Pass, Piece, covering_piece, draws};
use crate::{Error, Scene, View};

use super::{Overflow, Size};

/// Pixels from `left` to `right` and `top` to `bottom`, all of them within.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// Leftmost column.
    pub left: i32,
    /// Topmost row.
    pub top: i32,
    /// Rightmost column.
    pub right: i32,
    /// Bottommost row.
    pub bottom: i32,
}

impl Bounds {
    /// All pixels of a picture.
    pub fn of(viewport: &Viewport) -> Self {
        Self { left: 0, top: 0, right: viewport.width as i32 - 1, bottom: viewport.height as i32 - 1 }
    }

    /// Pixels in both; `None` if there are none.
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let both = Self {
            left: self.left.max(other.left),
            top: self.top.max(other.top),
            right: self.right.min(other.right),
            bottom: self.bottom.min(other.bottom),
        };
        (both.left <= both.right && both.top <= both.bottom).then_some(both)
    }

    /// The pixels whose centres lie between the outermost corners of pieces.
    fn around(pieces: &[Piece]) -> Option<Self> {
        let vertices = || pieces.iter().flat_map(|piece| &piece.triangle.vertices);
        // From the centre at or after the least corner to the one at or before the greatest.
        let half = SUBPIXELS / 2;
        let first = |least: i32| (least + half - 1).div_euclid(SUBPIXELS);
        let last = |greatest: i32| (greatest - half).div_euclid(SUBPIXELS);
        Some(Self {
            left: first(vertices().map(|vertex| vertex.x).min()?),
            top: first(vertices().map(|vertex| vertex.y).min()?),
            right: last(vertices().map(|vertex| vertex.x).max()?),
            bottom: last(vertices().map(|vertex| vertex.y).max()?),
        })
    }
}

/// A primitive in sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Primitive {
    /// Its draw among [`Geometry::draws`].
    pub draw: u32,
    /// Number of the triangle in the draw's mesh.
    pub triangle: u32,
    /// First of its pieces among [`Geometry::pieces`].
    pub first_piece: u32,
    /// How many pieces it has: one, unless it is clipped.
    pub piece_count: u32,
    /// The pixels it may cover.
    pub bounds: Bounds,
}

/// The triangles of one pass of a view on the pixel grid, in draw order.
///
/// This is the geometry stage of a draw. Every pass of every window rasterizes it again.
#[derive(Debug, Clone)]
pub struct Geometry<'a> {
    /// The scene's instances.
    pub draws: Vec<Draw<'a>>,
    /// Those of their triangles that are in sight.
    pub primitives: Vec<Primitive>,
    /// What these become on the pixel grid.
    pub pieces: Vec<Piece>,
    /// The picture's.
    pub viewport: Viewport,
    /// Triangles left out because they are not finite.
    pub dropped_triangles: u64,
}

impl<'a> Geometry<'a> {
    /// Sets up the surfaces of one pass of a view.
    ///
    /// # Errors
    /// If the view is invalid.
    pub fn new(scene: &'a Scene, view: &View, pass: Pass) -> Result<Self, Error> {
        let draws = draws(scene, view)?;
        let viewport = Viewport::of(view);
        let picture = Bounds::of(&viewport);
        let (mut primitives, mut all_pieces, mut dropped_triangles) = (Vec::new(), Vec::new(), 0);
        for (number, draw) in (0..).zip(&draws).filter(|(_, draw)| draw.pass == pass) {
            for triangle in 0..draw.mesh.triangles().len() {
                let Ok(pieces) = draw.pieces(triangle, &viewport) else {
                    dropped_triangles += 1;
                    continue;
                };
                let Some(bounds) = Bounds::around(&pieces).and_then(|bounds| bounds.intersection(&picture)) else {
                    continue;
                };
                primitives.push(Primitive {
                    draw: number,
                    triangle: triangle as u32,
                    first_piece: all_pieces.len() as u32,
                    piece_count: pieces.len() as u32,
                    bounds,
                });
                all_pieces.extend(pieces);
            }
        }
        Ok(Self { draws, primitives, pieces: all_pieces, viewport, dropped_triangles })
    }

    /// The pieces of a primitive.
    pub fn pieces_of(&self, primitive: &Primitive) -> &[Piece] {
        &self.pieces[primitive.first_piece as usize..][..primitive.piece_count as usize]
    }

    /// Number of a primitive in draw order.
    pub fn number(&self, primitive: &Primitive) -> u32 {
        self.draws[primitive.draw as usize].first_primitive + primitive.triangle
    }
}

/// Where a fragment is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Its position in the order.
    pub slot: u64,
    /// Its primitive among [`Geometry::primitives`].
    pub primitive: usize,
    /// Its piece among the primitive's.
    pub piece: usize,
    /// Column of its pixel.
    pub x: u32,
    /// Row of its pixel.
    pub y: u32,
}

/// The order of all fragments of a geometry: fragments of each primitive counted, and the counts summed up.
#[derive(Debug, Clone)]
pub struct RasterOrder<'a> {
    geometry: Geometry<'a>,
    /// First slot of each primitive, and at last the number of fragments.
    first_slots: Vec<u64>,
}

impl<'a> RasterOrder<'a> {
    /// Counts the fragments of every primitive.
    pub fn new(geometry: Geometry<'a>) -> Self {
        let mut first_slots = Vec::with_capacity(geometry.primitives.len() + 1);
        let mut fragments = 0;
        first_slots.push(fragments);
        for primitive in &geometry.primitives {
            for_each_pixel(&geometry, primitive, |_, _, _| fragments += 1);
            first_slots.push(fragments);
        }
        Self { geometry, first_slots }
    }

    /// What is drawn.
    pub fn geometry(&self) -> &Geometry<'a> {
        &self.geometry
    }

    /// All fragments.
    pub fn fragments(&self) -> u64 {
        self.first_slots[self.geometry.primitives.len()]
    }

    /// The slots of a range of primitives, which index [`Geometry::primitives`].
    pub fn slots(&self, primitives: Range<usize>) -> Range<u64> {
        self.first_slots[primitives.start]..self.first_slots[primitives.end]
    }

    /// Rasterizes, in order, what lies in a window of slots. Other fragments are discarded unseen, and primitives wholly
    /// outside are not even looked at.
    pub fn rasterize(&self, window: Range<u64>, mut visit: impl FnMut(Place)) {
        let first = self.first_slots.partition_point(|&slot| slot <= window.start).saturating_sub(1);
        for (number, primitive) in self.geometry.primitives.iter().enumerate().skip(first) {
            let mut slot = self.first_slots[number];
            if slot >= window.end {
                break;
            }
            for_each_pixel(&self.geometry, primitive, |piece, x, y| {
                if window.contains(&slot) {
                    visit(Place { slot, primitive: number, piece, x, y });
                }
                slot += 1;
            });
        }
    }

    /// Splits the draw into batches of primitives that fit a buffer each, as large as possible, for hardware that does
    /// nothing but report an overflow (section 3.2). They are ranges of [`Geometry::primitives`].
    ///
    /// # Errors
    /// [`Overflow`] if a primitive alone does not fit: then only windows do.
    pub fn batches(&self, size: Size) -> Result<Vec<Range<usize>>, Overflow> {
        let (slots, mut batches, mut start) = (size.slots(), Vec::new(), 0);
        let primitives = self.geometry.primitives.len();
        while start < primitives {
            let end = self.first_slots.partition_point(|&slot| slot <= self.first_slots[start] + slots) - 1;
            if end == start {
                let needed = self.first_slots[start + 1] - self.first_slots[start];
                return Err(Overflow { needed, slots });
            }
            batches.push(start..end);
            start = end;
        }
        Ok(batches)
    }
}

/// The pixels of a primitive, row by row, from the left, each with the piece that covers it.
fn for_each_pixel(geometry: &Geometry<'_>, primitive: &Primitive, mut visit: impl FnMut(usize, u32, u32)) {
    let pieces = geometry.pieces_of(primitive);
    let Bounds { left, top, right, bottom } = primitive.bounds;
    for y in top..=bottom {
        for x in left..=right {
            if let Some(piece) = covering_piece(pieces, x, y) {
                visit(piece, x as u32, y as u32);
            }
        }
    }
}
