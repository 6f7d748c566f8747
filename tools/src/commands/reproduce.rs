use std::{env, path::PathBuf};

use bhm_bench::reproduction;
use clap::Args;

use crate::{
    options::seconds,
    output::{Output, Usage},
};

/// Reproduce the paper's tables and figures as a report: every system, every dataset, one page
///
/// Datasets 1 and 2 are simulated here, since the originals are not public; dataset 3, the Intel Research Lab, is a log that you
/// give by its path. What was measured is kept in the folder, and a report that was cut short goes on where it was.
#[derive(Args, Debug)]
pub(crate) struct Reproduce {
    /// Dataset 3, the log of the Intel Research Lab; without it the report has the simulated ones alone
    log: Option<PathBuf>,
    /// Folder of the report
    #[arg(short, long, default_value = "bhm-out/report", value_name = "FOLDER")]
    output: PathBuf,
    /// A small report for a first look: few scans, short deadlines
    #[arg(long)]
    quick: bool,
    /// Processor time that a contestant may learn on a task, seconds [default: 40 and for the log 100, with --quick 1]
    #[arg(long, value_name = "S", value_parser = seconds())]
    deadline: Option<f64>,
    /// Seed of the simulated worlds, of what is held out, and of contestants' dice
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Seeds over which those are repeated who finish a task within a few seconds [default: 2, with --quick 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100))]
    seeds: Option<u64>,
    /// How many tasks run at once
    #[arg(short, long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=64), value_name = "N")]
    jobs: u16,
    /// Leave out the count of instructions, which needs valgrind
    #[arg(long)]
    no_instructions: bool,
}

impl Reproduce {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        if let Some(log) = self.log.as_ref().filter(|log| !log.is_file()) {
            return Err(Usage(format!("{}: no such file", log.display())).into());
        }
        let request = reproduction::Reproduce {
            log: self.log.clone(),
            output: self.output.clone(),
            quick: self.quick,
            deadline_s: self.deadline,
            seed: self.seed,
            seeds: self.seeds,
            jobs: usize::from(self.jobs),
            counted: if self.no_instructions { None } else { Some(env::current_exe()?) },
        };
        let reproduced = request.run()?;
        output.result(&reproduced, || reproduced.text())
    }
}
