//! What learning reports, said on standard error and added up.

use bhm_bench::reading::DAMAGE_SHOWN;
pub(crate) use bhm_bench::reading::{point_log, recorded_s, scan_log, source};
use bhm_core::{mapper::IntegrateReport, profile::Profile, scan::ScanRejected};
use serde::Serialize;
use tracing::warn;

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
