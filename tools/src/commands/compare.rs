//! Contestants on datasets: one table for each dataset and thing held out.

use std::path::PathBuf;

use bhm_bench::{
    baselines,
    contest::{
        Contest, Contestant, Dataset, Origin, Outcome, Results, RunOptions, Standings, hold, load, rounds, rows,
        standings,
    },
    evaluation::Held,
};
use bhm_core::profile;
use clap::Args;
use serde::Serialize;

use crate::{
    options::{fraction, held, seconds},
    output::{Output, Usage, columns, markdown},
};

/// Compare ways of mapping: the same data, the same questions, the same scores
///
/// Contestants are NAME or NAME:SIZE; --list says what there is. Lengths are for buildings and twice as long on sites. A dataset
/// is a simulated scene (building, traffic, outdoor) or a log's path, either with @PROFILE after it.
#[derive(Args, Debug)]
pub(crate) struct Compare {
    /// Say what contestants there are, and end
    #[arg(long)]
    list: bool,
    /// Who takes part; everyone in their default size if none is named
    #[arg(short, long = "contestant", value_name = "NAME[:SIZE]", value_delimiter = ',')]
    contestants: Vec<Contestant>,
    /// What is mapped
    #[arg(short, long = "dataset", value_name = "SCENE|LOG", value_delimiter = ',')]
    datasets: Vec<String>,
    /// Labelled points to learn (CSV: scan,x,y,label), plain or gzip: a dataset that is already divided
    #[arg(long, value_name = "CSV", requires = "test")]
    train: Option<PathBuf>,
    /// Labelled points to predict
    #[arg(long, value_name = "CSV", requires = "train")]
    test: Option<PathBuf>,
    /// The log that those points are of, for methods that cast rays: scan n is its n-th, from 0
    #[arg(long, value_name = "LOG", requires = "train")]
    log: Option<PathBuf>,
    /// What is held out, each in turn
    #[arg(long = "holdout", value_parser = held(), value_delimiter = ',', default_values_t = [Held::Beams])]
    held: Vec<Held>,
    /// The part that is held out, above 0 and below 1
    #[arg(long, default_value_t = 0.1, value_parser = fraction(), value_name = "PART")]
    fraction: f64,
    /// Seed of what is simulated and held out, and of contestants' dice
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How many seeds, from that one on: each is a task of its own
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100), value_name = "N")]
    seeds: u64,
    /// Use every n-th scan
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), value_name = "N")]
    every: u32,
    /// Processor time that a contestant may learn on a task, seconds; then it is stopped, and not ranked
    #[arg(long, value_name = "S", value_parser = seconds())]
    deadline: Option<f64>,
    /// How many tasks run at once
    #[arg(short, long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64), value_name = "N")]
    jobs: u16,
    /// Keep outcomes in this file as they come, and take those that it has already: what was cut short goes on
    #[arg(long, value_name = "FILE")]
    results: Option<PathBuf>,
    /// Whom ratios are relative to
    #[arg(long, default_value = "ours:0.5", value_name = "NAME:SIZE")]
    reference: Contestant,
    /// Print tables as Markdown
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
}

#[derive(Serialize)]
struct Compared {
    standings: Vec<Standings>,
    outcomes: Vec<Outcome>,
}

#[derive(Serialize)]
struct Listed {
    name: &'static str,
    size: String,
    summary: &'static str,
    source: &'static str,
}

impl Compare {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        if self.list {
            return list(output);
        }
        let datasets = self.datasets()?;
        let options = RunOptions { deadline_s: self.deadline, checkpoints: 0 };
        let contestants =
            if self.contestants.is_empty() { Contestant::all().collect() } else { self.contestants.clone() };
        let seeds: Vec<u64> = (self.seed..self.seed.saturating_add(self.seeds)).collect();
        let loaded = load(&datasets, &seeds)?;
        let rounds = rounds(&loaded, &self.held, self.fraction)?;
        let contest = Contest { rounds, contestants, options, jobs: usize::from(self.jobs) };
        let mut results = match &self.results {
            Some(path) => Results::open(path)?,
            None => Results::in_memory(),
        };
        let outcomes = hold(&contest, &mut results)?;
        let standings = standings(&outcomes, &self.reference.to_string());
        let compared = Compared { standings, outcomes };
        output.result(&compared, || {
            let one = |standings: &Standings| {
                let rows = rows(standings);
                let heading = format!("{}, {} held out", standings.dataset, standings.held);
                if self.markdown {
                    format!("### {heading}\n\n{}\n", markdown(&rows))
                } else {
                    format!("{heading}\n{}\n", columns(&rows))
                }
            };
            compared.standings.iter().map(one).collect()
        })
    }

    fn datasets(&self) -> anyhow::Result<Vec<Dataset>> {
        let mut datasets = Vec::new();
        for text in &self.datasets {
            let dataset = Dataset::parse(text).map_err(|problem| Usage(problem.to_string()))?;
            datasets.push(Dataset { every: self.every as usize, ..dataset });
        }
        if let (Some(train), Some(test)) = (&self.train, &self.test) {
            datasets.push(Dataset {
                name: "points".to_owned(),
                origin: Origin::Points { train: train.clone(), test: test.clone(), log: self.log.clone() },
                profile: profile::INDOOR,
                every: 1,
            });
        }
        if datasets.is_empty() {
            return Err(Usage("nothing to map: name a --dataset, or --train and --test".to_owned()).into());
        }
        Ok(datasets)
    }
}

fn list(output: &Output) -> anyhow::Result<()> {
    let listed: Vec<Listed> = Contestant::all()
        .map(|contestant| {
            let (entry, size) = (contestant.entry, contestant.size);
            let size = match entry.size {
                baselines::Size::Metres(_) => format!("{size} m"),
                baselines::Size::Count(_, what) => format!("{size} {what}"),
            };
            Listed { name: entry.name, size, summary: entry.summary, source: entry.source }
        })
        .collect();
    output.result(&listed, || {
        let one = |listed: &Listed| {
            format!("{} ({})\n    {}\n    {}\n", listed.name, listed.size, listed.summary, listed.source)
        };
        listed.iter().map(one).collect()
    })
}
