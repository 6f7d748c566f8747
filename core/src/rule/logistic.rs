//! The logistic function and its expectations, in `f32`.

/// The logistic function `σ(z) = 1/(1 + e⁻ᶻ)`: the probability of log-odds `z`.
#[inline]
#[must_use]
pub fn sigmoid(z: f32) -> f32 {
    let e = libm::expf(-z.abs());
    let small = e / (1.0 + e);
    if z < 0.0 { small } else { 1.0 - small }
}

/// `ln σ(z)`.
#[inline]
#[must_use]
pub fn ln_sigmoid(z: f32) -> f32 {
    z.min(0.0) - libm::log1pf(libm::expf(-z.abs()))
}

/// `λ(ξ) = (σ(ξ) − ½)/(2ξ)`, eq. (7): `tanh(ξ/2)/(4ξ)`, and its series below 0.02 where that is 0/0.
#[inline]
#[must_use]
pub fn jaakkola_lambda(xi: f32) -> f32 {
    let xi = xi.abs();
    if xi < 0.02 { 0.125 - xi * xi * (1.0 / 96.0) } else { 0.25 * libm::tanhf(0.5 * xi) / xi }
}

/// `κ = 1/√(1 + πs²/8)`: how far uncertainty pulls a logit towards zero (probit approximation).
#[inline]
#[must_use]
pub fn kappa(variance: f32) -> f32 {
    1.0 / libm::sqrtf(1.0 + core::f32::consts::FRAC_PI_8 * variance)
}

/// Weights and widths of the normal cumulative distributions whose mixture is the logistic function.
///
/// Fitted by minimising the largest error of the integrated mixture against `ln(1 + eᶻ)`: 3.8e-5 nats.
const MIXTURE: [(f32, f32); 3] = [(0.566_076_4, 1.841_183_3), (0.110_642_57, 2.916_276_5), (0.323_281_06, 1.152_688_4)];

/// `E[ln σ(f)]` for `f ~ N(mean, variance)`, within 5e-5 nats (relative 1e-6 where it is large) for every mean and variance.
///
/// The logistic function as a mixture of normal cumulative distributions (Monahan & Stefanski 1992) makes the expectation
/// a closed form whose error does not depend on the variance; Gauss–Hermite nodes miss the kink of `ln σ` by nats where
/// the prior is wide.
#[inline]
#[must_use]
pub fn expected_ln_sigmoid(mean: f32, variance: f32) -> f32 {
    let mut total = 0.0;
    for (weight, width) in MIXTURE {
        let spread = libm::sqrtf(width * width + variance);
        total += weight * spread * positive_part(mean.abs() / spread);
    }
    mean.min(0.0) - total
}

/// `E[max(0, Z − u)]` for a standard normal `Z` and `u ≥ 0`: `φ(u) − u·(1 − Φ(u))`, within 4e-7.
#[inline]
fn positive_part(u: f32) -> f32 {
    const INVERSE_SQRT_TAU: f32 = 0.398_942_3;
    // 1 − Φ(u) = φ(u)·poly(t), Abramowitz & Stegun 26.2.17: one exponential for both terms.
    let t = 1.0 / (1.0 + 0.231_641_9 * u);
    let tail = t * (0.319_381_53 + t * (-0.356_563_78 + t * (1.781_477_9 + t * (-1.821_256 + t * 1.330_274_4))));
    INVERSE_SQRT_TAU * libm::expf(-0.5 * u * u) * (1.0 - u * tail)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `E[ln σ(f)]` by the trapezoidal rule in `f64`, which converges geometrically for a Gaussian weight.
    fn by_quadrature(mean: f64, variance: f64) -> f64 {
        let deviation = variance.sqrt();
        let (mut total, mut weight) = (0.0, 0.0);
        let step = (0.05 / deviation.max(1e-3)).min(0.02);
        let nodes = (9.0 / step) as i64;
        for i in -nodes..=nodes {
            let z = i as f64 * step;
            let w = (-0.5 * z * z).exp();
            let f = mean + deviation * z;
            total += w * (f.min(0.0) - (-f.abs()).exp().ln_1p());
            weight += w;
        }
        total / weight
    }

    #[test]
    fn expected_log_likelihood_agrees_with_quadrature_from_certain_to_wide_open() {
        for variance in [0.0_f64, 1e-4, 0.01, 0.3, 1.0, 4.0, 30.0, 400.0, 1e4] {
            for i in -40..=40 {
                let mean = f64::from(i).powi(3) * 5e-3;
                let exact = by_quadrature(mean, variance);
                let got = f64::from(expected_ln_sigmoid(mean as f32, variance as f32));
                assert!(
                    (got - exact).abs() < 5e-5 + 1e-6 * exact.abs(),
                    "m {mean} s² {variance}: {got} against {exact}"
                );
            }
        }
    }

    #[test]
    fn lambda_is_smooth_where_its_formula_is_not() {
        for i in 1..4_000 {
            let xi = f64::from(i) * 1e-3;
            let exact = (xi / 2.0).tanh() / (4.0 * xi);
            assert!((f64::from(jaakkola_lambda(xi as f32)) - exact).abs() < 2e-8);
        }
        assert_eq!(jaakkola_lambda(0.0), 0.125);
    }

    #[test]
    fn sigmoid_and_its_logarithm_hold_at_the_ends() {
        for z in [-200.0_f32, -20.0, -1.0, 0.0, 1.0, 20.0, 200.0] {
            let exact = 1.0 / (1.0 + (-f64::from(z)).exp());
            assert!((f64::from(sigmoid(z)) - exact).abs() < 1e-7);
            assert!(ln_sigmoid(z).is_finite());
        }
        assert_eq!(ln_sigmoid(-200.0), -200.0);
    }
}
