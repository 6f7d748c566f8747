use bhm_core::{
    beam::Observation,
    geometry::Point,
    mapper::IntegrateReport,
    profile::{Capacities, Profile},
    scan::ScanRejected,
};
use bhm_host::map::{self, AnyMap};

use super::{Baseline, Entry, Failed, Prediction, Setup, Size};
use crate::evaluation::TrainingScan;

pub(super) const ENTRIES: &[Entry] = &[Entry {
    name: "ours",
    summary: "this project's Bayesian Hilbert map: banded tiles, full covariance, f32, Gaussian variational update",
    source: "Senanayake and Ramos 2018; Opper and Archambeau 2009 for the update",
    size: Size::Metres(0.5),
    open: |setup| Ok(Box::new(Ours::new(setup)?)),
}];

/// Labelled points of a scan beyond which they are learned in pieces.
const CAPACITIES: Capacities = Capacities { tiles: 1_024, observations: 1 << 16, rows: 1 << 16, touched: 1 << 13 };

/// The map every other command makes, through the interface every program has.
pub(super) struct Ours {
    map: Box<dyn AnyMap>,
    work: [u64; 2],
}

impl Ours {
    pub(super) fn new(setup: &Setup) -> Result<Self, Failed> {
        let mut settings = setup.profile.settings;
        settings.spacing_m = setup.size;
        settings.limits = setup.limits;
        let profile = Profile { settings, capacities: CAPACITIES, ..setup.profile };
        let map = map::open(&profile).map_err(|error| Failed(error.to_string()))?;
        Ok(Self { map, work: [0; 2] })
    }

    fn count(&mut self, outcome: Result<IntegrateReport, ScanRejected>) -> Result<(), Failed> {
        let report = outcome.map_err(|rejected| Failed(rejected.to_string()))?;
        let lost = report.rows_over_capacity
            + report.rows_refused
            + report.tiles_failed
            + report.tiles_lost
            + report.observations.over_capacity
            + report.beams.over_capacity;
        let passes = u64::from(self.map.settings().passes);
        self.work = [self.work[0] + u64::from(report.passes), self.work[1] + u64::from(report.rows) * passes];
        if lost == 0 { Ok(()) } else { Err(Failed(format!("a scan was learned in part only: {report:?}"))) }
    }
}

impl Baseline for Ours {
    fn description(&self) -> String {
        let settings = self.map.settings();
        format!("{} m spacing, {} passes, {}", settings.spacing_m, settings.passes, settings.kernel.name())
    }

    fn integrate(&mut self, shown: &TrainingScan) -> Result<(), Failed> {
        if let Some(scan) = shown.beams() {
            let outcome = self.map.integrate(&scan.as_scan());
            return self.count(outcome);
        }
        let observations: Vec<_> =
            shown.points().map(|(point_m, occupied)| Observation::at_point(Point::from(point_m), occupied)).collect();
        for observations in observations.chunks(CAPACITIES.observations) {
            let outcome = self.map.integrate_observations(observations);
            self.count(outcome)?;
        }
        Ok(())
    }

    fn predict(&mut self, points_m: &[[f32; 2]]) -> Vec<Prediction> {
        let ask = |point_m: &[f32; 2]| {
            let occupancy = self.map.occupancy(&Point::from(*point_m));
            Prediction { logit: f64::from(occupancy.logit()), variance: Some(f64::from(occupancy.variance)) }
        };
        points_m.iter().map(ask).collect()
    }

    fn memory_bytes(&self) -> usize {
        // What it works in does not grow with the log; what it knows is its tiles.
        let (resident, archived) = self.map.tile_counts();
        let (_, tile_bytes) = self.map.bytes();
        (resident + archived) * tile_bytes
    }

    fn work(&self) -> Option<[u64; 2]> {
        Some(self.work)
    }
}
