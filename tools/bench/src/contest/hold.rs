use tracing::{info, warn};

use super::{Contest, Dataset, DatasetProblem, Loaded, Origin, Outcome, Results, ResultsError, Round};
use crate::{evaluation::Held, progress::ContestBars, reading};

/// Every dataset under every seed: simulated ones differ, recorded ones are read once for each.
pub fn load(datasets: &[Dataset], seeds: &[u64]) -> Result<Vec<(u64, Loaded)>, DatasetProblem> {
    let mut all = Vec::new();
    for dataset in datasets {
        for seed in seeds {
            let loaded = dataset.clone().load(*seed)?;
            if seed == &seeds[0] {
                if let (Origin::Log(path) | Origin::Points { log: Some(path), .. }, Some(report)) =
                    (&loaded.dataset.origin, &loaded.report)
                {
                    reading::scan_log(path, report);
                }
                loaded.point_reports.iter().for_each(|(path, report)| reading::point_log(path, report));
            }
            all.push((*seed, loaded));
        }
    }
    Ok(all)
}

/// Each of them divided in each of these ways; points that are divided already, once.
pub fn rounds<'a>(loaded: &'a [(u64, Loaded)], held: &[Held], fraction: f64) -> Result<Vec<Round<'a>>, DatasetProblem> {
    let mut rounds = Vec::new();
    for (seed, loaded) in loaded {
        let prepared = matches!(loaded.dataset.origin, Origin::Points { .. });
        for held in held.iter().take(if prepared { 1 } else { held.len() }) {
            let task = loaded.task(*held, fraction, *seed)?;
            let name = if prepared { "test points".to_owned() } else { held.to_string() };
            rounds.push(Round::new(loaded, name, *seed, task));
        }
    }
    Ok(rounds)
}

/// Holds a contest, and says how it goes.
pub fn hold(contest: &Contest<'_>, results: &mut Results) -> Result<Vec<Outcome>, ResultsError> {
    if results.unreadable() > 0 {
        warn!("{} lines of the kept results say nothing; passed over", results.unreadable());
    }
    let (open, all) = contest.to_run(results);
    if open < all {
        info!("{} of {all} outcomes are kept already", all - open);
    }
    let bars = ContestBars::new(open, contest.jobs);
    contest.run(results, &bars)
}
