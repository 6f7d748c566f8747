//! How good probabilistic predictions of occupancy are, against labelled points.
//!
//! Predictions are *logits* `z`, with `p(occupied) = 1 / (1 + exp(−z))`, not probabilities: a confident map saturates
//! `p` to exactly 0 or 1, where the ranking is lost and the log-likelihood is infinite; its logit keeps both.
//!
//! ```
//! use bhm_bench::metrics::Scores;
//!
//! let scores = Scores::of(&[2.0, -1.0, 0.5, -3.0], &[true, false, false, false])?;
//! assert_eq!(scores.auc, Some(1.0));
//! assert_eq!(scores.accuracy, 0.75);
//! # Ok::<(), bhm_bench::metrics::ScoreError>(())
//! ```

mod spread;
#[cfg(test)]
mod tests;

pub use spread::Spread;

use serde::{Deserialize, Serialize};

/// The number of equal-width bins on `p(occupied)` that [`Scores::ece`] compares.
pub const CALIBRATION_BINS: usize = 15;

/// The scores of a set of predictions. `y` is 1 for occupied and 0 for free, `N` the number of points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// `N`, how many points were scored.
    pub points: usize,
    /// How many of them are labelled occupied.
    pub positives: usize,
    /// The area under the receiver operating characteristic: the probability that an occupied point has a greater logit
    /// than a free one, a tie counting one half. `None` (JSON `null`) when the labels are all of one class, where no
    /// such pair exists; the other scores still hold.
    pub auc: Option<f64>,
    /// The mean negative log-likelihood in nats, `1/N Σ −ln p(y)`, unclipped; never infinite.
    pub nll: f64,
    /// The mean squared error of the probability, `1/N Σ (p − y)²`.
    pub brier: f64,
    /// The expected calibration error `Σ_b N_b/N · |mean of p in b − share of occupied points in b|` over
    /// [`CALIBRATION_BINS`] bins `b` of equal width on `p(occupied)`; each holds its lower edge, the last one also 1.
    pub ece: f64,
    /// The share of points whose label is the more probable class; `p = 0.5` counts as occupied.
    pub accuracy: f64,
}

/// Why predictions cannot be scored.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ScoreError {
    /// There is nothing to average.
    #[error("no predictions to score")]
    Empty,
    /// Predictions and labels do not pair up.
    #[error("{logits} predictions, but {labels} labels")]
    Lengths {
        /// How many predictions were given.
        logits: usize,
        /// How many labels were given.
        labels: usize,
    },
    /// A prediction is NaN or infinite. A score that leaves it out would flatter the map.
    #[error("prediction {index} is not finite: {logit}")]
    NotFinite {
        /// Its position in the predictions.
        index: usize,
        /// Its value.
        logit: f64,
    },
}

impl Scores {
    /// Every score with its name.
    #[must_use]
    pub fn rows(&self) -> [(&'static str, String); 5] {
        [
            ("AUC", self.auc.map_or("undefined: one class only".to_owned(), |auc| format!("{auc:.5}"))),
            ("NLL", format!("{:.5} nats", self.nll)),
            ("Brier", format!("{:.5}", self.brier)),
            ("ECE", format!("{:.5}", self.ece)),
            ("accuracy", format!("{:.5}", self.accuracy)),
        ]
    }

    /// AUC, NLL and ECE for a table, to five decimals.
    #[must_use]
    pub fn cells(&self) -> [String; 3] {
        let auc = self.auc.map_or("-".to_owned(), |auc| format!("{auc:.5}"));
        [auc, format!("{:.5}", self.nll), format!("{:.5}", self.ece)]
    }

    /// Scores `logits` against `labels` (`true` for occupied), in `O(N log N)`.
    ///
    /// # Errors
    /// If there are no predictions, a different number of labels, or a prediction that is not finite.
    pub fn of<L: Copy + Into<f64>>(logits: &[L], labels: &[bool]) -> Result<Self, ScoreError> {
        if logits.len() != labels.len() {
            return Err(ScoreError::Lengths { logits: logits.len(), labels: labels.len() });
        }
        if logits.is_empty() {
            return Err(ScoreError::Empty);
        }
        let mut predictions = Vec::with_capacity(logits.len());
        for (index, (&logit, &occupied)) in logits.iter().zip(labels).enumerate() {
            let logit = logit.into();
            if !logit.is_finite() {
                return Err(ScoreError::NotFinite { index, logit });
            }
            predictions.push(Prediction { logit, occupied });
        }
        Ok(Self {
            points: predictions.len(),
            positives: labels.iter().filter(|&&occupied| occupied).count(),
            nll: mean(&predictions, Prediction::surprise),
            brier: mean(&predictions, Prediction::squared_error),
            accuracy: mean(&predictions, |p| f64::from(u8::from((p.logit >= 0.0) == p.occupied))),
            ece: expected_calibration_error(&predictions),
            auc: area_under_curve(&mut predictions),
        })
    }
}

#[derive(Clone, Copy)]
struct Prediction {
    logit: f64,
    occupied: bool,
}

impl Prediction {
    fn probability(&self) -> f64 {
        sigmoid(self.logit)
    }

    /// The logit of the class that is not the label's: the greater, the more wrong.
    fn wrong_logit(&self) -> f64 {
        if self.occupied { -self.logit } else { self.logit }
    }

    /// `−ln p(y) = softplus(wrong logit) = ln(1 + exp(wrong logit))`, with no exponential that can overflow.
    fn surprise(&self) -> f64 {
        let z = self.wrong_logit();
        z.max(0.0) + (-z.abs()).exp().ln_1p()
    }

    /// `(p − y)²`, from the wrong class's probability so that nothing cancels near `p = y = 1`.
    fn squared_error(&self) -> f64 {
        sigmoid(self.wrong_logit()).powi(2)
    }
}

/// The logistic function `σ(z) = 1/(1 + e⁻ᶻ)`: the probability of log-odds `z`. An `exp` that overflows to infinity gives the
/// right limit, 0.
#[must_use]
pub fn sigmoid(z: f64) -> f64 {
    1.0 / (1.0 + (-z).exp())
}

fn mean(predictions: &[Prediction], score: impl Fn(&Prediction) -> f64) -> f64 {
    predictions.iter().map(score).sum::<f64>() / predictions.len() as f64
}

/// The Mann–Whitney statistic with mid-ranks: `U / (P·N)`, `U` counting every (occupied, free) pair in the right order
/// as 1 and every tie as ½. Counted in halves, so that the sum is exact.
fn area_under_curve(predictions: &mut [Prediction]) -> Option<f64> {
    predictions.sort_unstable_by(|a, b| a.logit.total_cmp(&b.logit));
    let (mut positives, mut negatives, mut half_wins) = (0_u64, 0_u64, 0_u64);
    // `total_cmp` puts −0 beside +0, so `==` still finds the whole tie.
    for tie in predictions.chunk_by(|a, b| a.logit == b.logit) {
        let tied_positives = tie.iter().filter(|p| p.occupied).count() as u64;
        let tied_negatives = tie.len() as u64 - tied_positives;
        half_wins += tied_positives * (2 * negatives + tied_negatives);
        positives += tied_positives;
        negatives += tied_negatives;
    }
    let pairs = positives * negatives;
    (pairs > 0).then(|| half_wins as f64 / (2.0 * pairs as f64))
}

/// `N_b · |mean p − share occupied| = |Σ p − Σ y|` within a bin, so each bin needs only the sum of `p − y`.
fn expected_calibration_error(predictions: &[Prediction]) -> f64 {
    let mut excess = [0.0; CALIBRATION_BINS];
    for prediction in predictions {
        let p = prediction.probability();
        let bin = ((p * CALIBRATION_BINS as f64) as usize).min(CALIBRATION_BINS - 1);
        excess[bin] += p - f64::from(u8::from(prediction.occupied));
    }
    excess.iter().map(|e| e.abs()).sum::<f64>() / predictions.len() as f64
}
