//! The legend of a heat map, drawn into its lower left corner: what the colours count, and how far they go.
//!
//! Bitmap fonts scaled by whole numbers, not outlines: they are crisp at every size, and no font file has to be shipped.

mod canvas;
mod scale;

use embedded_graphics::mono_font::MonoFont;
use embedded_graphics::mono_font::ascii::{FONT_6X10, FONT_7X13, FONT_9X15, FONT_10X20};
use embedded_graphics::pixelcolor::Rgb888;
use pellucid::Image;
use pellucid::core::heat_map;

use canvas::{Align, Canvas};

/// Titles: what the colours count.
pub(crate) const FRAGMENTS: &str = "fragments per pixel";
pub(crate) const ERROR: &str = "error, in 1/255";
/// Under the swatch of what is beyond the scale.
const BEYOND: &str = "more";

const TITLE_COLOR: Rgb888 = Rgb888::new(235, 235, 235);
const NUMBER_COLOR: Rgb888 = Rgb888::new(190, 190, 190);
const FRAME_COLOR: Rgb888 = Rgb888::new(90, 90, 90);
/// What the panel leaves of the picture behind it.
const SHINES_THROUGH: f32 = 0.05;

/// Characters that fit along the bar: the title, or, where there is room, half as many again.
const BAR_CHARACTERS: [u32; 2] = [30, 20];

/// Sizes of everything, in units of `zoom` pixels.
struct Layout {
    font: &'static MonoFont<'static>,
    zoom: u32,
    padding: u32,
    bar_width: u32,
    bar_height: u32,
    /// Width of gap and swatch for what is beyond the scale; 0 if nothing is.
    beyond_width: u32,
    tick: u32,
}

/// Draws the legend of a scale of that title that ends at `full_scale`, with a swatch for numbers beyond it if there are any.
///
/// Returns whether there was room for it; otherwise the picture is as it was.
pub(crate) fn draw(image: &mut Image, title: &str, full_scale: u32, has_beyond: bool) -> bool {
    let Some(layout) = Layout::for_picture(image.width(), image.height(), has_beyond) else {
        return false;
    };
    let (width, height) = layout.panel();
    let margin = layout.padding;
    let left = margin * layout.zoom;
    let top = image.height() - (height + margin) * layout.zoom;
    let mut canvas = Canvas::new(image, (left, top), (width, height), layout.zoom);
    canvas.darken(SHINES_THROUGH);
    canvas.outline((0, 0), (width, height), FRAME_COLOR);
    layout.draw(&mut canvas, title, full_scale);
    true
}

/// Writes a name into the upper left corner of a part of a picture, from column `left` on and `width` wide, if it fits.
pub(crate) fn label(image: &mut Image, name: &str, (left, width): (u32, u32)) {
    let font = &FONT_9X15;
    let characters = name.len() as u32;
    let (padding, zoom) = (4, (image.height() / 600).max(1));
    let size = (characters * font.character_size.width + 2 * padding, font.character_size.height + 2);
    if size.0 * zoom + 2 * padding > width || 3 * size.1 * zoom > image.height() {
        return;
    }
    let mut canvas = Canvas::new(image, (left + padding * zoom, padding * zoom), size, zoom);
    canvas.darken(SHINES_THROUGH);
    canvas.text(name, (padding, 1), Align::Left, font, TITLE_COLOR);
}

impl Layout {
    /// The largest that takes no more than its share of the picture; else the smallest, unless it hides a quarter of it.
    fn for_picture(width: u32, height: u32, has_beyond: bool) -> Option<Self> {
        const FONTS: [&MonoFont<'_>; 4] = [&FONT_6X10, &FONT_7X13, &FONT_9X15, &FONT_10X20];
        let small = FONTS.map(|font| (font, 1));
        // Zoomed so far, text has 1/27 of the height of the largest picture.
        let large = (2..=30).map(|zoom| (FONTS[3], zoom));
        let of = |characters| move |(font, zoom)| Self::new(font, zoom, characters, has_beyond);
        let is_modest = |layout: &Self| {
            let (w, h) = layout.panel();
            layout.font.character_size.height * layout.zoom * 30 <= height
                && w * layout.zoom * 5 <= width * 2
                && h * layout.zoom * 4 <= height
        };
        let fits = |layout: &Self| {
            let (w, h) = layout.panel();
            w + 2 * layout.padding <= width && 2 * h <= height && 4 * w * h <= width * height
        };
        let [wide, narrow] = BAR_CHARACTERS;
        let modest = small.into_iter().chain(large).map(of(wide)).rfind(is_modest);
        modest.or_else(|| small.map(of(wide)).into_iter().chain(small.map(of(narrow))).find(fits))
    }

    fn new(font: &'static MonoFont<'static>, zoom: u32, characters: u32, has_beyond: bool) -> Self {
        let character = font.character_size;
        let beyond_width = if has_beyond { character.width * (BEYOND.len() as u32 + 1) } else { 0 };
        Self {
            font,
            zoom,
            padding: character.height * 3 / 5,
            bar_width: character.width * characters - beyond_width,
            bar_height: character.height,
            beyond_width,
            tick: character.height / 5,
        }
    }

    /// Width and height of the whole legend.
    fn panel(&self) -> (u32, u32) {
        let line = self.font.character_size.height;
        let width = self.bar_width + self.beyond_width + 2 * self.padding;
        (width, self.numbers_top() + line + self.padding / 2)
    }

    fn bar_top(&self) -> u32 {
        self.padding / 2 + self.font.character_size.height + self.padding / 2
    }

    fn numbers_top(&self) -> u32 {
        self.bar_top() + self.bar_height + self.tick + 2
    }

    fn draw(&self, canvas: &mut Canvas<'_>, title: &str, full_scale: u32) {
        let Self { padding: left, bar_width, bar_height, .. } = *self;
        let character_width = self.font.character_size.width;
        canvas.text(title, (left, self.padding / 2), Align::Left, self.font, TITLE_COLOR);

        // Each number from 0 on has an equal share of the bar.
        let share = |x: u32| u64::from(x) * (u64::from(full_scale) + 1) / u64::from(bar_width);
        for x in 0..bar_width {
            let color = rgb(heat_map::color(share(x) as u32, full_scale));
            canvas.fill((left + x, self.bar_top()), (1, bar_height), color);
        }
        canvas.outline((left - 1, self.bar_top() - 1), (bar_width + 2, bar_height + 2), FRAME_COLOR);

        for tick in scale::ticks(full_scale, bar_width, character_width) {
            let x = left + tick.x;
            canvas.fill((x, self.bar_top() + bar_height + 1), (1, self.tick), NUMBER_COLOR);
            canvas.text(
                &tick.label,
                (left + tick.label_left, self.numbers_top()),
                Align::Left,
                self.font,
                NUMBER_COLOR,
            );
        }

        if self.beyond_width > 0 {
            let swatch = (BEYOND.len() as u32 * character_width, bar_height);
            let right = left + bar_width + self.beyond_width;
            canvas.fill((right - swatch.0, self.bar_top()), swatch, rgb(heat_map::color(u32::MAX, full_scale)));
            canvas.text(BEYOND, (right, self.numbers_top()), Align::Right, self.font, NUMBER_COLOR);
        }
    }
}

fn rgb([r, g, b]: [u8; 3]) -> Rgb888 {
    Rgb888::new(r, g, b)
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;

    #[test]
    fn the_legend_fits_every_picture_or_is_left_out() {
        let mut drawn = 0;
        for width in [1, 64, 100, 150, 200, 320, 640, 1280, 1920] {
            for height in [1, 48, 80, 120, 240, 720] {
                for (full_scale, beyond) in [(1, false), (23, true), (1_000_000, false), (u32::MAX - 1, true)] {
                    let empty = Image::filled(width, height, Vec4::ONE);
                    let mut image = empty.clone();
                    let is_drawn = draw(&mut image, FRAGMENTS, full_scale, beyond);
                    assert_eq!(is_drawn, image != empty, "{width} x {height}");
                    drawn += u32::from(is_drawn);
                }
            }
        }
        assert!(drawn > 50, "{drawn}");
    }

    #[test]
    fn it_grows_with_the_picture() {
        let height = |width, height| {
            let layout = Layout::for_picture(width, height, false).unwrap();
            layout.font.character_size.height * layout.zoom
        };
        assert_eq!(height(320, 240), 10);
        assert_eq!(height(1280, 720), 20);
        assert_eq!(height(3840, 2160), 60);
        assert!(Layout::for_picture(64, 48, false).is_none());
    }
}
