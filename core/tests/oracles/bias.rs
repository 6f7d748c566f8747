//! A bias that says much: variances and gradients against the dense matrix in `f64` with one weight more.
//!
//! Between the supports of a B-spline the bias feature is zero and between those of the usual squared exponential a ripple of a
//! hundredth, which hides an error in the bias's terms. Here the features are random, or the kernel is narrow.

use bhm_core::{
    geometry::Point,
    kernel::{KernelSettings, SquaredExponentialSettings, TwoScalesSettings},
    map::Map,
    prior::{PriorSettings, WhitePrior},
    profile::{COMPACT, Capacities, Profile},
    rule::AnyRule,
    settings::{BiasSettings, Settings, TileSettings},
};
use bhm_oracle::{Rule, TileBlend, XiStart, quadratic};

use crate::{
    common::{
        BorderedRow, Learner, SAFEGUARD, SparseRow, Stream, bordered, bordered_observations, dense_bordered_prior,
        labelled,
    },
    map::TestMap,
};

const M: usize = 49;
const B: usize = 9;
/// Priors and rows below keep the condition under 1e4, at which `f32` is right to a few times `1e4 · 6e-8`.
const RELATIVE: f64 = 2e-3;

fn random_row(stream: &mut Stream) -> BorderedRow {
    let first = stream.below(M);
    let mut entries = vec![(first as u32, stream.between(0.2, 1.0) as f32)];
    for offset in 1..B.min(M - first) {
        if stream.unit() < 0.6 {
            entries.push(((first + offset) as u32, stream.between(-0.5, 1.0) as f32));
        }
    }
    let row = SparseRow { entries, occupied: stream.unit() < 0.5 };
    BorderedRow { row, bias: stream.between(-1.0, 1.0) as f32 }
}

#[test]
fn a_belief_with_a_bias_is_the_dense_belief_with_a_weight_more() {
    let rules = AnyRule::ALL.iter().map(|rule| match rule {
        AnyRule::GaussianVariational(_) => (rule, Rule::GaussianVariational { xi_cap: 4.0, safeguard: SAFEGUARD }),
        AnyRule::JaakkolaJordan(_) => (rule, Rule::JaakkolaJordan { start: XiStart::PredictedUpTo(4.0) }),
    });
    for (rule, exact_rule) in rules {
        for seed in 0..12 {
            let mut stream = Stream::new(seed);
            let [precision, bias_precision, coupling] =
                [(0.1, 3.0), (0.1, 3.0), (0.0, 0.7)].map(|(low, high)| stream.between(low, high) as f32);
            let mut learner = bordered::<M, B>(precision, bias_precision, coupling);
            let mut dense = dense_bordered_prior::<M>(precision, bias_precision, coupling);
            for scan in 0..4 {
                // The prior first: what a map says where nothing was observed.
                moments_agree(&learner, &dense, &mut stream, &format!("{}, seed {seed}, scan {scan}", rule.name()));
                let rows: Vec<_> = (0..1 + stream.below(40)).map(|_| random_row(&mut stream)).collect();
                let before = dense.clone();
                let report = learner.update_bordered(&rows, rule, 3).expect("positive definite");
                let observations = bordered_observations::<M>(&rows);
                let trace = dense.update(&observations, &exact_rule, 3).expect("positive definite");
                assert_eq!((report.safeguards, trace.rejected), (0, 0), "nothing is refused here");
                let objective = *trace.objectives.last().expect("three passes");
                // The likelihood is right to 5e-5 nats a row; moments that are off by RELATIVE change a bound that is nearly
                // at its maximum by the square of that.
                let allowed = 1e-4 * rows.len() as f64 + 1e-4 * objective.abs();
                let off = (f64::from(report.objective) - objective).abs();
                assert!(off <= allowed, "{}, seed {seed}: {} for {objective}", rule.name(), report.objective);
                assert!(dense.divergence(&before) > 0.0);
            }
            moments_agree(&learner, &dense, &mut stream, rule.name());
            let information = learner.bordered_information();
            for i in 0..=M {
                let scale = (information[i][i] * information[M][M]).sqrt();
                assert!((information[i][M] - dense.information[i][M]).abs() <= RELATIVE * scale, "Λ[{i}][bias]");
            }
        }
    }
}

/// Mean and variance of rows that were never learned.
fn moments_agree(learner: &Learner<M, B>, dense: &bhm_oracle::DensePosterior, stream: &mut Stream, what: &str) {
    for _ in 0..40 {
        let row = random_row(stream);
        let exact = dense.predict(&bordered_observations::<M>(std::slice::from_ref(&row))[0].phi);
        let banded = row.banded::<M, B>();
        let got = learner.posterior.view().moments(&banded.as_row());
        let off = (f64::from(got.variance) - exact.variance).abs();
        assert!(off <= RELATIVE * exact.variance, "{what}: variance {} for {}", got.variance, exact.variance);
        let off = (f64::from(got.mean) - exact.mean).abs();
        let allowed = RELATIVE * (exact.variance.sqrt() + exact.mean.abs());
        assert!(off <= allowed, "{what}: mean {} for {}", got.mean, exact.mean);
        // Both rows of a bilinear form the same: the variance again.
        let bilinear = learner.posterior.view().bilinear(&banded.as_row(), &banded.as_row());
        assert!((f64::from(bilinear) - exact.variance).abs() <= RELATIVE * exact.variance, "{what}: bilinear");
    }
    // And of two different rows: (φ + ψ)ᵀΣ(φ + ψ) = φᵀΣφ + 2 φᵀΣψ + ψᵀΣψ, the bias of one being zero, of the other not.
    let (left, right) = (random_row(stream), BorderedRow { bias: 0.0, ..random_row(stream) });
    let [phi, psi] = [&left, &right].map(|row| bordered_observations::<M>(std::slice::from_ref(row))[0].phi.clone());
    let sum: Vec<f64> = phi.iter().zip(&psi).map(|(a, b)| a + b).collect();
    // Pairs outside the band count as zero: only rows that lie within one band of each other are asked.
    let reach = |row: &BorderedRow| {
        let indices = row.row.entries.iter().map(|(index, _)| *index as usize);
        (indices.clone().min().unwrap_or(0), indices.max().unwrap_or(0))
    };
    let ((a, b), (c, d)) = (reach(&left), reach(&right));
    if b.max(d) - a.min(c) >= B {
        return;
    }
    let exact = 0.5
        * (quadratic(&dense.covariance, &sum)
            - quadratic(&dense.covariance, &phi)
            - quadratic(&dense.covariance, &psi));
    let (left, right) = (left.banded::<M, B>(), right.banded::<M, B>());
    let got = learner.posterior.view().bilinear(&left.as_row(), &right.as_row());
    let scale = (quadratic(&dense.covariance, &phi) * quadratic(&dense.covariance, &psi)).sqrt();
    assert!((f64::from(got) - exact).abs() <= RELATIVE * scale, "{what}: {got} for {exact}");
}

const PRECISION: f32 = 1e-2;

/// A narrow kernel leaves the bias feature a ripple of a third.
fn rippled(kernel: KernelSettings) -> Profile {
    Profile {
        settings: Settings {
            kernel,
            tile: TileSettings { stencil: 6, width: [14; 2], stride: [8; 2], count: None },
            prior: PriorSettings::White(WhitePrior { precision: PRECISION }),
            bias: Some(BiasSettings { precision: 1e-2 }),
            ..COMPACT.settings
        },
        capacities: Capacities { tiles: 64, ..COMPACT.capacities },
        ..COMPACT
    }
}

/// Far above `f64` rounding, far below the length over which a third derivative matters.
const STEP_M: f64 = 1e-5;

#[test]
fn gradients_with_a_bias_are_the_functions() {
    let kernels = [
        KernelSettings::SquaredExponential(SquaredExponentialSettings { shape: 0.25 }),
        KernelSettings::TwoScales(TwoScalesSettings { shape: 0.25 }),
    ];
    for kernel in kernels {
        let profile = rippled(kernel);
        let mut map = TestMap::<196, 76>::new(&profile);
        let mut stream = Stream::new(71);
        for _ in 0..6 {
            let places: Vec<[f32; 2]> = (0..150).map(|_| [0, 1].map(|_| stream.between(-5.0, 5.0) as f32)).collect();
            // Mostly occupied, so that the bias is far from zero.
            let points = labelled(&places, |at| at[0] + at[1] > -5.0);
            let report = map.integrate_observations(&points);
            assert_eq!(report.tiles_failed, 0);
        }
        let coupling = map.mapper().basis().bias_coupling.map(f64::from);
        assert!(coupling.is_some());
        let mut oracle = TileBlend::of(&profile.settings, coupling);
        let (mut bias, mut largest) = (0.0_f64, 0.0_f64);
        for tile in map.mapper().tiles().iter() {
            oracle.insert_view(tile.index, &tile.posterior.view());
            bias = bias.max(f64::from(tile.posterior.bias_mean).abs());
            largest = tile.posterior.mean.iter().fold(largest, |largest, mean| largest.max(f64::from(*mean).abs()));
        }
        assert!(bias > 0.5, "a bias that says little: {bias}");
        let mut worst = [0.0_f64; 2];
        for _ in 0..2_000 {
            // Observed places, places of which some tiles were never touched, and places that no tile knows.
            let at = [0, 1].map(|_| stream.between(-14.0, 14.0) as f32);
            let got = map.mapper().gradient(&Point::from(at));
            assert_eq!(got.occupancy, map.mapper().occupancy(&Point::from(at)), "at {at:?}");
            let exact = oracle.predict(&at.map(f64::from));
            // Thirty-six products, each of a feature that is right to f32 at a place that is right to 1e-6 m, on which it
            // depends with a slope of 3/h: 1e-6 of the largest terms.
            let mean_scale = 36.0 * (largest + bias);
            // The largest variance there is, the prior's.
            let variance_scale = 36.0 * (1.0 / f64::from(PRECISION));
            // An answer without a gradient takes another way.
            for got in [got.occupancy, map.mapper().occupancy(&Point::from(at))] {
                let off = (f64::from(got.mean) - exact.mean).abs();
                assert!(off <= 1e-6 * mean_scale, "at {at:?}: {got:?} for {exact:?}");
                let off = (f64::from(got.variance) - exact.variance).abs();
                assert!(off <= 1e-6 * variance_scale, "at {at:?}: {got:?} for {exact:?}");
            }
            for (axis, [probability, mean, variance]) in
                oracle.differences(&at.map(f64::from), STEP_M).into_iter().enumerate()
            {
                let slope_per_m = 3.0 / f64::from(profile.settings.spacing_m);
                let off = [f64::from(got.mean[axis]) - mean, f64::from(got.variance[axis]) - variance].map(f64::abs);
                let allowed = [mean_scale, variance_scale].map(|scale| 1e-6 * slope_per_m * scale);
                for part in 0..2 {
                    worst[part] = worst[part].max(off[part] / allowed[part]);
                }
                // p = σ(κm), of which σ′ ≤ ¼ and κ ≤ 1: as right as the mean's slope, and as right as the variance's times
                // (π/16) κ³ m.
                let kappa = (1.0 + std::f64::consts::PI / 8.0 * exact.variance).sqrt().recip();
                let narrowing = std::f64::consts::PI / 16.0 * kappa.powi(3) * exact.mean.abs();
                let allowed = allowed[0] + narrowing * allowed[1] + 1e-5;
                let off = (f64::from(got.probability[axis]) - probability).abs();
                assert!(off <= allowed, "at {at:?}: {} for {probability}", got.probability[axis]);
            }
        }
        println!("{}: bias {bias:.2}, weights {largest:.2}, worst {worst:?} of what is allowed", kernel.name());
        assert!(worst.iter().all(|worst| *worst <= 1.0), "{worst:?}");
    }
}
