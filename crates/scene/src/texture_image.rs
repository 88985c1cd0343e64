//! Decodes PNG and JPEG pictures into textures.

use std::io::Cursor;

use image::{ImageReader, Limits};
use pellucid_core::Texture;
use pellucid_core::texture::{MAX_TEXTURE_SIZE_PX, Sampler};

/// Bytes a decoder may hold at once: the largest texture at 16 bits a channel, and some.
const DECODE_LIMIT_BYTES: u64 = 3 << 30;

/// A texture from the bytes of a PNG or JPEG file; the content, not a name, says which.
///
/// # Errors
/// A sentence on what is wrong with the picture.
pub(crate) fn decode(bytes: &[u8], sampler: Sampler) -> Result<Texture, String> {
    decode_with_alpha(bytes, sampler, |alpha| alpha)
}

/// As [`decode`], each texel's alpha replaced by what `alpha` makes of it.
///
/// # Errors
/// As [`decode`].
pub(crate) fn decode_with_alpha(bytes: &[u8], sampler: Sampler, alpha: impl Fn(u8) -> u8) -> Result<Texture, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    if reader.format().is_none() {
        return Err("is neither PNG nor JPEG".into());
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_TEXTURE_SIZE_PX);
    limits.max_image_height = Some(MAX_TEXTURE_SIZE_PX);
    limits.max_alloc = Some(DECODE_LIMIT_BYTES);
    reader.limits(limits);
    let picture = reader.decode().map_err(|error| format!("cannot be decoded: {error}"))?.into_rgba8();
    let (width, height) = picture.dimensions();
    let texels = picture.as_raw().as_chunks::<4>().0.iter().map(|&[r, g, b, a]| [r, g, b, alpha(a)]).collect();
    Texture::new(width, height, texels, sampler).map_err(|error| error.to_string())
}

/// Width and height as the file's head states them; `None` if it cannot be read.
pub(crate) fn size(bytes: &[u8]) -> Option<(u32, u32)> {
    ImageReader::new(Cursor::new(bytes)).with_guessed_format().ok()?.into_dimensions().ok()
}
