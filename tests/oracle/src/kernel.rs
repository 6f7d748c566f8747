//! Kernels of a displacement, in `f64`.

/// A kernel `k(d)` with `k(0) = 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kernel {
    /// `Πᵢ β(dᵢ/h)/β(0)`, β the cardinal cubic B-spline.
    CubicBSpline {
        /// `h`, metres.
        spacing_m: f64,
    },
    /// `exp(−dᵀd/g)`, eq. (9) with `G = g·I`.
    SquaredExponential {
        /// `g`, square metres.
        shape_m2: f64,
    },
    /// `½ exp(−dᵀd/g) + ½ exp(−dᵀd/4g)`.
    TwoScales {
        /// `g`, square metres.
        shape_m2: f64,
    },
}

impl Kernel {
    /// `k(d)`, `d` in metres.
    #[must_use]
    pub fn value(&self, displacement_m: &[f64]) -> f64 {
        match self {
            Self::CubicBSpline { spacing_m } => {
                displacement_m.iter().map(|d| spline(d / spacing_m) / spline(0.0)).product()
            }
            Self::SquaredExponential { shape_m2 } => {
                (-displacement_m.iter().map(|d| d * d).sum::<f64>() / shape_m2).exp()
            }
            Self::TwoScales { shape_m2 } => {
                let square = displacement_m.iter().map(|d| d * d).sum::<f64>();
                0.5 * ((-square / shape_m2).exp() + (-square / (4.0 * shape_m2)).exp())
            }
        }
    }
}

/// The cardinal cubic B-spline by truncated powers: `β(t) = 1/3! Σₖ (−1)ᵏ C(4, k) (t + 2 − k)³₊`.
fn spline(t: f64) -> f64 {
    // Even, and from the left no term but those that count is summed: no cancellation beyond the knot's own.
    let t = -t.abs();
    let powers = [1.0, -4.0, 6.0, -4.0, 1.0].iter().enumerate();
    powers.map(|(k, binomial)| binomial * (t + 2.0 - k as f64).max(0.0).powi(3)).sum::<f64>() / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spline_has_its_tabulated_values() {
        for (t, value) in [(0.0, 2.0 / 3.0), (1.0, 1.0 / 6.0), (-1.0, 1.0 / 6.0), (2.0, 0.0), (0.5, 23.0 / 48.0)] {
            assert!((spline(t) - value).abs() < 1e-15, "{t}");
        }
    }
}
