//! The command line of Pellucid: raw arguments (`args`) become a plan with meaning (`plan`), which a command carries out.
//!
//! Results go to stdout or the file named, everything else to stderr. Exit code 0: done; 1: failed; 2: the command line
//! itself has no meaning. A reader that closes the pipe early is no failure.
#![deny(unsafe_code)]

mod args;
mod camera;
mod commands;
mod devices;
mod legend;
mod plan;
mod progress;
mod report;
mod terminal;
mod values;
mod words;

use std::process::ExitCode;

use clap::Parser;

use args::{Args, Command};

const FAILED: u8 = 1;
const USAGE: u8 = 2;

/// A command line that can be read but has no meaning: exit code 2.
#[derive(Debug)]
struct UsageError(String);

impl std::fmt::Display for UsageError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for UsageError {}

/// On Linux, Mesa asks a window system which GPU it likes best, and where there is none complains on stderr. Pellucid
/// chooses itself, unless the user has told Mesa.
#[expect(unsafe_code, reason = "the environment is how Mesa is told")]
fn choose_devices_ourselves() {
    let is_told = ["NODEVICE_SELECT", "MESA_VK_DEVICE_SELECT"].iter().any(|name| std::env::var_os(name).is_some());
    if !is_told {
        // SAFETY: no other thread has been started that could read or write the environment.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}

fn main() -> ExitCode {
    choose_devices_ourselves();
    let result = match Args::try_parse() {
        Ok(args) => run(args.command),
        Err(error) => {
            let code = if error.use_stderr() { USAGE } else { 0 };
            match error.print() {
                Ok(()) => return ExitCode::from(code),
                Err(error) => Err(error.into()),
            }
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if terminal::is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            terminal::report_error(&error);
            ExitCode::from(if error.is::<UsageError>() { USAGE } else { FAILED })
        }
    }
}

fn run(command: Command) -> anyhow::Result<()> {
    match command {
        Command::Render(args) => commands::render::run(&plan::RenderPlan::new(*args)?),
        Command::Info(args) => commands::info::run(&plan::InfoPlan::new(*args)?),
        Command::Compare(args) => commands::compare::run(&plan::ComparePlan::new(*args)?),
        Command::Bench(args) => commands::bench::run(&plan::BenchPlan::new(*args)?),
        Command::Verify(args) => commands::verify::run(plan::VerifyPlan::new(args)?),
        Command::Scenes(args) => commands::scenes::run(args.json),
        Command::Techniques(args) => commands::techniques::run(args.json),
    }
}
