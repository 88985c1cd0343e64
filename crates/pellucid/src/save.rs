//! Pictures on disk: PNG and OpenEXR.

use std::io::Write;
use std::path::Path;

use image::ImageEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use pellucid_core::Image;

use crate::Error;
use crate::files::write_whole;

/// What a picture is stored as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageFormat {
    /// 8 bits a channel, sRGB, straight alpha; without an alpha channel if every pixel is opaque.
    Png,
    /// 32-bit float a channel, linear light, premultiplied alpha.
    Exr,
}

impl ImageFormat {
    /// The format that a file name's extension means: `.png` or `.exr`.
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "png" => Some(Self::Png),
            "exr" => Some(Self::Exr),
            _ => None,
        }
    }
}

/// Writes a picture as PNG or OpenEXR, by the extension of `path`.
///
/// # Errors
/// [`Error::Save`] if the extension is neither, or the file cannot be written; then nothing is left behind.
pub fn save(image: &Image, path: impl AsRef<Path>) -> Result<(), Error> {
    let path = path.as_ref();
    match ImageFormat::of(path) {
        Some(ImageFormat::Png) => write_whole(path, |writer| write_png(image, writer)),
        Some(ImageFormat::Exr) => write_whole(path, |writer| write_exr(image, writer)),
        None => Err(Error::save(path, "its extension is neither .png nor .exr")),
    }
}

fn write_png(image: &Image, writer: impl Write) -> Result<(), image::ImageError> {
    let rgba = image.to_srgb8();
    // A tenth of the time of the next better compression, for files a tenth larger.
    let encoder = PngEncoder::new_with_quality(writer, CompressionType::Fast, FilterType::Adaptive);
    let (width, height) = (image.width(), image.height());
    if rgba.chunks_exact(4).all(|pixel| pixel[3] == 255) {
        let rgb: Vec<u8> = rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        encoder.write_image(&rgb, width, height, image::ExtendedColorType::Rgb8)
    } else {
        encoder.write_image(&rgba, width, height, image::ExtendedColorType::Rgba8)
    }
}

fn write_exr(image: &Image, writer: impl Write + std::io::Seek) -> exr::error::UnitResult {
    use exr::prelude::{SpecificChannels, WritableImage};

    let size = (image.width() as usize, image.height() as usize);
    let channels = SpecificChannels::rgba(|position: exr::math::Vec2<usize>| {
        let pixel = image.pixel(position.x() as u32, position.y() as u32);
        (pixel.x, pixel.y, pixel.z, pixel.w)
    });
    exr::prelude::Image::from_channels(size, channels).write().to_buffered(writer)
}
