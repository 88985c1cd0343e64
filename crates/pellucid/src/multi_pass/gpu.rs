//! Shaders of several passes on the GPU. Passes: `lighting.wgsl`, and those of the example `pitted_glass` of
//! `pellucid-gpu`; what they know of a scene: `scene.wgsl`.

use std::time::Instant;

use glam::{Vec3, Vec4};
use pellucid_core::fbuffer::order::Geometry;
use pellucid_core::fbuffer::{Output, Size, Windows};
use pellucid_core::primitive::{Draw, Pass};
use pellucid_core::{Image, Scene, View};
use pellucid_gpu::fbuffer::{Content, Drawing, FBuffer, FBufferError, Framebuffer, Groups, Program, Target};
use pellucid_gpu::{Context, wgpu};
use wgpu::util::DeviceExt as _;

use super::{Picture, Shader, Through, over, step};
use crate::Error;

const SCENE: &str = include_str!("scene.wgsl");
const LIGHTING: &str = include_str!("lighting.wgsl");

/// One pass: opaque surfaces.
const LIT: &str = "fn shade(fragment: Fragment) -> vec4<f32> {
    let found = surface(fragment);
    if !found.is_there { fbuffer_kill(fragment); }
    return found.color;
}";

/// Two passes.
const SAVE: &str = "fn shade(fragment: Fragment) {
    let found = surface(fragment);
    if found.is_there { saved_store(fragment, 0u, found.color); } else { fbuffer_kill(fragment); }
}";
const RESTORE: &str = "fn shade(fragment: Fragment) -> vec4<f32> { return saved_load(fragment, 0u); }";

/// Three passes: those of the example.
const GLASS: [&str; 3] = [
    include_str!("../../../gpu/examples/pitted_glass/bump.wgsl"),
    include_str!("../../../gpu/examples/pitted_glass/refract.wgsl"),
    include_str!("../../../gpu/examples/pitted_glass/show.wgsl"),
];

impl Shader {
    fn passes_wgsl(self) -> Vec<String> {
        match self {
            Self::Lighting => [SAVE, RESTORE].map(|pass| [SCENE, LIGHTING, pass].concat()).to_vec(),
            Self::PittedGlass => GLASS.map(|pass| [SCENE, pass].concat()).to_vec(),
        }
    }

    /// What passes hand on.
    fn contents(self) -> &'static [(&'static str, Content<'static>)] {
        match self {
            Self::Lighting => &[("saved", Content::Targets(1))],
            Self::PittedGlass => &[("surface", Content::Targets(1)), ("light", Content::Targets(2))],
        }
    }

    /// Words of a slot that show what is in it: the buffer, and how many words there are of each slot.
    fn shown(self) -> (usize, usize) {
        match self {
            Self::Lighting => (0, 4),
            Self::PittedGlass => (1, 8),
        }
    }
}

/// Renders by shaders of several passes on a device. Make one and keep it: it holds on to buffers and compiled passes.
#[derive(Debug)]
pub struct GpuMultiPass {
    gpu: Context,
    layout: wgpu::BindGroupLayout,
    /// For opaque surfaces.
    lit: Option<(FBuffer, Program)>,
    /// One for each shader and way, of the last size.
    kept: Vec<Kept>,
}

#[derive(Debug)]
struct Kept {
    shader: Shader,
    through: Through,
    /// Of the picture.
    size: [u32; 2],
    buffer: Buffer,
    program: Program,
}

#[derive(Debug)]
enum Buffer {
    FBuffer(FBuffer),
    Framebuffer(Framebuffer),
}

impl GpuMultiPass {
    /// On a device that is open.
    pub fn new(gpu: Context) -> Self {
        let entry = |binding| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: true },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("scene"), entries: &[entry(0), entry(1)] };
        let layout = gpu.device().create_bind_group_layout(&descriptor);
        Self { gpu, layout, lit: None, kept: Vec::new() }
    }

    /// The device.
    pub fn context(&self) -> &Context {
        &self.gpu
    }

    /// As [`render`](super::render) does it on the CPU.
    ///
    /// # Errors
    /// [`Error::Core`] if the view is invalid, [`Error::Textures`] if the scene has any, [`Error::FBuffer`] or
    /// [`Error::Gpu`] if the device cannot do it.
    pub fn render(&mut self, scene: &Scene, view: &View, shader: Shader, through: Through) -> Result<Picture, Error> {
        let start = Instant::now();
        let transparent = Geometry::new(scene, view, Pass::Transparent)?;
        let opaque = Geometry::new(scene, view, Pass::Opaque)?;
        let group = self.scene_group(scene, &transparent.draws)?;
        let kept = self.kept(shader, through, [view.width, view.height])?;
        let drawing = self.kept[kept].buffer.drawing(transparent)?;
        let target = self.kept[kept].buffer.target(view)?;
        self.gpu.wait()?;
        let mut steps = vec![step("geometry", start)];

        let groups = [Some(&group), None, None];
        if !opaque.primitives.is_empty() {
            let start = Instant::now();
            self.draw_opaque(opaque, groups, &target)?;
            self.gpu.wait()?;
            steps.push(step("opaque", start));
        }

        let start = Instant::now();
        let Kept { buffer, program, .. } = &mut self.kept[kept];
        let output = Output { depth_test: true, ..Output::default() };
        let drawn = match buffer {
            Buffer::FBuffer(buffer) => buffer.draw(&drawing, program, groups, output, &target)?,
            Buffer::Framebuffer(buffer) => buffer.draw(&drawing, program, groups, output, &target)?,
        };
        self.gpu.wait()?;
        steps.push(step("passes", start));

        let (image, bytes) = match &self.kept[kept].buffer {
            Buffer::FBuffer(buffer) => (buffer.read(&target)?, buffer.bytes()),
            Buffer::Framebuffer(buffer) => (buffer.read(&target)?, buffer.bytes()),
        };
        Ok(Picture { image, drawn, bytes, steps })
    }

    /// As [`slots`](super::slots) does it on the CPU.
    ///
    /// # Errors
    /// As [`Self::render`].
    pub fn slots(&mut self, scene: &Scene, view: &View, shader: Shader, size: Size) -> Result<(Image, Windows), Error> {
        let geometry = Geometry::new(scene, view, Pass::Transparent)?;
        let group = self.scene_group(scene, &geometry.draws)?;
        let kept = self.kept(shader, Through::FBuffer(size), [view.width, view.height])?;
        let Kept { buffer: Buffer::FBuffer(buffer), program, .. } = &mut self.kept[kept] else {
            return Err(FBufferError::Mixed.into());
        };
        let drawing = buffer.drawing(geometry)?;
        let target = buffer.target(view.width, view.height, Vec4::ZERO)?;
        buffer.window(&drawing, program, [Some(&group), None, None], 0, Output::default(), &target)?;
        let windows = Windows::new(drawing.fragments(), size);
        let (number, words) = shader.shown();
        let contents = buffer.contents(number)?;
        let colors = contents.chunks_exact(words).map(|slot| {
            let [r, g, b, a] = [slot[0], slot[1], slot[2], slot[3]].map(f32::from_bits);
            Vec4::new(r, g, b, a)
        });
        let mut image = Image::filled(size.width(), size.height(), view.background);
        let used = windows.slots(0).end as usize;
        for (pixel, color) in image.pixels_mut().iter_mut().zip(colors.take(used)) {
            *pixel = over(color, *pixel);
        }
        Ok((image, windows))
    }

    fn draw_opaque(&mut self, geometry: Geometry<'_>, groups: Groups<'_>, target: &Target) -> Result<(), Error> {
        if self.lit.is_none() {
            // Any size gives the same picture; this one is quick and takes little.
            let fbuffer = FBuffer::new(self.gpu.device(), self.gpu.queue(), Size::square(1024)?, &[])?;
            let text = [SCENE, LIGHTING, LIT].concat();
            let program = fbuffer.program(&[&text], [Some(&self.layout), None, None])?;
            self.lit = Some((fbuffer, program));
        }
        if let Some((fbuffer, program)) = &mut self.lit {
            let drawing = fbuffer.drawing(geometry)?;
            fbuffer.draw(&drawing, program, groups, Output::OPAQUE, target)?;
        }
        Ok(())
    }

    /// The buffer with its compiled passes, which replace those of another size.
    fn kept(&mut self, shader: Shader, through: Through, size: [u32; 2]) -> Result<usize, Error> {
        let is_fbuffer = matches!(through, Through::FBuffer(_));
        let is_same_way =
            |kept: &Kept| kept.shader == shader && matches!(kept.through, Through::FBuffer(_)) == is_fbuffer;
        if let Some(place) = self.kept.iter().position(is_same_way) {
            let kept = &self.kept[place];
            if kept.through == through && (is_fbuffer || kept.size == size) {
                return Ok(place);
            }
            self.kept.swap_remove(place);
        }
        let (device, queue) = (self.gpu.device(), self.gpu.queue());
        let passes = shader.passes_wgsl();
        let passes: Vec<&str> = passes.iter().map(String::as_str).collect();
        let layouts = [Some(&self.layout), None, None];
        let (buffer, program) = match through {
            Through::FBuffer(slots) => {
                let buffer = FBuffer::new(device, queue, slots, shader.contents())?;
                let program = buffer.program(&passes, layouts)?;
                (Buffer::FBuffer(buffer), program)
            }
            Through::Framebuffer => {
                let pixels = u64::from(size[0]) * u64::from(size[1]);
                // As many slots as a picture of a few layers takes.
                let buffer = Framebuffer::new(device, queue, size, Size::holding(4 * pixels), shader.contents())?;
                let program = buffer.program(&passes, layouts)?;
                (Buffer::Framebuffer(buffer), program)
            }
        };
        self.kept.push(Kept { shader, through, size, buffer, program });
        Ok(self.kept.len() - 1)
    }

    fn scene_group(&self, scene: &Scene, draws: &[Draw<'_>]) -> Result<wgpu::BindGroup, Error> {
        if draws.iter().any(|draw| draw.texture.is_some()) {
            return Err(Error::Textures);
        }
        let (words, triangles) = scene_words(scene, draws);
        let buffer = |words: Vec<u32>| {
            let bytes: Vec<u8> = words.into_iter().flat_map(u32::to_ne_bytes).collect();
            self.gpu.device().create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("scene"),
                contents: &bytes,
                usage: wgpu::BufferUsages::STORAGE,
            })
        };
        let buffers = [buffer(words.into_flattened()), buffer(triangles)];
        let entries = [0, 1].map(|binding: u32| wgpu::BindGroupEntry {
            binding,
            resource: buffers[binding as usize].as_entire_binding(),
        });
        let descriptor = wgpu::BindGroupDescriptor { label: Some("scene"), layout: &self.layout, entries: &entries };
        Ok(self.gpu.device().create_bind_group(&descriptor))
    }
}

impl Buffer {
    fn drawing(&self, geometry: Geometry<'_>) -> Result<Drawing, FBufferError> {
        match self {
            Self::FBuffer(buffer) => buffer.drawing(geometry),
            Self::Framebuffer(buffer) => buffer.drawing(geometry),
        }
    }

    fn target(&self, view: &View) -> Result<Target, FBufferError> {
        match self {
            Self::FBuffer(buffer) => buffer.target(view.width, view.height, view.background),
            Self::Framebuffer(buffer) => buffer.target(view.background),
        }
    }
}

/// Draws and vertices, and the vertices of triangles. Twin: `scene.wgsl`.
fn scene_words(scene: &Scene, draws: &[Draw<'_>]) -> (Vec<[u32; 4]>, Vec<u32>) {
    const DRAW: usize = 6;
    const VERTEX: usize = 3;
    let bits = |v: Vec4| v.to_array().map(f32::to_bits);
    let (mut vertices, mut triangles, mut starts) = (Vec::new(), Vec::new(), Vec::new());
    for mesh in scene.meshes() {
        starts.push([triangles.len() / 3, draws.len() * DRAW + vertices.len()]);
        let of = |values: Option<&[Vec3]>, i: usize| values.map_or(Vec4::ZERO, |values| values[i].extend(0.0));
        vertices.reserve(mesh.positions().len() * VERTEX);
        for (i, position) in mesh.positions().iter().enumerate() {
            let color = mesh.colors().map_or(Vec4::ONE, |colors| colors[i]);
            vertices.extend([bits(position.extend(1.0)), bits(of(mesh.normals(), i)), bits(color)]);
        }
        triangles.extend(mesh.triangles().iter().flatten());
    }
    let mut words = Vec::with_capacity((draws.len() * DRAW + vertices.len()).max(1));
    for (draw, instance) in draws.iter().zip(scene.instances()) {
        let [triangle, vertex] = starts[instance.mesh.index()].map(|start| start as u32);
        let flags = [(draw.lit, 1), (draw.blends, 2), (draw.mesh.normals().is_some(), 4), (draw.cutoff.is_some(), 8)];
        let flags = flags.iter().map(|&(is_set, flag)| if is_set { flag } else { 0 }).sum();
        words.push(bits(super::glass::eye(draw).extend(draw.opacity)));
        let columns = draw.view_from_normal.to_cols_array_2d();
        for (column, last) in columns.into_iter().zip([triangle, vertex, flags]) {
            let [x, y, z] = column.map(f32::to_bits);
            words.push([x, y, z, last]);
        }
        words.push(bits(draw.material.base_color));
        words.push([draw.cutoff.unwrap_or(0.0).to_bits(), 0, 0, 0]);
    }
    words.extend(vertices);
    // There are no empty bindings.
    words.resize(words.len().max(1), [0; 4]);
    triangles.resize(triangles.len().max(1), 0);
    (words, triangles)
}
