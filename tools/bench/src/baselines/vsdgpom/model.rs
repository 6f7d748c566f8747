use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::super::{Baseline, Failed, Prediction, Setup, kernel::SquaredExponential, logistic::moderated};
use super::{
    history::History,
    inducing::{NEAREST, clusters_of, discover, is_new_ground},
    posterior::{Moments, Posterior, Weighted},
};
use crate::evaluation::TrainingScan;

/// Greatest size: the matrices of so many are half a gigabyte each.
const MOST_INDUCING: f32 = 8_192.0;
/// Points that are learned, or asked, at once.
const MOST_AT_ONCE: usize = 2_048;
const ASKED_AT_ONCE: usize = 512;

/// The lengths are parts of the side of the square that each inducing point would have, were they to fill the area.
/// Further than this from every inducing point is new ground.
const SPACING: f64 = 0.5;
/// Length scale of the covariance.
const LENGTH: f64 = 0.52;
/// Prior variance of the log-odds.
const VARIANCE: f64 = 60.0;
/// `ρ` of each step.
const RATE: f64 = 0.02;
/// Points drawn from the history for each step.
const REPLAYED: usize = 500;

/// Points of the history that clusters are found in, and learned again, when there is no room for new ground.
const RECLUSTERED: usize = 5 * MOST_AT_ONCE;
/// Part of the inducing points that those clusters take; the others are for new ground.
const CLUSTERS: f64 = 0.9;
/// By which part the history must have grown since the last time.
const GROWN: f64 = 0.4;
/// The rate of the steps that learn the sample again, with terms of the new belief in place of the old one's.
const RELEARNING_RATE: f64 = 0.1;

pub(super) fn open(setup: &Setup) -> Result<Box<dyn Baseline>, Failed> {
    Ok(Box::new(Vsdgpom::new(setup)?))
}

struct Vsdgpom {
    posterior: Posterior,
    history: History,
    kernel: SquaredExponential,
    spacing_m: f64,
    most_inducing: usize,
    /// Points seen when inducing points were last clustered anew, and how often they were.
    reclustered_at: u64,
    reclusterings: u32,
    rng: ChaCha8Rng,
    seed: u64,
}

fn weighted((at_m, occupied): &([f32; 2], bool), weight: f64) -> Weighted {
    Weighted { at_m: at_m.map(f64::from), occupied: *occupied, weight }
}

impl Vsdgpom {
    fn new(setup: &Setup) -> Result<Self, Failed> {
        let [min_m, max_m] = setup.area_m;
        let [width_m, height_m] = [0, 1].map(|axis| f64::from(max_m[axis]) - f64::from(min_m[axis]));
        let share_m = (width_m * height_m / f64::from(setup.size)).sqrt();
        if !((1.0..=MOST_INDUCING).contains(&setup.size) && share_m > 0.0 && share_m.is_finite()) {
            return Err(Failed(format!("no {} inducing points over {width_m} x {height_m} m", setup.size)));
        }
        let kernel = SquaredExponential { variance: VARIANCE, length_m: LENGTH * share_m };
        Ok(Self {
            posterior: Posterior::prior(kernel)?,
            history: History::default(),
            kernel,
            spacing_m: SPACING * share_m,
            most_inducing: setup.size as usize,
            reclustered_at: 0,
            reclusterings: 0,
            rng: ChaCha8Rng::seed_from_u64(setup.seed),
            seed: setup.seed,
        })
    }

    /// Gives new ground inducing points, if need be after making room for them.
    fn cover(&mut self, points: &[([f32; 2], bool)]) -> Result<(), Failed> {
        let points_m: Vec<_> = points.iter().map(|(at_m, _)| at_m.map(f64::from)).collect();
        let due = self.history.seen() as f64 >= self.reclustered_at as f64 * (1.0 + GROWN);
        if due && self.room() == 0 && is_new_ground(self.posterior.inducing_m(), &points_m, self.spacing_m) {
            self.recluster()?;
        }
        let known_m = self.posterior.inducing_m();
        let further_m = discover(known_m, &points_m, self.spacing_m, self.room(), self.seed);
        self.posterior.extend(&further_m)
    }

    fn room(&self) -> usize {
        self.most_inducing.saturating_sub(self.posterior.inducing_m().len())
    }

    /// Inducing points where most of the history lies. They adopt what is believed about a sample of it, so that its terms are
    /// those of a belief that knows much, and learn it once more. In the order of one axis, most are far from a point that has
    /// the first of its near ones late.
    fn recluster(&mut self) -> Result<(), Failed> {
        let sample = self.history.draw(RECLUSTERED, &mut self.rng);
        let weight = self.history.seen() as f64 / sample.len() as f64;
        let sample: Vec<_> = sample.iter().map(|point| weighted(point, weight)).collect();
        let points_m: Vec<_> = sample.iter().map(|point| point.at_m).collect();
        let clusters = (CLUSTERS * self.most_inducing as f64) as usize;
        let mut posterior = Posterior::prior(self.kernel)?;
        let mut centres_m = clusters_of(&points_m, clusters, NEAREST * self.spacing_m, self.seed);
        centres_m.sort_by(|[a, _], [b, _]| a.total_cmp(b));
        posterior.extend(&centres_m)?;
        sample.chunks(MOST_AT_ONCE).try_for_each(|batch| posterior.adopt(batch, &self.posterior))?;
        for batch in sample.chunks(MOST_AT_ONCE) {
            let weight = RELEARNING_RATE * self.history.seen() as f64 / batch.len() as f64;
            let batch: Vec<_> = batch.iter().map(|point| Weighted { weight, ..*point }).collect();
            posterior.step(&batch, RELEARNING_RATE)?;
        }
        self.posterior = posterior;
        self.reclustered_at = self.history.seen();
        self.reclusterings += 1;
        Ok(())
    }

    fn learn(&mut self, points: &[([f32; 2], bool)]) -> Result<(), Failed> {
        self.cover(points)?;
        let drawn = self.history.draw(REPLAYED, &mut self.rng);
        let weight = RATE * self.history.seen() as f64 / drawn.len().max(1) as f64;
        let mut batch: Vec<_> = points.iter().map(|point| weighted(point, 1.0)).collect();
        batch.extend(drawn.iter().map(|point| weighted(point, weight)));
        self.posterior.step(&batch, RATE)?;
        points.iter().for_each(|point| self.history.add(*point, &mut self.rng));
        Ok(())
    }
}

impl Baseline for Vsdgpom {
    fn description(&self) -> String {
        let Self { kernel, spacing_m, most_inducing, reclusterings, .. } = self;
        let known = self.posterior.inducing_m().len();
        format!(
            "{known} of {most_inducing} inducing points, {spacing_m:.2} m to new ground, clustered anew {reclusterings} times, \
             length scale {:.2} m, variance {}",
            kernel.length_m, kernel.variance
        )
    }

    fn integrate(&mut self, shown: &TrainingScan) -> Result<(), Failed> {
        let points: Vec<_> = shown.points().filter(|(at_m, _)| at_m.iter().all(|x| x.is_finite())).collect();
        points.chunks(MOST_AT_ONCE).try_for_each(|points| self.learn(points))
    }

    fn predict(&mut self, points_m: &[[f32; 2]]) -> Vec<Prediction> {
        let mut answers = Vec::with_capacity(points_m.len());
        for points_m in points_m.chunks(ASKED_AT_ONCE) {
            let points_m: Vec<_> = points_m.iter().map(|at_m| at_m.map(f64::from)).collect();
            answers.extend(self.posterior.moments(&points_m).into_iter().map(|Moments { mean, variance }| {
                Prediction { logit: moderated(mean, variance), variance: Some(variance) }
            }));
        }
        answers
    }

    fn memory_bytes(&self) -> usize {
        self.posterior.memory_bytes() + self.history.memory_bytes()
    }
}
