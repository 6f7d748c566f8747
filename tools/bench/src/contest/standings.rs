use serde::Serialize;

use super::{Ending, Outcome};
use crate::{evaluation::Timing, metrics::Spread};

/// How contestants did on one dataset with one thing held out, over all seeds.
#[derive(Clone, Debug, Serialize)]
pub struct Standings {
    /// The dataset.
    pub dataset: String,
    /// What was held out.
    pub held: String,
    /// Those who finished, best NLL first, then those who did not.
    pub rows: Vec<Standing>,
}

/// How one contestant did.
#[derive(Clone, Debug, Serialize)]
pub struct Standing {
    /// Its place by NLL among those who finished; null for the others.
    pub rank: Option<usize>,
    /// Who.
    pub contestant: String,
    /// What that was, in words.
    pub description: String,
    /// How it ended, where it did not finish under every seed.
    pub stopped: Option<String>,
    /// Over seeds: area under the ROC curve.
    pub auc: Option<Spread>,
    /// Over seeds: negative log-likelihood, nats.
    pub nll: Option<Spread>,
    /// Mean over seeds: squared error of the probability.
    pub brier: Option<f64>,
    /// Mean over seeds: expected calibration error.
    pub ece: Option<f64>,
    /// Over scans and seeds.
    pub auc_over_scans: Option<Spread>,
    /// Over scans and seeds.
    pub nll_over_scans: Option<Spread>,
    /// Mean over seeds: of places that no beam saw.
    pub unseen_auc: Option<f64>,
    /// Mean over seeds: of places that no beam saw, nats.
    pub unseen_nll: Option<f64>,
    /// Time of an update, milliseconds of the processor: mean over seeds of the median and of the 99th percentile.
    pub update_ms: [f64; 2],
    /// Mean over seeds: median time in the last quarter of the run relative to the first.
    pub growth: Option<f64>,
    /// Mean over seeds: bytes of state at the end.
    pub memory_bytes: usize,
    /// Median time relative to that of the reference; null if that has none.
    pub time_ratio: Option<f64>,
    /// NLL relative to that of the reference; null unless both finished.
    pub nll_ratio: Option<f64>,
}

/// Outcomes as tables: one for each dataset and thing held out, in the order in which they first occur. Ratios are to the
/// contestant called `reference`.
#[must_use]
pub fn standings(outcomes: &[Outcome], reference: &str) -> Vec<Standings> {
    let table = |((dataset, held), group): ((&String, &String), Vec<&Outcome>)| {
        let contestants = grouped(group, |outcome| &outcome.contestant);
        let mut rows: Vec<Standing> = contestants.iter().map(|(_, outcomes)| Standing::of(outcomes)).collect();
        rank(&mut rows);
        let measure =
            rows.iter().find(|row| row.contestant == reference).map(|row| (row.update_ms[0], row.ranked_nll()));
        if let Some((time_ms, nll)) = measure {
            for row in &mut rows {
                row.time_ratio = (time_ms > 0.0).then(|| row.update_ms[0] / time_ms);
                row.nll_ratio = row.ranked_nll().zip(nll).map(|(own, nll)| own / nll);
            }
        }
        Standings { dataset: dataset.clone(), held: held.clone(), rows }
    };
    grouped(outcomes, |outcome| (&outcome.dataset, &outcome.held)).into_iter().map(table).collect()
}

/// Outcomes of the same key together, in the order of the first of each.
pub(crate) fn grouped<'o, K: PartialEq>(
    outcomes: impl IntoIterator<Item = &'o Outcome>,
    key: impl Fn(&'o Outcome) -> K,
) -> Vec<(K, Vec<&'o Outcome>)> {
    let mut groups: Vec<(K, Vec<&Outcome>)> = Vec::new();
    for outcome in outcomes {
        let key = key(outcome);
        match groups.iter_mut().find(|(known, _)| *known == key) {
            Some((_, group)) => group.push(outcome),
            None => groups.push((key, vec![outcome])),
        }
    }
    groups
}

fn rank(rows: &mut [Standing]) {
    let key = |row: &Standing| row.ranked_nll().unwrap_or(f64::INFINITY);
    rows.sort_by(|a, b| key(a).total_cmp(&key(b)));
    for (row, place) in rows.iter_mut().zip(1..) {
        row.rank = row.ranked_nll().map(|_| place);
    }
}

impl Standing {
    /// Of the outcomes of one contestant, one for each seed.
    fn of(outcomes: &[&Outcome]) -> Self {
        let spread = |value: &dyn Fn(&Outcome) -> Option<f64>| {
            Spread::of(&outcomes.iter().filter_map(|o| value(o)).collect::<Vec<_>>())
        };
        let mean = |value: &dyn Fn(&Outcome) -> Option<f64>| spread(value).map(|spread| spread.mean);
        let pooled = |spread: &dyn Fn(&Outcome) -> Option<Spread>| {
            Spread::pooled(&outcomes.iter().filter_map(|o| spread(o)).collect::<Vec<_>>())
        };
        let timing =
            |value: &dyn Fn(&Timing) -> f64| mean(&|o| (o.learned > 0).then(|| value(&o.timing))).unwrap_or(0.0);
        let first = outcomes.first();
        Self {
            rank: None,
            contestant: first.map_or_else(String::new, |outcome| outcome.contestant.clone()),
            description: first.map_or_else(String::new, |outcome| outcome.description.clone()),
            stopped: outcomes.iter().find(|outcome| !outcome.finished()).map(|outcome| outcome.ending_in_words()),
            auc: spread(&|o| o.scores?.auc),
            nll: spread(&|o| Some(o.scores?.nll)),
            brier: mean(&|o| Some(o.scores?.brier)),
            ece: mean(&|o| Some(o.scores?.ece)),
            auc_over_scans: pooled(&|o| o.auc_over_scans),
            nll_over_scans: pooled(&|o| o.nll_over_scans),
            unseen_auc: mean(&|o| o.unseen?.scores.auc),
            unseen_nll: mean(&|o| Some(o.unseen?.scores.nll)),
            update_ms: [timing(&|timing| timing.p50_ms), timing(&|timing| timing.p99_ms)],
            growth: mean(&|o| o.growth),
            memory_bytes: mean(&|o| Some(o.memory_bytes as f64)).unwrap_or(0.0) as usize,
            time_ratio: None,
            nll_ratio: None,
        }
    }

    /// What it is ranked by; `None` if it did not finish.
    fn ranked_nll(&self) -> Option<f64> {
        self.nll.filter(|_| self.stopped.is_none()).map(|nll| nll.mean)
    }
}

impl Outcome {
    /// How it ended.
    #[must_use]
    pub fn ending_in_words(&self) -> String {
        match &self.ending {
            Ending::Finished => "finished".to_owned(),
            Ending::Deadline => format!("stopped at scan {} of {}", self.learned, self.scans),
            Ending::Failed { why } if self.learned == 0 => format!("failed: {why}"),
            Ending::Failed { why } => format!("failed at scan {} of {}: {why}", self.learned, self.scans),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Scores;

    fn outcome(contestant: &str, seed: u64, nll: f64, ending: Ending) -> Outcome {
        let logit = -(nll.exp_m1().ln());
        Outcome {
            contestant: contestant.to_owned(),
            description: String::new(),
            dataset: "here".to_owned(),
            held: "beams".to_owned(),
            seed,
            task: String::new(),
            deadline_s: Some(1.0),
            scans: 10,
            learned: if ending == Ending::Finished { 10 } else { 4 },
            ending,
            scores: Scores::of(&[logit, -logit], &[true, false]).ok(),
            auc_over_scans: None,
            nll_over_scans: None,
            curve: Vec::new(),
            unseen: None,
            timing: Timing { p50_ms: 4.0 * nll, ..Timing::default() },
            growth: None,
            update_ms: Vec::new(),
            work: Vec::new(),
            memory_bytes: 100,
        }
    }

    #[test]
    fn the_stopped_are_listed_but_never_ranked() {
        let outcomes = [
            outcome("slow:1", 1, 0.01, Ending::Deadline),
            outcome("ours:1", 1, 0.2, Ending::Finished),
            outcome("good:1", 1, 0.1, Ending::Finished),
            outcome("broken:1", 1, 0.02, Ending::Failed { why: "no".to_owned() }),
        ];
        let [table] = &standings(&outcomes, "ours:1")[..] else { panic!("one table") };
        let order: Vec<_> = table.rows.iter().map(|row| (row.contestant.as_str(), row.rank)).collect();
        assert_eq!(order[..2], [("good:1", Some(1)), ("ours:1", Some(2))]);
        assert!(order[2..].iter().all(|(_, rank)| rank.is_none()));
        let slow = table.rows.iter().find(|row| row.contestant == "slow:1").unwrap();
        assert_eq!(slow.stopped.as_deref(), Some("stopped at scan 4 of 10"));
        assert_eq!(slow.nll_ratio, None);
        assert!((table.rows[0].nll_ratio.unwrap() - 0.5).abs() < 1e-9);
        assert!((table.rows[0].time_ratio.unwrap() - 0.5).abs() < 1e-9);
    }

    #[test]
    fn one_stopped_seed_spoils_the_rank_and_seeds_are_averaged() {
        let mut outcomes = vec![outcome("a:1", 1, 0.2, Ending::Finished), outcome("a:1", 2, 0.4, Ending::Finished)];
        let [table] = &standings(&outcomes, "a:1")[..] else { panic!("one table") };
        let nll = table.rows[0].nll.unwrap();
        assert!((nll.mean - 0.3).abs() < 1e-9 && (nll.two_sigma - 2.0 * 0.02_f64.sqrt()).abs() < 1e-9);
        outcomes[1].ending = Ending::Deadline;
        assert_eq!(standings(&outcomes, "a:1")[0].rows[0].rank, None);
    }

    #[test]
    fn pooled_spreads_are_those_of_all_values() {
        let (a, b) = ([1.0, 2.0, 4.0], [8.0, 3.0]);
        let pooled = Spread::pooled(&[Spread::of(&a).unwrap(), Spread::of(&b).unwrap()]).unwrap();
        let all = Spread::of(&[1.0, 2.0, 4.0, 8.0, 3.0]).unwrap();
        assert!((pooled.mean - all.mean).abs() < 1e-12 && (pooled.two_sigma - all.two_sigma).abs() < 1e-12);
        assert_eq!(pooled.count, 5);
        assert_eq!(Spread::pooled(&[]), None);
    }
}
