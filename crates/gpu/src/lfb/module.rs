//! The text that lets any shader use an LFB. Twin: `shaders/lfb/module.wesl`.

use super::LfbError;
use crate::shaders;

/// What a shader does with an LFB.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// It adds fragments, while counting and while capturing: one uniform and three storage buffers.
    Capture,
    /// It reads them, any number of times: one uniform and two read-only storage buffers.
    Read,
}

/// A WGSL module, to be put in front of a shader of your own. Every name in it begins with [`name`](Self::name).
///
/// For a name `lfb`, in a shader that captures:
///
/// - `lfb_add(pixel: vec2<u32>, payload: LfbPayload, depth: f32, order: u32)` adds a fragment. `LfbPayload` is `u32` or
///   a vector of two to four. At equal depths the greater order is in front: give it what is drawn later, or the number
///   of the primitive, so that the order does not depend on timing. What is level in both is ordered by its payload.
/// - `lfb_add_color(pixel, color: vec4<f32>, depth, order)`, with a payload of two words, packs a colour as four halves.
/// - `lfb_is_counting() -> bool`: work that only leads to the payload can be left out then. What decides whether and
///   where a fragment is added must not.
///
/// In a shader that reads:
///
/// - `lfb_fragment_count(pixel) -> u32`, none outside.
/// - `lfb_load(pixel, i) -> LfbFragment` with its `payload`, `depth` and `order`; the nearest is the first.
/// - `lfb_range(pixel) -> LfbRange` for loops in order: `for (var i = range.first; i < range.end; i++)`, with
///   `lfb_at(i) -> LfbFragment`.
/// - `lfb_color(fragment) -> vec4<f32>` unpacks what `lfb_add_color` packed.
///
/// In both, `lfb_size() -> vec2<u32>`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LfbModule<'a> {
    /// What its names begin with: `lfb_add` and `LfbFragment` for `lfb`. Empty for a WESL module, whose names are imported:
    /// `import package::lfb::{add, is_counting};`.
    pub name: &'a str,
    /// Bind group.
    pub group: u32,
    /// Number of its first binding within the group; the others follow.
    pub first_binding: u32,
    /// Words of a payload, 1 to 4.
    pub payload_words: u32,
    /// What the shader does with it.
    pub access: Access,
}

impl LfbModule<'_> {
    /// The text.
    ///
    /// # Errors
    /// [`LfbError::Name`], [`LfbError::Payload`].
    pub fn wgsl(&self) -> Result<String, LfbError> {
        let template = match (self.access, self.payload_words) {
            (Access::Capture, 1) => shaders::LFB_CAPTURE_1,
            (Access::Capture, 2) => shaders::LFB_CAPTURE_2,
            (Access::Capture, 3) => shaders::LFB_CAPTURE_3,
            (Access::Capture, 4) => shaders::LFB_CAPTURE_4,
            (Access::Read, 1) => shaders::LFB_READ_1,
            (Access::Read, 2) => shaders::LFB_READ_2,
            (Access::Read, 3) => shaders::LFB_READ_3,
            (Access::Read, 4) => shaders::LFB_READ_4,
            (_, words) => return Err(LfbError::Payload(words)),
        };
        let (values, types) = self.prefixes()?;
        // By way of characters that no shader has, as the name may contain what is replaced.
        let mut text = template.replace("lfb_", "\u{1}").replace("Lfb", "\u{2}");
        // Upwards from the last, as a number may become that of a later one.
        for binding in (0..4).rev() {
            let number = self.first_binding.saturating_add(binding);
            text = text.replace(&format!("@binding({binding})"), &format!("@binding({number})"));
        }
        text = text.replace("@group(0)", &format!("@group({})", self.group));
        Ok(text.replace('\u{1}', &values).replace('\u{2}', &types))
    }

    /// What names of values and of types begin with.
    fn prefixes(&self) -> Result<(String, String), LfbError> {
        let mut characters = self.name.chars();
        let Some(first) = characters.next() else { return Ok(Default::default()) };
        if !first.is_ascii_alphabetic() || !characters.all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return Err(LfbError::Name(self.name.to_owned()));
        }
        let types = self.name.split('_').filter_map(|word| {
            let first = word.chars().next()?;
            Some(first.to_ascii_uppercase().to_string() + &word[1..])
        });
        Ok((format!("{}_", self.name), types.collect()))
    }
}
