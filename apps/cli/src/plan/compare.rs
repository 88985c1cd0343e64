//! What `pellucid compare` is to do.

use std::path::PathBuf;

use pellucid::{Resolve, Technique};

use super::{SceneName, ViewPlan, option, optional, usage};
use crate::args::{CompareArgs, ReferenceArg, UNSORTED};
use crate::devices::DevicePlan;
use crate::values;

/// One view to render with several techniques.
#[derive(Debug)]
pub(crate) struct ComparePlan {
    pub(crate) scene: SceneName,
    pub(crate) output: PathBuf,
    /// What is named, in that order, each once; empty for all that run on the backend.
    pub(crate) compared: Vec<Compared>,
    /// Oracle or CPU; `None` for whichever can do it in seconds.
    pub(crate) reference: Option<Technique>,
    /// What ordered layers become.
    pub(crate) resolve: Resolve,
    pub(crate) view: ViewPlan,
    pub(crate) device: DevicePlan,
    pub(crate) quiet: bool,
}

/// What a picture is made with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Compared {
    /// Blending in draw order, made from the reference's layers.
    Unsorted,
    Technique(Technique),
}

impl ComparePlan {
    pub(crate) fn new(args: CompareArgs) -> anyhow::Result<Self> {
        let mut compared = Vec::new();
        for name in &args.techniques {
            let named = match name.as_str() {
                UNSORTED => Compared::Unsorted,
                name => Compared::Technique(name.parse().map_err(|error| usage(format!("{error}")))?),
            };
            if !compared.contains(&named) {
                compared.push(named);
            }
        }
        let resolve: Resolve = args.resolve.parse().map_err(|error| usage(format!("{error}")))?;
        if let Some(named) = compared.iter().find(|named| !named.serves(resolve)) {
            let name = named.name();
            return Err(usage(format!(
                "--techniques: '{name}' does not order fragments, so it serves blend alone, not '{resolve}'"
            )));
        }
        let device = DevicePlan::new(&args.device)?;
        device.check("--techniques", &compared.iter().filter_map(|named| named.technique()).collect::<Vec<_>>())?;
        Ok(Self {
            scene: SceneName(args.scene),
            output: args.output,
            compared,
            reference: args.reference.map(|reference| match reference {
                ReferenceArg::Oracle => Technique::Oracle,
                ReferenceArg::Cpu => Technique::Cpu,
            }),
            resolve,
            view: ViewPlan {
                background: option("--background", &args.background, values::color)?,
                thickness: optional("--thickness", args.thickness.as_ref(), values::length)?,
                ..ViewPlan::new(&args.view)?
            },
            device,
            quiet: args.quiet,
        })
    }
}

impl Compared {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Unsorted => UNSORTED,
            Self::Technique(technique) => technique.name(),
        }
    }

    /// Whether it can make such a picture: what does not order fragments blends them, and that is all.
    pub(crate) fn serves(self, resolve: Resolve) -> bool {
        resolve == Resolve::Blend || self.technique().is_some_and(Technique::is_exact)
    }

    pub(crate) fn technique(self) -> Option<Technique> {
        match self {
            Self::Unsorted => None,
            Self::Technique(technique) => Some(technique),
        }
    }
}
