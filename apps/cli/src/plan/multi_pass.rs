//! Shaders of several passes: which, and through what.

use pellucid::core::fbuffer::{SIDES, Size};
use pellucid::multi_pass::Shader;

use super::{optional, usage};
use crate::args::{Backend, RenderArgs, ThroughArg};
use crate::values;

/// A picture by a shader of several passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MultiPassPlan {
    pub(crate) shader: Shader,
    /// Of the F-Buffer; `None` for one that holds all fragments.
    pub(crate) size: Option<Size>,
    pub(crate) show: Show,
    /// Whether a GPU was asked for; a software one will do.
    pub(crate) is_on_gpu: bool,
}

/// What is in the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Show {
    /// The view, through one of them.
    View(ThroughArg),
    /// The memory of the F-Buffer.
    Slots,
}

/// The name, among resolves, of an F-Buffer's memory.
pub(crate) const SLOTS: &str = "slots";

impl MultiPassPlan {
    /// None, unless there is an option that asks for one.
    pub(super) fn new(args: &RenderArgs) -> anyhow::Result<Option<Self>> {
        let shows_slots = args.resolve == SLOTS;
        let Some(shader) = args.shader.as_deref().or(shows_slots.then_some("lighting")) else {
            return match args.through {
                Some(_) => Err(usage("--through goes with --shader".into())),
                None => Ok(None),
            };
        };
        let because = if args.shader.is_some() { "--shader" } else { "--resolve slots" };
        let others = [
            ("--technique", args.capture.technique.is_some()),
            ("--frames", args.frames.is_some()),
            ("--thickness", args.thickness.is_some()),
            ("--resolve", !shows_slots && args.resolve != "blend"),
            ("--through", shows_slots && args.through.is_some()),
        ];
        if let Some((other, _)) = others.iter().find(|(_, is_given)| *is_given) {
            return Err(usage(format!("{other} does not go with {because}, which blends in draw order")));
        }
        Ok(Some(Self {
            shader: shader.parse().map_err(|error| usage(format!("{error}")))?,
            size: optional("--fbuffer", args.capture.fbuffer.as_ref(), side)?,
            show: match shows_slots {
                true => Show::Slots,
                false => Show::View(args.through.unwrap_or(ThroughArg::Fbuffer)),
            },
            is_on_gpu: args.capture.device.backend == Backend::Gpu,
        }))
    }
}

/// The side of a square F-Buffer.
pub(super) fn side(text: &str) -> Result<Size, values::Wrong> {
    let [least, greatest] = SIDES;
    let size = values::whole(text, least, greatest).ok().and_then(|side| Size::square(side).ok());
    size.ok_or_else(|| format!("not the side of an F-Buffer; it must be a power of two from {least} to {greatest}"))
}
