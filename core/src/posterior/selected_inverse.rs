//! The entries of `Σ = Λ⁻¹` inside the band, by the Takahashi recursion (Takahashi, Fagan & Chin 1973), in the place of the
//! factor.
//!
//! Row `i` of `Σ` follows from row `i` of `U` and the rows of `Σ` below it:
//! `Σᵢⱼ = δᵢⱼ/Uᵢᵢ² − Σₖ (Uᵢₖ/Uᵢᵢ) Σₖⱼ`, `i < k ≤ i + b`; every `Σₖⱼ` needed lies in the band. `Σ` is kept on both sides of the
//! diagonal, so that each source is one contiguous run.

use super::{
    Band, Entry, Moments, Scratch,
    factor::{NARROW, PANEL, for_each_panel, subtract_sources},
};

impl<const M: usize, const B: usize> Scratch<M, B> {
    /// Position of the diagonal in a row that holds both sides.
    const DIAGONAL: usize = B - 1;

    /// Replaces the factor by the band of its inverse.
    #[inline(always)]
    pub(crate) fn invert(&mut self) {
        let ld = Self::LD;
        let flat = self.work.as_flattened_mut().as_flattened_mut();
        let bias_covariance = 1.0 / (self.corner * self.corner);
        let border = &mut self.border;
        for i in (0..M).rev() {
            let reach = (M - 1 - i).min(B - 1);
            let (above, below) = flat.split_at_mut((i + 1) * ld);
            let Some(row) = above[i * ld..].first_chunk_mut::<B>() else { break };
            let scale = 1.0 / row[0];
            // weights[k] = U[i][i + k] / U[i][i], k ≥ 1; the target starts as the bias's share.
            let mut weights = *row;
            for weight in &mut weights {
                *weight *= scale;
            }
            let bias_weight = border[i] * scale;
            let mut coupled = -bias_weight * bias_covariance;
            for (weight, later) in weights[1..=reach].iter().zip(&border[i + 1..]) {
                coupled -= weight * later;
            }
            let mut sigma = [0.0; B];
            if bias_weight != 0.0 {
                for (target, later) in sigma[1..=reach].iter_mut().zip(&border[i + 1..]) {
                    *target = -bias_weight * later;
                }
            }
            // sigma[j] is the entry (i, i + j), j = 1..B; panels run over j − 1, one lane past the band being ignored.
            let mut shifted = [0.0; B];
            shifted[..B - 1].copy_from_slice(&sigma[1..]);
            for_each_panel!(B, |start, N| {
                if let Some(target) = shifted[start..].first_chunk_mut::<N>() {
                    // Source k = 1.. is row i + k; its entry (i + k, i + 1 + start) stands k − 1 − start left of the diagonal.
                    subtract_sources(
                        target,
                        below,
                        (0..reach).map(|k| (weights[k + 1], k * (ld - 1) + Self::DIAGONAL + start)),
                    );
                }
            });
            sigma[1..].copy_from_slice(&shifted[..B - 1]);
            sigma[reach + 1..].fill(0.0);
            let mut variance = scale * scale - bias_weight * coupled;
            for (weight, entry) in weights[1..=reach].iter().zip(&sigma[1..=reach]) {
                variance -= weight * entry;
            }
            sigma[0] = variance;
            border[i] = coupled;
            above[i * ld + Self::DIAGONAL..][..B].copy_from_slice(&sigma);
            for (k, entry) in sigma[1..=reach].iter().enumerate() {
                // The entry (i + 1 + k, i) stands k + 1 left of its row's diagonal.
                below[k * ld + Self::DIAGONAL - 1 - k] = *entry;
            }
        }
        self.corner = bias_covariance;
    }

    /// Mean step and variance of a row under the candidate: `φᵀ(μ − μ₋)` and `φᵀΣφ`.
    #[inline(always)]
    pub(crate) fn moments(&self, row: &[Entry], bias: f32) -> Moments {
        let (mut mean, mut variance) = (bias * self.bias_step, bias * bias * self.corner);
        for (i, a) in row.iter().enumerate() {
            mean += a.value * self.step[a.index()];
            let sigma = &self.work[a.index()].as_flattened()[Self::DIAGONAL..];
            let mut inner = 0.5 * a.value * sigma[0];
            for b in &row[i + 1..] {
                inner += b.value * sigma[b.index() - a.index()];
            }
            if bias != 0.0 {
                inner += bias * self.border[a.index()];
            }
            variance += 2.0 * a.value * inner;
        }
        Moments { mean, variance: variance.max(0.0) }
    }

    /// Copies the candidate's `Σ` out.
    #[inline(always)]
    pub(crate) fn copy_covariance(&self, covariance: &mut Band<M, B>, border: &mut [f32; M], bias: &mut f32) {
        for (target, source) in covariance.iter_mut().zip(&self.work) {
            if let Some(upper) = source.as_flattened()[Self::DIAGONAL..].first_chunk::<B>() {
                *target = *upper;
            }
        }
        *border = self.border;
        *bias = self.corner;
    }
}
