//! How much faster the CPU renderer is than a plain one: `cargo bench -p pellucid --bench plain`.
//!
//! The plain renderer is what one would write first: triangles binned into tiles, each tile's triangles rasterized pixel by
//! pixel, each pixel's fragments sorted and blended. It is exact, and runs on all cores, without SIMD and without light:
//! each surface keeps its bare colour. So it does less for each fragment than the CPU renderer, which lights as usual. Both
//! draw frames in turns, and before that their unlit pictures must be equal; which tells coverage, not order, as all has one colour.

mod common;
#[path = "common/median.rs"]
mod median;

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

use common::{Case, SCENES};
use glam::Vec4;
use median::median;
use pellucid::core::composite::Composite;
use pellucid::core::fragment::order_key;
use pellucid::core::pixel_grid::{
    SUBPIXELS, ScreenTriangle, ScreenVertex, Viewport, center, depth_at, twice_signed_area,
};
use pellucid::core::primitive::{Draw, draws, transform_point};
use pellucid::core::view::Shading;
use pellucid::{Canvas, Image, Renderer, Resolve, Scene, View};
use rayon::prelude::*;

/// Frames of each renderer.
const FRAMES: usize = 25;

/// Side of a tile in pixels; of 16, 32, 64 and 128 the fastest on the three scenes.
const TILE_PX: i32 = 128;
const TILE_PIXELS: usize = (TILE_PX * TILE_PX) as usize;

/// Up to so many fragments of a pixel are sorted by insertion.
const SORTED_BY_INSERTION: usize = 32;

fn main() {
    println!(
        "{:<20} {:>10} {:>12} {:>9} {:>9} {:>9}  ms, medians of {FRAMES} frames in turns, and their ratio",
        "scene", "triangles", "fragments", "plain", "pellucid", "ratio"
    );
    // Those of one mesh and one material, of which nothing has to be clipped.
    for case in common::wanted(SCENES.into_iter().take(3)) {
        measure(&case);
    }
}

fn measure(case: &Case) {
    let (scene, view) = case.load();
    let renderer = Renderer::new();
    let mut canvas = Canvas::new();
    let mut plain = PlainRenderer::new(&view);
    if let Err(why) = check(&scene, &view, &renderer, &mut plain) {
        return println!("{:<20} {why}", case.name);
    }
    let (mut plain_ms, mut pellucid_ms) = (Vec::new(), Vec::new());
    let mut fragments = 0;
    for _ in 0..FRAMES {
        let start = Instant::now();
        let drawn = plain.render(&scene, &view);
        plain_ms.push(start.elapsed().as_secs_f64() * 1e3);
        match (drawn, renderer.render_into(&scene, &view, Resolve::Blend, &mut canvas)) {
            (Ok(()), Ok(stats)) => {
                fragments = stats.fragments;
                pellucid_ms.push(stats.total_ms);
            }
            (Err(error), _) => return println!("{:<20} {error}", case.name),
            (_, Err(error)) => return println!("{:<20} {error}", case.name),
        }
    }
    let [plain_ms, pellucid_ms] = [plain_ms, pellucid_ms].map(median);
    println!(
        "{:<20} {:>10} {fragments:>12} {plain_ms:>9.2} {pellucid_ms:>9.2} {:>9.2}",
        case.name,
        scene.primitive_count(),
        plain_ms / pellucid_ms
    );
}

/// Whether both draw the same picture where nothing is lit. Allocates what both need.
fn check(scene: &Scene, view: &View, renderer: &Renderer, plain: &mut PlainRenderer) -> Result<(), String> {
    let unlit = View { shading: Shading::Unlit, ..*view };
    let frame = renderer.render(scene, &unlit, Resolve::Blend).map_err(|error| error.to_string())?;
    plain.render(scene, &unlit)?;
    let pairs = frame.image.pixels().iter().zip(plain.image.pixels());
    match pairs.filter(|(ours, plain)| ours != plain).count() {
        0 => Ok(()),
        count => Err(format!("{count} pixels differ between the plain renderer and the CPU renderer")),
    }
}

/// The plain renderer, with what it keeps from frame to frame.
struct PlainRenderer {
    vertices: Vec<ScreenVertex>,
    /// For each thread, for each tile: triangles that may cover a pixel in it.
    bins: Vec<Vec<Vec<u32>>>,
    scratch: Vec<Mutex<Scratch>>,
    image: Image,
    tile_columns: usize,
    tile_rows: usize,
}

/// What a thread needs to draw a tile.
#[derive(Default)]
struct Scratch {
    /// Pixel in the tile, and order key.
    fragments: Vec<(u32, u64)>,
    /// Order keys by pixel.
    keys: Vec<u64>,
}

impl PlainRenderer {
    fn new(view: &View) -> Self {
        let (tile_columns, tile_rows) =
            (view.width.div_ceil(TILE_PX as u32) as usize, view.height.div_ceil(TILE_PX as u32) as usize);
        let threads = rayon::current_num_threads();
        Self {
            vertices: Vec::new(),
            bins: vec![vec![Vec::new(); tile_columns * tile_rows]; threads],
            scratch: (0..threads).map(|_| Mutex::default()).collect(),
            image: Image::filled(view.width, view.height, Vec4::ZERO),
            tile_columns,
            tile_rows,
        }
    }

    fn render(&mut self, scene: &Scene, view: &View) -> Result<(), String> {
        let draws = draws(scene, view).map_err(|error| error.to_string())?;
        let [draw] = &draws[..] else { return Err("the plain renderer draws one instance only".into()) };
        let viewport = Viewport::of(view);
        self.transform(draw, &viewport)?;
        self.bin(draw);
        self.draw_tiles(draw, view);
        Ok(())
    }

    fn transform(&mut self, draw: &Draw<'_>, viewport: &Viewport) -> Result<(), String> {
        let any_outside = AtomicBool::new(false);
        let vertices = draw.mesh.positions().par_iter().with_min_len(4096).map(|&point| {
            let clip = transform_point(&draw.clip_from_mesh, point);
            if viewport.outcode(clip) == 0 {
                return viewport.project(clip);
            }
            any_outside.store(true, Ordering::Relaxed);
            ScreenVertex::default()
        });
        vertices.collect_into_vec(&mut self.vertices);
        if any_outside.into_inner() { Err("the plain renderer does not clip".into()) } else { Ok(()) }
    }

    fn bin(&mut self, draw: &Draw<'_>) {
        let triangles = draw.mesh.triangles();
        let each = triangles.len().div_ceil(self.bins.len());
        let (vertices, columns) = (&self.vertices, self.tile_columns);
        let picture =
            Bounds { left: 0, top: 0, right: self.image.width() as i32 - 1, bottom: self.image.height() as i32 - 1 };
        self.bins.par_iter_mut().zip(triangles.par_chunks(each)).enumerate().for_each(|(part, (bins, triangles))| {
            bins.iter_mut().for_each(Vec::clear);
            for (number, corners) in (part * each..).zip(triangles) {
                let corners = corners.map(|vertex| vertices[vertex as usize]);
                let Some(bounds) = picture.around(&corners) else { continue };
                for row in bounds.top / TILE_PX..=bounds.bottom / TILE_PX {
                    for column in bounds.left / TILE_PX..=bounds.right / TILE_PX {
                        bins[row as usize * columns + column as usize].push(number as u32);
                    }
                }
            }
        });
    }

    fn draw_tiles(&mut self, draw: &Draw<'_>, view: &View) {
        let (vertices, bins, scratch, columns) = (&self.vertices, &self.bins, &self.scratch, self.tile_columns);
        let tile_count = columns * self.tile_rows;
        let (width, height) = (view.width as i32, view.height as i32);
        let bands: Vec<_> = self.image.pixels_mut().chunks_mut((width * TILE_PX) as usize).map(Mutex::new).collect();
        let next = AtomicUsize::new(0);
        rayon::broadcast(|thread| {
            let Ok(mut scratch) = scratch[thread.index()].lock() else { return };
            loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                if number >= tile_count {
                    break;
                }
                let (left, top) = ((number % columns) as i32 * TILE_PX, (number / columns) as i32 * TILE_PX);
                let tile = Bounds {
                    left,
                    top,
                    right: (left + TILE_PX).min(width) - 1,
                    bottom: (top + TILE_PX).min(height) - 1,
                };
                let ends = scratch.capture(bins.iter().flat_map(|bins| &bins[number]), draw, vertices, tile);
                let Ok(mut band) = bands[number / columns].lock() else { return };
                let across = left as usize..=tile.right as usize;
                let rows = band.chunks_mut(width as usize).map(|row| &mut row[across.clone()]);
                scratch.resolve(&ends, draw, view, rows);
            }
        });
    }
}

/// Pixels, all borders included.
#[derive(Clone, Copy)]
struct Bounds {
    left: i32,
    top: i32,
    right: i32,
    bottom: i32,
}

impl Bounds {
    /// Those of the pixels whose centres lie in a triangle's bounding box; `None` if there are none.
    fn around(self, [a, b, c]: &[ScreenVertex; 3]) -> Option<Self> {
        let first = |subpixels: i32| (subpixels + SUBPIXELS / 2 - 1).div_euclid(SUBPIXELS);
        let last = |subpixels: i32| (subpixels - SUBPIXELS / 2).div_euclid(SUBPIXELS);
        let bounds = Self {
            left: first(a.x.min(b.x).min(c.x)).max(self.left),
            top: first(a.y.min(b.y).min(c.y)).max(self.top),
            right: last(a.x.max(b.x).max(c.x)).min(self.right),
            bottom: last(a.y.max(b.y).max(c.y)).min(self.bottom),
        };
        (bounds.left <= bounds.right && bounds.top <= bounds.bottom).then_some(bounds)
    }
}

impl Scratch {
    /// Rasterizes triangles into a tile and gathers its fragments by pixel. Says where each pixel's end.
    fn capture<'a>(
        &mut self,
        triangles: impl Iterator<Item = &'a u32>,
        draw: &Draw<'_>,
        vertices: &[ScreenVertex],
        tile: Bounds,
    ) -> [u32; TILE_PIXELS] {
        let mut ends = [0; TILE_PIXELS];
        self.fragments.clear();
        for &number in triangles {
            let mut corners = draw.mesh.triangles()[number as usize].map(|vertex| vertices[vertex as usize]);
            if twice_signed_area(corners) < 0 {
                corners.swap(1, 2);
            }
            let Some(triangle) = ScreenTriangle::new(corners) else { continue };
            self.rasterize(&triangle, draw.first_primitive + number, tile, &mut ends);
        }
        let mut start = 0;
        for end in &mut ends {
            (*end, start) = (start, start + *end);
        }
        self.keys.resize(self.fragments.len(), 0);
        for &(pixel, key) in &self.fragments {
            let end = &mut ends[pixel as usize];
            self.keys[*end as usize] = key;
            *end += 1;
        }
        ends
    }

    fn rasterize(&mut self, triangle: &ScreenTriangle, primitive: u32, tile: Bounds, counts: &mut [u32]) {
        let Some(Bounds { left, top, right, bottom }) = tile.around(&triangle.vertices) else { return };
        let mut row_values = triangle.edges.map(|edge| edge.biased_at(center(left), center(top)));
        let [anchor_x, anchor_y] = triangle.anchor_px();
        let plane = triangle.depth_plane(triangle.weight_planes());
        let range = triangle.depth_range();
        for y in top..=bottom {
            let mut values = row_values;
            for x in left..=right {
                if values[0] | values[1] | values[2] >= 0 {
                    let depth = depth_at(&plane, range, x - anchor_x, y - anchor_y);
                    let pixel = ((y - tile.top) * TILE_PX + (x - tile.left)) as usize;
                    counts[pixel] += 1;
                    self.fragments.push((pixel as u32, order_key(depth, primitive)));
                }
                for (value, edge) in values.iter_mut().zip(&triangle.edges) {
                    *value += edge.a * i64::from(SUBPIXELS);
                }
            }
            for (value, edge) in row_values.iter_mut().zip(&triangle.edges) {
                *value += edge.b * i64::from(SUBPIXELS);
            }
        }
    }

    /// Sorts each pixel's fragments and blends them.
    fn resolve<'a>(&mut self, ends: &[u32], draw: &Draw<'_>, view: &View, rows: impl Iterator<Item = &'a mut [Vec4]>) {
        let mut start = 0;
        for (row, ends) in rows.zip(ends.chunks(TILE_PX as usize)) {
            for (pixel, &end) in row.iter_mut().zip(ends) {
                let keys = &mut self.keys[start..end as usize];
                start = end as usize;
                sort(keys);
                let mut composite = Composite::default();
                for _ in keys {
                    composite.under(draw.base_color);
                }
                *pixel = composite.over(view.background);
            }
        }
    }
}

/// Greatest first: nearest in front.
fn sort(keys: &mut [u64]) {
    if keys.len() > SORTED_BY_INSERTION {
        keys.sort_unstable_by(|a, b| b.cmp(a));
        return;
    }
    for i in 1..keys.len() {
        let key = keys[i];
        let mut place = i;
        while place > 0 && keys[place - 1] < key {
            keys[place] = keys[place - 1];
            place -= 1;
        }
        keys[place] = key;
    }
}
