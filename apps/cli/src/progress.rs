//! What a long command is doing: on stderr, if that is a terminal and the work takes long enough to wonder.

use std::borrow::Cow;
use std::io::IsTerminal;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Work shorter than this shows nothing.
const PATIENCE: Duration = Duration::from_millis(300);
const TICK: Duration = Duration::from_millis(100);

/// A spinner with the present stage, or a bar that counts pictures. Gone when it is dropped.
pub(crate) struct Progress {
    bar: ProgressBar,
    starter: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Progress {
    /// For so many pictures; `None` for work that has no number.
    pub(crate) fn new(pictures: Option<u32>, quiet: bool) -> Self {
        match pictures {
            Some(count) => {
                Self::of(ProgressBar::new(count.into()), "{msg:10} [{bar:40}] {pos}/{len}, {eta} left", quiet)
            }
            None => Self::of(ProgressBar::new_spinner(), "{spinner} {msg} ({elapsed})", quiet),
        }
    }

    /// For work that should take so many seconds.
    pub(crate) fn timed(seconds: f64, quiet: bool) -> Self {
        Self::of(ProgressBar::new(ticks(seconds)), "[{bar:30}] {percent} %, {eta} left; {msg} ({elapsed})", quiet)
    }

    fn of(bar: ProgressBar, template: &str, quiet: bool) -> Self {
        bar.set_draw_target(ProgressDrawTarget::hidden());
        // The default style is as good if a template should ever be wrong.
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        let shows = !quiet && std::io::stderr().is_terminal();
        let starter = if shows { start_later(bar.clone()) } else { None };
        Self { bar, starter }
    }

    /// Names what is being done now.
    pub(crate) fn stage(&self, name: impl Into<Cow<'static, str>>) {
        self.bar.set_message(name);
    }

    /// One more picture is done.
    pub(crate) fn picture_done(&self) {
        self.bar.inc(1);
    }

    /// What should have taken so many seconds is done.
    pub(crate) fn advance(&self, seconds: f64) {
        self.bar.inc(ticks(seconds));
    }

    /// Writes lines to stderr without tearing the bar.
    pub(crate) fn suspend(&self, write: impl FnOnce()) {
        self.bar.suspend(write);
    }
}

/// Work of so many seconds in the bar's own units.
fn ticks(seconds: f64) -> u64 {
    (seconds * 1e3) as u64
}

/// Shows the bar after a while, unless the sender is gone by then. A system without threads to spare shows none.
fn start_later(bar: ProgressBar) -> Option<(Sender<()>, JoinHandle<()>)> {
    let (sender, receiver) = channel::<()>();
    let wait = move || {
        if receiver.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
            bar.set_draw_target(ProgressDrawTarget::stderr());
            bar.enable_steady_tick(TICK);
        }
    };
    Some((sender, std::thread::Builder::new().spawn(wait).ok()?))
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((sender, thread)) = self.starter.take() {
            drop(sender);
            let _ = thread.join();
        }
        self.bar.finish_and_clear();
    }
}
