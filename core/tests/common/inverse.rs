//! Whether the stored `Σ` is the inverse of the stored `Λ`, in `f64`.

use bhm_oracle::{Factor, Matrix};

use super::Learner;

/// How far the band of `Σ` is from the inverse of `Λ`, and how far it may be.
#[derive(Clone, Copy, Debug)]
pub struct Inverse {
    /// Largest difference, in units of the two weights' standard deviations.
    pub off: f64,
    /// Condition of `Λ` scaled to a unit diagonal, an upper bound of it: the product of the two largest row sums.
    pub condition: f64,
    /// What `f32` may do to an inverse at that condition: an entry of `Σ` comes of as many roundings as there are weights.
    pub allowed: f64,
}

impl Inverse {
    /// Without bias.
    pub fn of<const M: usize, const B: usize>(learner: &Learner<M, B>) -> Self {
        let information = learner.information();
        let inverse = Factor::of(&information).expect("positive definite in f64").inverse();
        let mut off = 0.0_f64;
        for (i, row) in learner.posterior.covariance.iter().enumerate() {
            for (j, value) in row.iter().enumerate().take(M - i) {
                let scale = (inverse[i][i] * inverse[i + j][i + j]).sqrt();
                off = off.max((f64::from(*value) - inverse[i][i + j]).abs() / scale);
            }
        }
        let condition = condition(&information, &inverse);
        Self { off, condition, allowed: M as f64 * f64::from(f32::EPSILON) / 2.0 * condition }
    }
}

/// An upper bound of the condition of a matrix that is scaled to a unit diagonal.
fn condition(information: &Matrix, inverse: &Matrix) -> f64 {
    let root: Vec<f64> = information.iter().enumerate().map(|(i, row)| row[i].sqrt()).collect();
    let largest = |matrix: &Matrix, scaled: &dyn Fn(f64, f64, f64) -> f64| {
        let row_sum = |(i, row): (usize, &Vec<f64>)| {
            row.iter().enumerate().map(|(j, value)| scaled(*value, root[i], root[j]).abs()).sum::<f64>()
        };
        matrix.iter().enumerate().map(row_sum).fold(0.0, f64::max)
    };
    largest(information, &|value, a, b| value / (a * b)) * largest(inverse, &|value, a, b| value * a * b)
}
