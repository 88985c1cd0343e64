//! A picture that is rendered again and again. Most tiles of most pictures hold nothing but the background, and did so in
//! the picture before: those need not be written again.

use std::sync::Mutex;

use glam::Vec4;
use pellucid_core::{Image, View};
use rayon::prelude::*;

use crate::bin::{PixelRect, TILE_PX};
use crate::tile::TILE_SAMPLES;

/// Pixels that a thread fills at a time.
const FILLED_PIXELS: usize = 1 << 15;

/// A picture to be rendered into again, as a turntable or a window does. As long as size and background stay the same, what is
/// written of it is only what differs from the background, now or in the picture before.
#[derive(Debug, Clone)]
pub struct Canvas {
    image: Image,
    /// What is seen in all tiles that are not painted; `None` if the picture may hold anything.
    background: Option<Vec4>,
    /// The picture's tiles, row by row.
    tiles: Vec<Tile>,
}

/// Whether a tile holds more than the background.
#[derive(Debug, Clone, Copy, Default)]
struct Tile {
    was_painted: bool,
    is_painted: bool,
}

/// A row of tiles.
pub(crate) struct TileRow<'a> {
    pixels: &'a mut [Vec4],
    tiles: &'a mut [Tile],
    width: usize,
    background: Vec4,
}

impl Default for Canvas {
    fn default() -> Self {
        Self { image: Image::filled(0, 0, Vec4::ZERO), background: None, tiles: Vec::new() }
    }
}

impl Canvas {
    /// An empty one: it takes the size of what is rendered into it.
    pub fn new() -> Self {
        Self::default()
    }

    /// The last picture.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// The last picture, to be kept.
    pub fn into_image(self) -> Image {
        self.image
    }

    /// Takes over a picture that was rendered elsewhere.
    pub fn put(&mut self, image: Image) {
        *self = Self { image, ..Self::default() };
    }

    /// The picture, whose painted tiles may be changed.
    pub(crate) fn image_mut(&mut self) -> &mut Image {
        &mut self.image
    }

    /// Whether tiles that are not painted show the background of a view.
    pub(crate) fn suits(&self, view: &View) -> bool {
        let bits = |color: Vec4| color.to_array().map(f32::to_bits);
        self.background.is_some_and(|background| bits(background) == bits(view.background))
            && [self.image.width(), self.image.height()] == [view.width, view.height]
    }

    /// Fills it with the background of a view, on all threads.
    pub(crate) fn fill(&mut self, view: &View) {
        self.background = None;
        let count = view.width as usize * view.height as usize;
        if [self.image.width(), self.image.height()] == [view.width, view.height] {
            self.image.pixels_mut().par_chunks_mut(FILLED_PIXELS).for_each(|pixels| pixels.fill(view.background));
        } else {
            self.image = Image::filled(0, 0, Vec4::ZERO);
            let pixels = rayon::iter::repeat_n(view.background, count).with_min_len(FILLED_PIXELS);
            self.image = Image::from_pixels(view.width, view.height, pixels.collect());
        }
        self.tiles.clear();
        self.tiles
            .resize(view.width.div_ceil(TILE_PX) as usize * view.height.div_ceil(TILE_PX) as usize, Tile::default());
        self.background = Some(view.background);
    }

    /// The rows of tiles, to be painted. Until [`Self::painted`], nothing is known of the picture.
    pub(crate) fn rows(&mut self, view: &View) -> Vec<Mutex<TileRow<'_>>> {
        self.background = None;
        let width = view.width as usize;
        let pixels = self.image.pixels_mut().chunks_mut(TILE_PX as usize * width);
        let tiles = self.tiles.chunks_mut(view.width.div_ceil(TILE_PX) as usize);
        pixels
            .zip(tiles)
            .map(|(pixels, tiles)| Mutex::new(TileRow { pixels, tiles, width, background: view.background }))
            .collect()
    }

    /// Says that every tile of a view was painted or left.
    pub(crate) fn painted(&mut self, view: &View) {
        for tile in &mut self.tiles {
            *tile = Tile { was_painted: tile.is_painted, is_painted: false };
        }
        self.background = Some(view.background);
    }
}

impl TileRow<'_> {
    /// Puts a part of a tile into the picture.
    pub(crate) fn paint(&mut self, rect: PixelRect, pixels: &[Vec4; TILE_SAMPLES]) {
        self.tiles[rect.left as usize / TILE_PX as usize].is_painted = true;
        for (to, from) in self.rows_of(rect).zip(pixels.chunks(TILE_PX as usize)) {
            to.copy_from_slice(&from[..to.len()]);
        }
    }

    /// Leaves a part of a tile to the background.
    pub(crate) fn leave(&mut self, rect: PixelRect) {
        if self.tiles[rect.left as usize / TILE_PX as usize].was_painted {
            let background = self.background;
            self.rows_of(rect).for_each(|row| row.fill(background));
        }
    }

    fn rows_of(&mut self, PixelRect { left, top, right, bottom }: PixelRect) -> impl Iterator<Item = &mut [Vec4]> {
        let first = top as usize % TILE_PX as usize;
        let rows = self.pixels.chunks_mut(self.width).skip(first).take((bottom - top + 1) as usize);
        rows.map(move |row| &mut row[left as usize..=right as usize])
    }
}
