//! The posterior as linear algebra: whatever the shape, it is what the dense formulas give, or an error and no change.

mod common;

use bhm_core::{
    em,
    geometry::Point,
    kernel::{CubicBSplineSettings, KernelSettings, SquaredExponentialSettings},
    map::Map,
    posterior::{NotPositiveDefinite, Pattern, RowError, RowState, Rows},
    profile::{COMPACT, Capacities, Profile},
    rule::{AnyRule, JaakkolaJordan, XiStart as CoreXiStart},
    settings::{BiasSettings, Settings, TileSettings},
};
use bhm_host::map::OwnedMapper;
use bhm_oracle::{DenseMap, DensePosterior, Features, Observation, Rule, TileBlend, XiStart};
use common::{BandedRow, Learner, SAFEGUARD, SparseRow, Stream, labelled, observations};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const JAAKKOLA: AnyRule = AnyRule::JaakkolaJordan(JaakkolaJordan { start: CoreXiStart::Constant(1.0) });
const EXACT_JAAKKOLA: Rule = Rule::JaakkolaJordan { start: XiStart::Constant(1.0) };

/// Priors and rows below keep the condition under 1e4, at which `f32` is right to a few times `1e4 · 6e-8`.
const RELATIVE: f64 = 2e-3;

/// A row anywhere in a band of `band`, with a few entries.
fn random_row(stream: &mut Stream, supports: usize, band: usize) -> SparseRow {
    let first = stream.below(supports);
    let reach = band.min(supports - first);
    let mut entries = vec![(first as u32, stream.between(0.2, 1.0) as f32)];
    for offset in 1..reach {
        if stream.unit() < 6.0 / band as f64 {
            entries.push(((first + offset) as u32, stream.between(-0.5, 1.0) as f32));
        }
    }
    SparseRow { entries, occupied: stream.unit() < 0.5 }
}

/// Learns random scans on both sides; compares `Σ`, `μ` and `ln|Λ|`, then forgets on both sides and compares again.
fn shape_agrees<const M: usize, const B: usize>(seed: u64) {
    let mut stream = Stream::new(seed);
    let precision = 10.0_f64.powf(stream.between(-1.5, 1.0)) as f32;
    let mut learner = Learner::<M, B>::flat(precision);
    let prior = DensePosterior::prior(&[f64::from(precision); M]);
    let mut dense = prior.clone();
    let compare = |learner: &Learner<M, B>, dense: &DensePosterior, what: &str| {
        let posterior = &learner.posterior;
        let inverse = learner.dense().unwrap().covariance;
        for i in 0..M {
            for (j, got) in posterior.covariance[i].iter().enumerate() {
                if i + j >= M {
                    assert_eq!((*got, posterior.information[i][j]), (0.0, 0.0), "beyond the last column");
                    continue;
                }
                let scale = (dense.covariance[i][i] * dense.covariance[i + j][i + j]).sqrt();
                for exact in [dense.covariance[i][i + j], inverse[i][i + j]] {
                    assert!(
                        (f64::from(*got) - exact).abs() <= RELATIVE * scale,
                        "{M}×{B} seed {seed}, {what}: Σ[{i}][{}] {got} against {exact}",
                        i + j
                    );
                }
            }
            let deviation = dense.covariance[i][i].sqrt();
            let off = (f64::from(posterior.mean[i]) - dense.mean[i]).abs();
            assert!(
                off <= RELATIVE * (deviation + dense.mean[i].abs()),
                "{M}×{B} seed {seed}, {what}: μ[{i}] off {off}"
            );
        }
        let log_determinant = f64::from(posterior.log_determinant[0]) + f64::from(posterior.log_determinant[1]);
        let off = (log_determinant - dense.log_determinant).abs();
        // Each pivot to RELATIVE/10: they do not all err at once.
        assert!(off <= 0.1 * RELATIVE * M as f64, "{M}×{B} seed {seed}, {what}: ln|Λ| off by {off}");
    };
    for scan in 0..4 {
        let rows: Vec<_> = (0..1 + stream.below(60)).map(|_| random_row(&mut stream, M, B)).collect();
        learner.update(&rows, &JAAKKOLA, 2).unwrap();
        dense.update(&observations::<M>(&rows), &EXACT_JAAKKOLA, 2).unwrap();
        compare(&learner, &dense, "learned");
        if scan % 2 == 1 {
            let keep = stream.between(0.2, 1.0) as f32;
            let core_prior = learner.prior.clone();
            learner.posterior.discount(&core_prior, keep, &mut learner.scratch).unwrap();
            dense.discount(&prior, f64::from(keep)).unwrap();
            compare(&learner, &dense, "forgotten");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 24,
        rng_seed: RngSeed::Fixed(77),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn every_shape_is_the_dense_formula(seed in any::<u64>()) {
        shape_agrees::<1, 1>(seed);
        shape_agrees::<10, 1>(seed);
        shape_agrees::<7, 2>(seed);
        shape_agrees::<49, 9>(seed);
        shape_agrees::<49, 49>(seed);
        shape_agrees::<36, 36>(seed);
        shape_agrees::<64, 41>(seed);
        shape_agrees::<64, 64>(seed);
        shape_agrees::<100, 57>(seed);
    }

}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 300,
        rng_seed: RngSeed::Fixed(78),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn a_row_that_does_not_fit_is_an_error_and_changes_nothing(seed in any::<u64>(), kind in 0..8_usize) {
        const M: usize = 30;
        const B: usize = 7;
        let mut stream = Stream::new(seed);
        const LEN: usize = 5;
        let pattern = Pattern::new(1, [0, 1, 2, 4, 6]).expect("a pattern");
        let mut features: Vec<f32> = (0..9 * LEN).map(|_| stream.between(-0.5, 1.0) as f32).collect();
        // The nearest that is too far to the right, as often as any.
        let too_far = M + 1 - B + stream.below(2) * stream.below(1_000_000);
        let (feature, first) = (stream.below(LEN), stream.below(M + 1 - B));
        let not_finite = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][stream.below(3)];
        let number = 9 + stream.below(2) * stream.below(1_000_000);
        // The ninth row's features, its first weight and its bias's feature.
        let (number, first, bias, expected) = match kind {
            0 => (8, too_far, 0.0, RowError::OutsideMatrix { index: too_far + B - 1, supports: M }),
            1 => (8, M + stream.below(2) * (usize::MAX - M), 0.0, RowError::OutsideMatrix { index: 0, supports: M }),
            2 | 3 => {
                features[8 * LEN + feature] = not_finite;
                (8, first, 0.0, RowError::NotFinite { feature })
            }
            4 => (8, first, not_finite, RowError::NotFinite { feature: LEN }),
            5 => (number, first, 0.0, RowError::NoFeatures { number }),
            6 => (usize::MAX / (1 + stream.below(2) * LEN), first, 0.0, RowError::NoFeatures { number: 0 }),
            _ => (8, first, 0.0, RowError::Full),
        };
        let expected = match expected {
            RowError::OutsideMatrix { index: 0, supports } => {
                RowError::OutsideMatrix { index: first.saturating_add(B).saturating_sub(1), supports }
            }
            RowError::NoFeatures { .. } => RowError::NoFeatures { number },
            other => other,
        };
        let good: Vec<(usize, bool)> = (0..8).map(|_| (stream.below(M + 1 - B), stream.unit() < 0.5)).collect();
        // Where there is no room it is the last that does not fit.
        let at = if expected == RowError::Full { 8 } else { 4 };
        let run = |intrude: bool| {
            let mut learner = Learner::<M, B>::flat(0.1);
            let mut states = vec![RowState::ZERO; if expected == RowError::Full { 8 } else { 20 }];
            let mut rows = Rows::new(&pattern, &features, &mut states);
            for place in 0..=8 {
                if intrude && place == at {
                    assert_eq!(rows.push::<M, B>(number, first, bias, true), Err(expected));
                    assert_eq!(rows.len(), place);
                }
                if let Some((first, occupied)) = good.get(place) {
                    rows.push::<M, B>(place, *first, 0.0, *occupied).unwrap();
                }
            }
            em::update(&mut learner.posterior, &mut rows, &JAAKKOLA, 2, &mut learner.scratch).unwrap();
            learner.posterior
        };
        prop_assert!(run(false) == run(true));
    }

    /// Whatever else is wrong with the row, and whether or not there is a weight that far away.
    #[test]
    fn a_pattern_wider_than_the_band_is_an_error(first in 0..40_usize, gap in 0..40_usize, number in 0..3_usize) {
        let pattern = Pattern::new(3, [0, 3 + gap]).expect("a pattern");
        let (features, mut states) = ([0.5; 12], [RowState::ZERO; 4]);
        let mut rows = Rows::new(&pattern, &features, &mut states);
        let span = 6 + gap;
        let pushed = rows.push::<30, 17>(number, first, 0.0, true);
        if span > 17 {
            prop_assert_eq!(pushed, Err(RowError::OutsideBand { span, band: 17 }));
        } else if first + span > 30 {
            prop_assert_eq!(pushed, Err(RowError::OutsideMatrix { index: first + span - 1, supports: 30 }));
        } else if number == 2 {
            prop_assert_eq!(pushed, Err(RowError::NoFeatures { number }));
        } else {
            prop_assert_eq!(pushed, Ok(()));
        }
        prop_assert_eq!(rows.len(), usize::from(pushed.is_ok()));
    }

    #[test]
    fn an_indefinite_matrix_is_named_by_its_row_and_nothing_changes(row in 0..20_usize, rule in 0..2_usize) {
        let mut learner = Learner::<20, 4>::flat(0.5);
        // The entries around it are zero, so the pivot is the entry: no row of the scan reaches it.
        learner.posterior.information[row][0] = -0.25;
        let untouched = learner.posterior.clone();
        let far = if row < 10 { 15 } else { 2 };
        let rows = [SparseRow { entries: vec![(far, 1.0), (far + 1, 0.5)], occupied: true }];
        for passes in [1, 3] {
            let error = learner.update(&rows, &AnyRule::ALL[rule], passes).unwrap_err();
            prop_assert_eq!(error, NotPositiveDefinite { row });
            prop_assert!(learner.posterior == untouched);
        }
        let prior = learner.prior.clone();
        let error = learner.posterior.discount(&prior, 0.9, &mut learner.scratch).unwrap_err();
        prop_assert_eq!(error, NotPositiveDefinite { row });
        prop_assert!(learner.posterior == untouched);
    }
}

#[test]
fn full_memory_is_an_error() {
    let (pattern, features, mut states) = (Pattern::contiguous(2), [1.0; 6], [RowState::ZERO; 2]);
    let mut rows = Rows::new(&pattern, &features, &mut states);
    assert_eq!(rows.push::<8, 4>(0, 0, 0.0, true), Ok(()));
    assert_eq!(rows.push::<8, 4>(1, 6, 0.0, true), Ok(()));
    assert_eq!(rows.push::<8, 4>(2, 2, 0.0, true), Err(RowError::Full));
    assert_eq!(rows.len(), 2);
    rows.clear();
    assert_eq!((rows.push::<8, 4>(2, 2, 0.0, true), rows.len()), (Ok(()), 1));
    assert_eq!(Rows::new(&pattern, &features, &mut []).push::<8, 4>(0, 0, 0.0, true), Err(RowError::Full));
}

/// Forgetting through the façade, with a bias and both kernels: the power prior in the plain coordinates of the oracle.
#[test]
fn forgetting_in_a_map_is_the_power_prior() {
    let kernels = [
        (KernelSettings::CubicBSpline(CubicBSplineSettings::DEFAULT), 4),
        (KernelSettings::SquaredExponential(SquaredExponentialSettings::DEFAULT), 6),
    ];
    for (kernel, stencil) in kernels {
        for bias in [false, true] {
            let profile = Profile {
                settings: Settings {
                    kernel,
                    prior: COMPACT.settings.prior.or_white(&kernel),
                    tile: TileSettings { stencil, width: [12; 2], stride: [12 - stencil; 2], count: Some([1, 1]) },
                    forgetting: 0.8,
                    bias: bias.then_some(BiasSettings { precision: 1e-4 }),
                    ..COMPACT.settings
                },
                capacities: Capacities { tiles: 1, ..COMPACT.capacities },
                ..COMPACT
            };
            // 66 holds both stencils: (6 − 1)·13 + 1.
            let mut map = OwnedMapper::<144, 66>::new(&profile).unwrap();
            let mut oracle = TileBlend::of(&profile.settings, bias.then_some(0.0));
            let features =
                Features { origin_m: [0.0; 2], spacing_m: 0.5, width: [12; 2], stencil, kernel: oracle.kernel, bias };
            let mut dense = DenseMap::new(features, oracle.prior.clone());
            let prior = dense.posterior.clone();
            let rule = Rule::GaussianVariational { xi_cap: 4.0, safeguard: SAFEGUARD };
            let mut stream = Stream::new(9);
            for scan in 0..12 {
                let places: Vec<_> =
                    (0..80).map(|_| [stream.between(1.1, 4.4) as f32, stream.between(1.1, 4.4) as f32]).collect();
                let occupied = |at: &[f32; 2]| (at[0] > 3.0) ^ (scan > 6);
                map.integrate_observations(&labelled(&places, occupied)).unwrap();
                if scan > 0 {
                    dense.posterior.discount(&prior, f64::from(0.8_f32)).unwrap();
                }
                let points: Vec<_> = places.iter().map(|at| (at.map(f64::from), occupied(at))).collect();
                dense.learn(&points, &rule, 3).unwrap();
            }
            oracle.insert([0, 0], dense.posterior.mean.clone(), dense.posterior.covariance.clone());
            let mut worst = 0.0_f64;
            for _ in 0..2_000 {
                let at = [stream.between(1.1, 4.4) as f32, stream.between(1.1, 4.4) as f32];
                let got = map.mapper().occupancy(&Point::from(at)).probability;
                worst = worst.max((f64::from(got) - oracle.predict(&at.map(f64::from)).probability).abs());
            }
            println!("forgetting, {}, bias {bias}: probability off by {worst:.2e} at most", kernel.name());
            assert!(worst <= 1e-2, "the specification's bound with a bias");
        }
    }
}

/// A row of the oracle and a row of the core are the same thing: checked once, so that the rest means something.
#[test]
fn both_sides_see_the_same_rows() {
    let rows = [SparseRow { entries: vec![(1, 0.5), (3, 0.25)], occupied: true }];
    // Of a band of three from where the row begins, and of one that is pushed back to fit.
    let banded = [BandedRow::of::<5, 3>(&rows[0], 0.0), BandedRow::of::<5, 5>(&rows[0], 0.0)];
    assert_eq!((banded[0].first, &banded[0].values[..]), (1, &[0.5, 0.0, 0.25][..]));
    assert_eq!((banded[1].first, &banded[1].values[..]), (0, &[0.0, 0.5, 0.0, 0.25, 0.0][..]));
    // Of runs with a gap, which it fits into from its first weight on, and from the weight before.
    let runs = |starts: [usize; 2]| BandedRow::new::<5>(&rows[0], 0.0, &Pattern::new(1, starts).unwrap());
    assert_eq!((runs([0, 2]).first, &runs([0, 2]).values[..]), (1, &[0.5, 0.25][..]));
    let wide = BandedRow::new::<5>(&rows[0], 0.0, &Pattern::new(2, [0, 3]).unwrap());
    assert_eq!((wide.first, &wide.values[..]), (0, &[0.0, 0.5, 0.25, 0.0][..]));
    let [Observation { phi, occupied }] = observations::<5>(&rows).try_into().unwrap();
    assert_eq!((phi, occupied), (vec![0.0, 0.5, 0.0, 0.25, 0.0], true));
}
