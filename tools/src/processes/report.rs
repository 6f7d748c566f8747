use std::{
    mem,
    path::{Path, PathBuf},
};

use anyhow::ensure;
use bhm_bench::metrics::Scores;
use bhm_host::{ipc::AnyPosterior, map::AnyMap};
use serde::Serialize;

use super::{
    firmware::Firmware,
    group::{GroupResult, ProcessIds},
    json_lines::{Onboarded, Sent, Watched},
};
use crate::output::table;

/// What three processes did together.
#[derive(Serialize)]
pub(super) struct RunReport {
    title: String,
    folder: PathBuf,
    processes: ProcessIds,
    scans_per_s: f64,
    /// How many times faster than the scans were taken; null where stamps do not say.
    times_real_time: Option<f64>,
    posterior: Posteriors,
    /// The program that made the map, where it is not the onboard process.
    #[serde(skip_serializing_if = "Option::is_none")]
    firmware: Option<PathBuf>,
    /// Against what is really there; null where that is not known.
    scores: Option<Scores>,
    source: Sent,
    onboard: Onboarded,
    watch: Watched,
    options: toml::Table,
}

/// Checksums of the posterior at the end; equal ones are equal bit for bit.
#[derive(Serialize)]
struct Posteriors {
    /// Of the tiles in the last posterior that the consumer read, computed in shared memory.
    shared: Option<String>,
    tiles_shared: usize,
    /// Whether the map that was made has those tiles, and they are the same.
    equal: bool,
    /// Of every tile in the saved map; null where none is saved.
    saved: Option<String>,
    /// Of every tile that the firmware sent; null where none did.
    received: Option<String>,
    tiles_saved: usize,
}

/// What the posterior in shared memory is compared with.
pub(super) struct Made {
    equal_to: Option<String>,
    saved: Option<String>,
    tiles: usize,
    firmware: Option<PathBuf>,
}

impl Made {
    /// A map that the onboard process saved.
    pub(super) fn saved(map: &dyn AnyMap, outcome: &GroupResult) -> Self {
        Self {
            equal_to: Some(map.digest_of(&outcome.watched.tiles).to_string()),
            saved: Some(map.digest().to_string()),
            tiles: map.tile_indices().len(),
            firmware: None,
        }
    }

    /// What firmware sent, of which this is left in shared memory.
    pub(super) fn by_firmware(firmware: &Firmware, posterior: &dyn AnyPosterior) -> Self {
        Self {
            equal_to: Some(posterior.digest().to_string()),
            saved: None,
            tiles: posterior.tile_indices().len(),
            firmware: Some(firmware.elf().to_owned()),
        }
    }
}

impl RunReport {
    pub(super) fn new(
        title: &str,
        folder: &Path,
        outcome: GroupResult,
        made: Made,
        scores: Option<Scores>,
        options: toml::Table,
    ) -> Self {
        let GroupResult { processes, beginning, sent, onboarded, mut watched, .. } = outcome;
        // The digest stands for them from here on.
        let shared_tiles = mem::take(&mut watched.tiles);
        Self {
            title: title.to_owned(),
            folder: folder.to_owned(),
            processes,
            scans_per_s: sent.scans as f64 / sent.seconds,
            times_real_time: beginning.recorded_s.map(|recorded_s| recorded_s / sent.seconds),
            posterior: Posteriors {
                // What came over the line is what was published, and what the consumer read.
                equal: watched.posterior == made.equal_to
                    && (made.firmware.is_none() || watched.posterior.as_ref() == Some(&onboarded.posterior)),
                shared: watched.posterior.clone(),
                tiles_shared: shared_tiles.len(),
                saved: made.saved,
                received: made.firmware.as_ref().map(|_| onboarded.posterior.clone()),
                tiles_saved: made.tiles,
            },
            firmware: made.firmware,
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
        let made = if self.firmware.is_some() { "what the firmware sent" } else { "the saved map's" };
        ensure!(self.posterior.equal, "the consumer's posterior {shared} is not {made}");
        Ok(())
    }

    /// For the terminal.
    pub(super) fn text(&self) -> String {
        table(&self.rows())
    }

    fn rows(&self) -> Vec<(&'static str, String)> {
        let Self { processes, source, onboard, watch, .. } = self;
        // A device counts each time that it said where it stands, were it to a host that asked again.
        let by_firmware = self.firmware.is_some();
        let (maker, published) = if by_firmware { ("bridge", "bridge_posteriors") } else { ("onboard", "published") };
        let emulated = processes.firmware.map_or(String::new(), |id| format!(", emulated microcontroller {id}"));
        let [published, received, integrated, lost] =
            [published, "received", "integrated", "lost"].map(|name| onboard.count(name));
        let [evicted, restored, tiles_lost] =
            ["tiles_evicted", "tiles_restored", "tiles_lost"].map(|name| onboard.count(name));
        let real_time = self.times_real_time.map_or(String::new(), |times| format!(", {times:.1} x real time"));
        let rejected: u64 =
            onboard.counters.iter().filter(|(name, _)| name.starts_with("rejected_")).map(|(_, count)| count).sum();
        let mut rows = vec![
            (
                "processes",
                format!(
                    "source {}, {maker} {}, consumer {}{emulated}",
                    processes.source, processes.onboard, processes.watch
                ),
            ),
            (
                "scans",
                format!(
                    "{} sent, {received} received, {integrated} integrated, {rejected} rejected, {lost} lost",
                    source.scans
                ),
            ),
            (
                "posteriors",
                format!(
                    "{published} published (the empty map first), {} read, {} skipped by the consumer",
                    watch.posteriors, watch.skipped
                ),
            ),
            ("speed", format!("{:.1} scans/s{real_time}", self.scans_per_s)),
            (
                "tiles",
                format!(
                    "{} in the store, {} in the archive; {evicted} evicted, {restored} restored, {tiles_lost} lost",
                    onboard.tiles_resident, onboard.tiles_archived
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
        let how = if self.firmware.is_some() {
            "Four processes: a source of scans, an emulated microcontroller whose firmware maps them, a bridge between its\n\
             serial line and shared memory, and a consumer that reads every posterior where it lies there. Both pictures are\n\
             drawn from the last posterior in shared memory, of the tiles in the firmware's store. No map is saved: the\n\
             information matrices that one goes on learning with stay on the microcontroller."
        } else {
            "Three processes: a source of scans, the onboard process that maps them, and a consumer that reads every\n\
             posterior where it lies in shared memory. Both pictures are drawn from the saved map (`map.bhm`), which holds\n\
             the tiles in the archive as well."
        };
        Ok(format!(
            "# {}\n\n{}\n{how}\n\n\
             ![Probability of occupancy](probability.png)\n\n\
             ![Standard deviation of the log-odds](deviation.png)\n\n\
             ## Map options in effect\n\n\
             Use them again with `--config options.toml`.\n\n```toml\n{}```\n\n\
             ## Everything the onboard process counted\n\n{}",
            self.title,
            cells(&self.rows()),
            toml::to_string(&self.options)?,
            cells(&self.onboard.counter_rows()),
        ))
    }
}

impl Posteriors {
    fn summary(&self) -> String {
        let Self { shared, tiles_shared, equal, saved, received, tiles_saved } = self;
        let saved = saved.as_ref().or(received.as_ref()).map_or("none", String::as_str);
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
