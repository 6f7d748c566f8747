use faer::Mat;

use super::super::{
    Failed,
    dense_algebra::{Cholesky, add_gram, bytes, column, product, squared_columns, transposed_times},
    kernel::SquaredExponential,
    logistic::Expected,
};

/// Added to the diagonal of the inducing points' covariance, as a part of the variance.
const JITTER: f64 = 1e-6;

/// A point with its label, and how often its term of the likelihood counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weighted {
    pub(super) at_m: [f64; 2],
    pub(super) occupied: bool,
    pub(super) weight: f64,
}

/// Mean and variance of the log-odds at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moments {
    pub(super) mean: f64,
    pub(super) variance: f64,
}

/// `q(u) = N(Lm, L S Lᵀ)` of the log-odds `u` at the inducing points, where `L Lᵀ` is their prior covariance `K`: the whitened
/// `v = L⁻¹u` has the prior `N(0, I)`. Kept in natural parameters, `S⁻¹` and `S⁻¹m`, in which steps along the natural gradient
/// are sums.
///
/// `L` of more points begins with `L` of fewer, so that a further point is a further coordinate that nothing has been learned
/// of: `q(u, u') = q(u) p(u'|u)`.
pub(super) struct Posterior {
    kernel: SquaredExponential,
    inducing_m: Vec<[f64; 2]>,
    /// `L`.
    prior: Cholesky,
    /// `S⁻¹`, its lower triangle.
    precision: Mat<f64>,
    /// `S⁻¹m`.
    pull: Vec<f64>,
    /// Of `S⁻¹`.
    factor: Cholesky,
    /// `m`.
    mean: Vec<f64>,
}

impl Posterior {
    pub(super) fn prior(kernel: SquaredExponential) -> Result<Self, Failed> {
        let (none, precision) = (Cholesky::of(Mat::zeros(0, 0))?, Mat::zeros(0, 0));
        let (pull, mean) = (Vec::new(), Vec::new());
        Ok(Self { kernel, inducing_m: Vec::new(), prior: none.clone(), precision, pull, factor: none, mean })
    }

    pub(super) fn inducing_m(&self) -> &[[f64; 2]] {
        &self.inducing_m
    }

    /// Adds inducing points; what is believed does not change.
    pub(super) fn extend(&mut self, further_m: &[[f64; 2]]) -> Result<(), Failed> {
        if further_m.is_empty() {
            return Ok(());
        }
        let inducing_m = [&self.inducing_m[..], further_m].concat();
        let prior = Cholesky::of(self.kernel.gram(&inducing_m, JITTER))?;
        let known = self.inducing_m.len();
        let of = |i: usize, j: usize| match (i < known && j < known, i == j) {
            (true, _) => self.precision[(i, j)],
            (false, diagonal) => f64::from(u8::from(diagonal)),
        };
        let precision = Mat::from_fn(inducing_m.len(), inducing_m.len(), of);
        let mut pull = self.pull.clone();
        pull.resize(inducing_m.len(), 0.0);
        let factor = Cholesky::of(precision.clone())?;
        let mean = factor.solve(&pull);
        *self = Self { kernel: self.kernel, inducing_m, prior, precision, pull, factor, mean };
        Ok(())
    }

    /// `a = L⁻¹k` of each point, a column each: `f = aᵀv` and what the inducing points do not determine.
    fn features(&self, points_m: &[[f64; 2]]) -> Mat<f64> {
        let mut a = self.kernel.matrix(&self.inducing_m, points_m);
        self.prior.solve_lower(a.as_mut());
        a
    }

    /// `m = aᵀm_v`, `s² = k − |a|² + aᵀSa` of each column.
    fn moments_of(&self, a: &Mat<f64>) -> Vec<Moments> {
        let means = transposed_times(a.as_ref(), &self.mean);
        let mut half = a.clone();
        self.factor.solve_lower(half.as_mut());
        let variances = squared_columns(a).zip(squared_columns(&half));
        let moments = means.iter().zip(variances).map(|(mean, (known, left))| Moments {
            mean: *mean,
            variance: (self.kernel.variance - known).max(0.0) + left,
        });
        moments.collect()
    }

    pub(super) fn moments(&self, points_m: &[[f64; 2]]) -> Vec<Moments> {
        self.moments_of(&self.features(points_m))
    }

    /// A step along the natural gradient of the evidence lower bound (Hensman et al. 2015 with the gradients of Khan and Lin 2017),
    /// with `E = E_q` over each point's `f ~ N(m, s²)`:
    ///
    /// ```text
    /// S⁻¹  ← (1 − ρ) S⁻¹  + ρ I + Σ w E[σ'(f)] a aᵀ
    /// S⁻¹m ← (1 − ρ) S⁻¹m       + Σ w (y − E σ(f) + E[σ'(f)] m) a
    /// ```
    ///
    /// A point that stands for `n` of the data it was drawn from has weight `w = ρ n`; one that the sums do not hold yet enters
    /// them with `w = 1`.
    pub(super) fn step(&mut self, batch: &[Weighted], rate: f64) -> Result<(), Failed> {
        let points_m: Vec<_> = batch.iter().map(|point| point.at_m).collect();
        let mut a = self.features(&points_m);
        let moments = self.moments_of(&a);
        let mut pulls = Vec::with_capacity(batch.len());
        let mut roots = Vec::with_capacity(batch.len());
        for (Weighted { occupied, weight, .. }, Moments { mean, variance }) in batch.iter().zip(moments) {
            let Expected { probability, curvature } = Expected::of(mean, variance);
            pulls.push(weight * (f64::from(u8::from(*occupied)) - probability + curvature * mean));
            roots.push((weight * curvature).sqrt());
        }
        let keep = 1.0 - rate;
        let pulled = product(a.as_ref(), column(&pulls).as_ref());
        let pull: Vec<_> = self.pull.iter().zip(pulled.col_as_slice(0)).map(|(old, new)| keep * old + new).collect();
        for (j, root) in roots.iter().enumerate() {
            a.col_as_slice_mut(j).iter_mut().for_each(|x| *x *= root);
        }
        let mut precision = self.precision.clone();
        for j in 0..precision.ncols() {
            precision.col_as_slice_mut(j).iter_mut().for_each(|x| *x *= keep);
            precision[(j, j)] += rate;
        }
        add_gram(precision.as_mut(), a.as_ref());
        let factor = Cholesky::of(precision.clone())?;
        let mean = factor.solve(&pull);
        if let Some(at) = mean.iter().position(|x| !x.is_finite()) {
            return Err(Failed(format!("the mean of inducing point {at} is not finite")));
        }
        *self = Self { precision, pull, factor, mean, ..std::mem::replace(self, Self::prior(self.kernel)?) };
        Ok(())
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let vectors = size_of_val(&self.inducing_m[..]) + size_of_val(&self.pull[..]) + size_of_val(&self.mean[..]);
        self.prior.bytes() + bytes(&self.precision) + self.factor.bytes() + vectors
    }
}
