use faer::Mat;

use super::super::{
    Failed,
    dense_algebra::{Cholesky, column, product, squared_columns, transposed_times},
    kernel::SquaredExponential,
};
use crate::metrics::sigmoid;

/// Newton's steps at most.
const MOST_STEPS: usize = 30;
/// The objective rises by less than this at the last of them, nats.
const CONVERGED: f64 = 1e-6;
/// A step that does not raise the objective is halved so often at most.
const MOST_HALVINGS: usize = 30;

/// A binary Gaussian process classifier, by Laplace's approximation at the mode `f̂ = Ka` of the log-odds of its points.
#[derive(Clone)]
pub(super) struct Laplace {
    /// `a = ∇ log p(y|f̂)`, of each point.
    pub(super) gradient: Vec<f64>,
    /// `W½`, of each point: `W = σ'(f̂)`.
    roots: Vec<f64>,
    /// Of `B = I + W½ K W½`.
    factor: Cholesky,
}

/// `a` and `f = Ka`, with `Ψ = −½ aᵀf + log p(y|f)`.
struct Iterate {
    a: Vec<f64>,
    f: Vec<f64>,
    objective: f64,
}

impl Iterate {
    fn at(a: Vec<f64>, gram: &Mat<f64>, occupied: &[bool]) -> Self {
        let f = product(gram.as_ref(), column(&a).as_ref()).col_as_slice(0).to_vec();
        let likelihood = |(f, occupied): (&f64, &bool)| {
            let f = if *occupied { *f } else { -*f };
            f.min(0.0) - (-f.abs()).exp().ln_1p()
        };
        let quadratic: f64 = a.iter().zip(&f).map(|(a, f)| a * f).sum();
        let objective = -0.5 * quadratic + f.iter().zip(occupied).map(likelihood).sum::<f64>();
        Self { a, f, objective }
    }
}

impl Laplace {
    /// Algorithm 3.1: Newton's method in `a`, beginning at `start`. Rises at each step, if need be after halving it, which the
    /// concave objective always allows.
    pub(super) fn fit(
        kernel: &SquaredExponential,
        points_m: &[[f64; 2]],
        occupied: &[bool],
        start: Vec<f64>,
    ) -> Result<Self, Failed> {
        let gram = kernel.gram(points_m, 0.0);
        let mut now = Iterate::at(start, &gram, occupied);
        for _ in 0..MOST_STEPS {
            let (roots, factor) = Self::curvature(&gram, &now.f)?;
            let full = Self::newton(&gram, &now.f, occupied, &roots, &factor);
            let mut next = Iterate::at(full.clone(), &gram, occupied);
            for _ in 0..MOST_HALVINGS {
                // Also if it is not a number.
                if next.objective >= now.objective {
                    break;
                }
                let half = next.a.iter().zip(&now.a).map(|(next, now)| 0.5 * (next + now)).collect();
                next = Iterate::at(half, &gram, occupied);
            }
            let risen = next.objective - now.objective;
            if risen >= 0.0 {
                now = next;
            }
            // Also if it is not a number.
            if risen.is_nan() || risen < CONVERGED {
                break;
            }
        }
        if !now.objective.is_finite() {
            return Err(Failed(format!("a mode of {} points is not finite", points_m.len())));
        }
        let (roots, factor) = Self::curvature(&gram, &now.f)?;
        let gradient = now.f.iter().zip(occupied).map(|(f, y)| f64::from(u8::from(*y)) - sigmoid(*f)).collect();
        Ok(Self { gradient, roots, factor })
    }

    /// `W½` and the factor of `B`.
    fn curvature(gram: &Mat<f64>, f: &[f64]) -> Result<(Vec<f64>, Cholesky), Failed> {
        let roots: Vec<_> = f.iter().map(|f| (sigmoid(*f) * sigmoid(-f)).sqrt()).collect();
        let mut b = gram.clone();
        for (j, root) in roots.iter().enumerate() {
            b.col_as_slice_mut(j).iter_mut().zip(&roots).for_each(|(x, other)| *x *= root * other);
            b[(j, j)] += 1.0;
        }
        Ok((roots, Cholesky::of(b)?))
    }

    /// `a = b − W½ B⁻¹ W½ K b` with `b = W f + ∇ log p(y|f)`.
    fn newton(gram: &Mat<f64>, f: &[f64], occupied: &[bool], roots: &[f64], factor: &Cholesky) -> Vec<f64> {
        let b: Vec<_> = (0..f.len())
            .map(|i| roots[i] * roots[i] * f[i] + f64::from(u8::from(occupied[i])) - sigmoid(f[i]))
            .collect();
        let kb = product(gram.as_ref(), column(&b).as_ref());
        let scaled: Vec<_> = kb.col_as_slice(0).iter().zip(roots).map(|(x, root)| x * root).collect();
        let solved = factor.solve(&scaled);
        (0..f.len()).map(|i| b[i] - roots[i] * solved[i]).collect()
    }

    /// Algorithm 3.2: mean and variance of the log-odds at each point.
    pub(super) fn moments(
        &self,
        kernel: &SquaredExponential,
        points_m: &[[f64; 2]],
        asked_m: &[[f64; 2]],
    ) -> Vec<[f64; 2]> {
        let mut cross = kernel.matrix(points_m, asked_m);
        let means = transposed_times(cross.as_ref(), &self.gradient);
        for j in 0..cross.ncols() {
            cross.col_as_slice_mut(j).iter_mut().zip(&self.roots).for_each(|(x, root)| *x *= root);
        }
        self.factor.solve_lower(cross.as_mut());
        let known = squared_columns(&cross);
        means.iter().zip(known).map(|(mean, known)| [*mean, (kernel.variance - known).max(0.0)]).collect()
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.factor.bytes() + size_of_val(&self.gradient[..]) + size_of_val(&self.roots[..])
    }
}
