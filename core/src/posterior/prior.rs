use super::{Posterior, Row};

/// What is believed before any scan: `N(0, Λ₀⁻¹)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Precision of each weight, `Λ₀ = precision · I`.
    pub precision: f32,
    /// The bias's part, if there is one.
    pub bias: Option<BiasPrior>,
}

/// The prior of a bias in the coordinates of [`Basis::new`](crate::basis::Basis::new): `w′ = w + c·b`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasPrior {
    /// Precision of the bias.
    pub precision: f32,
    /// `c`.
    pub coupling: f32,
}

impl Prior {
    /// `Λ₀` between a weight and the bias.
    pub(crate) fn border(&self) -> f32 {
        self.bias.map_or(0.0, |bias| -self.precision * bias.coupling)
    }

    /// `Λ₀` of the bias among `supports` weights.
    pub(crate) fn corner(&self, supports: usize) -> f32 {
        self.bias.map_or(1.0, |bias| bias.precision + self.precision * bias.coupling * bias.coupling * supports as f32)
    }

    /// `φᵀΛ₀⁻¹φ`: the variance where nothing was ever observed.
    #[inline]
    #[must_use]
    pub fn variance(&self, values: &[f32], bias_feature: f32) -> f32 {
        let (mut sum, mut squares) = (0.0, 0.0);
        for value in values {
            sum += value;
            squares += value * value;
        }
        let weights = squares / self.precision;
        self.bias.map_or(weights, |bias| {
            let constant = bias.coupling * sum + bias_feature;
            weights + constant * constant / bias.precision
        })
    }

    /// Half the derivative of [`variance`](Self::variance) when φ changes by `dφ`: `φᵀΛ₀⁻¹dφ`, of rows at the same weights.
    #[inline]
    #[must_use]
    pub fn bilinear(&self, left: &Row<'_>, right: &Row<'_>) -> f32 {
        let dot: f32 = left.values.iter().zip(right.values).map(|(a, b)| a * b).sum();
        let weights = dot / self.precision;
        self.bias.map_or(weights, |bias| {
            let constant = |row: &Row<'_>| bias.coupling * row.values.iter().sum::<f32>() + row.bias;
            weights + constant(left) * constant(right) / bias.precision
        })
    }
}

impl<const M: usize, const B: usize> Posterior<M, B> {
    /// Overwrites everything with the prior, in place.
    pub fn reset(&mut self, prior: &Prior) {
        let (common, border, corner) = prior.bias.map_or((0.0, 0.0, 1.0), |bias| {
            let variance = 1.0 / bias.precision;
            (bias.coupling * bias.coupling * variance, bias.coupling * variance, variance)
        });
        for (i, (information, covariance)) in self.information.iter_mut().zip(&mut self.covariance).enumerate() {
            information.fill(0.0);
            information[0] = prior.precision;
            covariance.fill(0.0);
            covariance[..B.min(M - i)].fill(common);
            covariance[0] += 1.0 / prior.precision;
        }
        self.mean.fill(0.0);
        self.border_information.fill(prior.border());
        self.border_covariance.fill(border);
        self.bias_information = prior.corner(M);
        self.bias_covariance = corner;
        self.bias_mean = 0.0;
        // |Λ₀| does not change under w′ = w + c·b, whose Jacobian has determinant one.
        let bias = prior.bias.map_or(0.0, |bias| libm::logf(bias.precision));
        self.log_determinant = [M as f32 * libm::logf(prior.precision) + bias, 0.0];
    }
}
