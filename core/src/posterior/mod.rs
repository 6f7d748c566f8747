//! The belief about the weights: a Gaussian in information form on a banded matrix.
//!
//! `Λ`, row by row, keeps the entries `(i, i) … (i, i + B − 1)`; dense is `B = M`. The same band of `Σ = Λ⁻¹` and the mean
//! `μ` stand beside it, for the next scan's first pass, for queries and for publication. A bias couples with every weight:
//! it is a border, one dense row beside the band.
//!
//! The posterior knows rows of features at weights, no geometry. Its state and scratch are plain numbers: all-zero bytes are a
//! valid value of both, so the owner can allocate them zeroed, in place.

mod factor;
mod forget;
mod pattern;
mod prior;
mod rows;
mod runs;
mod selected_inverse;

pub use pattern::{MAX_RUNS, Pattern, PatternError, Row};
pub use rows::{RowError, RowState, Rows, Site};

use core::fmt;

/// A banded symmetric matrix's upper half, row by row: `[i][j]` is the entry `(i, i + j)`; zero beyond the last column.
pub type Band<const M: usize, const B: usize> = [[f32; B]; M];

/// A Gaussian over `M` weights and one bias.
#[repr(C)]
#[derive(Clone, Debug, PartialEq)]
pub struct Posterior<const M: usize, const B: usize> {
    /// `Λ` of the weights.
    pub information: Band<M, B>,
    /// `Σ` of the weights, the band of it.
    pub covariance: Band<M, B>,
    /// `μ` of the weights.
    pub mean: [f32; M],
    /// `Λ` between the bias and each weight.
    pub border_information: [f32; M],
    /// `Σ` between the bias and each weight.
    pub border_covariance: [f32; M],
    /// `Λ`, `Σ` and `μ` of the bias itself. Without bias: 1, 1 and 0.
    pub bias_information: f32,
    /// See [`Self::bias_information`].
    pub bias_covariance: f32,
    /// See [`Self::bias_information`].
    pub bias_mean: f32,
    /// `ln |Λ|` as an unevaluated sum of two numbers, since a single one would lose what one scan changes.
    pub log_determinant: [f32; 2],
}

/// Working memory of one update, shared by every posterior of the same shape.
#[repr(C)]
#[derive(Clone, Debug)]
pub struct Scratch<const M: usize, const B: usize> {
    /// First the factor `U` (`Λ = UᵀU`), each row followed by as many zeros; then, in the same place, `Σ` on both sides
    /// of the diagonal.
    work: [[[f32; B]; 2]; M],
    /// `μ − μ₋` of the candidate.
    step: [f32; M],
    /// `μ − μ₋` of the best candidate so far.
    best_step: [f32; M],
    /// The factor's dense row, then `Σ` between bias and weights.
    border: [f32; M],
    /// What the candidate has on its diagonal beyond `Λ`; stale where the factorisation needed nothing.
    inflated: [f32; M],
    /// The factor's last pivot, then the bias's `Σ`.
    corner: f32,
    inflated_corner: f32,
    bias_step: f32,
    best_bias_step: f32,
}

/// A matrix that must be positive definite was not: the first pivot that was not a positive number.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotPositiveDefinite {
    /// The pivot's row; `M` for the bias.
    pub row: usize,
}

impl fmt::Display for NotPositiveDefinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "information matrix is not positive definite at row {}", self.row)
    }
}

impl core::error::Error for NotPositiveDefinite {}

/// Mean and variance of `φᵀw`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// `φᵀμ`.
    pub mean: f32,
    /// `φᵀΣφ`, not below zero.
    pub variance: f32,
}

/// What a query needs of a posterior, wherever it lies: in a mapper, in shared memory, in a file.
#[derive(Clone, Copy, Debug)]
pub struct PosteriorView<'a, const M: usize, const B: usize> {
    /// `μ`.
    pub mean: &'a [f32; M],
    /// The band of `Σ`.
    pub covariance: &'a Band<M, B>,
    /// `Σ` between bias and weights.
    pub border_covariance: &'a [f32; M],
    /// `Σ` of the bias.
    pub bias_covariance: f32,
    /// `μ` of the bias.
    pub bias_mean: f32,
}

impl<const M: usize, const B: usize> Posterior<M, B> {
    /// All zero: the vacant state, for a `static`. [`Prior::write`](crate::prior::Prior::write) makes it the prior.
    pub const ZERO: Self = Self {
        information: [[0.0; B]; M],
        covariance: [[0.0; B]; M],
        mean: [0.0; M],
        border_information: [0.0; M],
        border_covariance: [0.0; M],
        bias_information: 0.0,
        bias_covariance: 0.0,
        bias_mean: 0.0,
        log_determinant: [0.0; 2],
    };

    /// The part that queries read.
    #[inline]
    #[must_use]
    pub fn view(&self) -> PosteriorView<'_, M, B> {
        PosteriorView {
            mean: &self.mean,
            covariance: &self.covariance,
            border_covariance: &self.border_covariance,
            bias_covariance: self.bias_covariance,
            bias_mean: self.bias_mean,
        }
    }

    /// Copies another posterior, array by array, so that nothing large crosses the stack.
    pub fn copy_from(&mut self, source: &Self) {
        self.information.copy_from_slice(&source.information);
        self.covariance.copy_from_slice(&source.covariance);
        self.mean.copy_from_slice(&source.mean);
        self.border_information.copy_from_slice(&source.border_information);
        self.border_covariance.copy_from_slice(&source.border_covariance);
        self.bias_information = source.bias_information;
        self.bias_covariance = source.bias_covariance;
        self.bias_mean = source.bias_mean;
        self.log_determinant = source.log_determinant;
    }

    /// `Λ += c φφᵀ`, in the order in which [`Scratch::factor`] did it, so that `Σ` remains its inverse bit for bit.
    #[inline(always)]
    pub(crate) fn learn(&mut self, row: &Row<'_>, curvature: f32) {
        runs::add_outer(&mut self.information, row, curvature);
        if row.bias != 0.0 {
            row.add_to(curvature * row.bias, &mut self.border_information);
            self.bias_information += curvature * row.bias * row.bias;
        }
    }
}

impl<const M: usize, const B: usize> Posterior<M, B> {
    /// Adds to the diagonal what a kept pass needed there; see [`Scratch::factor`].
    pub(crate) fn inflate(&mut self, inflation: f32) {
        for row in &mut self.information {
            row[0] += inflation * row[0];
        }
        self.bias_information += inflation * self.bias_information;
    }
}

impl<const M: usize, const B: usize> Scratch<M, B> {
    /// Working memory, for a `static`; on a computer allocate it zeroed instead, which is the same value.
    pub const ZERO: Self = Self {
        work: [[[0.0; B]; 2]; M],
        step: [0.0; M],
        best_step: [0.0; M],
        border: [0.0; M],
        inflated: [0.0; M],
        corner: 0.0,
        inflated_corner: 0.0,
        bias_step: 0.0,
        best_bias_step: 0.0,
    };

    /// Remembers the candidate's step and hands its `Σ` to the posterior.
    #[inline(always)]
    pub(crate) fn keep(&mut self, posterior: &mut Posterior<M, B>) {
        self.best_step = self.step;
        self.best_bias_step = self.bias_step;
        self.copy_covariance(
            &mut posterior.covariance,
            &mut posterior.border_covariance,
            &mut posterior.bias_covariance,
        );
    }

    /// Adds the kept step to the mean.
    #[inline(always)]
    pub(crate) fn apply_step(&self, mean: &mut [f32; M], bias_mean: &mut f32) {
        for (mean, step) in mean.iter_mut().zip(&self.best_step) {
            *mean += step;
        }
        *bias_mean += self.best_bias_step;
    }
}

impl<const M: usize, const B: usize> PosteriorView<'_, M, B> {
    /// `φᵀμ` and `φᵀΣφ` of a row, whose weights must all exist; pairs that lie outside the band count as zero.
    ///
    /// # Panics
    /// If a weight of the row does not exist.
    #[inline(always)]
    #[must_use]
    pub fn moments(&self, row: &Row<'_>) -> Moments {
        let [mut variance] = runs::quadratic_forms(row.pattern, row.first, row.alone(), self.covariance);
        if row.bias != 0.0 {
            variance += row.bias * (2.0 * row.dot(self.border_covariance) + row.bias * self.bias_covariance);
        }
        Moments { mean: self.mean_of(row), variance: variance.max(0.0) }
    }

    /// [`moments`](Self::moments) of `L` rows at the same weights without bias, of which `values` are the features, weight by
    /// weight: a vector's worth of rows at the price of one.
    ///
    /// # Panics
    /// If a weight of the rows does not exist.
    #[inline(always)]
    #[must_use]
    pub fn moments_of_many<const L: usize>(
        &self,
        pattern: &Pattern,
        first: usize,
        values: &[[f32; L]],
    ) -> [Moments; L] {
        let variances = runs::quadratic_forms(pattern, first, values, self.covariance);
        let mut means = [0.0; L];
        for (start, run) in pattern.starts().iter().zip(values.chunks_exact(pattern.run())) {
            for (mean, values) in self.mean.get(first + start..).unwrap_or_default().iter().zip(run) {
                for (sum, value) in means.iter_mut().zip(values) {
                    *sum += value * mean;
                }
            }
        }
        core::array::from_fn(|row| Moments { mean: means[row], variance: variances[row].max(0.0) })
    }

    /// `φᵀμ`.
    #[inline(always)]
    #[must_use]
    pub fn mean_of(&self, row: &Row<'_>) -> f32 {
        row.dot(self.mean) + row.bias * self.bias_mean
    }

    /// `φᵀΣψ`.
    #[inline]
    #[must_use]
    pub fn bilinear(&self, left: &Row<'_>, right: &Row<'_>) -> f32 {
        let border = |weight: usize| self.border_covariance.get(weight).copied().unwrap_or(0.0);
        let mut total = left.bias * right.bias * self.bias_covariance;
        for (a, left_value) in left.weights() {
            let mut inner = right.bias * border(a);
            for (b, right_value) in right.weights() {
                let row = self.covariance.get(a.min(b));
                inner += right_value * row.and_then(|row| row.get(a.abs_diff(b))).copied().unwrap_or(0.0);
            }
            total += left_value * inner;
        }
        if left.bias != 0.0 {
            for (b, right_value) in right.weights() {
                total += left.bias * right_value * border(b);
            }
        }
        total
    }
}
