//! How far work has got, on standard error: bars on a terminal, elsewhere a line for what is worth one.

use std::borrow::Cow;

use indicatif::{MultiProgress, ProgressBar, ProgressIterator, ProgressStyle};
use tracing::info;

use crate::contest::{self, Outcome};

/// Counts items on standard error while they are taken, where that is a terminal.
pub fn over<I: ExactSizeIterator>(items: I, what: impl Into<Cow<'static, str>>) -> impl Iterator<Item = I::Item> {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(items.len() as u64).with_style(style).with_message(what);
    items.progress_with(bar.with_finish(indicatif::ProgressFinish::AndClear))
}

/// Shows how a contest goes: a bar for all tasks and one for each that is running; without a terminal, a line at the end
/// of each.
pub struct ContestBars {
    bars: MultiProgress,
    tasks: ProgressBar,
    jobs: Vec<ProgressBar>,
}

impl ContestBars {
    /// For so many tasks, of which so many run at once.
    pub fn new(tasks: usize, jobs: usize) -> Self {
        let style = |template| ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        let bars = MultiProgress::new();
        let all = bars.add(ProgressBar::new(tasks as u64).with_style(style("tasks {wide_bar} {pos}/{len} {elapsed}")));
        let job = |_| bars.add(ProgressBar::new(0).with_style(style("{msg} {wide_bar} {pos}/{len} scans")));
        let jobs = (0..jobs.max(1)).map(job).collect();
        all.tick();
        Self { tasks: all, jobs, bars }
    }
}

impl contest::Progress for ContestBars {
    fn begins(&self, job: usize, who: &str, scans: usize) {
        if let Some(bar) = self.jobs.get(job) {
            bar.reset();
            bar.set_length(scans as u64);
            bar.set_message(who.to_owned());
        }
    }

    fn learned(&self, job: usize, scans: usize) {
        if let Some(bar) = self.jobs.get(job) {
            bar.set_position(scans as u64);
        }
    }

    fn ends(&self, _job: usize, outcome: &Outcome) {
        self.tasks.inc(1);
        let nll = outcome.scores.map_or("-".to_owned(), |scores| format!("{:.4}", scores.nll));
        let Outcome { contestant, dataset, held, seed, .. } = outcome;
        self.bars.suspend(|| {
            info!("{contestant} on {dataset}, {held} held out, seed {seed}: {}, NLL {nll}", outcome.ending_in_words());
        });
    }
}

impl Drop for ContestBars {
    fn drop(&mut self) {
        self.jobs.iter().for_each(ProgressBar::finish_and_clear);
        self.tasks.finish_and_clear();
    }
}
