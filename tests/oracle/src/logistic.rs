//! The logistic function, the paper's λ, and an expectation by quadrature.

/// `σ(z) = 1/(1 + e⁻ᶻ)`.
#[must_use]
pub fn sigmoid(z: f64) -> f64 {
    1.0 / (1.0 + (-z).exp())
}

/// `ln σ(z)`.
#[must_use]
pub fn ln_sigmoid(z: f64) -> f64 {
    z.min(0.0) - (-z.abs()).exp().ln_1p()
}

/// `λ(ξ) = (σ(ξ) − ½)/(2ξ)`, eq. (7); 1/8 at 0.
#[must_use]
pub fn lambda(xi: f64) -> f64 {
    // tanh(ξ/2)/(4ξ) is the same without the difference; below, the next term of the series is 1e-20.
    if xi.abs() < 1e-4 { 0.125 - xi * xi / 96.0 } else { (0.5 * xi).tanh() / (4.0 * xi) }
}

/// `E[ln σ(f)]`, `f ~ N(mean, variance)`, by the trapezoidal rule.
///
/// In `z = (f − mean)/s` the integrand's nearest poles are `π/s` from the real line, so a step `h` errs by about
/// `exp(−2π·π/(s h))`: 1e-14 with the step below. ±9 standard deviations leave out 1e-19 of the weight.
#[must_use]
pub fn expected_ln_sigmoid(mean: f64, variance: f64) -> f64 {
    const REACH: f64 = 9.0;
    let deviation = variance.max(0.0).sqrt();
    let nodes = (REACH / (0.6 / deviation.max(1e-9)).min(0.25)).ceil() as i64;
    let step = REACH / nodes as f64;
    let (mut total, mut weight) = (0.0, 0.0);
    for i in -nodes..=nodes {
        let z = i as f64 * step;
        let w = (-0.5 * z * z).exp();
        total += w * ln_sigmoid(mean + deviation * z);
        weight += w;
    }
    total / weight
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lambda_agrees_with_its_definition_and_limit() {
        for xi in [0.01_f64, 0.5, 3.0, 40.0] {
            assert!((lambda(xi) - (sigmoid(xi) - 0.5) / (2.0 * xi)).abs() < 1e-14 / xi);
        }
        assert_eq!(lambda(0.0), 0.125);
    }

    #[test]
    fn quadrature_keeps_exact_identities() {
        // ln σ(f) − ln σ(−f) = f, hence so in expectation; and a certain f is no integral at all.
        for (mean, variance) in [(0.3, 0.5), (-4.0, 30.0), (50.0, 1e4), (0.0, 1e6)] {
            let difference = expected_ln_sigmoid(mean, variance) - expected_ln_sigmoid(-mean, variance);
            assert!((difference - mean).abs() < 1e-10 * (1.0 + mean.abs()));
        }
        assert!((expected_ln_sigmoid(1.7, 0.0) - ln_sigmoid(1.7)).abs() < 1e-15);
        // Halving the step changes nothing: E over N(0, s²) by brute force.
        for deviation in [0.5_f64, 2.0, 20.0] {
            let (mut total, mut weight) = (0.0, 0.0);
            for i in -400_000..=400_000 {
                let z = f64::from(i) * 2.5e-5;
                let w = (-0.5 * z * z).exp();
                total += w * ln_sigmoid(0.4 + deviation * z);
                weight += w;
            }
            let exact = total / weight;
            assert!((expected_ln_sigmoid(0.4, deviation * deviation) - exact).abs() < 1e-10, "{deviation}");
        }
    }
}
