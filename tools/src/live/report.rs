use std::{
    mem,
    path::{Path, PathBuf},
};

use anyhow::ensure;
use bhm_host::map::AnyMap;
use bhm_tools::metrics::Scores;
use serde::Serialize;

use super::{
    crew::{Outcome, ProcessIds},
    said::{Onboarded, Sent, Watched},
};
use crate::{options::MapValues, output::table};

/// What three processes did together.
#[derive(Serialize)]
pub(super) struct Report {
    title: String,
    folder: PathBuf,
    processes: ProcessIds,
    scans_per_s: f64,
    /// How many times faster than the scans were taken; null where stamps do not say.
    times_real_time: Option<f64>,
    posterior: Posteriors,
    /// Against what is really there; null where that is not known.
    scores: Option<Scores>,
    source: Sent,
    onboard: Onboarded,
    watch: Watched,
    options: MapValues,
}

/// Checksums of the posterior at the end; equal ones are equal bit for bit.
#[derive(Serialize)]
struct Posteriors {
    /// Of the tiles in the last posterior that the consumer read, computed in shared memory.
    shared: Option<String>,
    tiles_shared: usize,
    /// Whether the saved map has those tiles, and they are the same.
    equal: bool,
    /// Of every tile in the saved map.
    saved: String,
    tiles_saved: usize,
}

impl Report {
    pub(super) fn new(
        title: &str,
        folder: &Path,
        outcome: Outcome,
        saved: &dyn AnyMap,
        scores: Option<Scores>,
        options: MapValues,
    ) -> Self {
        let Outcome { processes, beginning, sent, onboarded, mut watched } = outcome;
        // The digest stands for them from here on.
        let shared_tiles = mem::take(&mut watched.tiles);
        Self {
            title: title.to_owned(),
            folder: folder.to_owned(),
            processes,
            scans_per_s: sent.scans as f64 / sent.seconds,
            times_real_time: beginning.recorded_s.map(|recorded_s| recorded_s / sent.seconds),
            posterior: Posteriors {
                equal: watched.posterior == Some(saved.digest_of(&shared_tiles).to_string()),
                shared: watched.posterior.clone(),
                tiles_shared: shared_tiles.len(),
                saved: saved.digest().to_string(),
                tiles_saved: saved.tile_indices().len(),
            },
            scores,
            source: sent,
            onboard: onboarded,
            watch: watched,
            options,
        }
    }

    /// Whether what was read in shared memory is what was saved.
    ///
    /// # Errors
    /// If it is not.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        let shared = self.posterior.shared.as_deref().unwrap_or("none");
        ensure!(self.posterior.equal, "the consumer's posterior {shared} is not the saved map's");
        Ok(())
    }

    /// For the terminal.
    pub(super) fn text(&self) -> String {
        table(&self.rows())
    }

    fn rows(&self) -> Vec<(&'static str, String)> {
        let Self { processes, source, onboard, watch, .. } = self;
        let count = |name| onboard.count(name);
        let real_time = self.times_real_time.map_or(String::new(), |times| format!(", {times:.1} x real time"));
        let rejected: u64 =
            onboard.counters.iter().filter(|(name, _)| name.starts_with("rejected_")).map(|(_, count)| count).sum();
        let mut rows = vec![
            (
                "processes",
                format!("source {}, onboard {}, consumer {}", processes.source, processes.onboard, processes.watch),
            ),
            (
                "scans",
                format!(
                    "{} sent, {} received, {} integrated, {rejected} rejected, {} lost",
                    source.scans,
                    count("received"),
                    count("integrated"),
                    count("lost")
                ),
            ),
            (
                "posteriors",
                format!(
                    "{} published (the empty map first), {} read, {} skipped by the consumer",
                    count("published"),
                    watch.posteriors,
                    watch.skipped
                ),
            ),
            ("speed", format!("{:.1} scans/s{real_time}", self.scans_per_s)),
            (
                "tiles",
                format!(
                    "{} in the store, {} in the archive; {} evicted, {} restored, {} lost",
                    onboard.tiles_resident,
                    onboard.tiles_archived,
                    count("tiles_evicted"),
                    count("tiles_restored"),
                    count("tiles_lost")
                ),
            ),
            ("posterior", self.posterior.summary()),
        ];
        rows.extend(self.scores.as_ref().map(|scores| {
            let auc = scores.auc.map_or("undefined".to_owned(), |auc| format!("{auc:.4}"));
            let Scores { nll, accuracy, points, .. } = scores;
            ("truth", format!("AUC {auc}, NLL {nll:.4} nats, accuracy {accuracy:.4} at {points} known points"))
        }));
        rows.extend(onboard.updates().map(|updates| ("updates", updates)));
        rows.extend(onboard.last_fault.as_ref().map(|fault| ("last fault", fault.clone())));
        rows.push(("results", self.folder.join("report.md").display().to_string()));
        rows
    }

    /// As a document.
    pub(super) fn markdown(&self) -> anyhow::Result<String> {
        let cells = |rows: &[(&str, String)]| {
            let lines = rows.iter().map(|(name, value)| format!("| {name} | {value} |\n"));
            "| | |\n|---|---|\n".to_owned() + &lines.collect::<String>()
        };
        let counters: Vec<_> =
            self.onboard.counters.iter().map(|(name, count)| (name.as_str(), count.to_string())).collect();
        Ok(format!(
            "# {}\n\n{}\n\
             Three processes: a source of scans, the onboard process that maps them, and a consumer that reads every\n\
             posterior where it lies in shared memory. Both pictures are drawn from the saved map (`map.bhm`), which holds\n\
             the tiles in the archive as well.\n\n\
             ![Probability of occupancy](probability.png)\n\n\
             ![Standard deviation of the log-odds](deviation.png)\n\n\
             ## Map options in effect\n\n\
             Use them again with `--config options.toml`.\n\n```toml\n{}```\n\n\
             ## Everything the onboard process counted\n\n{}",
            self.title,
            cells(&self.rows()),
            toml::to_string(&self.options)?,
            cells(&counters),
        ))
    }
}

impl Posteriors {
    fn summary(&self) -> String {
        let Self { shared, tiles_shared, equal, saved, tiles_saved } = self;
        let shared = shared.as_deref().unwrap_or("none");
        let verdict = if *equal { "the same" } else { "NOT THE SAME" };
        if tiles_shared == tiles_saved {
            return format!("{saved}; {shared} in shared memory: {verdict} {tiles_saved} tiles");
        }
        format!(
            "{saved}, {tiles_saved} tiles; {shared} in shared memory, which has the {tiles_shared} tiles of the store: \
             {verdict}"
        )
    }
}
