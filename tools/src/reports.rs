//! What reading and learning report, said on standard error and added up.

use std::{
    ops::{Deref, DerefMut},
    path::Path,
};

use bhm_core::{
    mapper::{IntegrateReport, ScanRejected},
    profile::Profile,
};
use bhm_firmware_sim::Counters;
use bhm_host::{
    ScanRecord,
    dataset::{Damage, MaxRangeSource, PointReport, ReadReport},
};
use serde::{Serialize, Serializer};
use tracing::{info, warn};

/// Damaged lines that are quoted; all are counted.
const DAMAGE_SHOWN: usize = 10;

/// Says how reading a scan log went.
pub(crate) fn scan_log(path: &Path, report: &ReadReport) {
    let file = path.display();
    damage(path, report.damaged, &report.damage);
    if report.stamps_repaired > 0 {
        warn!(
            "{file}: {} stamps were unusable or not later than the one before; made 1 ns later",
            report.stamps_repaired
        );
    }
    info!(
        "{file}: {} scans in {} lines; maximum range {} m ({})",
        report.scans,
        report.lines,
        report.max_range_m,
        source(report.max_range_source)
    );
}

/// Seconds from the first scan to the last, where the stamps are the recorder's own.
pub(crate) fn recorded_s(scans: &[ScanRecord], report: &ReadReport) -> Option<f64> {
    // Repaired stamps are nanoseconds apart: a few do no harm, many say nothing about time.
    let real = report.stamps_repaired * 10 < report.scans;
    let span_ns = scans.last().zip(scans.first()).map_or(0, |(last, first)| last.stamp_ns - first.stamp_ns);
    (real && span_ns > 0).then(|| span_ns as f64 / 1e9)
}

/// Says how reading labelled points went.
pub(crate) fn point_log(path: &Path, report: &PointReport) {
    damage(path, report.damaged, &report.damage);
    info!("{}: {} points", path.display(), report.points);
}

fn damage(path: &Path, total: u64, kept: &[Damage]) {
    for damage in kept.iter().take(DAMAGE_SHOWN) {
        warn!("{}: {damage}; skipped", path.display());
    }
    if total > 0 {
        warn!("{}: {total} damaged lines skipped", path.display());
    }
}

/// Where a maximum range comes from, in words.
pub(crate) fn source(source: MaxRangeSource) -> &'static str {
    match source {
        MaxRangeSource::Caller => "given",
        MaxRangeSource::Stated => "stated in the log",
        MaxRangeSource::Plateau => "found from the log: 1 % below the plateau of readings without return",
        MaxRangeSource::LargestReading => "found from the log: just above its largest reading, every one is an echo",
    }
}

/// What became of all scans, by the names that the onboard program counts by.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Learned(Counters);

impl Deref for Learned {
    type Target = Counters;

    fn deref(&self) -> &Counters {
        &self.0
    }
}

impl DerefMut for Learned {
    fn deref_mut(&mut self) -> &mut Counters {
        &mut self.0
    }
}

impl Serialize for Learned {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let totals = [("scans", self.integrated), ("scans_rejected", self.rejected())];
        serializer.collect_map(totals.into_iter().chain(self.iter()))
    }
}

impl Learned {
    /// Adds what became of a scan; a rejection is also said, at first.
    pub(crate) fn add(&mut self, outcome: &Result<IntegrateReport, ScanRejected>) {
        self.received += 1;
        self.count(outcome);
        if let Err(rejected) = outcome
            && self.rejected() <= DAMAGE_SHOWN as u64
        {
            warn!("scan {} rejected: {rejected}", self.received);
        }
    }

    /// Says what did not become part of the map, and which option helps.
    pub(crate) fn warn(&self, profile: &Profile) {
        let capacities = &profile.capacities;
        for (count, what) in [
            (self.rejected(), "scans rejected".to_owned()),
            (self.beams_not_a_number, "beams dropped: not a number".to_owned()),
            (self.beams_negative, "beams dropped: negative range".to_owned()),
            (self.beams_too_near, "beams dropped: nearer than the sensor measures".to_owned()),
            (
                self.beams_over_capacity,
                format!("beams dropped: their scans have over {} observations (see --free-spacing)", capacities.points),
            ),
            (self.points_unplaceable, "observations dropped: too far away".to_owned()),
            (self.points_outside, "observations dropped: outside the bounded area of the profile".to_owned()),
            (
                self.points_over_capacity,
                format!(
                    "observations dropped: their scans touch over {} tiles (see --range-limit)",
                    capacities.touched
                ),
            ),
            (
                self.points_narrowed,
                "observations learned as less uncertain than their pose: the stencil has no room for more".to_owned(),
            ),
            (
                self.rows_over_capacity + self.rows_refused,
                format!("observations dropped: over {} in one tile", capacities.rows),
            ),
            (self.tiles_lost, "tiles lost".to_owned()),
            (self.tiles_failed, "updates of a tile failed and changed nothing".to_owned()),
        ] {
            if count > 0 {
                warn!("{count} {what}");
            }
        }
    }

    /// In a line, for people.
    pub(crate) fn summary(&self) -> String {
        let Counters { integrated, points_used, beams_hit, beams_beyond_range, beams_no_return, .. } = self.0;
        let dropped = self.beams_not_a_number + self.beams_negative + self.beams_too_near + self.beams_over_capacity;
        let mut text = format!("{integrated} scans ({} rejected), {points_used} observations", self.rejected());
        if beams_hit + beams_beyond_range + beams_no_return + dropped > 0 {
            text += &format!(
                " from {beams_hit} hits, {beams_beyond_range} beyond range, {beams_no_return} without return; {dropped} dropped"
            );
        }
        text
    }
}
