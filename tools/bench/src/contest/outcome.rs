use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{
    evaluation::{TestPoints, Timing},
    metrics::{ScoreError, Scores, Spread},
};

/// All that is kept of one contestant on one task.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Who, as `NAME:SIZE`, lengths as for a building.
    pub contestant: String,
    /// What it made of that, in words.
    pub description: String,
    /// The dataset's name.
    pub dataset: String,
    /// What was held out.
    pub held: String,
    /// Of the division, and of the contestant's dice.
    pub seed: u64,
    /// Checksum of everything that is learned and asked.
    #[serde(rename = "exam")]
    pub task: String,
    /// Processor time that it had for learning, seconds; null if as much as it wanted.
    pub deadline_s: Option<f64>,
    /// Scans of the task.
    pub scans: usize,
    /// Scans learned.
    pub learned: usize,
    /// How it ended.
    pub ending: Ending,
    /// Of everything asked about the scans it had seen; null if it could not be asked.
    pub scores: Option<Scores>,
    /// Of each scan's questions alone, answered at the end.
    pub auc_over_scans: Option<Spread>,
    /// The same for the negative log-likelihood.
    pub nll_over_scans: Option<Spread>,
    /// Scores on the way.
    pub curve: Vec<Checkpoint>,
    /// Of places that no beam saw; null where the truth is not known or not all scans were learned.
    pub unseen: Option<UnseenScores>,
    /// Time of updates.
    pub timing: Timing,
    /// Median time of an update in the last quarter of the scans learned, relative to the first quarter.
    pub growth: Option<f64>,
    /// Time of each update, milliseconds.
    pub update_ms: Vec<f32>,
    /// Units of work in each update (see [`Baseline::work`](crate::baselines::Baseline::work)); empty if it names none.
    pub work: Vec<[u64; 2]>,
    /// Bytes of state at the end.
    pub memory_bytes: usize,
}

/// How a contestant came to its end.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "ending")]
pub enum Ending {
    /// Everything was learned.
    #[default]
    Finished,
    /// The deadline came first; scored only on what it had seen, never ranked.
    Deadline,
    /// It gave up.
    Failed {
        /// Why.
        why: String,
    },
}

/// Scores after a part of the scans, on questions about scans seen so far.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Scans learned.
    pub scans: usize,
    /// Area under the ROC curve; null if all questions have one answer.
    pub auc: Option<f64>,
    /// Negative log-likelihood, nats.
    pub nll: f64,
}

/// What is said of places that no beam saw.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnseenScores {
    /// Against what really stands there.
    pub scores: Scores,
    /// Probabilities inside obstacles.
    pub inside: Quantiles,
    /// Probabilities on free ground.
    pub outside: Quantiles,
}

/// Values that 5, 25, 50, 75 and 95 of 100 do not exceed, and the mean.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quantiles {
    /// At 5, 25, 50, 75 and 95 percent.
    pub at: [f64; 5],
    /// The mean.
    pub mean: f64,
    /// Of how many values.
    pub count: usize,
}

impl Outcome {
    /// Whether it may be ranked among others.
    #[must_use]
    pub fn finished(&self) -> bool {
        self.ending == Ending::Finished && self.scores.is_some()
    }

    /// Whether it is the outcome of the same contestant on the same task, under no shorter a deadline.
    #[must_use]
    pub fn answers(
        &self,
        contestant: &str,
        task: &str,
        seed: u64,
        deadline_s: Option<f64>,
        checkpoints: usize,
    ) -> bool {
        let same = self.contestant == contestant && self.task == task && self.seed == seed;
        // Who finished, finished; who was stopped would go on with more time, and is stopped earlier with less.
        // Who was stopped before the first checkpoint has none.
        let marked = !self.curve.is_empty() || self.learned * checkpoints < self.scans.max(1);
        same && (self.ending == Ending::Finished || self.deadline_s == deadline_s) && marked
    }
}

impl Quantiles {
    /// Of these values, by nearest rank; `None` if there are none.
    #[must_use]
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_unstable_by(f64::total_cmp);
        let count = values.len();
        let at = |percent: usize| values.get((count * percent).div_ceil(100).max(1) - 1).copied();
        let [a, b, c, d, e] = [5, 25, 50, 75, 95].map(at);
        let mean = values.iter().sum::<f64>() / count.max(1) as f64;
        Some(Self { at: [a?, b?, c?, d?, e?], mean, count })
    }
}

/// AUC and NLL of each scan's questions alone; a scan whose questions all have one answer has no AUC.
pub(super) fn over_scans(logits: &[f64], test: &TestPoints) -> Result<[Option<Spread>; 2], ScoreError> {
    let mut by_scan: BTreeMap<u64, (Vec<f64>, Vec<bool>)> = BTreeMap::new();
    for ((logit, occupied), scan) in logits.iter().zip(&test.occupied).zip(&test.scans) {
        let (logits, labels) = by_scan.entry(*scan).or_default();
        logits.push(*logit);
        labels.push(*occupied);
    }
    let (mut auc, mut nll) = (Vec::new(), Vec::new());
    for (logits, labels) in by_scan.into_values() {
        let scores = Scores::of(&logits, &labels)?;
        auc.extend(scores.auc);
        nll.push(scores.nll);
    }
    Ok([Spread::of(&auc), Spread::of(&nll)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_textbooks() {
        let quantiles = Quantiles::of((1..=100).rev().map(f64::from).collect()).unwrap();
        assert_eq!((quantiles.at, quantiles.mean), ([5.0, 25.0, 50.0, 75.0, 95.0], 50.5));
        assert_eq!(Quantiles::of(vec![]), None);
    }

    #[test]
    fn each_scan_is_scored_alone() {
        // Scan 7: both right. Scan 3: both wrong. Scan 4: one answer only.
        let test = TestPoints {
            points_m: vec![[0.0; 2]; 5],
            occupied: vec![true, false, true, false, true],
            scans: vec![7, 7, 3, 3, 4],
        };
        let [auc, nll] = over_scans(&[2.0, -2.0, -2.0, 2.0, 0.0], &test).unwrap();
        assert_eq!((auc.unwrap().mean, auc.unwrap().count), (0.5, 2));
        let expected = ((1.0 + (-2.0_f64).exp()).ln() + (1.0 + 2.0_f64.exp()).ln() + 2.0_f64.ln()) / 3.0;
        assert!((nll.unwrap().mean - expected).abs() < 1e-12);
        assert_eq!(nll.unwrap().count, 3);
    }
}
