//! The figures of a frame.

use crate::{Image, Technique};

/// One timed part of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// What was done.
    pub name: &'static str,
    /// Wall-clock milliseconds.
    pub ms: f64,
}

/// What a frame took and held.
#[derive(Debug, Clone, PartialEq)]
pub struct Stats {
    /// How fragments were captured and ordered.
    pub technique: Technique,
    /// The device that did it, in words.
    pub device: String,
    /// Width of the picture in pixels.
    pub width: u32,
    /// Height of the picture in pixels.
    pub height: u32,
    /// Triangles after instancing.
    pub triangles: u64,
    /// Triangles left out because a vertex is NaN, infinite or beyond the range of f32 after projection.
    pub dropped_triangles: u64,
    /// Transparent fragments captured.
    pub fragments: u64,
    /// Most fragments at one pixel.
    pub max_depth_complexity: u32,
    /// Fragments over pixels that have any.
    pub mean_depth_complexity: f64,
    /// Timed parts, in order.
    pub steps: Vec<Step>,
    /// Whole frame, without loading, in milliseconds.
    pub total_ms: f64,
    /// Most bytes held at once besides scene and picture.
    pub peak_bytes: u64,
    /// Parts of the screen the capture was split into to stay inside its budget; 1 for all at once.
    pub windows: u32,
    /// Captures repeated because an estimate of their size was too small.
    pub rerenders: u32,
    /// Pixels with more layers than the frame was allowed to peel, or left early as too little light gets through: the picture
    /// is not exact there.
    pub cut_pixels: u64,
    /// Windows of slots that an F-Buffer slid over, in all parts of the screen; 0 for other techniques.
    pub slot_windows: u64,
    /// Pixels that a depth filter left out of order, and that were sorted after it; 0 for techniques without.
    pub repaired_pixels: u64,
    /// Parts of triangles in half-blocks of 8 x 4 pixels, which a rasterizer in compute sorts by depth; 0 for other techniques.
    pub half_block_parts: u64,
    /// Share of triangles' pairs that have one triangle only, as none was left that would make a quad with it; 0 for
    /// techniques that do not pair them.
    pub lone_share: f64,
}

impl Stats {
    /// Figures of a frame that is about to be rendered: everything but the size is still 0.
    pub fn new(technique: Technique, device: String, width: u32, height: u32) -> Self {
        Self {
            technique,
            device,
            width,
            height,
            triangles: 0,
            dropped_triangles: 0,
            fragments: 0,
            max_depth_complexity: 0,
            mean_depth_complexity: 0.0,
            steps: Vec::new(),
            total_ms: 0.0,
            peak_bytes: 0,
            windows: 1,
            rerenders: 0,
            cut_pixels: 0,
            slot_windows: 0,
            repaired_pixels: 0,
            half_block_parts: 0,
            lone_share: 0.0,
        }
    }

    /// Whether every fragment was captured and ordered.
    pub fn is_exact(&self) -> bool {
        self.technique.is_exact() && self.cut_pixels == 0
    }
}

/// A rendered picture and what it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// The picture.
    pub image: Image,
    /// What it took.
    pub stats: Stats,
}
