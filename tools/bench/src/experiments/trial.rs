use bhm_core::{
    profile::{Capacities, Profile},
    settings::{Settings, SettingsError},
    support::SupportTable,
};
use bhm_firmware_sim::Counters;
use bhm_host::{
    map::{self, AnyMap},
    supports::LearnedSupports,
};
use serde::Serialize;

use crate::{
    cost,
    evaluation::BeamSplit,
    metrics::Scores,
    progress,
    text::{Report, columns},
};

/// One of the ways of mapping that an experiment compares.
#[derive(Clone, Debug)]
pub struct Variant {
    /// What tables call it.
    pub name: String,
    /// What it learns with; the tile is fitted to them.
    pub settings: Settings,
    /// Supports of their own that nodes of its map have.
    pub supports: Option<LearnedSupports>,
}

impl Variant {
    /// Without supports of its own.
    pub fn new(name: impl Into<String>, settings: Settings) -> Self {
        Self { name: name.into(), settings, supports: None }
    }

    /// With these.
    #[must_use]
    pub fn with_supports(self, supports: LearnedSupports) -> Self {
        Self { supports: Some(supports), ..self }
    }

    /// The settings with the narrowest stencil that they need.
    #[must_use]
    pub fn fitted(&self) -> Settings {
        self.settings.fitted(self.supports.as_ref().map_or(&SupportTable::EMPTY, LearnedSupports::table))
    }
}

/// What a variant learned, and how well it answers.
#[derive(Clone, Debug, Serialize)]
pub struct Trial {
    /// The variant.
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
    /// Scans shown.
    #[serde(skip)]
    pub scans: usize,
}

/// Room enough that no variant loses anything, whatever its spacing; tiles beyond the store wait in the archive.
const CAPACITIES: Capacities = Capacities { tiles: 256, observations: 1 << 18, rows: 1 << 18, touched: 1 << 14 };

impl Trial {
    /// Has the variant learn what is not held out, and answer what is.
    ///
    /// # Errors
    /// If no map can be made like this, or the map cannot learn all that it is shown.
    pub fn run(split: &BeamSplit, variant: &Variant) -> anyhow::Result<(Self, Box<dyn AnyMap>)> {
        let (name, settings) = (variant.name.clone(), variant.fitted());
        let profile = Profile { name: "", purpose: "", settings, capacities: CAPACITIES };
        let mut map = map::open_with(&profile, variant.supports.clone())?;
        let mut counters = Counters::NONE;
        for scan in progress::over(split.training.iter(), name.clone()) {
            if let Ok(report) = map.integrate(&scan.as_scan()) {
                counters.count_integrated(&report);
            }
        }
        let Counters { rows, passes, observations_used, observations_narrowed, .. } = counters;
        let Counters { rows_over_capacity, rows_refused, tiles_failed, tiles_lost, .. } = counters;
        let lost = rows_over_capacity + rows_refused + tiles_failed + tiles_lost;
        anyhow::ensure!(lost == 0, "{name}: the scans were learned in part only: {counters:?}");
        let scores = split.test.score(|point_m| map.occupancy(point_m))?;
        let (resident, archived) = map.tile_counts();
        let trial = Self {
            name,
            scores,
            rows,
            passes,
            stencil: settings.tile.stencil,
            tiles: resident + archived,
            observations: observations_used,
            narrowed: observations_narrowed,
            scans: split.training.len(),
        };
        Ok((trial, map))
    }

    /// Instructions of a scan, modelled from what was learned with these settings.
    ///
    /// # Errors
    /// Settings that contradict themselves.
    pub fn instructions_per_scan(&self, settings: &Settings) -> Result<f64, SettingsError> {
        Ok(cost::instructions(settings, self.rows, self.passes)? / self.scans as f64)
    }
}

/// What an experiment says of a trial beside what all of them say.
pub trait Columns: Serialize + Sized {
    /// Their headings.
    const HEADS: &'static [&'static str];

    /// Of a trial with these settings.
    ///
    /// # Errors
    /// Settings that contradict themselves.
    fn of(trial: &Trial, settings: &Settings) -> Result<Self, SettingsError>;

    /// A cell for each heading.
    fn cells(&self) -> Vec<String>;
}

/// Nothing more.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct NoColumns {}

impl Columns for NoColumns {
    const HEADS: &'static [&'static str] = &[];

    fn of(_trial: &Trial, _settings: &Settings) -> Result<Self, SettingsError> {
        Ok(Self {})
    }

    fn cells(&self) -> Vec<String> {
        Vec::new()
    }
}

#[derive(Clone, Debug, Serialize)]
struct Row<C> {
    #[serde(flatten)]
    trial: Trial,
    #[serde(flatten)]
    more: C,
}

/// A row for each variant.
#[derive(Clone, Debug, Serialize)]
#[serde(transparent)]
pub struct Table<C>(Vec<Row<C>>);

impl<C: Columns> Table<C> {
    /// Of variants that all learn the same and are asked the same.
    ///
    /// # Errors
    /// As [`Trial::run`].
    pub fn run(split: &BeamSplit, variants: &[Variant]) -> anyhow::Result<Self> {
        let row = |variant: &Variant| {
            let trial = Trial::run(split, variant)?.0;
            Ok(Row { more: C::of(&trial, &variant.fitted())?, trial })
        };
        variants.iter().map(row).collect::<anyhow::Result<_>>().map(Self)
    }
}

impl Table<NoColumns> {
    /// Of trials that were run one by one.
    #[must_use]
    pub fn of(trials: Vec<Trial>) -> Self {
        Self(trials.into_iter().map(|trial| Row { trial, more: NoColumns {} }).collect())
    }
}

impl<C: Columns> Report for Table<C> {
    /// The best NLL is marked.
    fn text(&self) -> String {
        let best = self.0.iter().map(|row| row.trial.scores.nll).fold(f64::INFINITY, f64::min);
        let head = ["", "AUC", "NLL", "ECE", "rows", "tile passes", "stencil", "tiles"];
        let head = head.iter().chain(C::HEADS).chain(&[""]);
        let mut rows: Vec<Vec<String>> = vec![head.map(|head| (*head).to_owned()).collect()];
        rows.extend(self.0.iter().map(|Row { trial, more }| {
            let Trial { name, scores, rows, passes, stencil, tiles, .. } = trial;
            let mut cells = vec![name.clone()];
            cells.extend(scores.cells());
            cells.extend([rows.to_string(), passes.to_string(), stencil.to_string(), tiles.to_string()]);
            cells.extend(more.cells());
            cells.push(if scores.nll == best { "best".to_owned() } else { String::new() });
            cells
        }));
        columns(&rows)
    }
}
