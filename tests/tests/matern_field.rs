//! With the Matérn prior a Bayesian Hilbert map is a Gaussian process with a Matérn covariance, written on splines: against a dense
//! Gaussian process in `f64`, whose covariance is that of the field in the whole plane, `σ² κd K₁(κd)` (Whittle 1954).

use bhm_core::{
    prior::{MaternPrior, PriorSettings},
    profile::COMPACT,
    settings::{Settings, TileSettings},
};
use bhm_oracle::{DensePosterior, Factor, Features, Kernel, Matrix, prior, times};

mod common;
use common::Stream;

const RANGE_M: f64 = 1.5;
const DEVIATION: f64 = 3.0;

/// The field's region: its edge is more than two ranges away from all that is observed or asked.
const SIDE_M: f64 = 9.0;

/// The modified Bessel function `K₁`, `∫₀^∞ exp(−x cosh t) cosh t dt`.
fn bessel_k1(x: f64) -> f64 {
    let step = 1e-3;
    (0..12_000)
        .map(|i| {
            let t = (f64::from(i) + 0.5) * step;
            (-x * t.cosh()).exp() * t.cosh() * step
        })
        .sum()
}

/// `σ² κd K₁(κd)`, κ = √8/range.
fn covariance(one: [f64; 2], other: [f64; 2]) -> f64 {
    let distance = (one[0] - other[0]).hypot(one[1] - other[1]) * 8.0_f64.sqrt() / RANGE_M;
    DEVIATION * DEVIATION * if distance < 1e-6 { 1.0 } else { distance * bessel_k1(distance) }
}

/// Mean and variance at the places asked, of a belief that has the pulls and curvatures at the places observed.
fn gaussian_process(observed: &[([f64; 2], f64, f64)], asked: &[[f64; 2]]) -> Vec<(f64, f64)> {
    let gram: Matrix = observed
        .iter()
        .enumerate()
        .map(|(i, (one, curvature, _))| {
            let entry = |(j, (other, ..)): (usize, &([f64; 2], f64, f64))| {
                covariance(*one, *other) + if i == j { 1.0 / curvature } else { 0.0 }
            };
            observed.iter().enumerate().map(entry).collect()
        })
        .collect();
    let inverse = Factor::of(&gram).expect("positive definite").inverse();
    let targets: Vec<f64> = observed.iter().map(|(_, curvature, pull)| pull / curvature).collect();
    let weights = times(&inverse, &targets);
    asked
        .iter()
        .map(|at| {
            let cross: Vec<f64> = observed.iter().map(|(place, ..)| covariance(*at, *place)).collect();
            let mean = cross.iter().zip(&weights).map(|(a, b)| a * b).sum();
            let known: f64 = cross.iter().zip(times(&inverse, &cross)).map(|(a, b)| a * b).sum();
            (mean, covariance(*at, *at) - known)
        })
        .collect()
}

/// The same belief on splines this far apart.
fn splines(spacing_m: f64, observed: &[([f64; 2], f64, f64)], asked: &[[f64; 2]]) -> Vec<(f64, f64)> {
    let width = (SIDE_M / spacing_m).round() as usize + 3;
    let settings = Settings {
        spacing_m: spacing_m as f32,
        prior: PriorSettings::Matern(MaternPrior { deviation: DEVIATION as f32, range_m: RANGE_M as f32 }),
        tile: TileSettings { stencil: 4, width: [width; 2], stride: [width - 4; 2], count: Some([1, 1]) },
        ..COMPACT.settings
    };
    let features = Features {
        origin_m: [-0.5 * spacing_m * (width - 1) as f64; 2],
        spacing_m,
        width: [width; 2],
        stencil: 4,
        kernel: Kernel::CubicBSpline { spacing_m },
        bias: false,
    };
    let DensePosterior { mut information, mut eta, .. } = prior::of(&settings);
    for (at, curvature, pull) in observed {
        let phi = features.at(at);
        for (i, left) in phi.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            eta[i] += pull * left;
            for (j, right) in phi.iter().enumerate() {
                information[i][j] += curvature * left * right;
            }
        }
    }
    let belief = DensePosterior::from_information(information, eta).expect("positive definite");
    asked
        .iter()
        .map(|at| {
            let prediction = belief.predict(&features.at(at));
            (prediction.mean, prediction.variance)
        })
        .collect()
}

#[test]
fn the_finer_the_splines_the_closer_the_map_is_to_a_gaussian_process() {
    let mut stream = Stream::new(41);
    let mut place = || [0, 1].map(|_| stream.between(-1.2, 1.2));
    // Sites such as observations of a logistic likelihood are: curvatures below ¼, pulls up to ½.
    let observed: Vec<([f64; 2], f64, f64)> = (0..60)
        .map(|i| {
            let at = place();
            (at, 0.02 + 0.2 * f64::from(i % 5) / 4.0, if at[0] > 0.3 * at[1] { 0.5 } else { -0.5 })
        })
        .collect();
    let asked: Vec<[f64; 2]> = (0..200).map(|_| place()).collect();
    let exact = gaussian_process(&observed, &asked);
    let mut errors = Vec::new();
    for spacing_m in [1.5, 0.9, 0.5, 0.36, 0.3] {
        let found = splines(spacing_m, &observed, &asked);
        let rms = |part: fn(&(f64, f64)) -> f64| {
            let squares = found.iter().zip(&exact).map(|(a, b)| (part(a) - part(b)).powi(2));
            (squares.sum::<f64>() / asked.len() as f64).sqrt()
        };
        let (mean, deviation) = (rms(|moments| moments.0), rms(|moments| moments.1.sqrt()));
        println!(
            "{spacing_m:.2} m between supports: mean off by {mean:.4}, deviation by {deviation:.4} (root mean square)"
        );
        errors.push((mean, deviation));
    }
    for pair in errors.windows(2) {
        assert!(pair[1].0 < pair[0].0 && pair[1].1 < pair[0].1, "{errors:?}");
    }
    // The field has no derivative: splines come near it at about the rate of their spacing to the power of 3/2. An energy without
    // the slopes along one axis ends at 0.14 and 0.14, one that counts the mixed derivative once at 0.076 and 0.081.
    let (mean, deviation) = errors[4];
    assert!(mean < 0.065 && deviation < 0.115, "{errors:?}");
}
