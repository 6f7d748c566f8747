//! Bayesian Hilbert maps whose covariance is kept diagonal, the way public programs make them affordable.
//!
//! The model is that of the full map: `p(occupied) = σ(wᵀφ(x))` with squared-exponential features on a lattice, the last scan's
//! posterior `N(m₀, diag s₀²)` as the next one's prior, and Jaakkola and Jordan's bound. With `λ(ξ) = tanh(ξ/2)/(4ξ)`,
//!
//! ```text
//! 1/s_j² = 1/s₀_j² + 2 Σ_n λ(ξ_n) φ_nj²
//! ```
//!
//! The two entries differ in the mean. The public programs multiply the diagonal covariance with the natural mean,
//! `m_j = s_j² (m₀_j/s₀_j² + Σ_n φ_nj (y_n − ½))`: as if no two features ever saw the same point. The best factorised posterior
//! instead has (the minimum over `m_j` of the bound, the other means fixed)
//!
//! ```text
//! m_j = s_j² (m₀_j/s₀_j² + Σ_n φ_nj (y_n − ½ − 2 λ(ξ_n) Σ_{k≠j} φ_nk m_k))
//! ```
//!
//! which is solved feature after feature, once for each pass.

use std::f64::consts::PI;

use super::{Baseline, Entry, Failed, Prediction, Setup, Size, lattice::Lattice};
use crate::evaluation::TrainingScan;

pub(super) const ENTRIES: &[Entry] = &[
    Entry {
        name: "diagonal-bhm",
        summary: "Bayesian Hilbert map with a diagonal covariance, as public programs compute it",
        source: "Senanayake and Ramos 2017, the diagonal variant of their public program: one step of EM a scan (each further one \
                 scores worse, in the public program too), features below 1e-9 dropped, the moderated logit answers",
        size: Size::Metres(0.5),
        open: |setup| Ok(Box::new(DiagonalBhm::new(setup, Mean::AsIfAlone)?)),
    },
    Entry {
        name: "diagonal-bhm-mean-field",
        summary: "the same with the best diagonal posterior instead",
        source: "Senanayake and Ramos 2017 for the model; mean-field coordinate ascent (Bishop 2006, section 10.1) for the mean, \
                 with six passes a scan",
        size: Size::Metres(0.5),
        open: |setup| Ok(Box::new(DiagonalBhm::new(setup, Mean::Factorised)?)),
    },
];

/// Features below this are dropped.
const LEAST_FEATURE: f64 = 1e-9;

/// How the mean follows from a scan; see the head of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mean {
    AsIfAlone,
    Factorised,
}

impl Mean {
    /// Precision of every weight before the first scan. The public program's 1e-4 lets the factorised mean, which follows the
    /// data, run off to where six passes do not bring it back.
    fn prior_precision(self) -> f64 {
        match self {
            Self::AsIfAlone => 1e-4,
            Self::Factorised => 1e-2,
        }
    }

    fn passes(self) -> usize {
        match self {
            Self::AsIfAlone => 1,
            Self::Factorised => 6,
        }
    }
}

struct DiagonalBhm {
    lattice: Lattice,
    how: Mean,
    mean: Vec<f64>,
    precision: Vec<f64>,
    work: Work,
}

/// What a scan is learned in, kept so that its memory is.
#[derive(Default)]
struct Work {
    /// Numbers of supports and their features, point after point.
    features: Vec<(u32, f64)>,
    /// Where each point's begin, and the end of the last.
    starts: Vec<usize>,
    /// `y − ½`.
    labels: Vec<f64>,
    xi: Vec<f64>,
    lambda: Vec<f64>,
    logits: Vec<f64>,
    prior_mean: Vec<f64>,
    prior_precision: Vec<f64>,
    /// Support, point and feature, in this order.
    columns: Vec<(u32, u32, f64)>,
}

impl Work {
    fn row(&self, point: usize) -> &[(u32, f64)] {
        &self.features[self.starts[point]..self.starts[point + 1]]
    }
}

/// `λ(ξ) = tanh(ξ/2)/(4ξ)`, ⅛ in the limit.
fn lambda(xi: f64) -> f64 {
    if xi < 1e-4 { 0.125 } else { (xi / 2.0).tanh() / (4.0 * xi) }
}

impl DiagonalBhm {
    fn new(setup: &Setup, how: Mean) -> Result<Self, Failed> {
        let lattice = Lattice::over(setup, f64::from(setup.size))?;
        let (mean, precision) = (vec![0.0; lattice.count()], vec![how.prior_precision(); lattice.count()]);
        Ok(Self { lattice, how, mean, precision, work: Work::default() })
    }

    /// Mean and variance of `wᵀφ`.
    fn moments(&self, point_m: [f32; 2]) -> [f64; 2] {
        let mut moments = [0.0; 2];
        self.lattice.features(point_m, LEAST_FEATURE, |support, feature| {
            moments[0] += feature * self.mean[support];
            moments[1] += feature * feature / self.precision[support];
        });
        moments
    }

    fn take(&mut self, shown: &TrainingScan) {
        let mut work = std::mem::take(&mut self.work);
        work.features.clear();
        work.starts.clear();
        work.starts.push(0);
        work.labels.clear();
        for (point_m, occupied) in shown.points() {
            self.lattice
                .features(point_m, LEAST_FEATURE, |support, feature| work.features.push((support as u32, feature)));
            work.starts.push(work.features.len());
            work.labels.push(if occupied { 0.5 } else { -0.5 });
        }
        let points = work.labels.len();
        work.xi.clear();
        work.xi.resize(points, 1.0);
        work.lambda.resize(points, 0.0);
        work.logits.resize(points, 0.0);
        work.prior_mean.clone_from(&self.mean);
        work.prior_precision.clone_from(&self.precision);
        work.columns.clear();
        if self.how == Mean::Factorised {
            for point in 0..points {
                let row = work.starts[point]..work.starts[point + 1];
                let column = |(support, feature): &(u32, f64)| (*support, point as u32, *feature);
                work.columns.extend(work.features[row].iter().map(column));
            }
            work.columns.sort_unstable_by_key(|(support, point, _)| (*support, *point));
        }
        self.work = work;
    }

    fn pass(&mut self) {
        let work = &mut self.work;
        self.precision.clone_from(&work.prior_precision);
        for point in 0..work.labels.len() {
            work.lambda[point] = lambda(work.xi[point]);
            for (support, feature) in work.row(point) {
                self.precision[*support as usize] += 2.0 * work.lambda[point] * feature * feature;
            }
        }
        match self.how {
            Mean::AsIfAlone => self.mean_as_if_alone(),
            Mean::Factorised => self.mean_factorised(),
        }
        let work = &mut self.work;
        for point in 0..work.labels.len() {
            let (mut mean, mut variance) = (0.0, 0.0);
            for (support, feature) in work.row(point) {
                mean += feature * self.mean[*support as usize];
                variance += feature * feature / self.precision[*support as usize];
            }
            work.xi[point] = (variance + mean * mean).sqrt();
        }
    }

    fn mean_as_if_alone(&mut self) {
        let work = &self.work;
        for ((mean, prior_mean), prior_precision) in
            self.mean.iter_mut().zip(&work.prior_mean).zip(&work.prior_precision)
        {
            *mean = prior_mean * prior_precision;
        }
        for point in 0..work.labels.len() {
            for (support, feature) in work.row(point) {
                self.mean[*support as usize] += feature * work.labels[point];
            }
        }
        for (mean, precision) in self.mean.iter_mut().zip(&self.precision) {
            *mean /= precision;
        }
    }

    fn mean_factorised(&mut self) {
        let work = &mut self.work;
        for point in 0..work.labels.len() {
            work.logits[point] = work.row(point).iter().map(|(support, f)| f * self.mean[*support as usize]).sum();
        }
        for column in work.columns.chunk_by(|a, b| a.0 == b.0) {
            let support = column[0].0 as usize;
            let before = self.mean[support];
            let mut natural = work.prior_mean[support] * work.prior_precision[support];
            for (_, point, feature) in column {
                let point = *point as usize;
                let others = work.logits[point] - feature * before;
                natural += feature * (work.labels[point] - 2.0 * work.lambda[point] * others);
            }
            self.mean[support] = natural / self.precision[support];
            let change = self.mean[support] - before;
            for (_, point, feature) in column {
                work.logits[*point as usize] += feature * change;
            }
        }
    }
}

impl Baseline for DiagonalBhm {
    fn description(&self) -> String {
        format!("{} supports {} m apart, {} passes", self.mean.len(), self.lattice.spacing_m, self.how.passes())
    }

    fn integrate(&mut self, shown: &TrainingScan) -> Result<(), Failed> {
        self.take(shown);
        for _ in 0..self.how.passes() {
            self.pass();
        }
        Ok(())
    }

    /// `E[σ(f)] ≈ σ(m / √(1 + π s²/8))` (MacKay 1992).
    fn predict(&mut self, points_m: &[[f32; 2]]) -> Vec<Prediction> {
        let ask = |point_m: &[f32; 2]| {
            let [mean, variance] = self.moments(*point_m);
            Prediction { logit: mean / (1.0 + PI * variance / 8.0).sqrt(), variance: Some(variance) }
        };
        points_m.iter().map(ask).collect()
    }

    fn memory_bytes(&self) -> usize {
        size_of_val(&self.mean[..]) + size_of_val(&self.precision[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baselines::test_support::{of_points, setup};

    const AREA_M: [[f32; 2]; 2] = [[-2.0, -2.0], [2.0, 2.0]];

    /// Points half a metre apart are never features of each other's support on a lattice of 40 m: one support, one feature.
    fn one_support(how: Mean) -> DiagonalBhm {
        DiagonalBhm::new(&setup(AREA_M, 40.0), how).unwrap()
    }

    /// A single support at the origin, on which one free point lies (φ = 1). By hand, from ξ = 1 and λ(1) = tanh(½)/4:
    /// precision p₁ = p₀ + 2λ, mean −½/p₁.
    #[test]
    fn one_support_and_one_point_are_the_closed_form() {
        let mut map = one_support(Mean::AsIfAlone);
        map.integrate(&of_points(0, &[([0.0, 0.0], false)], None)).unwrap();
        assert_eq!(map.mean.len(), 1);
        let precision = 1e-4 + 2.0 * 0.5_f64.tanh() / 4.0;
        let [mean, variance] = map.moments([0.0, 0.0]);
        assert!((mean + 0.5 / precision).abs() < 1e-12 && (variance - 1.0 / precision).abs() < 1e-12);
        let found = map.predict(&[[0.0, 0.0]])[0];
        assert!((found.logit - mean / (1.0 + PI * variance / 8.0).sqrt()).abs() < 1e-12);
    }

    /// With one support, both means are the scalar recursion, whatever the points: EM written out without rows or columns.
    #[test]
    fn one_support_is_the_scalar_formula() {
        let points = [([0.0_f32, 0.0_f32], true), ([3.0, 1.0], false), ([-9.0, 4.0], true), ([6.0, -6.0], true)];
        let shape_m2 = 0.6 * 40.0 * 40.0;
        for how in [Mean::AsIfAlone, Mean::Factorised] {
            let mut map = one_support(how);
            let (mut mean, mut precision) = (0.0, how.prior_precision());
            for scan in 0..3 {
                map.integrate(&of_points(scan, &points, None)).unwrap();
                let (prior_mean, prior_precision) = (mean, precision);
                let mut xi = [1.0_f64; 4];
                for _ in 0..how.passes() {
                    let mut natural = prior_mean * prior_precision;
                    precision = prior_precision;
                    for (([x, y], occupied), xi) in points.iter().zip(xi) {
                        let phi = (-f64::from(x * x + y * y) / shape_m2).exp();
                        natural += phi * (f64::from(u8::from(*occupied)) - 0.5);
                        precision += phi * phi * (1.0 / (1.0 + (-xi).exp()) - 0.5) / xi;
                    }
                    mean = natural / precision;
                    for (([x, y], _), xi) in points.iter().zip(&mut xi) {
                        let phi = (-f64::from(x * x + y * y) / shape_m2).exp();
                        *xi = phi * (1.0 / precision + mean * mean).sqrt();
                    }
                }
            }
            assert!((map.mean[0] - mean).abs() < 1e-9 && (map.precision[0] - precision).abs() < 1e-9, "{how:?}");
        }
    }

    /// Among several supports the factorised mean, repeated, solves `(P + 2 Φᵀ Λ Φ) m = P m₀ + Φᵀ(y − ½)`: checked by its
    /// residual with dense rows.
    #[test]
    fn the_factorised_mean_solves_the_dense_equations() {
        let mut map = DiagonalBhm::new(&setup(AREA_M, 1.0), Mean::Factorised).unwrap();
        let places = (0..40).map(|i| ([(i as f32 * 0.7).sin() * 1.8, (i as f32 * 1.3).cos() * 1.8], i % 3 == 0));
        let shown = of_points(0, &places.collect::<Vec<_>>(), None);
        map.take(&shown);
        map.pass();
        for _ in 0..20_000 {
            map.mean_factorised();
        }
        let dense: Vec<Vec<f64>> = (0..40)
            .map(|point| {
                let mut row = vec![0.0; map.mean.len()];
                map.work.row(point).iter().for_each(|(support, feature)| row[*support as usize] = *feature);
                row
            })
            .collect();
        for j in 0..map.mean.len() {
            let mut residual = -map.mean[j] * how_prior();
            for (n, row) in dense.iter().enumerate() {
                let logit: f64 = row.iter().zip(&map.mean).map(|(f, m)| f * m).sum();
                residual += row[j] * (map.work.labels[n] - 2.0 * map.work.lambda[n] * logit);
            }
            assert!(residual.abs() < 1e-8, "support {j}: {residual}");
        }
    }

    fn how_prior() -> f64 {
        Mean::Factorised.prior_precision()
    }

    #[test]
    fn far_points_and_empty_scans_are_harmless() {
        for how in [Mean::AsIfAlone, Mean::Factorised] {
            let mut map = DiagonalBhm::new(&setup(AREA_M, 0.5), how).unwrap();
            map.integrate(&of_points(0, &[], None)).unwrap();
            map.integrate(&of_points(1, &[([1e30, -1e30], true), ([0.1, 0.1], true)], None)).unwrap();
            let found = map.predict(&[[1e30, -1e30], [0.1, 0.1]]);
            assert_eq!(found[0], Prediction { logit: 0.0, variance: Some(0.0) });
            assert!(found[1].logit > 0.0 && found[1].variance > Some(0.0));
        }
    }
}
