//! A belief with a bias, on both sides: the core's band with a border, and the dense matrix with one weight more.

use bhm_core::{
    em::{self, UpdateReport},
    posterior::NotPositiveDefinite,
    prior::BiasPrior,
    rule::AnyRule,
};
use bhm_oracle::{DensePosterior, Matrix, Observation};

use super::{BandedRow, Learner, SparseRow, push_all};

/// One observation with a bias feature.
#[derive(Clone, Debug)]
pub struct BorderedRow {
    pub row: SparseRow,
    pub bias: f32,
}

/// A learner with a bias, whose prior has these precisions; the coupling stands between the bias and every weight.
pub fn bordered<const M: usize, const B: usize>(precision: f32, bias_precision: f32, coupling: f32) -> Learner<M, B> {
    Learner::new(|prior| {
        prior.reset_white(precision);
        prior.couple_bias(&BiasPrior { precision: bias_precision, coupling });
    })
}

/// The same prior, dense, with the bias as the last weight: with `w′ = w + c·b` the form `λ Σ wᵢ² + λ_b b²` has `λ` on the
/// diagonal, `−λc` between a weight and the bias, and `λ_b + M λ c²` in the corner.
pub fn dense_bordered_prior<const M: usize>(precision: f32, bias_precision: f32, coupling: f32) -> DensePosterior {
    let (precision, bias_precision, coupling) = (f64::from(precision), f64::from(bias_precision), f64::from(coupling));
    let mut information = vec![vec![0.0; M + 1]; M + 1];
    for (i, row) in information.iter_mut().enumerate().take(M) {
        row[i] = precision;
        row[M] = -precision * coupling;
    }
    information[M] = vec![-precision * coupling; M + 1];
    information[M][M] = bias_precision + M as f64 * precision * coupling * coupling;
    DensePosterior::from_information(information, vec![0.0; M + 1]).expect("a prior")
}

/// Rows with every feature, the bias's last, for the oracle.
pub fn bordered_observations<const M: usize>(rows: &[BorderedRow]) -> Vec<Observation> {
    let observation = |row: &BorderedRow| {
        let mut phi = vec![0.0; M + 1];
        for (index, value) in &row.row.entries {
            phi[*index as usize] = f64::from(*value);
        }
        phi[M] = f64::from(row.bias);
        Observation { phi, occupied: row.row.occupied }
    };
    rows.iter().map(observation).collect()
}

impl BorderedRow {
    /// As the core takes it, in a band of `B` among `M` weights.
    pub fn banded<const M: usize, const B: usize>(&self) -> BandedRow {
        BandedRow::of::<M, B>(&self.row, self.bias)
    }
}

impl<const M: usize, const B: usize> Learner<M, B> {
    /// Learns rows with bias features that must all be acceptable.
    pub fn update_bordered(
        &mut self,
        rows: &[BorderedRow],
        rule: &AnyRule,
        passes: u32,
    ) -> Result<UpdateReport, NotPositiveDefinite> {
        let rows = rows.iter().map(|row| (&row.row, row.bias));
        let Self { posterior, pattern, scratch, .. } = self;
        push_all::<M, B, _>(pattern, rows, |rows| em::update(posterior, rows, rule, passes, scratch))
    }

    /// `Λ` with the bias as the last weight, in `f64`.
    pub fn bordered_information(&self) -> Matrix {
        let mut dense = self.information();
        for (row, value) in dense.iter_mut().zip(&self.posterior.border_information) {
            row.push(f64::from(*value));
        }
        let mut last: Vec<f64> = self.posterior.border_information.iter().copied().map(f64::from).collect();
        last.push(f64::from(self.posterior.bias_information));
        dense.push(last);
        dense
    }
}
