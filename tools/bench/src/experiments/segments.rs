//! What line segments bring (eqs. 11 and 12) against points on the free part of a beam, at equal cost.

use bhm_core::{
    beam::BeamChoice,
    settings::{Settings, SettingsError},
};
use serde::Serialize;

use super::trial::{BeamSplit, Trial, table_with, take};
use crate::cost::{self, Load, where_falls_to};

/// Segments that are tried against points.
#[derive(Clone, Debug)]
pub struct Segments {
    /// Longest segments, in spacings; each line of the lattice cuts once more.
    pub lengths: Vec<f32>,
}

/// What came of it.
#[derive(Serialize)]
#[serde(transparent)]
pub struct Report(Vec<Contestant>);

#[derive(Serialize)]
struct Contestant {
    #[serde(flatten)]
    marks: Trial,
    /// In spacings; null for points.
    segment_length: Option<f32>,
    /// Null for segments.
    free_spacing_m: Option<f32>,
    /// Modelled from what was learned.
    instructions_per_scan: f64,
}

/// Scans that a density is found by: it is that of a mean, and the final table says what came of it.
const SCANS_COUNTED: usize = 100;

impl Segments {
    /// Learns and asks each of them, and points at equal cost.
    ///
    /// # Errors
    /// If a contestant cannot learn all that it is shown.
    pub fn run(&self, task: &BeamSplit, base: &Settings) -> anyhow::Result<Report> {
        let base = Settings { beam: BeamChoice::PointSamples, ..*base };
        let every = task.scans.len().div_ceil(SCANS_COUNTED);
        let load = |settings: &Settings| Load::of(task.scans.iter().step_by(every), settings);
        let points = |free_spacing_m: f32| Settings { free_spacing_m, ..base };
        let mut contestants = vec![Contestant::learned(task, "points, as configured".to_owned(), base)?];
        for length in &self.lengths {
            let segments = Settings { beam: BeamChoice::LineSegments, segment_length: *length, ..base };
            contestants.push(Contestant::learned(task, format!("segments of {length}"), segments)?);
            let goal = load(&segments)?;
            let as_many_rows = where_falls_to(goal.rows as f64, |m| Ok(load(&points(m))?.rows as f64))?;
            let equal_instructions = goal.instructions(&segments)?;
            let as_dear = where_falls_to(equal_instructions, |m| {
                let settings = points(m);
                load(&settings)?.instructions(&settings)
            })?;
            contestants.push(Contestant::learned(task, "points, equal rows".to_owned(), points(as_many_rows))?);
            contestants.push(Contestant::learned(task, "points, equal instructions".to_owned(), points(as_dear))?);
        }
        Ok(Report(contestants))
    }
}

impl Contestant {
    fn learned(task: &BeamSplit, name: String, settings: Settings) -> anyhow::Result<Self> {
        let (marks, _) = take(task, name, settings, None)?;
        let segments = settings.beam == BeamChoice::LineSegments;
        let instructions: Result<f64, SettingsError> = cost::instructions(&settings, marks.rows, marks.passes);
        Ok(Self {
            segment_length: segments.then_some(settings.segment_length),
            free_spacing_m: (!segments).then_some(settings.free_spacing_m),
            instructions_per_scan: instructions? / task.scans.len() as f64,
            marks,
        })
    }
}

impl Report {
    /// As a table.
    #[must_use]
    pub fn text(&self) -> String {
        let marks: Vec<&Trial> = self.0.iter().map(|contestant| &contestant.marks).collect();
        let cell = |of: &dyn Fn(&Contestant) -> String| self.0.iter().map(of).collect();
        let spacing =
            |one: &Contestant| one.free_spacing_m.map_or("-".to_owned(), |spacing_m| format!("{spacing_m:.3}"));
        let instructions = |one: &Contestant| format!("{:.2}", one.instructions_per_scan / 1e6);
        table_with(&marks, &[("free spacing m", cell(&spacing)), ("M instr/scan", cell(&instructions))])
    }
}
