//! Records to tiles: for each tile the records that may cover a sample in it, in draw order.

use std::ops::Range;

use pellucid_core::pixel_grid::{SUBPIXELS, ScreenTriangle, ScreenVertex, Viewport, center};

/// Side of a tile in pixels. Small enough that the fragments of a tile with hundreds of layers stay in the second-level
/// cache, large enough that small triangles rarely lie in two.
pub(crate) const TILE_PX: u32 = 32;

/// The tiles of a window of the picture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TileGrid {
    pub(crate) viewport: Viewport,
    /// The pixels set up in one go. Begins where a tile of the whole picture begins.
    pub(crate) window: PixelRect,
    /// Tiles side by side.
    pub(crate) columns: u32,
    /// Tiles one above another.
    pub(crate) rows: u32,
}

/// A rectangle of pixels, all borders included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PixelRect {
    pub(crate) left: i32,
    pub(crate) top: i32,
    pub(crate) right: i32,
    pub(crate) bottom: i32,
}

impl PixelRect {
    /// The whole picture.
    pub(crate) fn all(viewport: &Viewport) -> Self {
        Self { left: 0, top: 0, right: viewport.width as i32 - 1, bottom: viewport.height as i32 - 1 }
    }

    pub(crate) fn is_single(self) -> bool {
        self.left == self.right && self.top == self.bottom
    }
}

impl TileGrid {
    pub(crate) fn new(viewport: Viewport, window: PixelRect) -> Self {
        let tiles = |first: i32, last: i32| ((last + 1 - first) as u32).div_ceil(TILE_PX);
        let (columns, rows) = (tiles(window.left, window.right), tiles(window.top, window.bottom));
        Self { viewport, window, columns, rows }
    }

    pub(crate) fn tile_count(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    /// The pixels of a tile.
    pub(crate) fn tile(&self, number: u32) -> PixelRect {
        let left = self.window.left + (number % self.columns * TILE_PX) as i32;
        let top = self.window.top + (number / self.columns * TILE_PX) as i32;
        PixelRect {
            left,
            top,
            right: self.window.right.min(left + TILE_PX as i32 - 1),
            bottom: self.window.bottom.min(top + TILE_PX as i32 - 1),
        }
    }

    /// Rows of pixels in a tile.
    pub(crate) fn tile_rows(&self, number: u32) -> u32 {
        let rect = self.tile(number);
        (rect.bottom + 1 - rect.top) as u32
    }

    /// The pixels of the window whose centres lie in a triangle's bounding box; `None` if there are none.
    #[inline]
    pub(crate) fn samples_in_bounds(&self, [a, b, c]: &[ScreenVertex; 3]) -> Option<PixelRect> {
        // The first centre at or after a coordinate, and the last one at or before it.
        let first = |subpixels: i32| (subpixels + (SUBPIXELS / 2 - 1)) >> 8;
        let last = |subpixels: i32| (subpixels - SUBPIXELS / 2) >> 8;
        let rect = PixelRect {
            left: first(a.x.min(b.x).min(c.x)).max(self.window.left),
            top: first(a.y.min(b.y).min(c.y)).max(self.window.top),
            right: last(a.x.max(b.x).max(c.x)).min(self.window.right),
            bottom: last(a.y.max(b.y).max(c.y)).min(self.window.bottom),
        };
        (rect.left <= rect.right && rect.top <= rect.bottom).then_some(rect)
    }
}

/// Records by tile: those of tile `i` are `records[starts[i]..starts[i + 1]]`.
#[derive(Debug, Default)]
pub(crate) struct Bins {
    /// Tile and record, in draw order.
    pairs: Vec<(u32, u32)>,
    starts: Vec<u32>,
    records: Vec<u32>,
}

impl Bins {
    /// Empties the bins.
    pub(crate) fn begin(&mut self) {
        self.pairs.clear();
    }

    /// Adds a record with the pixels it may cover.
    #[inline]
    pub(crate) fn add(&mut self, record: u32, vertices: &[ScreenVertex; 3], samples: PixelRect, grid: &TileGrid) {
        let tile = |pixel: i32, first: i32| (pixel - first) as u32 / TILE_PX;
        let PixelRect { left, top, .. } = grid.window;
        let columns = tile(samples.left, left)..tile(samples.right, left) + 1;
        let rows = tile(samples.top, top)..tile(samples.bottom, top) + 1;
        if columns.len() == 1 && rows.len() == 1 {
            self.pairs.push((rows.start * grid.columns + columns.start, record));
        } else {
            self.add_to_tiles(record, vertices, columns, rows, grid);
        }
    }

    /// Adds a record to those tiles of a block that do not lie wholly outside one of its edges.
    fn add_to_tiles(
        &mut self,
        record: u32,
        vertices: &[ScreenVertex; 3],
        columns: Range<u32>,
        rows: Range<u32>,
        grid: &TileGrid,
    ) {
        let Some(triangle) = ScreenTriangle::new(*vertices) else { return };
        for row in rows {
            for column in columns.clone() {
                let tile = row * grid.columns + column;
                let rect = grid.tile(tile);
                let reaches = triangle.edges.iter().all(|edge| {
                    let x = if edge.a > 0 { rect.right } else { rect.left };
                    let y = if edge.b > 0 { rect.bottom } else { rect.top };
                    edge.biased_at(center(x), center(y)) >= 0
                });
                if reaches {
                    self.pairs.push((tile, record));
                }
            }
        }
    }

    /// Sorts what was added by tile, keeping draw order.
    pub(crate) fn finish(&mut self, grid: &TileGrid) {
        sort_by_tile(self.pairs.iter().copied(), grid, &mut self.starts, &mut self.records);
    }

    /// The records of a tile, in draw order.
    pub(crate) fn tile(&self, number: u32) -> &[u32] {
        if self.records.is_empty() {
            return &[];
        }
        let number = number as usize;
        &self.records[self.starts[number] as usize..self.starts[number + 1] as usize]
    }

    /// Adds how many records each tile has.
    pub(crate) fn add_counts(&self, counts: &mut [u64]) {
        add_counts(&self.starts, 1, counts);
    }

    /// Adds how many bytes each tile needs, `record_bytes` for each record.
    pub(crate) fn add_bytes(&self, record_bytes: usize, bytes: &mut [u64]) {
        add_counts(&self.starts, record_bytes + size_of::<(u32, u32)>() + 4, bytes);
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.pairs.capacity() * size_of::<(u32, u32)>() + (self.starts.capacity() + self.records.capacity()) * 4
    }
}

/// Adds the lengths of the ranges between `starts`, each place counting as so many.
pub(crate) fn add_counts(starts: &[u32], weight: usize, counts: &mut [u64]) {
    for (count, range) in counts.iter_mut().zip(starts.windows(2)) {
        *count += u64::from(range[1] - range[0]) * weight as u64;
    }
}

/// Sorts what comes with a tile each by tile, keeping its order: that of tile `i` is `sorted[starts[i]..starts[i + 1]]`.
/// Both are empty if nothing comes.
pub(crate) fn sort_by_tile<T: Copy + Default>(
    all: impl ExactSizeIterator<Item = (u32, T)> + Clone,
    grid: &TileGrid,
    starts: &mut Vec<u32>,
    sorted: &mut Vec<T>,
) {
    starts.clear();
    sorted.clear();
    if all.len() == 0 {
        return;
    }
    starts.resize(grid.tile_count() + 1, 0);
    for (tile, _) in all.clone() {
        starts[tile as usize + 1] += 1;
    }
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    sorted.resize(all.len(), T::default());
    // Each start moves to the next one's place while what belongs there is put down ...
    for (tile, one) in all {
        let place = &mut starts[tile as usize];
        sorted[*place as usize] = one;
        *place += 1;
    }
    // ... and back.
    starts.copy_within(0..grid.tile_count(), 1);
    starts[0] = 0;
}
