//! A rectangle of a picture that can be drawn into, in units of whole pixels.

use std::convert::Infallible;

use embedded_graphics::Drawable;
use embedded_graphics::draw_target::DrawTarget;
use embedded_graphics::geometry::{OriginDimensions, Point, Size};
use embedded_graphics::mono_font::{MonoFont, MonoTextStyle};
use embedded_graphics::pixelcolor::{Rgb888, RgbColor};
use embedded_graphics::text::{Alignment, Baseline, Text, TextStyleBuilder};
use glam::Vec4;
use pellucid::Image;
use pellucid::core::color::linear_from_srgb8;

/// A rectangle of a picture. Each of its units is `zoom` pixels wide and high; what leaves it is not drawn.
pub(super) struct Canvas<'a> {
    image: &'a mut Image,
    left_px: u32,
    top_px: u32,
    width: u32,
    height: u32,
    zoom: u32,
}

/// Which end of a text its position is.
#[derive(Debug, Clone, Copy)]
pub(super) enum Align {
    Left,
    Right,
}

impl<'a> Canvas<'a> {
    /// The rectangle from (left, top) in pixels, as wide and high as `size` in units.
    pub(super) fn new(image: &'a mut Image, (left_px, top_px): (u32, u32), size: (u32, u32), zoom: u32) -> Self {
        Self { image, left_px, top_px, width: size.0, height: size.1, zoom }
    }

    /// Leaves so much of the picture's light, and makes it opaque.
    pub(super) fn darken(&mut self, leaves: f32) {
        for y in 0..self.height {
            for x in 0..self.width {
                self.each_pixel(x, y, |pixel| *pixel = (pixel.truncate() * leaves).extend(1.0));
            }
        }
    }

    /// Fills a rectangle.
    pub(super) fn fill(&mut self, (left, top): (u32, u32), (width, height): (u32, u32), color: Rgb888) {
        for y in top..(top + height).min(self.height) {
            for x in left..(left + width).min(self.width) {
                self.set(x, y, color);
            }
        }
    }

    /// Draws the outermost units of a rectangle.
    pub(super) fn outline(&mut self, (left, top): (u32, u32), (width, height): (u32, u32), color: Rgb888) {
        self.fill((left, top), (width, 1), color);
        self.fill((left, top + height - 1), (width, 1), color);
        self.fill((left, top), (1, height), color);
        self.fill((left + width - 1, top), (1, height), color);
    }

    /// Writes a text, its upper end at `top`.
    pub(super) fn text(
        &mut self,
        text: &str,
        (x, top): (u32, u32),
        align: Align,
        font: &'static MonoFont<'static>,
        color: Rgb888,
    ) {
        let alignment = match align {
            Align::Left => Alignment::Left,
            Align::Right => Alignment::Right,
        };
        let style = TextStyleBuilder::new().alignment(alignment).baseline(Baseline::Top).build();
        // A right end is the last unit written to, not the one after.
        let x = if alignment == Alignment::Right { x.saturating_sub(1) } else { x };
        let text =
            Text::with_text_style(text, Point::new(x as i32, top as i32), MonoTextStyle::new(font, color), style);
        // Drawing into memory cannot fail.
        let Ok(_) = text.draw(self);
    }

    fn set(&mut self, x: u32, y: u32, color: Rgb888) {
        let [r, g, b] = [color.r(), color.g(), color.b()].map(linear_from_srgb8);
        self.each_pixel(x, y, |pixel| *pixel = Vec4::new(r, g, b, 1.0));
    }

    /// All pixels of a unit.
    fn each_pixel(&mut self, x: u32, y: u32, change: impl Fn(&mut Vec4)) {
        let (left, top) = (self.left_px + x * self.zoom, self.top_px + y * self.zoom);
        let stride = self.image.width() as usize;
        let pixels = self.image.pixels_mut();
        for row in top..top + self.zoom {
            let start = row as usize * stride + left as usize;
            pixels[start..start + self.zoom as usize].iter_mut().for_each(&change);
        }
    }
}

impl OriginDimensions for Canvas<'_> {
    fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }
}

impl DrawTarget for Canvas<'_> {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I>(&mut self, pixels: I) -> Result<(), Infallible>
    where
        I: IntoIterator<Item = embedded_graphics::Pixel<Rgb888>>,
    {
        for embedded_graphics::Pixel(Point { x, y }, color) in pixels {
            if let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y))
                && x < self.width
                && y < self.height
            {
                self.set(x, y, color);
            }
        }
        Ok(())
    }
}
