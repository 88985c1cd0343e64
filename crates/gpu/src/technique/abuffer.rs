//! The A-buffer (Crassin 2010): an array of fragments for each pixel, all of the same length, filled in one pass over the
//! geometry behind an atomic counter for each pixel. Twins: `shaders/technique/abuffer.wesl`, `abuffer_texture.wesl`.
//!
//! The article fixes the length, and loses what lies beyond it. Here it is the greatest count of the last frame; counters
//! count on beyond it, and a capture that did not fit is repeated with the greatest of them. One deep pixel makes all
//! arrays long: where that exceeds the budget, the window is split so that deep pixels are among few others.
//!
//! As in the article, fragments are kept in memory or in an array of textures. In memory they lie layer by layer too, so
//! that neighbouring pixels write side by side. WebGPU's floor cannot read and write one texture in a pass: from textures
//! references to fragments are sorted. Rejected: a second array of textures to sort into.
//!
//! **Where the time goes**, in percent of a frame in buffers, measured as for [`linear`](super::linear): main render 70 (bunny)
//! and 64 (dragon), which is drawn again for each of the windows that deep pixels make necessary: 2 on the dragon, 16 on hair and
//! Sponza; greatest count 12 and 3; read and blend 8 and 3.

use pellucid_core::primitive::Pass;
use wgpu::{BindGroup, BindGroupLayout, BindingResource, ComputePipeline, ShaderStages, TextureUsages};

use super::growth::{Splits, most_that_fits};
use super::{Capture, Layouts, Outcome};
use crate::frame::Frame;
use crate::memory::Window;
use crate::pass::ordered::{LfbShaders, OrderedPasses, compute_pipeline, dispatch_window};
use crate::readback::read_buffer;
use crate::surface::{SurfacePass, SurfacePipelines, depth_state, shader, storage_entry};
use crate::{Context, GpuError, shaders, table};

/// Bytes of a stored fragment.
const FRAGMENT_BYTES: u64 = 16;
/// Length of the arrays as long as nothing is known.
const FIRST_GUESS: u64 = 8;

const COUNTS: &str = "counts";
const FRAGMENTS: &str = "fragments";
const LAYERS: &str = "layers";

/// Where the A-buffer keeps fragments.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Storage {
    /// In a buffer, 16 bytes for each pixel and layer.
    #[default]
    Buffer,
    /// In an array of textures, 16 bytes for each pixel and layer, and 4 more if a pixel has more than 32, or all are put in order
    /// in memory.
    Texture,
}

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct ABuffer {
    storage: Storage,
    /// Of the capture, and of what comes after it.
    layouts: [BindGroupLayout; 2],
    capture: SurfacePipelines,
    reduce: ComputePipeline,
    ordered: OrderedPasses,
    guess: u64,
    splits: Splits,
}

/// What came of a capture.
struct Captured {
    counts: wgpu::Buffer,
    group: BindGroup,
    /// Most fragments at one pixel.
    greatest: u64,
    /// How many there was room for.
    layers: u64,
}

/// An array of textures with room for so many layers of every pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Shape {
    array_layers: u32,
    /// Texels of a pixel, below each other, where there are more layers than a texture may have.
    rows: u32,
}

impl Shape {
    fn new(gpu: &Context, layers: u64) -> Self {
        let rows = layers.div_ceil(gpu.limits.max_texture_array_layers.into()).max(1);
        Self { array_layers: layers.div_ceil(rows).max(1) as u32, rows: rows as u32 }
    }

    fn layers(self) -> u64 {
        u64::from(self.array_layers) * u64::from(self.rows)
    }
}

impl Storage {
    /// Everything for so many pixels and layers. Textures are told one by one, as each is its own thing to the limits.
    fn needs(self, gpu: &Context, pixels: u64, layers: u64) -> Vec<(&'static str, u64)> {
        let mut needs = vec![(COUNTS, (pixels + 1) * 4)];
        match self {
            Self::Buffer => needs.push((FRAGMENTS, pixels * layers * FRAGMENT_BYTES)),
            Self::Texture => {
                let shape = Shape::new(gpu, layers);
                needs.push(OrderedPasses::order_need(pixels * shape.layers()));
                let texture_bytes = pixels * u64::from(shape.rows) * FRAGMENT_BYTES;
                needs.extend((0..shape.array_layers).map(|_| (LAYERS, texture_bytes)));
            }
        }
        needs.extend(OrderedPasses::needs(pixels));
        needs
    }

    /// Whether so many pixels and layers fit, in rows of so many pixels.
    fn fits(self, frame: &Frame<'_>, width: u32, pixels: u64, layers: u64) -> bool {
        let height = pixels.div_ceil(width.into());
        let is_too_high = self == Self::Texture
            && height * u64::from(Shape::new(frame.gpu, layers).rows)
                > frame.gpu.limits.max_texture_dimension_2d.into();
        !is_too_high && frame.memory.fits(frame.gpu, &self.needs(frame.gpu, pixels, layers))
    }
}

impl ABuffer {
    pub(crate) fn new(gpu: &Context, layouts: Layouts<'_>, storage: Storage) -> Self {
        let visibility = ShaderStages::FRAGMENT | ShaderStages::COMPUTE;
        let own_layout = |label, fragments| {
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some(label),
                entries: &[storage_entry(0, visibility, false), fragments],
            })
        };
        let (written, read) = match storage {
            Storage::Buffer => (storage_entry(1, visibility, false), storage_entry(1, visibility, false)),
            Storage::Texture => (table::stored_entry(1, visibility, table::GROUPS), table::read_entry(1, visibility)),
        };
        let layouts_of = [own_layout("abuffer, captured", written), own_layout("abuffer", read)];
        let (wgsl, ordered_shaders) = match storage {
            Storage::Buffer => (
                shaders::ABUFFER,
                LfbShaders {
                    classify: shaders::CLASSIFY_ABUFFER,
                    sort: Some(shaders::SORT_ABUFFER),
                    resolve: shaders::RESOLVE_ABUFFER,
                    gather: shaders::GATHER_ABUFFER,
                    by_reference: false,
                },
            ),
            Storage::Texture => (
                shaders::ABUFFER_TEXTURE,
                LfbShaders {
                    classify: shaders::CLASSIFY_ABUFFER_TEXTURE,
                    sort: Some(shaders::SORT_ABUFFER_TEXTURE),
                    resolve: shaders::RESOLVE_ABUFFER_TEXTURE,
                    gather: shaders::GATHER_ABUFFER_TEXTURE,
                    by_reference: true,
                },
            ),
        };
        let capture = SurfacePass {
            label: "main render",
            wgsl,
            plain: "capture",
            varied: "capture_varied",
            ignores_color: false,
            targets: &[],
            depth_stencil: depth_state(false, false),
            own_layout: Some(&layouts_of[0]),
        };
        let module = shader(gpu, "greatest count", shaders::ABUFFER);
        let group_layouts = [Some(layouts.picture), None, None, Some(&layouts_of[1])];
        Self {
            storage,
            capture: SurfacePipelines::new(gpu, layouts.surfaces, &capture),
            reduce: compute_pipeline(gpu, "greatest count", &module, "reduce", &group_layouts, &[]),
            ordered: OrderedPasses::new(gpu, ordered_shaders, layouts.picture, &layouts_of[1]),
            layouts: layouts_of,
            guess: FIRST_GUESS,
            splits: Splits::default(),
        }
    }

    /// Makes what holds so many layers of a window: what is bound in the capture and after it, and how many layers that is.
    fn allocate(
        &self,
        frame: &mut Frame<'_>,
        window: Window,
        layers: u64,
    ) -> Result<(wgpu::Buffer, [BindGroup; 2], u64), GpuError> {
        let (gpu, pixels) = (frame.gpu, window.pixels());
        let mut needs: Vec<(&'static str, u64)> = Vec::new();
        for (name, bytes) in self.storage.needs(gpu, pixels, layers) {
            match needs.last_mut().filter(|(last, _)| *last == name) {
                Some((_, sum)) => *sum += bytes,
                None => needs.push((name, bytes)),
            }
        }
        frame.memory.make_room(&needs);
        let counts = frame.memory.buffer(gpu, needs[0].0, needs[0].1)?;
        let (buffer, texture);
        let (fragments, there_are) = match self.storage {
            Storage::Buffer => {
                buffer = frame.memory.buffer(gpu, FRAGMENTS, pixels * layers * FRAGMENT_BYTES)?;
                (buffer.as_entire_binding(), buffer.size() / FRAGMENT_BYTES / pixels)
            }
            Storage::Texture => {
                let shape = Shape::new(gpu, layers);
                texture = table::view(&frame.memory.texture(gpu, LAYERS, &texture_of(window, shape))?);
                (BindingResource::TextureView(&texture), shape.layers())
            }
        };
        let groups = self.layouts.each_ref().map(|layout| {
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("abuffer"),
                layout,
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: counts.as_entire_binding() },
                    wgpu::BindGroupEntry { binding: 1, resource: fragments.clone() },
                ],
            })
        });
        Ok((counts, groups, there_are))
    }

    /// Captures with room for so many layers.
    fn capture(&mut self, frame: &mut Frame<'_>, window: Window, layers: u64) -> Result<Captured, GpuError> {
        let (counts, [captured, group], there_are) = self.allocate(frame, window, layers)?;
        let (gpu, pixels) = (frame.gpu, window.pixels());
        frame.zero("zero", &counts, (pixels + 1) * 4)?;
        let mut pass = frame.capture_pass("main render", window)?;
        pass.set_bind_group(3, &captured, &[]);
        frame.surfaces.draw(gpu, &mut pass, Pass::Transparent, &mut self.capture);
        drop(pass);
        let mut pass = frame.compute_pass("greatest count")?;
        pass.set_pipeline(&self.reduce);
        dispatch_window(&mut pass, frame, window, &group);
        drop(pass);
        let greatest = u64::from(read_buffer::<u32>(frame, &counts, pixels, 1)?[0]);
        Ok(Captured { counts, group, greatest, layers: there_are })
    }

    /// Parts of a window that fit, now that it is known how many fragments each pixel has.
    fn split(&mut self, frame: &mut Frame<'_>, window: Window, counts: &wgpu::Buffer) -> Result<Outcome, GpuError> {
        let counts: Vec<u32> = read_buffer(frame, counts, 0, window.pixels())?;
        let fits = |pixels, layers| self.storage.fits(frame, window.width, pixels, layers);
        let parts = window
            .parts_by(&counts, u64::max, fits)
            .map_err(|layers| frame.memory.refusal(frame.gpu, &self.storage.needs(frame.gpu, 1, layers)))?;
        let greatest = |counts: &[u32]| counts.iter().copied().max().map_or(0, u64::from);
        self.splits.split(window, &counts, &parts, greatest);
        Ok(Outcome::Split(parts))
    }
}

impl Capture for ABuffer {
    fn window(&mut self, frame: &mut Frame<'_>, window: Window) -> Result<Outcome, GpuError> {
        let (gpu, pixels) = (frame.gpu, window.pixels());
        let parts =
            self.splits.parts_of(window, u64::max, |layers| self.storage.fits(frame, window.width, pixels, layers));
        if let Some(parts) = parts {
            return Ok(Outcome::Split(parts));
        }
        let known = self.splits.need(window);
        let wanted = known.unwrap_or(self.guess);
        let Some(mut room) = most_that_fits(wanted, |layers| self.storage.fits(frame, window.width, pixels, layers))
        else {
            return frame.memory.halves(gpu, window, &self.storage.needs(gpu, pixels, 1));
        };
        loop {
            let captured = self.capture(frame, window, room)?;
            match known {
                Some(_) => self.splits.learn(window, captured.greatest),
                None => self.guess = captured.greatest.max(1),
            }
            if captured.greatest <= captured.layers {
                self.ordered.record(frame, window, &captured.group, pixels * captured.greatest)?;
                return Ok(Outcome::Done);
            }
            frame.rerenders += 1;
            room = captured.greatest;
            if !self.storage.fits(frame, window.width, pixels, room) {
                return self.split(frame, window, &captured.counts);
            }
        }
    }
}

fn texture_of(window: Window, shape: Shape) -> wgpu::TextureDescriptor<'static> {
    wgpu::TextureDescriptor {
        label: Some(LAYERS),
        size: wgpu::Extent3d {
            width: window.width,
            height: window.height * shape.rows,
            depth_or_array_layers: shape.array_layers,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: table::GROUPS,
        usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    }
}
