mod axes;
mod trial;
mod tuned;

use std::{fs, num::NonZeroUsize, path::Path, path::PathBuf};

use anyhow::Context;
use bhm_bench::{
    evaluation::{Parts, three_parts},
    search::{Found, Method, grid_len, search},
};
use clap::{Args, ValueEnum};
use serde::Serialize;
use tracing::info;

use self::{
    axes::{Search, SearchAxes},
    trial::Trial,
    tuned::{Tested, Tuned},
};
use crate::{
    options::{Effective, MapOptions, number},
    output::{Output, Usage},
};

/// Most combinations of a grid: more would run for days.
const MAX_GRID: usize = 10_000;

/// Search for map options that suit a log, and write them as a configuration file
///
/// Tries candidates and keeps the one that predicts a validation part of the log's beams best (--by nll), or that explains
/// what it learns best (--by objective). What the winner is worth is then told by a test part, which no candidate has seen:
/// there it and the start, both learned once more from all the rest, are compared as `bhm evaluate` would with the same
/// --fraction and --seed.
///
/// The map options are where the search begins. Without any --try option it looks for the prior precision, and for the
/// kernel's shape if the kernel has one. The spacing stays unless --try-spacing is given, since it is rather a choice of
/// cost: finer usually predicts better, and half of it takes about four times the memory.
///
/// The objective is the evidence lower bound that learning maximises, of each update given all scans before it, summed over
/// tiles and scans and divided by the rows learned (an observation is a row in each tile that holds it). It needs no
/// validation part but judges only what is learned: it compares settings on the same observations, so that --try-gap and
/// --try-free-spacing, which change those, are refused with it; it is a lower bound, the looser for Jaakkola-Jordan, and
/// tiles that overlap count an observation more than once. Every scan is judged by what was known before it: so it is about
/// learning a place fast, where the NLL is about the map in the end. On a recorded building it chose a prior precision that
/// predicted held-out beams 3 % worse than the default did. Prefer --by nll where beams can be spared.
#[derive(Args, Debug)]
pub(crate) struct Tune {
    /// Scan log (CARMEN), plain or gzip
    #[arg(required_unless_present = "print_config")]
    log: Option<PathBuf>,
    /// Configuration file to write, for --config of every command
    #[arg(short, long, value_name = "FILE", required_unless_present = "print_config")]
    output: Option<PathBuf>,
    /// What decides between candidates
    #[arg(long, value_enum, default_value_t = By::Nll)]
    by: By,
    /// In which order candidates are tried
    #[arg(long, value_enum, default_value_t = Search::Coordinate)]
    search: Search,
    /// Most rounds of a coordinate search; it ends before when one brings nothing new [default: 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=20))]
    rounds: Option<u32>,
    /// Use every n-th scan, for speed. Fewer scans say less of each place, which may favour another prior
    #[arg(long, default_value_t = NonZeroUsize::MIN, value_name = "N")]
    every: NonZeroUsize,
    /// The part of the beams that is the validation part, and again the test part; above 0 and below 0.5
    #[arg(long, default_value_t = 0.1, value_name = "PART",
        value_parser = number(|part| *part > 0.0 && *part < 0.5, "a number above 0 and below 0.5"))]
    fraction: f64,
    /// Seed of what is held out and of where held-out beams are asked
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Most work that the winner may take, as a multiple of the start's: instructions estimated from tiles, rows and passes
    #[arg(long, default_value_t = 1.5, value_name = "X",
        value_parser = number(|number| *number > 0.0 && number.is_finite(), "a positive number"))]
    max_cost: f64,
    #[command(flatten)]
    axes: SearchAxes,
    #[command(flatten)]
    map: MapOptions,
}

/// What decides between candidates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
enum By {
    /// The negative log-likelihood of the validation part
    Nll,
    /// The evidence lower bound of what is learned, per row
    Objective,
}

impl Tune {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(start) = self.map.effective()? else { return Ok(()) };
        let (Some(log_path), Some(path)) = (&self.log, &self.output) else {
            return Err(Usage("a log and a configuration file to write are needed".to_owned()).into());
        };
        start.open()?;
        let (numbers, axes) = self.axes.of(&start, self.by)?;
        let method = self.method(grid_len(&axes))?;
        // Now, and not after minutes of work.
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        fs::metadata(folder).with_context(|| format!("cannot write {}", path.display()))?;

        let scans: Vec<_> = start.read(log_path)?.scans.into_iter().step_by(self.every.get()).collect();
        let parts = three_parts(&scans, self.fraction, self.seed);
        let [validation, test, of] = parts.beams();
        info!("{} scans; of {of} beams with a return, {validation} to choose by and {test} to test with", scans.len());
        anyhow::ensure!(validation > 0 && test > 0, "a part of the log has no beam; take a greater --fraction");

        let named = |values: &[f32]| numbers.iter().copied().zip(values.iter().copied()).collect::<Vec<_>>();
        let found = search(&axes, method, self.max_cost, |place, values| {
            let said: Vec<_> = named(values).iter().map(|(number, value)| format!("{} {value}", number.flag)).collect();
            let name = format!("candidate {}: {}", place + 1, said.join(", "));
            info!("{name}");
            Trial::run(start.with(&named(values)), self.by, &parts.validation, name)
        });
        let Some(best) = found.best else { return Err(self.nothing_found(&found)) };
        let winner = start.with(&named(&found.tried[best].values)).map_err(Usage)?;
        let test = Tested {
            start: test_part(&start, &parts, "start")?,
            best: if best == 0 { None } else { Some(test_part(&winner, &parts, "best")?) },
        };
        let tuned = Tuned { request: self, log_path, path, scans: scans.len(), numbers, parts, found, best, test };
        fs::write(path, tuned.header() + &winner.configuration()?)
            .with_context(|| format!("cannot write {}", path.display()))?;
        output.result(&tuned.summary(), || tuned.text())
    }

    fn method(&self, grid: usize) -> anyhow::Result<Method> {
        let usage = |text: String| Err(Usage(text).into());
        match self.search {
            Search::Coordinate => Ok(Method::Coordinate { rounds: self.rounds.unwrap_or(2) }),
            Search::Grid if self.rounds.is_some() => usage("a grid search has no --rounds".to_owned()),
            Search::Grid if grid > MAX_GRID => {
                usage(format!("a grid of {grid} candidates, expected at most {MAX_GRID}"))
            }
            Search::Grid => Ok(Method::Grid),
        }
    }

    fn nothing_found(&self, found: &Found<Trial>) -> anyhow::Error {
        let said: Vec<_> = found.tried.iter().map(|tried| tuned::remark(&tried.result)).collect();
        anyhow::anyhow!("no candidate can be used (--max-cost {}): {}", self.max_cost, said.join("; "))
    }
}

/// Learns everything but the test part, and asks that.
fn test_part(options: &Effective, parts: &Parts, name: &str) -> anyhow::Result<Trial> {
    let said = format!("testing the {name}");
    info!("{said}");
    let trial = Trial::run(Ok(options.clone()), By::Nll, &parts.test, said);
    match trial.scored() {
        Some(scored) => scored.learned.warn(&options.profile),
        None => anyhow::ensure!(name == "start", "the {name} cannot be tested: {}", tuned::remark(&trial)),
    }
    Ok(trial)
}
