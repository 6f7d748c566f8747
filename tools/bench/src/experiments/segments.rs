//! What line segments bring (eqs. 11 and 12) against points on the free part of a beam, at equal cost.

use bhm_core::{
    beam::{AnyBeamRule, LineSegments, PointSamples},
    settings::{Settings, SettingsError},
};
use serde::Serialize;

use super::trial::{Columns, Table, Trial, Variant};
use crate::{
    cost::{Load, where_falls_to},
    evaluation::BeamSplit,
};

/// What the free part of a beam is learned as, and what it costs.
#[derive(Serialize)]
pub struct BeamColumns {
    /// In spacings; null for points.
    segment_length: Option<f32>,
    /// Null for segments.
    free_spacing_m: Option<f32>,
    /// Modelled from what was learned.
    instructions_per_scan: f64,
}

/// Scans that a density is found by: it is that of a mean, and the final table says what came of it.
const SCANS_COUNTED: usize = 100;

/// Learns and asks segments of these lengths at most, in spacings, and points at equal cost; each line of the lattice cuts a
/// segment once more.
///
/// # Errors
/// If a variant cannot learn all that it is shown.
pub fn compare(split: &BeamSplit, base: &Settings, lengths: &[f32]) -> anyhow::Result<Table<BeamColumns>> {
    let (as_points, as_segments) = match base.beam {
        AnyBeamRule::PointSamples(rule) => (rule, LineSegments { gap_m: rule.gap_m, ..LineSegments::DEFAULT }),
        AnyBeamRule::LineSegments(rule) => (PointSamples { gap_m: rule.gap_m, ..PointSamples::DEFAULT }, rule),
    };
    let every = split.training.len().div_ceil(SCANS_COUNTED);
    let load = |settings: &Settings| Load::of(split.training.iter().step_by(every), settings);
    let points = |free_spacing_m: f32| {
        let beam = AnyBeamRule::PointSamples(PointSamples { free_spacing_m, ..as_points });
        Settings { beam, ..*base }
    };
    let mut variants = vec![Variant::new("points, as configured", points(as_points.free_spacing_m))];
    for length in lengths {
        let beam = AnyBeamRule::LineSegments(LineSegments { length: *length, ..as_segments });
        let segments = Settings { beam, ..*base };
        variants.push(Variant::new(format!("segments of {length}"), segments));
        let goal = load(&segments)?;
        let as_many_rows = where_falls_to(goal.rows as f64, |m| Ok(load(&points(m))?.rows as f64))?;
        let equal_instructions = goal.instructions(&segments)?;
        let as_dear = where_falls_to(equal_instructions, |m| {
            let settings = points(m);
            load(&settings)?.instructions(&settings)
        })?;
        variants.push(Variant::new("points, equal rows", points(as_many_rows)));
        variants.push(Variant::new("points, equal instructions", points(as_dear)));
    }
    Table::run(split, &variants)
}

impl Columns for BeamColumns {
    const HEADS: &'static [&'static str] = &["free spacing m", "M instr/scan"];

    fn of(trial: &Trial, settings: &Settings) -> Result<Self, SettingsError> {
        let (segment_length, free_spacing_m) = match settings.beam {
            AnyBeamRule::LineSegments(rule) => (Some(rule.length), None),
            AnyBeamRule::PointSamples(rule) => (None, Some(rule.free_spacing_m)),
        };
        Ok(Self { segment_length, free_spacing_m, instructions_per_scan: trial.instructions_per_scan(settings)? })
    }

    fn cells(&self) -> Vec<String> {
        let spacing = self.free_spacing_m.map_or("-".to_owned(), |spacing_m| format!("{spacing_m:.3}"));
        vec![spacing, format!("{:.2}", self.instructions_per_scan / 1e6)]
    }
}
