use std::time::{Duration, Instant};

pub(crate) use bhm_bench::progress::over;
use indicatif::{ProgressBar, ProgressStyle};
use tracing::info;

/// How often a line is written where there is no terminal to draw a bar on.
const LINE_EVERY: Duration = Duration::from_secs(5);

/// Shows how many scans have gone the whole way: as a bar, or where there is no terminal, as a line now and then.
pub(crate) struct ScanCount {
    bar: ProgressBar,
    last_line: Instant,
}

impl ScanCount {
    /// A count that begins at nought.
    pub(crate) fn new() -> Self {
        let style = ProgressStyle::with_template("mapping {wide_bar} {pos}/{len} scans {per_sec} {eta}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        Self { bar: ProgressBar::new(0).with_style(style), last_line: Instant::now() }
    }

    /// So many of so many.
    pub(crate) fn show(&mut self, scans: u64, of: u64) {
        self.bar.set_length(of);
        self.bar.set_position(scans);
        if self.bar.is_hidden() && self.last_line.elapsed() > LINE_EVERY {
            info!("{scans} of {of} scans mapped");
            self.last_line = Instant::now();
        }
    }

    /// Has something else written to the terminal.
    pub(crate) fn pause(&self, write: impl FnOnce()) {
        self.bar.suspend(write);
    }
}

impl Drop for ScanCount {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
