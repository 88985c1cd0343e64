//! Textures: an image and a sampler (glTF 2.0, section 3.8).

use pellucid_core::TextureId;
use pellucid_core::texture::{Filter, Sampler, Wrap};

use super::{Loader, document, malformed};
use crate::{LoadError, texture_image};

/// Texels that any file may have: a compressed picture of one colour is a thousand times smaller than what it becomes.
const FREE_TEXELS: u64 = 1 << 26;

/// Texels beyond these for one byte read. Of one colour, a JPEG has about 85.
const TEXELS_PER_BYTE: u64 = 128;

/// What becomes of the alpha of a texture's texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum TexelAlpha {
    /// Stays.
    AsItIs,
    /// All 255.
    One,
    /// 255 where it is at least this, 0 elsewhere.
    Tested { least: u16 },
}

/// A picture as one material uses it.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Use {
    image: usize,
    sampler: Sampler,
    alpha: TexelAlpha,
}

impl Loader<'_> {
    /// The texture of that number in the document; `None`, with a warning, if its picture cannot be read.
    pub(super) fn texture(
        &mut self,
        index: usize,
        alpha: TexelAlpha,
        place: &str,
    ) -> Result<Option<TextureId>, LoadError> {
        let Some(source) = self.document.textures.get(index) else {
            let count = self.document.textures.len();
            return Err(malformed(format!("{place}: texture {index} does not exist; there are {count}")));
        };
        let sampler = match source.sampler {
            None => Sampler::default(),
            Some(number) => match self.document.samplers.get(number) {
                Some(source) => sampler(source, number)?,
                None => {
                    let count = self.document.samplers.len();
                    return Err(malformed(format!(
                        "texture {index}: sampler {number} does not exist; there are {count}"
                    )));
                }
            },
        };
        let Some(image) = source.source else {
            self.warnings
                .add("textures in a format other than PNG or JPEG are not supported: the base colour is shown");
            return Ok(None);
        };
        let key = Use { image, sampler, alpha };
        if let Some(&known) = self.textures.get(&key) {
            return Ok(Some(known));
        }
        if self.failed_images.contains(&image) {
            return Ok(None);
        }
        match self.decode(key, index)? {
            Ok(texture) => {
                let id = self.scene.add_texture(texture)?;
                self.textures.insert(key, id);
                Ok(Some(id))
            }
            Err(reason) => {
                self.failed_images.insert(image);
                self.warnings.add(format!("image {image}: {reason}; the base colour is shown"));
                Ok(None)
            }
        }
    }

    /// The inner error is what is wrong with the picture.
    fn decode(&mut self, key: Use, texture: usize) -> Result<Result<pellucid_core::Texture, String>, LoadError> {
        let file;
        let Some(image) = self.document.images.get(key.image) else {
            let (index, count) = (key.image, self.document.images.len());
            return Err(malformed(format!("texture {texture}: image {index} does not exist; there are {count}")));
        };
        let bytes: &[u8] = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => {
                file = match self.uris.read(uri) {
                    Err(error @ LoadError::Asset { .. }) => return Ok(Err(error.to_string())),
                    other => other?,
                };
                &file
            }
            (None, Some(view)) => self.buffers.view(view, &format!("image {}", key.image))?.0,
            (None, None) => return Err(malformed(format!("image {} has neither a URI nor a buffer view", key.image))),
        };
        let texels = texture_image::size(bytes).map_or(0, |(width, height)| u64::from(width) * u64::from(height));
        let read = self.file_bytes + self.uris.bytes_read;
        let total = self.texels.saturating_add(texels);
        if total > FREE_TEXELS.saturating_add(read.saturating_mul(TEXELS_PER_BYTE)) {
            return Ok(Err(format!("{texels} more texels are too many for a file of this size")));
        }
        let decoded =
            match key.alpha {
                TexelAlpha::AsItIs => texture_image::decode(bytes, key.sampler),
                TexelAlpha::One => texture_image::decode_with_alpha(bytes, key.sampler, |_| 255),
                TexelAlpha::Tested { least } => texture_image::decode_with_alpha(bytes, key.sampler, |alpha| {
                    if u16::from(alpha) >= least { 255 } else { 0 }
                }),
            };
        if decoded.is_ok() {
            self.texels = total;
        }
        Ok(decoded)
    }
}

fn sampler(source: &document::Sampler, number: usize) -> Result<Sampler, LoadError> {
    let unknown = |what: &str, code: u32| malformed(format!("sampler {number}: unknown {what} {code}"));
    let (linear, nearest) = (Filter::Linear, Filter::Nearest);
    let default = Sampler::default();
    let magnify = match source.mag_filter {
        None => default.magnify,
        Some(9728) => nearest,
        Some(9729) => linear,
        Some(code) => return Err(unknown("magnification filter", code)),
    };
    let (minify, mip) = match source.min_filter {
        None => (default.minify, default.mip),
        Some(9728) => (nearest, None),
        Some(9729) => (linear, None),
        Some(9984) => (nearest, Some(nearest)),
        Some(9985) => (linear, Some(nearest)),
        Some(9986) => (nearest, Some(linear)),
        Some(9987) => (linear, Some(linear)),
        Some(code) => return Err(unknown("minification filter", code)),
    };
    let wrap = |code| match code {
        None | Some(10497) => Ok(Wrap::Repeat),
        Some(33648) => Ok(Wrap::MirroredRepeat),
        Some(33071) => Ok(Wrap::ClampToEdge),
        Some(code) => Err(unknown("wrap mode", code)),
    };
    Ok(Sampler { wrap_u: wrap(source.wrap_s)?, wrap_v: wrap(source.wrap_t)?, magnify, minify, mip })
}
