//! The logistic likelihood under a Gaussian belief about the log-odds, which several baselines share.

use std::f64::consts::PI;

use crate::metrics::sigmoid;

/// The log-odds `m/√(1 + πs²/8)` of the mean probability (MacKay 1992).
pub(super) fn moderated(mean: f64, variance: f64) -> f64 {
    mean / (1.0 + PI * variance / 8.0).sqrt()
}

/// Expectations over `f ~ N(m, s²)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Expected {
    /// `E σ(f)`.
    pub(super) probability: f64,
    /// `E σ'(f)`.
    pub(super) curvature: f64,
}

/// Standard deviations to either side that expectations reach; what is left out is below 1e-8.
const REACH: f64 = 6.0;
/// Steps to either side. The trapezoid rule converges geometrically for integrands analytic in a strip, here of half-width
/// π/s: with this step the error is below 1e-6 up to s = 5, where Gauss–Hermite of as many nodes is no better.
const STEPS: i32 = 24;

impl Expected {
    pub(super) fn of(mean: f64, variance: f64) -> Self {
        let deviation = variance.max(0.0).sqrt();
        let [mut total, mut probability, mut curvature] = [0.0; 3];
        for step in -STEPS..=STEPS {
            let z = REACH * f64::from(step) / f64::from(STEPS);
            let weight = (-0.5 * z * z).exp();
            let p = sigmoid(mean + deviation * z);
            total += weight;
            probability += weight * p;
            curvature += weight * p * (1.0 - p);
        }
        Self { probability: probability / total, curvature: curvature / total }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Simpson's rule of 20 000 steps over ±12 standard deviations.
    fn simpson(mean: f64, deviation: f64, g: impl Fn(f64) -> f64) -> f64 {
        let (steps, reach) = (20_000, 12.0);
        let width = 2.0 * reach / f64::from(steps);
        let weight = |i: i32| if i == 0 || i == steps { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
        let at = |i: i32| {
            let z = -reach + width * f64::from(i);
            (-0.5 * z * z).exp() / (2.0 * PI).sqrt() * g(mean + deviation * z)
        };
        (0..=steps).map(|i| weight(i) * at(i)).sum::<f64>() * width / 3.0
    }

    #[test]
    fn expectations_are_those_of_fine_quadrature() {
        for mean in [-9.0, -2.0, 0.0, 0.3, 4.0] {
            for deviation in [0.0, 0.1, 1.0, 3.0, 5.0] {
                let Expected { probability, curvature } = Expected::of(mean, deviation * deviation);
                let fine = simpson(mean, deviation, sigmoid);
                assert!((probability - fine).abs() < 1e-6, "{mean} {deviation}: {probability} {fine}");
                let fine = simpson(mean, deviation, |f| sigmoid(f) * sigmoid(-f));
                assert!((curvature - fine).abs() < 1e-6, "{mean} {deviation}: {curvature} {fine}");
            }
        }
    }
}
