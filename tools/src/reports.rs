//! What learning reports, said on standard error and added up.

use std::{
    borrow::Cow,
    time::{Duration, Instant},
};

use bhm_bench::{progress, reading::DAMAGE_SHOWN};
use bhm_core::{mapper::IntegrateReport, profile::Profile, scan::ScanRejected};
use bhm_firmware_sim::Counters;
use bhm_host::{ScanRecord, map::AnyMap};
use serde::{Serialize, Serializer};
use tracing::warn;

/// What became of all scans, by name, and how long they took.
#[derive(Clone, Debug, Default)]
pub(crate) struct Learned {
    pub(crate) counters: Counters,
    /// Of each scan, whether it was learned or not.
    pub(crate) durations: Vec<Duration>,
    /// Of all updates, nats.
    pub(crate) objective: f64,
}

impl Learned {
    /// Has a scan learned, and says whether it was; the first rejections are also said on standard error.
    pub(crate) fn learn(&mut self, learn: impl FnOnce() -> Result<IntegrateReport, ScanRejected>) -> bool {
        let start = Instant::now();
        let result = learn();
        self.durations.push(start.elapsed());
        let counters = &mut self.counters;
        counters.count(&result);
        match &result {
            Ok(report) => self.objective += f64::from(report.objective),
            Err(rejected) => {
                if counters.rejected() <= DAMAGE_SHOWN as u64 {
                    warn!("scan {} rejected: {rejected}", counters.integrated + counters.rejected());
                }
            }
        }
        result.is_ok()
    }

    /// Has every scan learned.
    pub(crate) fn learn_all(&mut self, map: &mut dyn AnyMap, scans: &[ScanRecord], what: impl Into<Cow<'static, str>>) {
        for scan in progress::over(scans.iter(), what) {
            self.learn(|| map.integrate(&scan.as_scan()));
        }
    }

    /// Leaves out beams that were held out: they were NaN to the map, but that is not the log's fault.
    pub(crate) fn leave_out(&mut self, held_out: usize) {
        let count = &mut self.counters.beams_not_a_number;
        *count = count.saturating_sub(held_out as u64);
    }

    /// Says what did not become part of the map, and which option helps.
    pub(crate) fn warn(&self, profile: &Profile) {
        let (Self { counters, .. }, capacities) = (self, &profile.capacities);
        for (count, what) in [
            (counters.rejected(), "scans rejected".to_owned()),
            (counters.beams_not_a_number, "beams dropped: not a number".to_owned()),
            (counters.beams_negative, "beams dropped: negative range".to_owned()),
            (counters.beams_too_near, "beams dropped: nearer than the sensor measures".to_owned()),
            (
                counters.beams_over_capacity,
                format!(
                    "beams dropped: their scans have over {} observations (see --free-spacing)",
                    capacities.observations
                ),
            ),
            (counters.observations_unplaceable, "observations dropped: too far away".to_owned()),
            (counters.observations_outside, "observations dropped: outside the bounded area of the profile".to_owned()),
            (
                counters.observations_over_capacity,
                format!(
                    "observations dropped: their scans touch over {} tiles (see --range-limit)",
                    capacities.touched
                ),
            ),
            (
                counters.observations_narrowed,
                "observations learned as less uncertain than their pose: the stencil has no room for more".to_owned(),
            ),
            (
                counters.rows_over_capacity + counters.rows_refused,
                format!("observations dropped: over {} in one tile", capacities.rows),
            ),
            (counters.tiles_lost, "tiles lost".to_owned()),
            (counters.tiles_failed, "updates of a tile failed and changed nothing".to_owned()),
        ] {
            if count > 0 {
                warn!("{count} {what}");
            }
        }
    }

    /// In a line, for people.
    pub(crate) fn summary(&self) -> String {
        let Self { counters, .. } = self;
        let Counters { integrated, observations_used, beams_hit, beams_beyond_range, beams_no_return, .. } = counters;
        let rejected = counters.rejected();
        let dropped = counters.beams_not_a_number
            + counters.beams_negative
            + counters.beams_too_near
            + counters.beams_over_capacity;
        let mut text = format!("{integrated} scans ({rejected} rejected), {observations_used} observations");
        if beams_hit + beams_beyond_range + beams_no_return + dropped > 0 {
            text += &format!(
                " from {beams_hit} hits, {beams_beyond_range} beyond range, {beams_no_return} without return; {dropped} dropped"
            );
        }
        text
    }
}

/// Counts of the loop, which only a process that receives scans has, are left out.
impl Serialize for Learned {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self { counters, .. } = self;
        let of_scans = [("scans", counters.integrated), ("scans_rejected", counters.rejected())];
        let of_maps = ["beams_", "observations_", "rows", "tiles_", "passes", "safeguards", "conditioned"];
        let counts = counters.iter().filter(|(name, _)| of_maps.iter().any(|prefix| name.starts_with(prefix)));
        serializer.collect_map(of_scans.into_iter().chain(counts))
    }
}
