//! One candidate: learned, asked, and what it cost.

use std::time::Instant;

use bhm_core::{geometry::Point, mapper::IntegrateReport, profile::Profile};
use bhm_host::{ScanRecord, map};
use bhm_tools::{
    evaluation::{TestPoints, Timing},
    metrics::Scores,
    search::{Judged, Worth},
};
use serde::Serialize;

use super::By;
use crate::{options::Effective, progress, reports::Learned};

/// Instructions that a tile and a row take in a pass, with tiles of 144 supports in a band of 40 and a stencil of 4: what
/// `cargo bench -p bhm-tools --bench instructions` finds, there within 2 % of every scan of a recorded log.
const TILE_PASS: f64 = 355e3;
const ROW_PASS: f64 = 3.9e3;

/// What a candidate learns, and what it is asked.
#[derive(Clone, Copy)]
pub(super) struct Exam<'a> {
    pub(super) scans: &'a [ScanRecord],
    /// Beams of these scans that were replaced by NaN.
    pub(super) beams_removed: usize,
    pub(super) points: &'a TestPoints,
}

/// What came of a candidate.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Outcome {
    /// No map can be made like this.
    Refused(String),
    /// A map was made, but it cannot be judged.
    Failed(String),
    /// Learned and asked.
    Scored(Box<Scored>),
}

/// What a map predicted, and what it cost.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Scored {
    #[serde(flatten)]
    pub(super) scores: Scores,
    /// The sum of every update's objective over the rows learned, nats.
    pub(super) objective_per_row: f64,
    /// An observation is a row in each tile that holds its whole stencil.
    pub(super) rows: u64,
    /// Instructions, estimated from tiles, rows and passes: equal on every machine.
    pub(super) work: f64,
    #[serde(flatten)]
    pub(super) timing: Timing,
    pub(super) tiles: usize,
    /// Of these tiles.
    pub(super) map_bytes: usize,
    pub(super) learned: Learned,
}

/// A candidate's outcome and what it is worth.
pub(super) struct Trial {
    pub(super) outcome: Outcome,
    by: By,
}

impl Judged for Trial {
    fn worth(&self) -> Option<Worth> {
        let scored = self.scored()?;
        let score = match self.by {
            By::Nll => scored.scores.nll,
            By::Objective => -scored.objective_per_row,
        };
        Some(Worth { score, cost: scored.work })
    }
}

impl Trial {
    /// Takes the exam with these options, or says why that cannot be.
    pub(super) fn run(options: Result<Effective, String>, by: By, exam: Exam<'_>, name: String) -> Self {
        Self { outcome: options.map_or_else(Outcome::Refused, |options| learn(&options, exam, name)), by }
    }

    pub(super) fn scored(&self) -> Option<&Scored> {
        match &self.outcome {
            Outcome::Scored(scored) => Some(scored),
            Outcome::Refused(_) | Outcome::Failed(_) => None,
        }
    }
}

fn learn(options: &Effective, exam: Exam<'_>, name: String) -> Outcome {
    let Exam { scans, beams_removed, points } = exam;
    let (mut map, shape) = match options.open().and_then(|map| Ok((map, map::shape(&options.profile)?))) {
        Ok(opened) => opened,
        Err(error) => return Outcome::Refused(error.to_string()),
    };
    let (mut learned, mut durations) = (Learned::default(), Vec::with_capacity(scans.len()));
    let (mut objective, mut rows, mut work) = (0.0, 0, 0.0);
    for scan in progress::over(scans.iter(), name) {
        let start = Instant::now();
        let outcome = map.integrate(&scan.as_scan());
        durations.push(start.elapsed());
        if let Ok(report) = &outcome {
            objective += f64::from(report.objective);
            rows += u64::from(report.rows);
            work += work_of(report, &options.profile, shape);
        }
        learned.add(&outcome);
    }
    // They were NaN to the map, but they are not the log's fault.
    learned.beams_not_a_number = learned.beams_not_a_number.saturating_sub(beams_removed as u64);
    // The rows of an update that failed have no objective, and what it would have learned is missing.
    if learned.tiles_failed > 0 {
        return Outcome::Failed(format!("{} updates of a tile failed", learned.tiles_failed));
    }
    if rows == 0 {
        return Outcome::Failed("nothing could be learned".to_owned());
    }
    let logits: Vec<f32> =
        points.points_m.iter().map(|point_m| map.occupancy(&Point::from(*point_m)).logit()).collect();
    let scores = match Scores::of(&logits, &points.occupied) {
        Ok(scores) => scores,
        Err(error) => return Outcome::Failed(error.to_string()),
    };
    let (resident, archived) = map.tile_counts();
    let tiles = resident + archived;
    Outcome::Scored(Box::new(Scored {
        scores,
        objective_per_row: objective / rows as f64,
        rows,
        work,
        timing: Timing::of(durations),
        tiles,
        map_bytes: tiles * map.bytes().1,
        learned,
    }))
}

/// Instructions that a scan takes. Factor and selected inverse of `M` supports in a band of `B` are of the order of `M·B²`,
/// and a row of `stencil²` entries adds as many products as pairs of them: so do the measured figures scale.
fn work_of(report: &IntegrateReport, profile: &Profile, (supports, band): (usize, usize)) -> f64 {
    let tile_pass = TILE_PASS * (supports * band * band) as f64 / f64::from(144 * 40 * 40);
    let row_pass = ROW_PASS * (profile.settings.stencil as f64 / 4.0).powi(4);
    f64::from(report.passes) * tile_pass + f64::from(report.rows) * f64::from(profile.settings.passes) * row_pass
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::profile;

    #[test]
    fn the_measured_scan_costs_what_was_measured() {
        // The README's average: 20.3 million instructions at three passes.
        let report = IntegrateReport { passes: 3 * 8, rows: 1_000, ..Default::default() };
        assert_eq!(work_of(&report, &profile::COMPACT, (144, 40)), 24.0 * 355e3 + 3_000.0 * 3.9e3);
        let wide = profile::COMPACT.settings.with_kernel(bhm_core::kernel::KernelChoice::SquaredExponential);
        let wide = Profile { settings: wide, ..profile::COMPACT };
        let times = work_of(&report, &wide, (196, 76)) / work_of(&report, &profile::COMPACT, (144, 40));
        assert!((4.8..5.2).contains(&times), "{times}");
    }
}
