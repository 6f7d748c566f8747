//! What reading and learning report, said on standard error and added up.

use std::path::Path;

use bhm_core::{
    mapper::{IntegrateReport, ScanRejected},
    profile::Profile,
};
use bhm_host::{
    ScanRecord,
    dataset::{Damage, MaxRangeSource, PointReport, ReadReport},
};
use serde::Serialize;
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

/// What became of all scans, by name.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Learned {
    pub(crate) scans: u64,
    pub(crate) scans_rejected: u64,
    pub(crate) beams_hit: u64,
    pub(crate) beams_beyond_range: u64,
    pub(crate) beams_no_return: u64,
    pub(crate) beams_not_a_number: u64,
    pub(crate) beams_negative: u64,
    pub(crate) beams_too_near: u64,
    pub(crate) beams_over_capacity: u64,
    pub(crate) points_used: u64,
    pub(crate) points_unplaceable: u64,
    pub(crate) points_outside: u64,
    pub(crate) points_over_capacity: u64,
    pub(crate) points_narrowed: u64,
    pub(crate) rows_over_capacity: u64,
    pub(crate) tiles_evicted: u64,
    pub(crate) tiles_restored: u64,
    pub(crate) tiles_lost: u64,
    pub(crate) tiles_failed: u64,
    pub(crate) passes: u64,
    pub(crate) safeguards: u64,
    pub(crate) conditioned: u64,
}

impl Learned {
    /// Adds what became of a scan; a rejection is also said, at first.
    pub(crate) fn add(&mut self, result: Result<IntegrateReport, ScanRejected>) {
        match result {
            Ok(report) => self.count(&report),
            Err(rejected) => {
                self.scans_rejected += 1;
                if self.scans_rejected <= DAMAGE_SHOWN as u64 {
                    warn!("scan {} rejected: {rejected}", self.scans + self.scans_rejected);
                }
            }
        }
    }

    fn count(&mut self, report: &IntegrateReport) {
        self.scans += 1;
        let IntegrateReport { beams, points, .. } = report;
        for (total, count) in [
            (&mut self.beams_hit, beams.hits),
            (&mut self.beams_beyond_range, beams.beyond_range),
            (&mut self.beams_no_return, beams.no_return),
            (&mut self.beams_not_a_number, beams.not_a_number),
            (&mut self.beams_negative, beams.negative),
            (&mut self.beams_too_near, beams.too_near),
            (&mut self.beams_over_capacity, beams.over_capacity),
            (&mut self.points_used, points.used),
            (&mut self.points_unplaceable, points.unplaceable),
            (&mut self.points_outside, points.outside),
            (&mut self.points_over_capacity, points.over_capacity),
            (&mut self.points_narrowed, points.narrowed),
            (&mut self.rows_over_capacity, report.rows_over_capacity + report.rows_refused),
            (&mut self.tiles_evicted, report.tiles_evicted),
            (&mut self.tiles_restored, report.tiles_restored),
            (&mut self.tiles_lost, report.tiles_lost),
            (&mut self.tiles_failed, report.tiles_failed),
            (&mut self.passes, report.passes),
            (&mut self.safeguards, report.safeguards),
            (&mut self.conditioned, report.conditioned),
        ] {
            *total += u64::from(count);
        }
    }

    /// Says what did not become part of the map, and which option helps.
    pub(crate) fn warn(&self, profile: &Profile) {
        let capacities = &profile.capacities;
        for (count, what) in [
            (self.scans_rejected, "scans rejected".to_owned()),
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
            (self.rows_over_capacity, format!("observations dropped: over {} in one tile", capacities.rows)),
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
        let Self { scans, scans_rejected, points_used, beams_hit, beams_beyond_range, beams_no_return, .. } = self;
        let dropped = self.beams_not_a_number + self.beams_negative + self.beams_too_near + self.beams_over_capacity;
        let mut text = format!("{scans} scans ({scans_rejected} rejected), {points_used} observations");
        if beams_hit + beams_beyond_range + beams_no_return + dropped > 0 {
            text += &format!(
                " from {beams_hit} hits, {beams_beyond_range} beyond range, {beams_no_return} without return; {dropped} dropped"
            );
        }
        text
    }
}
