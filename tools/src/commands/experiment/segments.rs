use std::path::PathBuf;

use bhm_core::{
    beam::BeamChoice,
    settings::{Settings, SettingsError},
};
use clap::Args;
use serde::Serialize;

use super::{
    cost::{self, Load, where_falls_to},
    trial::{Exam, Marks, table_with, take},
};
use crate::{options::MapOptions, output::Output};

/// What line segments bring (eqs. 11 and 12) against points on the free part of a beam, at equal cost
///
/// Every segment length of --lengths is tried against points at three densities: the one that is configured, the one that
/// gives as many rows, and the one that takes as many instructions. Held-out beams judge.
#[derive(Args, Debug)]
pub(crate) struct Segments {
    /// Scan log (CARMEN), plain or gzip
    #[arg(required_unless_present = "print_config")]
    log: Option<PathBuf>,
    /// Use every n-th scan
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), value_name = "N")]
    every: u32,
    /// Seed of what is held out
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Longest segments, in spacings; each line of the lattice cuts once more
    #[arg(long, value_delimiter = ',', default_value = "0.5,1,2,4", value_name = "LIST")]
    lengths: Vec<f32>,
    #[command(flatten)]
    map: MapOptions,
}

#[derive(Serialize)]
struct Contestant {
    #[serde(flatten)]
    marks: Marks,
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
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.map.effective()? else { return Ok(()) };
        let Some(log) = &self.log else { return Ok(()) };
        let exam = Exam::of_log(log, &options, self.every as usize, 0.1, self.seed)?;
        let base = Settings { beam: BeamChoice::PointSamples, ..options.profile.settings };
        let every = exam.scans.len().div_ceil(SCANS_COUNTED);
        let load = |settings: &Settings| Load::of(exam.scans.iter().step_by(every), settings);
        let points = |free_spacing_m: f32| Settings { free_spacing_m, ..base };
        let mut contestants = vec![Contestant::learned(&exam, "points, as configured".to_owned(), base)?];
        for length in &self.lengths {
            let segments = Settings { beam: BeamChoice::LineSegments, segment_length: *length, ..base };
            contestants.push(Contestant::learned(&exam, format!("segments of {length}"), segments)?);
            let goal = load(&segments)?;
            let as_many_rows = where_falls_to(goal.rows as f64, |m| Ok(load(&points(m))?.rows as f64))?;
            let equal_instructions = goal.instructions(&segments)?;
            let as_dear = where_falls_to(equal_instructions, |m| {
                let settings = points(m);
                load(&settings)?.instructions(&settings)
            })?;
            contestants.push(Contestant::learned(&exam, "points, equal rows".to_owned(), points(as_many_rows))?);
            contestants.push(Contestant::learned(&exam, "points, equal instructions".to_owned(), points(as_dear))?);
        }
        output.result(&contestants, || Contestant::table(&contestants))
    }
}

impl Contestant {
    fn learned(exam: &Exam, name: String, settings: Settings) -> anyhow::Result<Self> {
        let (marks, _) = take(exam, name, settings, None)?;
        let segments = settings.beam == BeamChoice::LineSegments;
        let instructions: Result<f64, SettingsError> = cost::instructions(&settings, marks.rows, marks.passes);
        Ok(Self {
            segment_length: segments.then_some(settings.segment_length),
            free_spacing_m: (!segments).then_some(settings.free_spacing_m),
            instructions_per_scan: instructions? / exam.scans.len() as f64,
            marks,
        })
    }

    fn table(contestants: &[Self]) -> String {
        let marks: Vec<&Marks> = contestants.iter().map(|contestant| &contestant.marks).collect();
        let cell = |of: &dyn Fn(&Self) -> String| contestants.iter().map(of).collect();
        let spacing = |one: &Self| one.free_spacing_m.map_or("-".to_owned(), |spacing_m| format!("{spacing_m:.3}"));
        let instructions = |one: &Self| format!("{:.2}", one.instructions_per_scan / 1e6);
        table_with(&marks, &[("free spacing m", cell(&spacing)), ("M instr/scan", cell(&instructions))])
    }
}
