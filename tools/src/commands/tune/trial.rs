//! One candidate: learned, asked, and what it cost.

use bhm_bench::{
    cost,
    evaluation::{BeamSplit, Timing},
    metrics::Scores,
    search::{Judged, Worth},
};
use bhm_firmware_sim::Counters;
use serde::Serialize;

use super::By;
use crate::{options::Effective, reports::Learned};

/// What came of a candidate.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum TrialResult {
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

/// What came of a candidate, and by what it is judged.
pub(super) struct Trial {
    pub(super) result: TrialResult,
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
    /// Learns and answers with these options, or says why that cannot be.
    pub(super) fn run(options: Result<Effective, String>, by: By, split: &BeamSplit, name: String) -> Self {
        let learned = options.map_err(TrialResult::Refused).and_then(|options| learn(&options, split, name));
        Self { result: learned.map_or_else(|unscored| unscored, TrialResult::Scored), by }
    }

    pub(super) fn scored(&self) -> Option<&Scored> {
        match &self.result {
            TrialResult::Scored(scored) => Some(scored),
            TrialResult::Refused(_) | TrialResult::Failed(_) => None,
        }
    }
}

fn learn(options: &Effective, split: &BeamSplit, name: String) -> Result<Box<Scored>, TrialResult> {
    let BeamSplit { training: scans, test: points, held, .. } = split;
    let mut map = options.open().map_err(|error| TrialResult::Refused(error.to_string()))?;
    let mut learned = Learned::default();
    learned.learn_all(&mut *map, scans, name);
    learned.leave_out(*held);
    let Counters { rows, passes, tiles_failed, .. } = learned.counters;
    // The rows of an update that failed have no objective, and what it would have learned is missing.
    if tiles_failed > 0 {
        return Err(TrialResult::Failed(format!("{tiles_failed} updates of a tile failed")));
    }
    if rows == 0 {
        return Err(TrialResult::Failed("nothing could be learned".to_owned()));
    }
    let scores = points.score(|point_m| map.occupancy(point_m));
    let scores = scores.map_err(|error| TrialResult::Failed(error.to_string()))?;
    let work = cost::instructions(&options.profile.settings, rows, passes);
    let work = work.map_err(|error| TrialResult::Refused(error.to_string()))?;
    let (resident, archived) = map.tile_counts();
    let tiles = resident + archived;
    Ok(Box::new(Scored {
        scores,
        objective_per_row: learned.objective / rows as f64,
        rows,
        work,
        timing: Timing::of(learned.durations.clone()),
        tiles,
        map_bytes: tiles * map.bytes().1,
        learned,
    }))
}
