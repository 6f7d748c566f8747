//! Hilbert maps (Ramos and Ott, RSS 2015): logistic regression on features of the plane, learned by stochastic gradients as
//! scans stream by. One file for each kind of features; this one is how their weights are learned.
//!
//! A step takes one point, in random order within its scan, a few times over: `g = (σ(wᵀφ) − y) φ`, and each weight moves at its
//! own rate `r_j = η / √(ε + Σ g_j²)` (AdaGrad; Duchi, Hazan and Singer 2011), so that places the robot sees for the first time
//! are learned as fast as the first ones were. The elastic net is applied as its proximal step after each gradient step,
//! `w ← sign(w) max(0, |w| − r λ₁) / (1 + r λ₂)`. A weight whose feature is zero keeps its rate, and all it missed is caught up
//! with in closed form when it is next touched: with `a = 1/(1 + r λ₂)`, after `k` steps
//! `|w| ← max(0, aᵏ|w| − (λ₁/λ₂)(1 − aᵏ))`. Where features are zero nearly everywhere, answers come from averages
//! that weigh later values more (Shamir and Zhang 2013), taken over the values a weight had when it was touched. Features that
//! are nowhere zero have no such past: an average would mix the present with what was not yet seen, so their last values answer.
//!
//! The paper's program instead takes scikit-learn's rates, one for all weights, which fall whether or not a place was seen.

mod fourier;
#[cfg(feature = "dense")]
mod nystrom;
mod sparse;

use bhm_core::rule::sigmoid;
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

use super::{Baseline, Entry, Failed, Prediction, Setup, Size};
use crate::evaluation::TrainingScan;

pub(super) const ENTRIES: &[Entry] = &[
    Entry {
        name: "hilbert-sparse",
        summary: "Hilbert map on features of compact support",
        source: "Ramos and Ott 2015; kernel of Melkumyan and Ramos 2009, two spacings wide, on a lattice; AdaGrad with averages \
                 instead of plain SGD",
        size: Size::Metres(0.5),
        open: |setup| Ok(Box::new(HilbertMap::new(sparse::Sparse::new(setup)?, setup))),
    },
    Entry {
        name: "hilbert-fourier",
        summary: "Hilbert map on random Fourier features",
        source: "Ramos and Ott 2015; features of Rahimi and Recht 2008 (a sine and a cosine of each frequency), length scale from \
                 the area per feature; AdaGrad instead of plain SGD",
        size: Size::Count(4000.0, "features"),
        open: |setup| Ok(Box::new(HilbertMap::new(fourier::Fourier::new(setup)?, setup))),
    },
    Entry {
        name: "hilbert-nystrom",
        summary: "Hilbert map on Nyström features",
        source: "Ramos and Ott 2015; inducing points on a lattice over the area, since a stream has no sample of all its points; \
                 features below 1e-3 dropped; AdaGrad with averages instead of plain SGD",
        size: Size::Count(4000.0, "inducing points"),
        open: dense!(|setup| Ok(Box::new(HilbertMap::new(nystrom::Nystrom::new(setup)?, setup)))),
    },
];

/// λ₁ and λ₂. Chosen, like all numbers of these files, on a tenth of the beams of the Intel log's training points: what is ten
/// times stronger already fades places that the robot left.
const ELASTIC_NET: ElasticNet = ElasticNet { l1: 0.15e-7, l2: 0.85e-7 };
/// Exponent of the averages: the newest value has the weight `(1 + 3)/(n + 3)` among `n`.
const AVERAGING: f32 = 3.0;
/// Points asked at once.
const ASKED_AT_ONCE: usize = 512;

/// Features of points, and what suits them.
trait Features: Send {
    /// Times that a scan is gone through.
    const EPOCHS: usize;
    /// η.
    const RATE: f32;
    /// ε.
    const FIRST_SQUARES: f32;

    fn count(&self) -> usize;

    fn description(&self) -> String;

    fn bytes(&self) -> usize;

    /// Appends a row for each point.
    fn append(&mut self, points_m: &[[f32; 2]], rows: &mut Rows);
}

/// Features, row after row.
#[derive(Clone, Debug, Default, PartialEq)]
struct Rows {
    /// Where each row ends.
    ends: Vec<usize>,
    /// Numbers of the features; none if every row has all of them.
    indices: Vec<u32>,
    values: Vec<f32>,
}

#[derive(Clone, Copy)]
enum Row<'a> {
    Dense(&'a [f32]),
    Sparse(&'a [u32], &'a [f32]),
}

impl Rows {
    fn clear(&mut self) {
        self.ends.clear();
        self.indices.clear();
        self.values.clear();
    }

    fn end_row(&mut self) {
        self.ends.push(self.values.len());
    }

    fn get(&self, number: usize) -> Row<'_> {
        let start = if number == 0 { 0 } else { self.ends[number - 1] };
        let range = start..self.ends[number];
        if self.indices.is_empty() {
            Row::Dense(&self.values[range])
        } else {
            Row::Sparse(&self.indices[range.clone()], &self.values[range])
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct ElasticNet {
    l1: f32,
    l2: f32,
}

impl ElasticNet {
    /// One proximal step at this rate.
    fn step(self, weight: f32, rate: f32) -> f32 {
        weight.signum() * (weight.abs() - rate * self.l1).max(0.0) / (1.0 + rate * self.l2)
    }

    /// As many such steps at once. In `f64`: one step changes less than the last bit of an `f32`.
    fn steps(self, weight: f32, rate: f32, steps: u64) -> f32 {
        let (l1, l2, rate) = (f64::from(self.l1), f64::from(self.l2), f64::from(rate));
        let log_kept = -(steps as f64) * (rate * l2).ln_1p();
        let thresholds = if l2 > 0.0 { -log_kept.exp_m1() * l1 / l2 } else { steps as f64 * rate * l1 };
        let weight = f64::from(weight);
        (weight.signum() * (log_kept.exp() * weight.abs() - thresholds).max(0.0)) as f32
    }
}

/// Weights and what each remembers of its past.
#[derive(Clone, Debug, PartialEq)]
struct Weights {
    net: ElasticNet,
    rate: f32,
    now: Vec<f32>,
    averages: Vec<f32>,
    /// `ε + Σ g²`.
    squares: Vec<f32>,
    /// How often each was touched, where rows are sparse.
    touches: Vec<u32>,
    /// Up to which step the elastic net was applied.
    shrunk: Vec<u64>,
    /// Steps so far.
    steps: u64,
}

impl Weights {
    fn new(count: usize, rate: f32, first_squares: f32, net: ElasticNet) -> Self {
        Self {
            net,
            rate,
            now: vec![0.0; count],
            averages: vec![0.0; count],
            squares: vec![first_squares; count],
            touches: vec![0; count],
            shrunk: vec![0; count],
            steps: 0,
        }
    }

    fn learn(&mut self, row: Row<'_>, occupied: bool) {
        let label = if occupied { 1.0 } else { 0.0 };
        match row {
            Row::Dense(values) => self.learn_dense(values, label),
            Row::Sparse(indices, values) => self.learn_sparse(indices, values, label),
        }
        self.steps += 1;
    }

    fn learn_sparse(&mut self, indices: &[u32], values: &[f32], label: f32) {
        for index in indices.iter().map(|index| *index as usize) {
            let missed = self.steps - self.shrunk[index];
            self.now[index] = self.net.steps(self.now[index], self.rate / self.squares[index].sqrt(), missed);
            self.shrunk[index] = self.steps;
        }
        let error = sigmoid(sparse_product(indices, values, &self.now)) - label;
        for (index, value) in indices.iter().zip(values) {
            let index = *index as usize;
            let gradient = error * value;
            self.squares[index] += gradient * gradient;
            self.now[index] -= self.rate * gradient / self.squares[index].sqrt();
            self.touches[index] = self.touches[index].saturating_add(1);
            let share = (1.0 + AVERAGING) / (self.touches[index] as f32 + AVERAGING);
            self.averages[index] += share * (self.now[index] - self.averages[index]);
        }
    }

    fn learn_dense(&mut self, values: &[f32], label: f32) {
        let error = sigmoid(dense_product(values, &self.now)) - label;
        let (net, rate) = (self.net, self.rate);
        for ((now, squares), value) in self.now.iter_mut().zip(&mut self.squares).zip(values) {
            let gradient = error * value;
            *squares += gradient * gradient;
            let rate = rate / squares.sqrt();
            *now = net.step(*now - rate * gradient, rate);
        }
    }

    fn logit(&self, row: Row<'_>) -> f32 {
        match row {
            Row::Dense(values) => dense_product(values, &self.now),
            Row::Sparse(indices, values) => sparse_product(indices, values, &self.averages),
        }
    }

    fn bytes(&self) -> usize {
        self.now.len() * (3 * size_of::<f32>() + size_of::<u32>() + size_of::<u64>())
    }
}

fn sparse_product(indices: &[u32], values: &[f32], weights: &[f32]) -> f32 {
    indices.iter().zip(values).map(|(index, value)| weights[*index as usize] * value).sum()
}

/// In sixteen sums, which is an order that vectors can keep.
fn dense_product(values: &[f32], weights: &[f32]) -> f32 {
    let mut sums = [0.0; 16];
    let (values, weights) = (values.chunks_exact(16), weights.chunks_exact(16));
    let rest: f32 = values.remainder().iter().zip(weights.remainder()).map(|(value, weight)| value * weight).sum();
    for (values, weights) in values.zip(weights) {
        for lane in 0..16 {
            sums[lane] += values[lane] * weights[lane];
        }
    }
    sums.iter().sum::<f32>() + rest
}

struct HilbertMap<F> {
    features: F,
    weights: Weights,
    dice: ChaCha8Rng,
    rows: Rows,
    points_m: Vec<[f32; 2]>,
    labels: Vec<bool>,
    order: Vec<usize>,
}

impl<F: Features> HilbertMap<F> {
    fn new(features: F, setup: &Setup) -> Self {
        let weights = Weights::new(features.count(), F::RATE, F::FIRST_SQUARES, ELASTIC_NET);
        Self {
            features,
            weights,
            dice: ChaCha8Rng::seed_from_u64(setup.seed),
            rows: Rows::default(),
            points_m: Vec::new(),
            labels: Vec::new(),
            order: Vec::new(),
        }
    }
}

impl<F: Features> Baseline for HilbertMap<F> {
    fn description(&self) -> String {
        let counts = format!("{} features, {} epochs a scan", self.features.count(), F::EPOCHS);
        format!("{}, {counts}", self.features.description())
    }

    fn integrate(&mut self, shown: &TrainingScan) -> Result<(), Failed> {
        self.points_m.clear();
        self.labels.clear();
        self.points_m.extend(shown.points().map(|(point_m, _)| point_m));
        self.labels.extend(shown.points().map(|(_, occupied)| occupied));
        self.rows.clear();
        self.features.append(&self.points_m, &mut self.rows);
        self.order.clear();
        self.order.extend(0..self.labels.len());
        for _ in 0..F::EPOCHS {
            self.order.shuffle(&mut self.dice);
            for point in &self.order {
                self.weights.learn(self.rows.get(*point), self.labels[*point]);
            }
        }
        Ok(())
    }

    fn predict(&mut self, points_m: &[[f32; 2]]) -> Vec<Prediction> {
        let mut predictions = Vec::with_capacity(points_m.len());
        for points_m in points_m.chunks(ASKED_AT_ONCE) {
            self.rows.clear();
            self.features.append(points_m, &mut self.rows);
            predictions.extend((0..points_m.len()).map(|point| Prediction {
                logit: f64::from(self.weights.logit(self.rows.get(point))),
                variance: None,
            }));
        }
        predictions
    }

    fn memory_bytes(&self) -> usize {
        self.features.bytes() + self.weights.bytes()
    }
}

#[cfg(test)]
mod tests;
