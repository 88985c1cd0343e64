//! LucidRaster (Jakubowski 2025): a rasterizer in compute shaders, made for transparent surfaces, and exact. Twins:
//! `shaders/technique/lucid`.
//!
//! By stage, each a file here and there:
//!
//! - `quads`: at load time triangles are paired, so that set-up transforms shared vertices once.
//! - `setup`: one invocation a quad culls, transforms and snaps it to the pixel grid, and finds what small triangles cover of
//!   their blocks of 8 x 8 pixels, in integers. What has to be clipped is listed for the host, as it takes f64 (`record`).
//! - `bin`: large triangles find their bins of 16 x 16 pixels, shared out evenly over invocations, and in those their blocks.
//!   Then every block's parts of triangles are listed, behind each other, less what opaque surfaces hide.
//! - `raster`: parts of a block are sorted by depth. Which of them cover each pixel is noted in bits, 32 parts at a time; then
//!   each is shaded, and its fragments stored where their pixels have them next.
//! - `blend`: fragments of a pixel, which are nearly in order, go through a small filter by depth to the resolve. Pixels that
//!   leave it out of order are sorted, as in every LFB, and resolved again.
//!
//! What differs from the paper, and why:
//!
//! - Small triangles, which most are, go to blocks at set-up, up to 4 x 4 of them, not to bins and from there to blocks: one of
//!   few samples would be read and rasterized twice to find one block.
//! - Stages are passes over parts, blocks and pixels rather than workgroups that keep a bin in their memory: lists are as long
//!   as counted, there is no limit to triangles in a block, and neither barriers nor memory of workgroups, which are what is
//!   dear on llvmpipe. The price is that fragments are stored before they are blended, 16 bytes each, and that the threshold of
//!   alpha saves blending but not shading.
//! - Coverage is exact, and so is the order: pixels for which the filter was too small are found and mended, and equal depths
//!   follow draw order. The depths that blocks are sorted by only decide how many have to be.
//! - All buffers are as large as counters say; a window that overflows is repeated or split.
//! - Subgroups of any size, where the device has them, take places in lists at once, in set-up and bins. Nowhere else does an
//!   invocation wait for another.
//!
//! Where time went on llvmpipe with 2 cores of an AMD EPYC (model 25.1), in milliseconds, with the whole of `linear` in the same
//! run beside, while fragments lay in a buffer. In a texture, blending them takes half of that or less, and shading up to 8 % more. Seen from the front, the dragon at 1280 x 720 and opacity 0.3, hair at 1920 x 1080 and opacity 0.5:
//!
//! | step | dragon | hair | bound by |
//! |---|---|---|---|
//! | set-up | 171 | 318 | arithmetic, and stores of records, parts and their places, lane by lane |
//! | bins | 1 | 11 | few triangles reach farther than 4 x 4 blocks |
//! | lists | 12 | 111 | stores all over the lists |
//! | sort | 27 | 373 | loads and stores of merges |
//! | cover | 49 | 270 | reads and writes of each chunk's and each pixel's words |
//! | shade | 47 | 602 | cache misses: records, normals, and where fragments go; arithmetic is a third |
//! | empty pixels, classify, sums | 20 | 41 | as in every LFB |
//! | blend | 13 | 215 | reading fragments |
//! | repair | 0 | 81 | sorting 7,230 pixels |
//! | whole frame | 346 | 2,195 | |
//! | `linear` | 546 | 2,510 | |
//!
//! The dragon has 871,414 triangles and 0.28 million fragments, hair 1,026,000 and 7.9 million. What llvmpipe takes most for are
//! words of storage buffers: it reads them lane by lane and puts each into its vector through memory, 13 cycles a word. What
//! helped:
//!
//! - tables in textures, of which it fetches whole texels for all lanes: 0.7 of shading;
//! - small triangles of up to 4 x 4 blocks instead of 2 x 2: set-up and bins of hair 352 ms instead of 1,180;
//! - rows of 1,024 workgroups: each of its threads takes a contiguous part of a dispatch, and of rows of 32,768 the second was
//!   nearly empty, so that one thread shaded nearly all: 0.63 of shading, 0.55 of lists;
//! - no local arrays in set-up (a third of it), and chunks in the order of blocks (40 % of shading).
//!
//! What did not: parts of a chunk shaded in the order of how many fragments they have; writing rows of masks out instead of
//! looping over columns (little); rows of blocks with even numbers before those with odd ones.

mod bin;
mod blend;
mod layouts;
mod quads;
mod raster;
mod record;
mod setup;
mod work;

use std::collections::HashMap;

use pellucid_core::{Resolve, Scene};
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, TextureView};

use self::layouts::{OwnLayouts, stage_group, stage_layout};
use self::work::{
    BLOCK_PARTS, CHUNK_HEADS, CHUNK_SUMS, CHUNKS, COVERING, Counts, DISPATCHES, DRAW_GROUPS, DRAWS, FRAGMENTS, Header,
    LISTS, OFFSETS, ORDERED, PARTS, PLACES, RECORDS, Shading, WORK, WRONG,
};
use super::growth::most_that_fits;
use super::{Capture, Layouts, Outcome, linear};
use crate::frame::{Frame, Goal};
use crate::memory::Window;
use crate::pass::ordered::{OrderedPasses, compute_pipeline};
use crate::pass::prefix_sum::PrefixSum;
use crate::readback::read_buffer;
use crate::surface::shader;
use crate::upload::SceneUpload;
use crate::{Context, GpuError, shaders, table};

/// How the rasterizer in compute blends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthFilter {
    /// Fragments of a pixel that wait for nearer ones, from 1 to 12.
    pub size: u32,
    /// Share of light, from 0 to 1: a pixel is left when less gets through. The picture is exact at 0 alone.
    pub threshold: f32,
}

impl DepthFilter {
    /// Fragments that can wait at most: as many registers as `shaders/technique/lucid/filter.wesl` has.
    pub const GREATEST_SIZE: u32 = 12;
}

impl Default for DepthFilter {
    fn default() -> Self {
        Self { size: 3, threshold: 0.0 }
    }
}

/// Windows to remember; more are those of pictures of other sizes.
const MOST_LEARNED: usize = 4096;

/// What a window took last.
#[derive(Debug, Clone, Copy)]
struct Learned {
    counts: Counts,
    fragments: u64,
    /// It did not fit, so there may be more than was counted.
    was_split: bool,
}

/// Long-lived half.
#[derive(Debug)]
pub(crate) struct Lucid {
    layouts: OwnLayouts,
    setup: setup::Setup,
    bin: bin::Bin,
    raster: raster::Raster,
    blend: blend::Blend,
    ordered: OrderedPasses,
    prefix_sum: PrefixSum,
    prepare: ComputePipeline,
    /// Of the fragments, as `linear` has them.
    lfb: BindGroupLayout,
    scene: Option<LoadedScene>,
    learned: HashMap<Window, Learned>,
}

/// What is made of a scene when it is loaded.
#[derive(Debug)]
struct LoadedScene {
    revision: u64,
    /// Of each mesh.
    quads: Vec<setup::MeshQuads>,
    /// Tables of all.
    vertices: [TextureView; 3],
    atlas: TextureView,
}

impl LoadedScene {
    fn lone_share(&self) -> f64 {
        let sum = |of: fn(&setup::MeshQuads) -> usize| self.quads.iter().map(of).sum::<usize>();
        sum(|quads| quads.lone) as f64 / sum(|quads| quads.count).max(1) as f64
    }
}

/// Buffers and tables of a window.
struct Buffers {
    work: wgpu::Buffer,
    records: TextureView,
    parts: wgpu::Buffer,
    places: wgpu::Buffer,
    block_parts: wgpu::Buffer,
    lists: wgpu::Buffer,
    chunk_heads: TextureView,
    chunks: wgpu::Buffer,
    chunk_sums: wgpu::Buffer,
    ordered: TextureView,
    covering: TextureView,
    offsets: wgpu::Buffer,
    wrong: wgpu::Buffer,
    dispatches: wgpu::Buffer,
}

/// What became of an attempt at a window.
enum Attempt {
    /// It is drawn, with so much.
    Done(Counts, u64),
    /// There was too little room; so much is needed.
    Overflow(Counts),
    /// Its fragments do not fit.
    TooMany(Counts, u64),
    /// Buffers were larger than they had to be, and had to be given back.
    Again,
}

/// What stages record with.
struct Stage<'a> {
    window: Window,
    buffers: &'a Buffers,
    picture: BindGroup,
    scene: BindGroup,
    shading: Shading,
}

impl Lucid {
    pub(crate) fn new(gpu: &Context, layouts: Layouts<'_>) -> Self {
        let own = OwnLayouts::new(gpu);
        let module = shader(gpu, "dispatches", shaders::LUCID_DISPATCH);
        let groups = [None, None, Some(&own.dispatches), Some(&own.work)];
        let lfb = blend::lfb_layout(gpu);
        let ordered = OrderedPasses::new(gpu, linear::ORDERED_SHADERS, layouts.picture, &lfb);
        Self {
            setup: setup::Setup::new(gpu, layouts.surfaces),
            bin: bin::Bin::new(gpu, &own),
            raster: raster::Raster::new(gpu, &own),
            blend: blend::Blend::new(gpu, layouts, &ordered, &lfb),
            ordered,
            prefix_sum: PrefixSum::new(gpu),
            prepare: compute_pipeline(gpu, "dispatches", &module, "prepare", &groups, &[]),
            lfb,
            layouts: own,
            scene: None,
            learned: HashMap::new(),
        }
    }

    /// How much a window is likely to take, with its fragments; split windows as much as their parts.
    fn need(&self, window: Window) -> Option<(Counts, u64)> {
        let learned = self.learned.get(&window)?;
        if !learned.was_split {
            return Some((learned.counts, learned.fragments));
        }
        let [(a, a_fragments), (b, b_fragments)] = match window.halves()?.map(|half| self.need(half)) {
            [Some(a), Some(b)] => [a, b],
            _ => return None,
        };
        Some((a.plus(&b), a_fragments + b_fragments))
    }

    fn learn(&mut self, window: Window, learned: Learned) {
        if self.learned.len() >= MOST_LEARNED {
            self.learned.clear();
        }
        self.learned.insert(window, learned);
    }

    fn split(
        &mut self,
        frame: &Frame<'_>,
        window: Window,
        counts: Counts,
        fragments: u64,
    ) -> Result<Outcome, GpuError> {
        self.learn(window, Learned { counts, fragments, was_split: true });
        let draws = frame.surfaces.data.len() as u64;
        frame.memory.halves(frame.gpu, window, &work::needs(&counts, fragments, window, draws))
    }

    /// Draws a window, unless there is too little room.
    fn run(&mut self, frame: &mut Frame<'_>, window: Window, room: &Counts) -> Result<Attempt, GpuError> {
        let gpu = frame.gpu;
        let draws = frame.surfaces.data.len() as u64;
        let needs = work::needs(room, 0, window, draws);
        // Fragments of the frame before stay where they are, unless they are in the way.
        frame.memory.make_room(&needs);
        let chunks = work::chunks(room, window);
        let mut table = |name, format, count| frame.memory.table(gpu, name, format, count);
        let records = table(RECORDS, table::GROUPS, work::record_groups(room))?;
        let ordered = table(ORDERED, table::GROUPS, room.parts.into())?;
        let chunk_heads = table(CHUNK_HEADS, table::GROUPS, chunks + 1)?;
        let covering = table(COVERING, table::PAIRS, chunks * work::CHUNK_WORDS)?;
        let all_draws = table(DRAWS, table::GROUPS, draws * DRAW_GROUPS)?;
        let mut buffer = |name| {
            let bytes = needs.iter().find(|&&(other, _)| other == name).map_or(0, |&(_, bytes)| bytes);
            frame.memory.buffer(gpu, name, bytes)
        };
        let buffers = Buffers {
            work: buffer(WORK)?,
            records,
            parts: buffer(PARTS)?,
            places: buffer(PLACES)?,
            block_parts: buffer(BLOCK_PARTS)?,
            lists: buffer(LISTS)?,
            chunk_heads,
            chunks: buffer(CHUNKS)?,
            chunk_sums: buffer(CHUNK_SUMS)?,
            ordered,
            covering,
            offsets: buffer(OFFSETS)?,
            wrong: buffer(WRONG)?,
            dispatches: buffer(DISPATCHES)?,
        };
        frame.submit()?;
        gpu.queue.write_buffer(&buffers.work, 0, bytemuck::bytes_of(&work::header(room)));
        table::write(gpu, all_draws.texture(), bytemuck::cast_slice(&frame.surfaces.data).iter().copied());
        let Some(scene) = &self.scene else { unreachable!("it was loaded") };
        let stage = Stage {
            window,
            picture: self.layouts.picture_group(frame),
            scene: self.layouts.scene_group(gpu, scene, &all_draws),
            shading: Shading::of(&frame.surfaces),
            buffers: &buffers,
        };

        frame.zero("zero", &buffers.block_parts, buffers.block_parts.size())?;
        frame.zero("zero", &buffers.chunks, buffers.chunks.size())?;
        self.setup.record(frame, &stage, scene)?;
        if room.clipped > 0 {
            let header: Header = read_buffer(frame, &buffers.work, 0, 1)?[0];
            if !header.counts.fits(room) || !setup::clip(frame, &stage, &header)? {
                let more = header.counts.clipped.saturating_mul(16);
                let counts = header.counts;
                return Ok(Attempt::Overflow(Counts {
                    records: counts.records.saturating_add(more),
                    large: counts.large.saturating_add(more),
                    ..counts
                }));
            }
        }
        self.dispatches(frame, &stage, "bins")?;
        self.bin.find_bins(frame, &stage)?;
        self.dispatches(frame, &stage, "bins")?;
        self.bin.cover_blocks(frame, &stage, room.clipped > 0)?;
        self.sums(frame, window, &buffers.block_parts, work::blocks(window) + 1)?;
        self.bin.count_chunks(frame, &stage)?;
        self.sums(frame, window, &buffers.chunk_sums, work::blocks(window) + 1)?;
        self.dispatches(frame, &stage, "lists")?;
        self.bin.list_parts(frame, &stage)?;
        self.bin.hide(frame, &stage, &self.layouts)?;
        self.dispatches(frame, &stage, "sort")?;
        self.raster.sort_chunks(frame, &stage)?;
        let header: Header = read_buffer(frame, &buffers.work, 0, 1)?[0];
        let counts = header.counts;
        if !counts.fits(room) {
            return Ok(Attempt::Overflow(counts));
        }
        self.raster.merge(frame, &stage, &header)?;
        self.raster.count(frame, &stage, &counts)?;
        let pixels = window.pixels();
        self.sums(frame, window, &buffers.offsets, pixels + 1)?;
        let total: u32 = read_buffer(frame, &buffers.offsets, pixels, 1)?[0];
        let fragment_count = u64::from(total);
        let with_fragments = work::needs(room, fragment_count, window, draws);
        // Sums stick at the greatest number.
        if total == u32::MAX || !frame.memory.fits(gpu, &with_fragments) {
            return Ok(Attempt::TooMany(counts, fragment_count));
        }
        if frame.memory.make_room(&with_fragments) {
            return Ok(Attempt::Again);
        }
        let fragments = frame.memory.table(gpu, FRAGMENTS, table::GROUPS, fragment_count)?;
        self.raster.shade(frame, &stage, &self.layouts, (&counts, &fragments))?;
        let lfb = stage_group(gpu, &self.lfb, &[(1, &fragments)], &[(0, &buffers.offsets)]);
        let needs_no_order = matches!(frame.resolve, Resolve::Nearest | Resolve::Complexity(_));
        if matches!(frame.goal, Goal::Layers(_)) || needs_no_order || frame.presort {
            self.ordered.record(frame, window, &lfb, fragment_count)?;
        } else {
            let listed = self.ordered.list(frame, window, &lfb, true)?;
            let buffers = [&buffers.wrong, &buffers.dispatches];
            self.blend.record(frame, window, &listed, (&lfb, fragment_count), buffers)?;
        }
        frame.half_block_parts += u64::from(counts.half_blocks);
        Ok(Attempt::Done(counts, fragment_count))
    }

    /// Sums up values in buffers that are large enough for those of pixels, too.
    fn sums(&self, frame: &mut Frame<'_>, window: Window, values: &wgpu::Buffer, length: u64) -> Result<(), GpuError> {
        let gpu = frame.gpu;
        let mut buffers = vec![values.clone()];
        for (name, bytes) in PrefixSum::needs(window.pixels() + 1) {
            buffers.push(frame.memory.buffer(gpu, name, bytes)?);
        }
        let groups = self.prefix_sum.groups(gpu, length, &buffers)?;
        self.prefix_sum.run(&mut frame.compute_pass("prefix sums")?, &groups);
        Ok(())
    }

    /// Makes dispatches of what has been counted so far.
    fn dispatches(&self, frame: &mut Frame<'_>, stage: &Stage<'_>, step: &'static str) -> Result<(), GpuError> {
        let mut pass = frame.compute_pass(step)?;
        pass.set_pipeline(&self.prepare);
        self.set_dispatch_groups(&mut pass, frame, stage);
        pass.dispatch_workgroups(1, 1, 1);
        Ok(())
    }

    fn set_dispatch_groups(&self, pass: &mut wgpu::ComputePass<'_>, frame: &Frame<'_>, stage: &Stage<'_>) {
        let gpu = frame.gpu;
        pass.set_bind_group(
            2,
            &stage_group(gpu, &self.layouts.dispatches, &[], &[(0, &stage.buffers.dispatches)]),
            &[],
        );
        pass.set_bind_group(3, &stage_group(gpu, &self.layouts.work, &[], &[(0, &stage.buffers.work)]), &[]);
    }
}

impl Capture for Lucid {
    fn load(&mut self, gpu: &Context, scene: &Scene, upload: &SceneUpload) -> Result<(), GpuError> {
        if self.scene.as_ref().is_some_and(|loaded| loaded.revision == scene.revision()) {
            return Ok(());
        }
        self.learned.clear();
        self.scene = None;
        let quads =
            scene.meshes().iter().zip(&upload.meshes).map(|(mesh, uploaded)| setup::upload(gpu, mesh, uploaded));
        let quads = quads.collect::<Result<Vec<_>, GpuError>>()?;
        let atlas = upload.atlas.upload(gpu, scene.textures())?;
        let vertices = setup::upload_vertices(gpu, scene)?;
        let atlas = table::view(&atlas);
        self.scene = Some(LoadedScene { revision: scene.revision(), quads, vertices, atlas });
        Ok(())
    }

    fn window(&mut self, frame: &mut Frame<'_>, window: Window) -> Result<Outcome, GpuError> {
        let gpu = frame.gpu;
        frame.lone_share = self.scene.as_ref().map_or(0.0, LoadedScene::lone_share);
        let draws = frame.surfaces.data.len() as u64;
        let picture = u64::from(frame.view.width) * u64::from(frame.view.height);
        let known = self.need(window);
        let known_fragments = known.map_or(0, |(_, fragments)| fragments);
        let fits = |frame: &Frame<'_>, room: &Counts, fragments| {
            frame.memory.fits(gpu, &work::needs(room, fragments, window, draws))
        };
        if let Some((counts, fragments)) = known.filter(|(counts, fragments)| !fits(frame, counts, *fragments)) {
            return self.split(frame, window, counts, fragments);
        }
        let guess = || {
            let share = (window.pixels() as f64 / picture as f64).sqrt();
            Counts::guess(frame.scene.primitive_count().into(), window, share)
        };
        let known = known.map(|(counts, _)| counts);
        let wanted = known.map_or_else(guess, |counts| counts.with_slack());
        let Some(share) = most_that_fits(1024, |share| fits(frame, &wanted.scaled(share), known_fragments)) else {
            return self.split(frame, window, known.unwrap_or_default(), known_fragments);
        };
        // Without slack rather than with less than is known to be needed.
        let mut room = wanted.scaled(share).max(&known.unwrap_or_default());
        loop {
            match self.run(frame, window, &room)? {
                Attempt::Done(counts, fragments) => {
                    self.learn(window, Learned { counts, fragments, was_split: false });
                    return Ok(Outcome::Done);
                }
                Attempt::TooMany(counts, fragments) => {
                    if !fits(frame, &counts, fragments) {
                        return self.split(frame, window, counts, fragments);
                    }
                    // With less room for what turned out to be less.
                    frame.rerenders += 1;
                    room = counts;
                }
                Attempt::Again => frame.rerenders += 1,
                Attempt::Overflow(counts) => {
                    let needed = counts.max(&known.unwrap_or_default());
                    if !fits(frame, &needed, known_fragments) {
                        return self.split(frame, window, needed, known_fragments);
                    }
                    frame.rerenders += 1;
                    room = needed.max(&room);
                    if !fits(frame, &room, known_fragments) {
                        room = needed;
                    }
                }
            }
        }
    }
}
