//! The covariance of the Gaussian processes here.

use faer::Mat;

/// Squared exponential `σ² exp(−|x − x'|² / 2ℓ²)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SquaredExponential {
    pub(super) variance: f64,
    pub(super) length_m: f64,
}

impl SquaredExponential {
    pub(super) fn between(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        let [x, y] = [a[0] - b[0], a[1] - b[1]];
        let squared = (x * x + y * y) / (self.length_m * self.length_m);
        // What is nowhere has to do with nothing: not a number becomes 0.
        self.variance * (-0.5 * squared).exp().max(0.0)
    }

    /// Beyond this distance it is less than `part` of the variance.
    pub(super) fn reach_m(&self, part: f64) -> f64 {
        self.length_m * (-2.0 * part.ln()).sqrt()
    }

    /// A row for each of `a`, a column for each of `b`.
    pub(super) fn matrix(&self, a: &[[f64; 2]], b: &[[f64; 2]]) -> Mat<f64> {
        Mat::from_fn(a.len(), b.len(), |i, j| self.between(a[i], b[j]))
    }

    /// Of points with themselves, `jitter` times the variance added on the diagonal.
    pub(super) fn gram(&self, points: &[[f64; 2]], jitter: f64) -> Mat<f64> {
        let mut gram = self.matrix(points, points);
        for i in 0..points.len() {
            gram[(i, i)] += jitter * self.variance;
        }
        gram
    }
}
