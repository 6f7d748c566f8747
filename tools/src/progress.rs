use indicatif::{ProgressBar, ProgressIterator, ProgressStyle};

/// Counts items on standard error while they are taken, where that is a terminal.
pub(crate) fn over<I: ExactSizeIterator>(items: I, what: &'static str) -> impl Iterator<Item = I::Item> {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(items.len() as u64).with_style(style).with_message(what);
    items.progress_with(bar.with_finish(indicatif::ProgressFinish::AndClear))
}
