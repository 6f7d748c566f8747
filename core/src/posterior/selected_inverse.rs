//! The entries of `Σ = Λ⁻¹` inside the band, by the Takahashi recursion (Takahashi, Fagan & Chin 1973), in the place of the
//! factor.
//!
//! Row `i` of `Σ` follows from row `i` of `U` and the rows of `Σ` below it:
//! `Σᵢⱼ = δᵢⱼ/Uᵢᵢ² − Σₖ (Uᵢₖ/Uᵢᵢ) Σₖⱼ`, `i < k ≤ i + b`; every `Σₖⱼ` needed lies in the band. `Σ` is kept on both sides of the
//! diagonal, so that each source is one contiguous run.

use super::{
    Band, Moments, Row, Scratch,
    factor::{dot, for_each_panel, subtract_sources},
    runs::{UpperRows, quadratic_forms},
};

/// `Σ` on both sides of the diagonal, as [`Scratch::invert`] leaves it.
struct TwoSided<'a, const M: usize, const B: usize>(&'a [[[f32; B]; 2]; M]);

impl<const M: usize, const B: usize> UpperRows<B> for TwoSided<'_, M, B> {
    #[inline(always)]
    fn upper(&self, row: usize) -> &[f32; B] {
        // The diagonal stands before the second half's entries.
        const { assert!(B > 0) };
        match self.0[row].as_flattened()[B - 1..].first_chunk() {
            Some(upper) => upper,
            None => unreachable!(),
        }
    }
}

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
        let bordered = border.iter().any(|entry| *entry != 0.0);
        for i in (0..M).rev() {
            let (above, below) = flat.split_at_mut((i + 1) * ld);
            let reach = (M - 1 - i).min(B - 1);
            // The row's first half is U's; the second, still zero, becomes Σ(i, i + 1), Σ(i, i + 2), …
            let (upper, sigma) = above[i * ld..].split_at_mut(B);
            let scale = 1.0 / upper[0];
            // weights[k − 1] = U(i, i + k)/U(i, i).
            let mut weights = [0.0; B];
            for (weight, entry) in weights.iter_mut().zip(&upper[1..]) {
                *weight = entry * scale;
            }
            let mut variance = scale * scale;
            if bordered {
                let bias_weight = border[i] * scale;
                let coupled = -bias_weight * bias_covariance - dot(&weights, &border[i + 1..]);
                for (entry, later) in sigma.iter_mut().zip(&border[i + 1..]).take(reach) {
                    *entry = -bias_weight * later;
                }
                variance -= bias_weight * coupled;
                border[i] = coupled;
            }
            for_each_panel!(B, vectors [40, 8, 1], scalars [20, 16, 8, 4, 1], |start, N| {
                if let Some(target) = sigma[start..].first_chunk_mut::<N>() {
                    // Row i + 1 + k has its entry with column i + 1 + start that much left of its diagonal: the starts of the
                    // sources lie ld − 1 apart.
                    let sources = below.get(Self::DIAGONAL + start..).unwrap_or_default().chunks(ld - 1);
                    subtract_sources(
                        target,
                        sources
                            .zip(&weights[..B - 1])
                            .map_while(|(source, weight)| Some((*weight, source.first_chunk()?))),
                    );
                }
            });
            variance -= dot(&weights[..B - 1], sigma);
            for (k, entry) in sigma.iter().enumerate().take(reach) {
                // The entry (i + 1 + k, i) stands k + 1 left of its row's diagonal.
                below[k * ld + Self::DIAGONAL - 1 - k] = *entry;
            }
            upper[Self::DIAGONAL] = variance;
        }
        self.corner = bias_covariance;
    }

    /// Mean step and variance of a row under the candidate: `φᵀ(μ − μ₋)` and `φᵀΣφ`.
    #[inline(always)]
    pub(crate) fn moments(&self, row: &Row<'_>) -> Moments {
        let [variance] = quadratic_forms(row.pattern, row.first, row.alone(), &TwoSided(&self.work));
        let mut moments = Moments { mean: row.dot(&self.step), variance };
        if row.bias != 0.0 {
            moments.mean += row.bias * self.bias_step;
            moments.variance += row.bias * (2.0 * row.dot(&self.border) + row.bias * self.corner);
        }
        moments.variance = moments.variance.max(0.0);
        moments
    }

    /// What an inflated diagonal contributes to the divergence, as sites without pull: `Σᵢ jᵢ (Σᵢᵢ + δᵢ²)`.
    pub(crate) fn inflated(&self) -> f32 {
        let weights = self.inflated.iter().zip(&self.work).zip(&self.step);
        let bias = self.inflated_corner * (self.corner + self.bias_step * self.bias_step);
        weights.map(|((j, sigma), step)| j * (sigma.as_flattened()[Self::DIAGONAL] + step * step)).sum::<f32>() + bias
    }

    /// Copies the candidate's `Σ` out.
    #[inline(always)]
    pub(crate) fn copy_covariance(&self, covariance: &mut Band<M, B>, border: &mut [f32; M], bias: &mut f32) {
        for (row, target) in covariance.iter_mut().enumerate() {
            *target = *TwoSided(&self.work).upper(row);
        }
        *border = self.border;
        *bias = self.corner;
    }
}
