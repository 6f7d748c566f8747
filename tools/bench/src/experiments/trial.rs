//! One contestant of an experiment: learned, asked, and what it cost.

use bhm_core::{
    geometry::Point,
    profile::{Capacities, Profile},
    settings::Settings,
};
use bhm_host::{
    ScanRecord,
    map::{self, AnyMap},
    supports::LearnedSupports,
};
use serde::Serialize;

use crate::{
    evaluation::{Held, TestPoints, Training, hold_out},
    metrics::Scores,
    progress, text,
};

/// What every contestant learns and is asked.
#[derive(Clone, Debug)]
pub struct BeamSplit {
    /// Learned: held-out beams are NaN.
    pub scans: Vec<ScanRecord>,
    /// Asked.
    pub test: TestPoints,
}

impl BeamSplit {
    /// These scans, a fraction of the beams held out.
    ///
    /// # Errors
    /// If that is no beam at all.
    pub fn of(scans: &[ScanRecord], fraction: f64, seed: u64) -> anyhow::Result<Self> {
        let split = hold_out(scans, Held::Beams, fraction, seed);
        anyhow::ensure!(!split.test.points_m.is_empty(), "nothing to predict: no beam was held out");
        let Training::Scans(scans) = split.training else { unreachable!("beams are held out of scans") };
        Ok(Self { scans, test: split.test })
    }
}

/// How a contestant did.
#[derive(Clone, Debug, Serialize)]
pub struct Trial {
    /// The contestant.
    pub name: String,
    /// Of its answers.
    #[serde(flatten)]
    pub scores: Scores,
    /// Rows learned: an observation is a row in each tile that holds its whole stencil.
    pub rows: u64,
    /// Passes over tiles.
    pub passes: u64,
    /// Supports a side that a point sees, on which the cost of a tile depends.
    pub stencil: usize,
    /// Tiles at the end.
    pub tiles: usize,
    /// Observations learned.
    pub observations: u64,
    /// Of those, learned as less uncertain than their scan's pose makes them: the stencil had no room for all of it.
    pub narrowed: u64,
}

/// Room enough that no contestant loses anything, whatever its spacing; tiles beyond the store wait in the archive.
const CAPACITIES: Capacities = Capacities { tiles: 256, points: 1 << 18, rows: 1 << 18, touched: 1 << 14 };

/// Learns the task's scans with these settings, the tile fitted to them, and answers its questions.
pub(super) fn take(
    task: &BeamSplit,
    name: impl Into<String>,
    settings: Settings,
    supports: Option<&'static LearnedSupports>,
) -> anyhow::Result<(Trial, Box<dyn AnyMap>)> {
    let name = name.into();
    let table = supports.map_or(bhm_core::support::SupportTable::EMPTY, LearnedSupports::table);
    let settings = settings.fitted(table);
    let profile = Profile { name: "", purpose: "", settings, capacities: CAPACITIES };
    let mut map = map::open_with(&profile, supports)?;
    let (mut rows, mut passes, mut observations, mut narrowed) = (0, 0, 0, 0);
    for scan in progress::over(task.scans.iter(), name.clone()) {
        if let Ok(report) = map.integrate(&scan.as_scan()) {
            let lost = report.rows_over_capacity + report.rows_refused + report.tiles_failed + report.tiles_lost;
            anyhow::ensure!(lost == 0, "{name}: a scan was learned in part only: {report:?}");
            rows += u64::from(report.rows);
            passes += u64::from(report.passes);
            observations += u64::from(report.points.used);
            narrowed += u64::from(report.points.narrowed);
        }
    }
    let logits: Vec<f32> =
        task.test.points_m.iter().map(|point_m| map.occupancy(&Point::from(*point_m)).logit()).collect();
    let scores = Scores::of(&logits, &task.test.occupied)?;
    let (resident, archived) = map.tile_counts();
    let (stencil, tiles) = (settings.stencil, resident + archived);
    Ok((Trial { name, scores, rows, passes, stencil, tiles, observations, narrowed }, map))
}

/// The marks as a table, the best NLL marked.
pub(super) fn table(marks: &[Trial]) -> String {
    table_with(&marks.iter().collect::<Vec<_>>(), &[])
}

/// The same with further columns: a heading, and a cell for each of the marks.
pub(super) fn table_with(marks: &[&Trial], further: &[(&str, Vec<String>)]) -> String {
    let best = marks.iter().map(|marks| marks.scores.nll).fold(f64::INFINITY, f64::min);
    let head = ["", "AUC", "NLL", "ECE", "rows", "tile passes", "stencil", "tiles"];
    let head = head.into_iter().chain(further.iter().map(|(name, _)| *name)).chain([""]);
    let mut rows: Vec<Vec<String>> = vec![head.map(str::to_owned).collect()];
    rows.extend(marks.iter().enumerate().map(|(line, Trial { name, scores, rows, passes, stencil, tiles, .. })| {
        let mut cells = vec![
            name.clone(),
            scores.auc.map_or("-".to_owned(), |auc| format!("{auc:.5}")),
            format!("{:.5}", scores.nll),
            format!("{:.5}", scores.ece),
            rows.to_string(),
            passes.to_string(),
            stencil.to_string(),
            tiles.to_string(),
        ];
        cells.extend(further.iter().map(|(_, column)| column.get(line).cloned().unwrap_or_default()));
        cells.push(if scores.nll == best { "best".to_owned() } else { String::new() });
        cells
    }));
    text::columns(&rows)
}
