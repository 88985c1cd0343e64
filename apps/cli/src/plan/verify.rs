//! What `pellucid verify` is to do.

use pellucid::Technique;

use super::usage;
use crate::args::VerifyArgs;
use crate::devices::DevicePlan;

/// Techniques to hold against the oracle.
#[derive(Debug)]
pub(crate) struct VerifyPlan {
    /// Those named; empty for all that run on the backend.
    pub(crate) techniques: Vec<Technique>,
    pub(crate) device: DevicePlan,
    pub(crate) json: bool,
}

impl VerifyPlan {
    pub(crate) fn new(args: VerifyArgs) -> anyhow::Result<Self> {
        let techniques = args.technique.iter().map(|name| name.parse().map_err(|error| usage(format!("{error}"))));
        let techniques = techniques.collect::<anyhow::Result<Vec<Technique>>>()?;
        let device = DevicePlan::new(&args.device)?;
        device.check("--technique", &techniques)?;
        Ok(Self { techniques, device, json: args.json })
    }
}
