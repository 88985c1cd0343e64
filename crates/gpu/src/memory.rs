//! What a capture may hold, and the windows it is split into to stay inside that.
//!
//! A technique says what a window of the picture takes; if that is more than the budget, or than one storage binding of
//! the device, the window is split and each part captured on its own. Every fragment is captured in exactly one window,
//! so the picture is the same at any budget.

use std::collections::HashMap;

use crate::technique::Outcome;
use crate::{Context, GpuError, table};

/// A rectangle of pixels of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Window {
    /// Column of its leftmost pixel.
    pub left: u32,
    /// Row of its topmost pixel.
    pub top: u32,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
}

impl Window {
    /// Its number of pixels.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Two halves, the first above or to the left of the second: by rows while there are several, as rows share no
    /// columns of triangles. `None` for a single pixel.
    pub fn halves(&self) -> Option<[Self; 2]> {
        if self.height > 1 {
            let height = self.height / 2;
            return Some([
                Self { height, ..*self },
                Self { top: self.top + height, height: self.height - height, ..*self },
            ]);
        }
        let width = self.width / 2;
        (width > 0)
            .then(|| [Self { width, ..*self }, Self { left: self.left + width, width: self.width - width, ..*self }])
    }

    /// Parts, from the top, that each fit, as large as possible: bands of rows, and where one row does not fit, pieces of
    /// it. `fits(pixels, fragments)` tells of a part; `counts` are the fragments of each pixel.
    ///
    /// # Errors
    /// The number of fragments of the first pixel that does not fit alone.
    pub(crate) fn parts(&self, counts: &[u32], fits: impl Fn(u64, u64) -> bool) -> Result<Vec<Self>, u64> {
        self.parts_by(counts, |a, b| a + b, fits)
    }

    /// As [`Self::parts`], where pixels together do not need the sum of what each needs but something else that grows
    /// with both.
    pub(crate) fn parts_by(
        &self,
        counts: &[u32],
        join: fn(u64, u64) -> u64,
        fits: impl Fn(u64, u64) -> bool,
    ) -> Result<Vec<Self>, u64> {
        let width = self.width as usize;
        let row_totals: Vec<u64> =
            counts.chunks(width).map(|row| row.iter().map(|&count| u64::from(count)).fold(0, join)).collect();
        let mut parts = Vec::new();
        let mut row = 0;
        while row < row_totals.len() {
            let rows = fitting(&row_totals[row..], width as u64, join, &fits);
            let top = self.top + row as u32;
            if rows > 0 {
                parts.push(Self { top, height: rows as u32, ..*self });
                row += rows;
                continue;
            }
            let columns: Vec<u64> = counts[row * width..][..width].iter().map(|&count| u64::from(count)).collect();
            let mut column = 0;
            while column < width {
                let pixels = fitting(&columns[column..], 1, join, &fits);
                if pixels == 0 {
                    return Err(columns[column]);
                }
                parts.push(Self { left: self.left + column as u32, top, width: pixels as u32, height: 1 });
                column += pixels;
            }
            row += 1;
        }
        Ok(parts)
    }
}

/// How many of the first totals fit together.
fn fitting(totals: &[u64], pixels_each: u64, join: fn(u64, u64) -> u64, fits: impl Fn(u64, u64) -> bool) -> usize {
    let mut joint = 0u64;
    totals
        .iter()
        .enumerate()
        .take_while(|&(i, &total)| {
            joint = join(joint, total);
            fits((i as u64 + 1) * pixels_each, joint)
        })
        .count()
}

/// A guess of how many fragments a window has, kept between frames by techniques that have to allocate before they know.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    fragments_per_pixel: f64,
}

impl Default for Estimate {
    fn default() -> Self {
        Self { fragments_per_pixel: 4.0 }
    }
}

impl Estimate {
    /// Room asked for above what was seen last, so that a moving camera seldom overflows.
    const SLACK: f64 = 1.125;

    /// Fragments to make room for.
    pub fn fragments(&self, window: &Window) -> u64 {
        (self.fragments_per_pixel * window.pixels() as f64 * Self::SLACK).ceil().max(1.0) as u64
    }

    /// Fragments to make room for where there were so many last.
    pub(crate) fn with_slack(fragments: u64) -> u64 {
        (fragments as f64 * Self::SLACK).ceil().max(1.0) as u64
    }

    /// Takes note of how many there really were.
    pub fn learn(&mut self, window: &Window, fragments: u64) {
        self.fragments_per_pixel = fragments as f64 / window.pixels() as f64;
    }
}

/// Buffers of a technique, kept between frames, and what they take.
#[derive(Debug)]
pub(crate) struct Memory {
    budget_bytes: u64,
    buffers: HashMap<&'static str, wgpu::Buffer>,
    textures: HashMap<&'static str, wgpu::Texture>,
    peak_bytes: u64,
}

impl Memory {
    pub(crate) fn new(budget_bytes: u64) -> Self {
        Self { budget_bytes, buffers: HashMap::new(), textures: HashMap::new(), peak_bytes: 0 }
    }

    /// Starts a frame: what is held is counted anew.
    pub(crate) fn begin_frame(&mut self, budget_bytes: u64) {
        if self.held_bytes() > budget_bytes {
            self.clear();
        }
        self.budget_bytes = budget_bytes;
        self.peak_bytes = self.held_bytes();
    }

    /// Most bytes held at once in this frame.
    pub(crate) fn peak_bytes(&self) -> u64 {
        self.peak_bytes
    }

    /// Gives all buffers back.
    pub(crate) fn clear(&mut self) {
        for buffer in self.buffers.drain().map(|(_, buffer)| buffer) {
            buffer.destroy();
        }
        for texture in self.textures.drain().map(|(_, texture)| texture) {
            texture.destroy();
        }
    }

    fn held_bytes(&self) -> u64 {
        self.held().map(|(_, bytes)| bytes).sum()
    }

    fn held(&self) -> impl Iterator<Item = (&'static str, u64)> {
        let buffers = self.buffers.iter().map(|(&name, buffer)| (name, buffer.size()));
        buffers.chain(self.textures.iter().map(|(&name, texture)| (name, texture_bytes(texture))))
    }

    /// The texture of this name: the one there is if size and format are as described.
    pub(crate) fn texture(
        &mut self,
        gpu: &Context,
        name: &'static str,
        descriptor: &wgpu::TextureDescriptor<'_>,
    ) -> Result<wgpu::Texture, GpuError> {
        if let Some(texture) = self.textures.get(name) {
            if (texture.size(), texture.format()) == (descriptor.size, descriptor.format) {
                return Ok(texture.clone());
            }
            texture.destroy();
            self.textures.remove(name);
        }
        let texture = gpu.texture(&wgpu::TextureDescriptor { label: Some(name), ..descriptor.clone() })?;
        self.textures.insert(name, texture.clone());
        self.peak_bytes = self.peak_bytes.max(self.held_bytes());
        Ok(texture)
    }

    /// The table of this name: the one there is if it is large enough and not twice too large; else a new one for exactly
    /// `count` entries. Its content is undefined.
    pub(crate) fn table(
        &mut self,
        gpu: &Context,
        name: &'static str,
        format: wgpu::TextureFormat,
        count: u64,
    ) -> Result<wgpu::TextureView, GpuError> {
        let bytes = table::bytes(format, count);
        if let Some(texture) = self.textures.get(name)
            && texture.format() == format
            && (bytes..=2 * bytes).contains(&texture_bytes(texture))
        {
            return Ok(table::view(texture));
        }
        self.texture(gpu, name, &table::descriptor(name, format, count)).map(|texture| table::view(&texture))
    }

    /// The storage buffer of this name: the one there is if it is large enough, not twice too large, and leaves room for
    /// the others; else a new one of exactly `bytes`. Its content is undefined.
    pub(crate) fn buffer(&mut self, gpu: &Context, name: &'static str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
        let bytes = allocated(bytes);
        if let Some(buffer) = self.buffers.get(name) {
            if (bytes..=2 * bytes).contains(&buffer.size()) {
                return Ok(buffer.clone());
            }
            buffer.destroy();
            self.buffers.remove(name);
        }
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let buffer = gpu.buffer(name, bytes, usage | wgpu::BufferUsages::INDIRECT)?;
        self.buffers.insert(name, buffer.clone());
        self.peak_bytes = self.peak_bytes.max(self.held_bytes());
        Ok(buffer)
    }

    /// Whether buffers of these sizes fit the budget together and the device's limits each.
    pub(crate) fn fits(&self, gpu: &Context, needs: &[(&'static str, u64)]) -> bool {
        let limit = gpu.max_binding_bytes().min(gpu.limits.max_buffer_size);
        total(needs) <= self.budget_bytes && needs.iter().all(|&(_, bytes)| bytes <= limit)
    }

    /// Why what a single pixel needs does not fit.
    pub(crate) fn refusal(&self, gpu: &Context, needs: &[(&'static str, u64)]) -> GpuError {
        let limit = gpu.max_binding_bytes().min(gpu.limits.max_buffer_size);
        match needs.iter().find(|&&(_, bytes)| bytes > limit) {
            Some(&(name, size)) => GpuError::Limit {
                what: format!("one pixel's {name}"),
                size,
                limit,
                limit_name: "maxStorageBufferBindingSize",
            },
            None => GpuError::Budget { needed: total(needs), budget: self.budget_bytes },
        }
    }

    /// The two halves of a window whose needs do not fit.
    pub(crate) fn halves(
        &self,
        gpu: &Context,
        window: Window,
        needs: &[(&'static str, u64)],
    ) -> Result<Outcome, GpuError> {
        match window.halves() {
            Some(halves) => Ok(Outcome::Split(halves.to_vec())),
            None => Err(self.refusal(gpu, needs)),
        }
    }

    /// The storage buffer of this name, of any size: for passes that need something bound and do not touch it.
    pub(crate) fn any_buffer(&mut self, gpu: &Context, name: &'static str) -> Result<wgpu::Buffer, GpuError> {
        match self.buffers.get(name) {
            Some(buffer) => Ok(buffer.clone()),
            None => self.buffer(gpu, name, 16),
        }
    }

    /// Gives back buffers that are larger than these need to be, so that all of them fit the budget together. Techniques
    /// call it with everything a window needs, before they ask for any of it. Returns whether everything was given back.
    pub(crate) fn make_room(&mut self, needs: &[(&'static str, u64)]) -> bool {
        let need = |name| needs.iter().find(|&&(other, _)| other == name).map_or(0, |&(_, bytes)| allocated(bytes));
        let is_held = |name| self.held().any(|(held, _)| held == name);
        let total: u64 = self
            .held()
            .map(|(name, bytes)| bytes.max(need(name)))
            .chain(needs.iter().filter(|&&(name, _)| !is_held(name)).map(|&(_, bytes)| allocated(bytes)))
            .sum();
        let is_too_much = total > self.budget_bytes;
        if is_too_much {
            self.clear();
        }
        is_too_much
    }
}

fn texture_bytes(texture: &wgpu::Texture) -> u64 {
    let texel_bytes = texture.format().block_copy_size(None).unwrap_or(4);
    let texels = u64::from(texture.width()) * u64::from(texture.height()) * u64::from(texture.depth_or_array_layers());
    texels * u64::from(texel_bytes)
}

fn total(needs: &[(&'static str, u64)]) -> u64 {
    needs.iter().map(|&(_, bytes)| allocated(bytes)).sum()
}

/// Bytes of a buffer that has to hold so many.
fn allocated(bytes: u64) -> u64 {
    bytes.max(16).next_multiple_of(4)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Window = Window { left: 3, top: 5, width: 4, height: 3 };

    #[test]
    fn halves_cover_the_window() {
        let mut pending = vec![WINDOW];
        let mut pixels = Vec::new();
        while let Some(window) = pending.pop() {
            match window.halves() {
                Some(halves) => pending.extend(halves),
                None => pixels.push((window.left, window.top)),
            }
        }
        pixels.sort_unstable();
        let all: Vec<_> = (3..7).flat_map(|x| (5..8).map(move |y| (x, y))).collect();
        assert_eq!(pixels, all);
    }

    #[test]
    fn parts_are_bands_and_pieces_of_rows_that_do_not_fit() {
        let counts = [1, 1, 1, 1, 9, 0, 9, 9, 2, 2, 2, 2];
        let parts = WINDOW.parts(&counts, |_, fragments| fragments <= 10).unwrap();
        assert_eq!(
            parts,
            [
                Window { height: 1, ..WINDOW },
                Window { left: 3, top: 6, width: 2, height: 1 },
                Window { left: 5, top: 6, width: 1, height: 1 },
                Window { left: 6, top: 6, width: 1, height: 1 },
                Window { top: 7, height: 1, ..WINDOW },
            ]
        );
        assert_eq!(WINDOW.parts(&counts, |_, fragments| fragments <= 8), Err(9));
        assert_eq!(WINDOW.parts(&counts, |_, _| true), Ok(vec![WINDOW]));
    }
}
