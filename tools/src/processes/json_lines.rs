//! What processes say on standard output with `--json`, one object a line.

use std::{collections::BTreeMap, path::PathBuf};

use serde::{Deserialize, Serialize};

use crate::output::table;

/// A line of a source of scans.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum SourceLine {
    /// Before the first scan.
    Begins(Beginning),
    /// After the last.
    Sent(Sent),
}

/// What a source is about to send.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Beginning {
    pub(crate) scans: u64,
    /// From the first scan to the last, where the stamps say so.
    pub(crate) recorded_s: Option<f64>,
}

/// What a source has sent.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Sent {
    pub(crate) scans: u64,
    /// Of those, how many went out twice because the mapper was replaced.
    pub(crate) sent_again: u64,
    /// Whether all were sent, and those that were to be acknowledged have been.
    pub(crate) complete: bool,
    /// From the first scan until the last was sent, or acknowledged.
    pub(crate) seconds: f64,
}

/// What the onboard process says at its end.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Onboarded {
    pub(crate) mapper: String,
    /// Whether the source ended, rather than this process being stopped.
    pub(crate) source_ended: bool,
    pub(crate) map: Option<PathBuf>,
    /// Digest of every tile.
    pub(crate) posterior: String,
    pub(crate) tiles_resident: usize,
    pub(crate) tiles_archived: usize,
    pub(crate) counters: BTreeMap<String, u64>,
    /// How long a scan was meant to take at most, milliseconds; `deadlines_missed` counts those that took longer.
    pub(crate) deadline_ms: Option<u32>,
    /// The longest that a scan took from being received to being integrated, milliseconds.
    pub(crate) slowest_update_ms: Option<f64>,
    pub(crate) last_fault: Option<String>,
}

impl Onboarded {
    /// For the terminal; `places` says where the tiles are that are resident, and where those that are archived.
    pub(crate) fn text(&self, places: [&str; 2]) -> String {
        let Self { posterior, tiles_resident, tiles_archived, .. } = self;
        let ended = if self.source_ended { "with its source" } else { "when told to" };
        let mut rows = vec![("ended", ended.to_owned())];
        rows.extend(self.map.as_ref().map(|map| ("map", map.display().to_string())));
        rows.push(("posterior", posterior.clone()));
        rows.push(("tiles", format!("{tiles_resident} {}, {tiles_archived} {}", places[0], places[1])));
        rows.extend(self.updates().map(|updates| ("updates", updates)));
        rows.extend(self.last_fault.as_ref().map(|fault| ("last fault", fault.clone())));
        table(&rows) + "\n" + &table(&self.counter_rows())
    }

    pub(crate) fn counter_rows(&self) -> Vec<(&str, String)> {
        self.counters.iter().map(|(name, count)| (name.as_str(), count.to_string())).collect()
    }

    /// How long updates took, for people; `None` if there was none.
    pub(crate) fn updates(&self) -> Option<String> {
        let slowest = format!("slowest {:.2} ms", self.slowest_update_ms?);
        Some(match self.deadline_ms {
            None => slowest,
            Some(deadline_ms) => {
                format!("{slowest}; {} missed the deadline of {deadline_ms} ms", self.count("deadlines_missed"))
            }
        })
    }

    /// A counter by its name.
    pub(crate) fn count(&self, name: &str) -> u64 {
        self.counters.get(name).copied().unwrap_or_default()
    }
}

/// A line of a consumer.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum WatchLine {
    /// For every posterior.
    Posterior(Seen),
    /// At the end.
    Watched(Watched),
}

/// A posterior that a consumer read.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Seen {
    pub(crate) mapper: String,
    pub(crate) sequence: u64,
    /// The newest scan of its source that it knows of.
    pub(crate) scan_sequence: u64,
    pub(crate) scans: u64,
    pub(crate) tiles: u64,
    pub(crate) tiles_archived: u64,
    pub(crate) ended: bool,
    /// At the points asked for, in their order.
    pub(crate) probabilities: Vec<f32>,
}

/// Everything that a consumer read.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Watched {
    pub(crate) posteriors: u64,
    /// Published, and replaced by a newer one before they were read.
    pub(crate) skipped: u64,
    /// Runs of a mapper that were heard.
    pub(crate) mappers: u64,
    /// Messages that could not be used.
    pub(crate) unusable: u64,
    pub(crate) last: Option<Seen>,
    /// Digest of the last one's tiles, computed where they lie.
    pub(crate) posterior: Option<String>,
    /// Indices of those tiles.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) tiles: Vec<[i32; 2]>,
}
