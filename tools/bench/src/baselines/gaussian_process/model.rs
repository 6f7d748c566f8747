use std::collections::BTreeMap;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::super::{Baseline, Failed, Prediction, Setup, kernel::SquaredExponential, logistic::moderated};
use super::region::Region;
use crate::evaluation::TrainingScan;

/// Side of a region, metres, unless that would make too many of them.
const SIDE_M: f64 = 1.2;
/// Regions that would cover the whole area, at most: each keeps the factor of its matrix.
const MOST_REGIONS: f64 = 2_048.0;
/// Ground around a region whose points it also learns, as a part of its side.
const MARGIN: f64 = 0.25;
/// Length scale of the covariance, as a part of the side.
const LENGTH: f64 = 0.3;
/// Prior variance of the log-odds.
const VARIANCE: f64 = 16.0;
/// Points a region at most: each fit factorises a matrix of so many rows several times.
const MOST_POINTS: f32 = 4_096.0;
/// Points that are asked of a region at once.
const ASKED_AT_ONCE: usize = 1_024;

pub(super) fn open(setup: &Setup) -> Result<Box<dyn Baseline>, Failed> {
    Ok(Box::new(GaussianProcess::new(setup)?))
}

/// Squares of the plane, each with the exact classifier of a sample of the points in and around it.
struct GaussianProcess {
    kernel: SquaredExponential,
    side_m: f64,
    margin_m: f64,
    points_a_region: usize,
    /// By column and row of their squares.
    regions: BTreeMap<[i64; 2], Region>,
    rng: ChaCha8Rng,
}

impl GaussianProcess {
    fn new(setup: &Setup) -> Result<Self, Failed> {
        let [min_m, max_m] = setup.area_m;
        let [width_m, height_m] = [0, 1].map(|axis| f64::from(max_m[axis]) - f64::from(min_m[axis]));
        if !((1.0..=MOST_POINTS).contains(&setup.size) && width_m.is_finite() && height_m.is_finite()) {
            return Err(Failed(format!("no regions of {} points over {width_m} x {height_m} m", setup.size)));
        }
        let side_m = SIDE_M.max((width_m * height_m / MOST_REGIONS).sqrt());
        Ok(Self {
            kernel: SquaredExponential { variance: VARIANCE, length_m: LENGTH * side_m },
            side_m,
            margin_m: MARGIN * side_m,
            points_a_region: setup.size as usize,
            regions: BTreeMap::new(),
            rng: ChaCha8Rng::seed_from_u64(setup.seed),
        })
    }

    fn square(&self, x_m: f64) -> i64 {
        (x_m / self.side_m).floor() as i64
    }
}

impl Baseline for GaussianProcess {
    fn description(&self) -> String {
        let Self { kernel, side_m, margin_m, points_a_region, .. } = self;
        format!(
            "{} regions of {side_m:.2} m and {margin_m:.2} m around, {points_a_region} points each, length scale {:.2} m, \
             variance {}",
            self.regions.len(),
            kernel.length_m,
            kernel.variance
        )
    }

    fn integrate(&mut self, shown: &TrainingScan) -> Result<(), Failed> {
        for (point_m, occupied) in shown.points().filter(|(point_m, _)| point_m.iter().all(|x| x.is_finite())) {
            let point_m = point_m.map(f64::from);
            let [columns, rows] = point_m.map(|x| self.square(x - self.margin_m)..=self.square(x + self.margin_m));
            for row in rows {
                for column in columns.clone() {
                    let region = self.regions.entry([column, row]).or_default();
                    region.offer(point_m, occupied, self.points_a_region, &mut self.rng);
                }
            }
        }
        self.regions.values_mut().try_for_each(|region| region.refit(&self.kernel).map(|_| ()))
    }

    fn predict(&mut self, points_m: &[[f32; 2]]) -> Vec<Prediction> {
        let mut asked: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
        for (index, point_m) in points_m.iter().enumerate() {
            asked.entry(point_m.map(|x| self.square(f64::from(x)))).or_default().push(index);
        }
        let unknown = Prediction { logit: 0.0, variance: Some(self.kernel.variance) };
        let mut answers = vec![unknown; points_m.len()];
        for (square, asked) in asked {
            let Some(region) = self.regions.get(&square) else { continue };
            for asked in asked.chunks(ASKED_AT_ONCE) {
                let asked_m: Vec<_> = asked.iter().map(|index| points_m[*index].map(f64::from)).collect();
                for (index, [mean, variance]) in asked.iter().zip(region.moments(&self.kernel, &asked_m)) {
                    answers[*index] = Prediction { logit: moderated(mean, variance), variance: Some(variance) };
                }
            }
        }
        answers
    }

    fn memory_bytes(&self) -> usize {
        self.regions.values().map(Region::memory_bytes).sum()
    }
}
