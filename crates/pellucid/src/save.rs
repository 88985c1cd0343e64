//! Pictures on disk: PNG and OpenEXR. Written to a temporary name first and renamed when whole, so that an error leaves
//! nothing behind and a reader never sees half a picture.

use std::io::{BufWriter, Write};
use std::path::Path;

use image::ImageEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use pellucid_core::Image;

use crate::Error;

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
    let format = ImageFormat::of(path).ok_or_else(|| Error::save(path, "its extension is neither .png nor .exr"))?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = tempfile::Builder::new().prefix(".pellucid-").tempfile_in(folder).map_err(Error::save_io(path))?;
    {
        let mut writer = BufWriter::new(file.as_file_mut());
        match format {
            ImageFormat::Png => write_png(image, &mut writer).map_err(|error| Error::save(path, error))?,
            ImageFormat::Exr => write_exr(image, &mut writer).map_err(|error| Error::save(path, error))?,
        }
        writer.flush().map_err(Error::save_io(path))?;
    }
    make_readable(file.as_file()).map_err(Error::save_io(path))?;
    file.persist(path).map_err(|error| Error::save(path, error.error))?;
    Ok(())
}

fn write_png(image: &Image, writer: impl Write) -> Result<(), image::ImageError> {
    let rgba = image.to_srgb8();
    let encoder = PngEncoder::new_with_quality(writer, CompressionType::Default, FilterType::Adaptive);
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

/// A temporary file is its owner's alone; a picture is made like any other file.
#[cfg(unix)]
fn make_readable(file: &std::fs::File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn make_readable(_: &std::fs::File) -> std::io::Result<()> {
    Ok(())
}
