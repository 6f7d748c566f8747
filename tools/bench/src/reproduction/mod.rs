//! The paper's table and figures, measured here: a folder with one page, its pictures, and every outcome.

mod curves;
mod maps;
mod page;
mod passes;
mod per_tile;
mod scaling;
mod tables;

use std::path::PathBuf;

use serde::Serialize;
use tracing::info;

use self::page::Page;
use crate::{
    contest::{Contest, Contestant, Dataset, Ending, Outcome, Results, RunOptions, hold, load, rounds},
    evaluation::Held,
    text::table,
};

/// What is asked for.
#[derive(Clone, Debug)]
pub struct Reproduce {
    /// Dataset 3, the log of the Intel Research Lab; without it the report has the simulated ones alone.
    pub log: Option<PathBuf>,
    /// Folder of the report.
    pub output: PathBuf,
    /// A small report for a first look: few scans, short deadlines.
    pub quick: bool,
    /// Processor time that a contestant may learn on a task, seconds; `None` for what is usual.
    pub deadline_s: Option<f64>,
    /// Seed of the simulated worlds, of what is held out, and of contestants' dice.
    pub seed: u64,
    /// Seeds over which those are repeated who finish a task within a few seconds; `None` for what is usual.
    pub seeds: Option<u64>,
    /// How many tasks run at once.
    pub jobs: usize,
    /// The program `bhm`, of which an update's instructions are counted; `None` leaves the count out.
    pub counted: Option<PathBuf>,
}

/// How much of everything a report has.
struct Extent {
    /// For a scene and for a log.
    deadline_s: [f64; 2],
    seeds: u64,
    /// Every how many scans of a scene and of a log are used.
    every: [usize; 2],
    held: &'static [Held],
    /// Who finishes a task in less time is repeated under further seeds, seconds.
    repeated_s: f64,
    checkpoints: usize,
    /// Sizes in each direction of the table of run times.
    scaling_steps: usize,
}

const FULL: Extent = Extent {
    deadline_s: [40.0, 100.0],
    seeds: 2,
    every: [5, 1],
    held: &[Held::Points, Held::Beams, Held::Scans],
    repeated_s: 4.0,
    checkpoints: 20,
    scaling_steps: 4,
};

const QUICK: Extent = Extent {
    deadline_s: [1.0, 1.0],
    seeds: 1,
    every: [25, 30],
    held: &[Held::Points, Held::Beams, Held::Scans],
    repeated_s: 0.0,
    checkpoints: 5,
    scaling_steps: 2,
};

/// The part that the paper holds out.
const FRACTION: f64 = 0.1;

/// Our map besides the default of every contestant.
const FINE: &str = "ours:0.25";
const COARSE: &str = "ours:0.5";

/// What the paper calls BHM at a size that a full matrix allows, besides the published one.
const SMALL_DENSE: &str = "dense-bhm:2";

/// What came of it.
#[derive(Serialize)]
pub struct Reproduced {
    report: PathBuf,
    pictures: Vec<PathBuf>,
    outcomes: usize,
    stopped: usize,
    failed: usize,
}

impl Reproduce {
    /// Measures everything that is not kept already, and writes the report.
    ///
    /// # Errors
    /// If the log cannot be read, or a file cannot be written.
    pub fn run(&self) -> anyhow::Result<Reproduced> {
        let extent = if self.quick { &QUICK } else { &FULL };
        let deadlines_s = extent.deadline_s.map(|deadline_s| self.deadline_s.unwrap_or(deadline_s));
        let mut page = Page::into(&self.output)?;
        let mut results = Results::open(&self.output.join("results.jsonl"))?;
        let outcomes = self.contest(extent, &mut results)?;

        page.heading(self.log.is_some(), self.quick, &extent.every, &deadlines_s);
        tables::write(&mut page, &outcomes, self.log.is_some());
        curves::scores(&mut page, &outcomes)?;
        let counting = self.counted.as_ref().map(|bhm| per_tile::start(bhm, self.log.as_deref(), extent, &self.output));
        maps::write(&mut page, &self.datasets(extent)?, self.seed, deadlines_s)?;
        curves::run_times(&mut page, &outcomes)?;
        if let Some(counting) = counting {
            per_tile::write(&mut page, counting)?;
        }
        curves::unseen(&mut page, &outcomes)?;
        passes::write(&mut page, self, extent, &mut results)?;
        scaling::write(&mut page, extent, self.seed, &mut results)?;

        let (report, pictures) = page.finish()?;
        let failed = outcomes.iter().filter(|o| matches!(o.ending, Ending::Failed { .. })).count();
        let stopped = outcomes.iter().filter(|outcome| !outcome.finished()).count() - failed;
        Ok(Reproduced { report, pictures, outcomes: outcomes.len(), stopped, failed })
    }

    /// The paper's datasets, by number.
    fn datasets(&self, extent: &Extent) -> anyhow::Result<Vec<Dataset>> {
        let mut datasets = vec![Dataset::parse("traffic")?, Dataset::parse("outdoor")?];
        for (dataset, name) in datasets.iter_mut().zip(["1 (traffic)", "2 (outdoor site)"]) {
            (dataset.name, dataset.every) = (name.to_owned(), extent.every[0]);
        }
        if let Some(log) = &self.log {
            let dataset = Dataset::parse(&log.to_string_lossy())?;
            datasets.push(Dataset { name: "3 (Intel)".to_owned(), every: extent.every[1], ..dataset });
        }
        Ok(datasets)
    }

    /// Everyone in their default size, and further sizes of ours and of the full matrix; for a first look, coarser ones.
    fn contestants(&self) -> anyhow::Result<Vec<Contestant>> {
        let mut contestants: Vec<Contestant> = vec![FINE.parse()?];
        contestants.extend(Contestant::all());
        if self.quick {
            // What is not ours costs more than a first look may take; the full matrix with the cube of its size.
            let factor = |name: &str| match name {
                "ours" => 1.0,
                "dense-bhm" => 16.0,
                _ => 4.0,
            };
            contestants = contestants.into_iter().map(|who| who.coarser(factor(who.entry.name))).collect();
        } else {
            contestants.push(SMALL_DENSE.parse()?);
        }
        Ok(contestants)
    }

    /// Everyone on everything; then further seeds for those who are quick.
    fn contest(&self, extent: &Extent, results: &mut Results) -> anyhow::Result<Vec<Outcome>> {
        let contestants = self.contestants()?;
        let datasets = self.datasets(extent)?;
        let seeds = self.seeds.unwrap_or(extent.seeds);
        let mut outcomes = Vec::new();
        for seed in self.seed..self.seed.saturating_add(seeds) {
            // Simulated worlds are driven again under each seed, recorded ones divided anew.
            let loaded = load(&datasets, &[seed])?;
            for held in extent.held {
                let entrants = if seed == self.seed {
                    contestants.clone()
                } else {
                    let quick = |who: &Contestant| is_quick(&outcomes, who, extent.repeated_s);
                    contestants.iter().copied().filter(quick).collect()
                };
                info!("seed {seed}, {held:?} held out: {} contestants", entrants.len());
                let (logs, scenes): (Vec<_>, Vec<_>) =
                    rounds(&loaded, &[*held], FRACTION)?.into_iter().partition(|round| round.loaded.world.is_none());
                for (rounds, deadline_s) in [scenes, logs].into_iter().zip(extent.deadline_s) {
                    let deadline_s = Some(self.deadline_s.unwrap_or(deadline_s));
                    let options = RunOptions { deadline_s, checkpoints: extent.checkpoints };
                    let jobs = self.jobs;
                    outcomes.extend(hold(&Contest { rounds, contestants: entrants.clone(), options, jobs }, results)?);
                }
            }
        }
        Ok(outcomes)
    }
}

impl Reproduced {
    /// As a table.
    #[must_use]
    pub fn text(&self) -> String {
        let Self { report, pictures, outcomes, stopped, failed } = self;
        table(&[
            ("report", report.display().to_string()),
            ("pictures", pictures.len().to_string()),
            ("outcomes", format!("{outcomes}, {stopped} of them stopped at the deadline, {failed} failed")),
        ])
    }
}

/// Whether a contestant finished every task so far within a few seconds.
fn is_quick(outcomes: &[Outcome], who: &Contestant, within_s: f64) -> bool {
    let name = who.to_string();
    let spent_s = |outcome: &Outcome| outcome.update_ms.iter().map(|ms| f64::from(*ms)).sum::<f64>() / 1e3;
    outcomes.iter().filter(|o| o.contestant == name).all(|o| o.finished() && spent_s(o) < within_s)
}
