use faer::Mat;

use super::super::{
    Failed,
    dense_algebra::{Cholesky, add_gram, bytes, column, product, squared_columns, transposed_times},
    kernel::SquaredExponential,
    logistic::Expected,
};

/// Added to the diagonal of the inducing points' covariance, as a part of the variance.
const JITTER: f64 = 1e-6;

/// The covariance below this part of the variance is left out, where a point meets an inducing point: less than the jitter.
const NEGLIGIBLE: f64 = 1e-10;
/// Columns that are solved for at once.
const BLOCK: usize = 128;

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

/// `a = L⁻¹k` of points, a column each: `f = aᵀv` and what the inducing points do not determine. Columns begin with zeros: up
/// to the first inducing point that is near. They are in the order of it, so that blocks of them leave the rows above out.
struct Features {
    columns: Mat<f64>,
    blocks: Vec<Block>,
    /// Whose each column is.
    points: Vec<usize>,
}

/// Columns that are zero above a row.
struct Block {
    row: usize,
    column: usize,
    columns: usize,
}

fn places(batch: &[Weighted]) -> Vec<[f64; 2]> {
    batch.iter().map(|point| point.at_m).collect()
}

/// `L⁻¹ A`.
fn solve_blocks(lower: &Cholesky, columns: &mut Mat<f64>, blocks: &[Block]) {
    for &Block { row, column, columns: width } in blocks {
        let rows = columns.nrows() - row;
        lower.solve_lower_from(row, columns.submatrix_mut(row, column, rows, width));
    }
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
        let (known, further) = (self.inducing_m.len(), further_m.len());
        let beside = self.kernel.matrix(&self.inducing_m, further_m);
        let prior = self.prior.extended(beside, self.kernel.gram(further_m, JITTER))?;
        let factor = self.factor.extended(Mat::zeros(known, further), Mat::identity(further, further))?;
        let of = |i: usize, j: usize| match (i < known && j < known, i == j) {
            (true, _) => self.precision[(i, j)],
            (false, diagonal) => f64::from(u8::from(diagonal)),
        };
        self.precision = Mat::from_fn(known + further, known + further, of);
        self.inducing_m.extend_from_slice(further_m);
        self.pull.resize(known + further, 0.0);
        self.mean.resize(known + further, 0.0);
        (self.prior, self.factor) = (prior, factor);
        Ok(())
    }

    fn features(&self, points_m: &[[f64; 2]]) -> Features {
        let reach_m = self.kernel.reach_m(NEGLIGIBLE);
        let near = |i: usize, j: usize| {
            let [x, y] = [0, 1].map(|axis| self.inducing_m[i][axis] - points_m[j][axis]);
            x * x + y * y <= reach_m * reach_m
        };
        let size = self.inducing_m.len();
        let first = |j: usize| (0..size).find(|i| near(*i, j)).unwrap_or(size);
        let mut order: Vec<_> = (0..points_m.len()).map(|j| (first(j), j)).collect();
        order.sort_unstable();
        let blocks: Vec<_> = order
            .chunks(BLOCK)
            .enumerate()
            .map(|(i, columns)| Block { row: columns[0].0, column: i * BLOCK, columns: columns.len() })
            .collect();
        let of = |i: usize, column: usize| match order[column] {
            (first, j) if i >= first && near(i, j) => self.kernel.between(self.inducing_m[i], points_m[j]),
            _ => 0.0,
        };
        let mut columns = Mat::from_fn(size, points_m.len(), of);
        solve_blocks(&self.prior, &mut columns, &blocks);
        Features { columns, blocks, points: order.into_iter().map(|(_, j)| j).collect() }
    }

    /// `m = aᵀm_v`, `s² = k − |a|² + aᵀSa` of each column.
    fn moments_of(&self, a: &Features) -> Vec<Moments> {
        let means = transposed_times(a.columns.as_ref(), &self.mean);
        let mut half = a.columns.clone();
        solve_blocks(&self.factor, &mut half, &a.blocks);
        let variances = squared_columns(&a.columns).zip(squared_columns(&half));
        let moments = means.iter().zip(variances).map(|(mean, (known, left))| Moments {
            mean: *mean,
            variance: (self.kernel.variance - known).max(0.0) + left,
        });
        moments.collect()
    }

    pub(super) fn moments(&self, points_m: &[[f64; 2]]) -> Vec<Moments> {
        let a = self.features(points_m);
        let mut moments: Vec<_> = a.points.iter().zip(self.moments_of(&a)).collect();
        moments.sort_unstable_by_key(|(point, _)| **point);
        moments.into_iter().map(|(_, moments)| moments).collect()
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
        let a = self.features(&places(batch));
        let moments = self.moments_of(&a);
        self.add(batch, a, &moments, rate)
    }

    /// Adds the terms of points under what `other` believes about them: what it learned, said by these inducing points.
    pub(super) fn adopt(&mut self, batch: &[Weighted], other: &Self) -> Result<(), Failed> {
        let points_m = places(batch);
        let (a, moments) = (self.features(&points_m), other.moments(&points_m));
        let moments: Vec<_> = a.points.iter().map(|point| moments[*point]).collect();
        self.add(batch, a, &moments, 0.0)
    }

    /// The sums of a step with terms at these moments, one for each column.
    fn add(&mut self, batch: &[Weighted], mut a: Features, moments: &[Moments], rate: f64) -> Result<(), Failed> {
        let mut pulls = Vec::with_capacity(batch.len());
        let mut roots = Vec::with_capacity(batch.len());
        for (point, &Moments { mean, variance }) in a.points.iter().zip(moments) {
            let Weighted { occupied, weight, .. } = batch[*point];
            let Expected { probability, curvature } = Expected::of(mean, variance);
            pulls.push(weight * (f64::from(u8::from(occupied)) - probability + curvature * mean));
            roots.push((weight * curvature).sqrt());
        }
        let keep = 1.0 - rate;
        let pulled = product(a.columns.as_ref(), column(&pulls).as_ref());
        let pull: Vec<_> = self.pull.iter().zip(pulled.col_as_slice(0)).map(|(old, new)| keep * old + new).collect();
        for (j, root) in roots.iter().enumerate() {
            a.columns.col_as_slice_mut(j).iter_mut().for_each(|x| *x *= root);
        }
        let mut precision = self.precision.clone();
        for j in 0..precision.ncols() {
            precision.col_as_slice_mut(j).iter_mut().for_each(|x| *x *= keep);
            precision[(j, j)] += rate;
        }
        for Block { row, column, columns } in a.blocks {
            let rows = precision.nrows() - row;
            add_gram(precision.submatrix_mut(row, row, rows, rows), a.columns.submatrix(row, column, rows, columns));
        }
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
