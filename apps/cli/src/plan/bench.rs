//! What `pellucid bench` is to do.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, bail};

use super::{MAX_THREADS, option, optional};
use crate::args::{Backend, BenchArgs};
use crate::commands::bench::{SUITES, Suite};
use crate::values;

/// Suites to measure, and how.
#[derive(Debug)]
pub(crate) struct BenchPlan {
    /// Those named, each once, in the order of the list; all if none is named.
    pub(crate) suites: Vec<&'static Suite>,
    /// The folder of the real scenes, which exists.
    pub(crate) scenes: Option<PathBuf>,
    pub(crate) output: PathBuf,
    pub(crate) backend: Backend,
    /// Of the CPU renderer; 0: one for each core.
    pub(crate) threads: usize,
    pub(crate) budget_bytes: Option<u64>,
    /// Frames measured of a technique at a point.
    pub(crate) repeats: u32,
    /// Most that one technique may take at one point.
    pub(crate) time_limit: Duration,
    pub(crate) quick: bool,
    pub(crate) fresh: bool,
    pub(crate) quiet: bool,
}

const MAX_REPEATS: u32 = 10_000;
const MAX_TIME_LIMIT_S: u32 = 86_400;
/// Most frames of a `--quick` run.
const QUICK_REPEATS: u32 = 2;

impl BenchPlan {
    pub(crate) fn new(args: BenchArgs) -> anyhow::Result<Self> {
        let is_wanted = |suite: &Suite| args.suite.is_empty() || args.suite.iter().any(|name| name == suite.name);
        let repeats = option("--repeats", &args.repeats, |text| values::whole(text, 1, MAX_REPEATS))?;
        let seconds = option("--time-limit", &args.time_limit, |text| values::whole(text, 1, MAX_TIME_LIMIT_S))?;
        let threads = option("--threads", &args.threads, |text| values::whole(text, 0, MAX_THREADS))?;
        let budget_bytes = optional("--budget", args.budget.as_ref(), values::bytes)?;
        if let Some(folder) = &args.scenes {
            let metadata = folder.metadata();
            let metadata = metadata.with_context(|| format!("cannot find the scenes folder '{}'", folder.display()))?;
            if !metadata.is_dir() {
                bail!("--scenes '{}' is a file; name the folder of the scenes", folder.display());
            }
        }
        Ok(Self {
            suites: SUITES.iter().filter(|suite| is_wanted(suite)).collect(),
            scenes: args.scenes,
            output: args.output,
            backend: args.backend,
            threads: threads as usize,
            budget_bytes,
            repeats: if args.quick { repeats.min(QUICK_REPEATS) } else { repeats },
            time_limit: Duration::from_secs(seconds.into()),
            quick: args.quick,
            fresh: args.fresh,
            quiet: args.quiet,
        })
    }
}
