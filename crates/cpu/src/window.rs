//! Parts of the picture that are set up one after another, so that memory stays bounded.
//!
//! Triangles are streamed: of each chunk of them only what tiles need is kept. Where even that is more than the budget, the
//! picture is cut into windows, and triangles are set up again for each. Capturing a part of the triangles at a time
//! instead would save nothing: any later one may lie between earlier ones, so all fragments of a pixel have to be there
//! when it is ordered.

use std::ops::Range;

use crate::bin::{PixelRect, TILE_PX, TileGrid};

/// Bytes that chunks hold at most, unless a single tile needs more: together with what threads take, tiles and a picture of
/// 1920 x 1080 less than 2 GiB.
pub(crate) const DEFAULT_BUDGET_BYTES: usize = 3 << 29;

/// Of the budget, what windows are meant to take when the rest of the triangles is like those seen so far.
const TARGET: f64 = 0.75;

/// The windows of a frame that are still to be captured, the next one last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Windows {
    left: Vec<PixelRect>,
}

impl Windows {
    /// These windows, from the first to the last.
    pub(crate) fn new(mut windows: Vec<PixelRect>) -> Self {
        windows.reverse();
        Self { left: windows }
    }

    pub(crate) fn next(&mut self) -> Option<PixelRect> {
        self.left.pop()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.left.is_empty()
    }

    /// Cuts the window of a grid, of two tiles or more, that does not fit the budget, given the bytes that a part of the
    /// triangles has for each of its tiles, and how large a part.
    pub(crate) fn cut(&mut self, grid: &TileGrid, tile_bytes: &[u64], part: f64, budget_bytes: usize) {
        let (columns, rows) = (grid.columns as usize, grid.rows as usize);
        let most = budget_bytes as f64 * TARGET * part;
        let window = grid.window;
        let tile = TILE_PX as i32;
        if rows > 1 {
            let bytes: Vec<u64> = tile_bytes.chunks(columns).map(|row| row.iter().sum()).collect();
            self.left.extend(cut(&bytes, most).into_iter().rev().map(|rows| PixelRect {
                top: window.top + rows.start as i32 * tile,
                bottom: window.bottom.min(window.top + rows.end as i32 * tile - 1),
                ..window
            }));
        } else {
            self.left.extend(cut(tile_bytes, most).into_iter().rev().map(|columns| PixelRect {
                left: window.left + columns.start as i32 * tile,
                right: window.right.min(window.left + columns.end as i32 * tile - 1),
                ..window
            }));
        }
    }
}

/// Cuts rows or columns of tiles, two or more, into at least two runs of up to `most` bytes.
fn cut(bytes: &[u64], most: f64) -> Vec<Range<usize>> {
    let most = most.min(bytes.iter().sum::<u64>() as f64 / 2.0);
    let mut runs = Vec::new();
    let (mut start, mut sum) = (0, 0.0);
    for (i, &bytes) in bytes.iter().enumerate() {
        if i > start && sum + bytes as f64 > most {
            runs.push(start..i);
            (start, sum) = (i, 0.0);
        }
        sum += bytes as f64;
    }
    if runs.is_empty() {
        start = bytes.len() / 2;
        runs.push(0..start);
    }
    runs.push(start..bytes.len());
    runs
}
