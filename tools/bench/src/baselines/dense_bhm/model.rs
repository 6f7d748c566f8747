use faer::Mat;

use super::super::{
    Baseline, Failed, Prediction, Setup,
    dense_algebra::{Cholesky, bytes},
    lattice::Lattice,
    logistic::moderated,
};
use super::lattice::{self, Row};
use crate::evaluation::TrainingScan;

const PRIOR_VARIANCE: f64 = 1e4;
/// Passes of expectation–maximisation over each scan: "1–2 iterations".
const PASSES: usize = 2;
/// Where ξ begins in each scan.
const FIRST_XI: f64 = 1.0;

pub(super) fn open(setup: &Setup) -> Result<Box<dyn Baseline>, Failed> {
    Ok(Box::new(DenseBhm::new(setup)?))
}

struct DenseBhm {
    lattice: Lattice,
    /// Of the setup, metres.
    wanted_m: f32,
    belief: Belief,
}

/// `N(μ, Σ)` with `Λ = Σ⁻¹` and `η = Λμ`.
struct Belief {
    /// `Λ`, its lower triangle.
    information: Mat<f64>,
    eta: Vec<f64>,
    covariance: Mat<f64>,
    mean: Vec<f64>,
}

/// `λ(ξ) = (σ(ξ) − ½) / (2ξ) = tanh(ξ/2) / (4ξ)`.
fn lambda(xi: f64) -> f64 {
    if xi < 1e-4 { 0.125 - xi * xi / 96.0 } else { (0.5 * xi).tanh() / (4.0 * xi) }
}

impl Belief {
    fn prior(supports: usize) -> Self {
        let diagonal = |value: f64| Mat::from_fn(supports, supports, |i, j| if i == j { value } else { 0.0 });
        let zeros = vec![0.0; supports];
        let [information, covariance] = [1.0 / PRIOR_VARIANCE, PRIOR_VARIANCE].map(diagonal);
        Self { information, eta: zeros.clone(), covariance, mean: zeros }
    }

    /// `m = φᵀμ` and `s² = φᵀΣφ`.
    fn moments(&self, row: &Row) -> [f64; 2] {
        let mean = row.iter().map(|(i, phi)| phi * self.mean[*i]).sum();
        let column = |(j, phi): &(usize, f64)| {
            let column = self.covariance.col_as_slice(*j);
            phi * row.iter().map(|(i, phi)| phi * column[*i]).sum::<f64>()
        };
        [mean, row.iter().map(column).sum::<f64>().max(0.0)]
    }

    /// Eqs. (6) and (7) from this belief, for rows with labels and ξ.
    fn updated(&self, rows: &[(Row, bool)], xi: &[f64]) -> Result<Self, Failed> {
        let mut information = self.information.clone();
        let mut eta = self.eta.clone();
        for ((row, occupied), xi) in rows.iter().zip(xi) {
            let curvature = 2.0 * lambda(*xi);
            let pull = if *occupied { 0.5 } else { -0.5 };
            for (at, (j, phi_j)) in row.iter().enumerate() {
                eta[*j] += pull * phi_j;
                let column = information.col_as_slice_mut(*j);
                // Rows rise: these are of the lower triangle.
                for (i, phi_i) in &row[at..] {
                    column[*i] += curvature * phi_i * phi_j;
                }
            }
        }
        let factor = Cholesky::of(information.clone())?;
        let mean = factor.solve(&eta);
        Ok(Self { information, eta, covariance: factor.inverse(), mean })
    }
}

impl DenseBhm {
    fn new(setup: &Setup) -> Result<Self, Failed> {
        let lattice = lattice::over(setup)?;
        Ok(Self { lattice, wanted_m: setup.size, belief: Belief::prior(lattice.count()) })
    }
}

impl Baseline for DenseBhm {
    fn description(&self) -> String {
        let Lattice { spacing_m, shape: [columns, rows], .. } = self.lattice;
        let widened = if spacing_m > f64::from(self.wanted_m) {
            format!(", widened from {} m to fit into memory", self.wanted_m)
        } else {
            String::new()
        };
        format!("{spacing_m:.3} m spacing{widened}, {columns} x {rows} supports, {PASSES} passes")
    }

    fn integrate(&mut self, shown: &TrainingScan) -> Result<(), Failed> {
        let rows: Vec<_> =
            shown.points().map(|(point_m, occupied)| (lattice::row(&self.lattice, point_m), occupied)).collect();
        let rows: Vec<_> = rows.into_iter().filter(|(row, _)| !row.is_empty()).collect();
        if rows.is_empty() {
            return Ok(());
        }
        let mut xi = vec![FIRST_XI; rows.len()];
        let mut updated = self.belief.updated(&rows, &xi)?;
        for _ in 1..PASSES {
            for (xi, (row, _)) in xi.iter_mut().zip(&rows) {
                // Eq. (8).
                let [mean, variance] = updated.moments(row);
                *xi = (variance + mean * mean).sqrt();
            }
            updated = self.belief.updated(&rows, &xi)?;
        }
        self.belief = updated;
        Ok(())
    }

    fn predict(&mut self, points_m: &[[f32; 2]]) -> Vec<Prediction> {
        let ask = |point_m: &[f32; 2]| {
            let [mean, variance] = self.belief.moments(&lattice::row(&self.lattice, *point_m));
            Prediction { logit: moderated(mean, variance), variance: Some(variance) }
        };
        points_m.iter().map(ask).collect()
    }

    fn memory_bytes(&self) -> usize {
        let Belief { information, eta, covariance, mean } = &self.belief;
        bytes(information) + bytes(covariance) + size_of_val(&eta[..]) + size_of_val(&mean[..])
    }
}
