//! The techniques, one file each, behind one small trait. Twins of their shaders: `shaders/technique`.
//!
//! A technique is the long-lived half: pipelines, and estimates that are good for the next frame. Buffers it asks of
//! [`Frame::memory`], which keeps them by name and counts their bytes. The per-frame half is [`Frame`].

mod abuffer;
mod alpha;
mod fbuffer;
mod growth;
mod linear;
mod list;
mod lucid;
mod pages;
mod peel;

pub use abuffer::Storage;
pub use lucid::DepthFilter;
use pellucid_core::{Scene, Technique};
use wgpu::BindGroupLayout;

use crate::frame::Frame;
use crate::memory::Window;
use crate::surface::SurfaceLayouts;
use crate::upload::SceneUpload;
use crate::{Context, GpuError};

/// What became of a window.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Outcome {
    /// It is in the picture, or among the layers.
    Done,
    /// It does not fit; nothing of it was drawn. These parts of it will be asked for instead, in this order.
    Split(Vec<Window>),
}

/// A way to capture and order fragments, on the GPU.
pub(crate) trait Capture: std::fmt::Debug + Send {
    /// Takes what it needs of a scene beside what all techniques do, if it has not yet.
    fn load(&mut self, _gpu: &Context, _scene: &Scene, _upload: &SceneUpload) -> Result<(), GpuError> {
        Ok(())
    }

    /// Captures the transparent fragments of a window in front of the opaque surfaces, orders them, and records or runs
    /// everything up to the frame's goal. The frame is already aimed at the window.
    fn window(&mut self, frame: &mut Frame<'_>, window: Window) -> Result<Outcome, GpuError>;
}

/// Layouts that techniques share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layouts<'a> {
    pub(crate) surfaces: &'a SurfaceLayouts,
    /// Group 0 of passes over pixels.
    pub(crate) picture: &'a BindGroupLayout,
}

/// The long-lived half of a technique.
pub(crate) fn new(
    gpu: &Context,
    layouts: Layouts<'_>,
    technique: Technique,
    storage: Storage,
) -> Result<Box<dyn Capture>, GpuError> {
    match technique {
        Technique::Alpha => Ok(Box::new(alpha::Alpha::new(gpu, layouts))),
        Technique::Linear => Ok(Box::new(linear::Linear::new(gpu, layouts))),
        Technique::Pages => Ok(Box::new(pages::Pages::new(gpu, layouts))),
        Technique::ABuffer => Ok(Box::new(abuffer::ABuffer::new(gpu, layouts, storage))),
        Technique::List => Ok(Box::new(list::List::new(gpu, layouts))),
        Technique::FBuffer => Ok(Box::new(fbuffer::FBuffer::new(gpu, layouts))),
        Technique::Lucid => Ok(Box::new(lucid::Lucid::new(gpu, layouts))),
        Technique::Peel => Ok(Box::new(peel::Peel::new(gpu, layouts))),
        Technique::Cpu | Technique::Oracle => Err(GpuError::NotOnGpu(technique)),
    }
}
