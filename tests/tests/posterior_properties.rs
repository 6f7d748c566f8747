//! The posterior as linear algebra: whatever the shape, it is what the dense formulas give, or an error and no change.

mod common;

use bhm_core::{
    em,
    geometry::Point,
    kernel::KernelChoice,
    posterior::{Entry, NotPositiveDefinite, RowError, RowState, Rows},
    profile::{COMPACT, Capacities, Profile},
    reference::{DenseMap, DensePosterior, Features, Observation, Rule, TileBlend, XiStart},
    rule::{AnyRule, JaakkolaJordan, XiStart as CoreXiStart},
    settings::Settings,
};
use bhm_host::map::OwnedMapper;
use common::{Learner, SAFEGUARD, SparseRow, Stream, observations};
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
            let core_prior = learner.prior;
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
    fn a_row_that_does_not_fit_is_an_error_and_changes_nothing(seed in any::<u64>(), kind in 0..6_usize) {
        const M: usize = 30;
        const B: usize = 7;
        let mut stream = Stream::new(seed);
        let good: Vec<_> = (0..8).map(|_| random_row(&mut stream, M, B)).collect();
        let entry = |index: usize, value: f32| Entry { index: index as u32, value };
        let first = stream.below(M - B);
        let (bad, bias, expected) = match kind {
            0 => {
                // The nearest that is too far, as often as any.
                let last = first + B + stream.below(2) * stream.below(M - B - first);
                (vec![entry(first, 1.0), entry(last, 0.5)], 0.0, RowError::OutsideBand { first, last, band: B })
            }
            1 => {
                let index = M + stream.below(1_000_000);
                (vec![entry(index, 1.0)], 0.0, RowError::OutsideMatrix { index, supports: M })
            }
            2 => (vec![entry(first + 1, 1.0), entry(first, 1.0)], 0.0, RowError::NotAscending { index: first }),
            3 => (vec![entry(first, 1.0), entry(first, 1.0)], 0.0, RowError::NotAscending { index: first }),
            4 => (vec![entry(first, f32::NAN)], 0.0, RowError::NotFinite { index: first }),
            _ => (vec![entry(first, 1.0)], f32::INFINITY, RowError::NotFinite { index: M }),
        };
        let run = |intrude: bool| {
            let mut learner = Learner::<M, B>::flat(0.1);
            let (mut entries, mut states) = (vec![Entry::default(); 200], vec![RowState::default(); 20]);
            let mut rows = Rows::new(&mut entries, &mut states);
            for (number, row) in good.iter().enumerate() {
                if intrude && number == 4 {
                    assert_eq!(rows.push::<M, B>(bad.clone(), bias, true), Err(expected));
                    assert_eq!(rows.len(), 4);
                }
                let entries = row.entries.iter().map(|(index, value)| entry(*index as usize, *value));
                rows.push::<M, B>(entries, 0.0, row.occupied).unwrap();
            }
            em::update(&mut learner.posterior, &mut rows, &JAAKKOLA, 2, &mut learner.scratch).unwrap();
            learner.posterior
        };
        prop_assert!(run(false) == run(true));
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
        let prior = learner.prior;
        let error = learner.posterior.discount(&prior, 0.9, &mut learner.scratch).unwrap_err();
        prop_assert_eq!(error, NotPositiveDefinite { row });
        prop_assert!(learner.posterior == untouched);
    }
}

#[test]
fn full_memory_is_an_error() {
    let (mut entries, mut states) = ([Entry::default(); 3], [RowState::default(); 2]);
    let mut rows = Rows::new(&mut entries, &mut states);
    let row = |from: u32| [Entry { index: from, value: 1.0 }, Entry { index: from + 1, value: 1.0 }];
    assert_eq!(rows.push::<8, 4>(row(0), 0.0, true), Ok(()));
    assert_eq!(rows.push::<8, 4>(row(2), 0.0, true), Err(RowError::Full));
    assert_eq!(rows.push::<8, 4>([Entry { index: 2, value: 1.0 }], 0.0, true), Ok(()));
    assert_eq!(rows.push::<8, 4>([], 0.0, true), Err(RowError::Full));
    assert_eq!(rows.len(), 2);
}

/// Forgetting through the façade, with a bias and both kernels: the power prior in the plain coordinates of the oracle.
#[test]
fn forgetting_in_a_map_is_the_power_prior() {
    for (kernel, stencil) in [(KernelChoice::CubicBSpline, 4), (KernelChoice::SquaredExponential, 6)] {
        for bias in [false, true] {
            let profile = Profile {
                settings: Settings {
                    kernel,
                    stencil,
                    tile_width: [12; 2],
                    tile_stride: [12 - stencil; 2],
                    tile_count: Some([1, 1]),
                    forgetting: 0.8,
                    bias,
                    bias_precision: 1e-4,
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
            let mut dense = DenseMap::new(features, 1e-4_f32.into());
            let prior = dense.posterior.clone();
            let rule = Rule::GaussianVariational { xi_cap: 4.0, safeguard: SAFEGUARD };
            let mut stream = Stream::new(9);
            for scan in 0..12 {
                let batch: Vec<_> = (0..80)
                    .map(|_| [stream.between(1.1, 4.4) as f32, stream.between(1.1, 4.4) as f32])
                    .map(|at| (at, (at[0] > 3.0) ^ (scan > 6)))
                    .collect();
                let places: Vec<_> = batch.iter().map(|(at, _)| Point::<2>::from(*at)).collect();
                let labels: Vec<_> = batch.iter().map(|(_, occupied)| *occupied).collect();
                map.integrate_points(&places, &labels).unwrap();
                if scan > 0 {
                    dense.posterior.discount(&prior, f64::from(0.8_f32)).unwrap();
                }
                let points: Vec<_> = batch.iter().map(|(at, occupied)| (at.map(f64::from), *occupied)).collect();
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
    let [Observation { phi, occupied }] = observations::<5>(&rows).try_into().unwrap();
    assert_eq!((phi, occupied), (vec![0.0, 0.5, 0.0, 0.25, 0.0], true));
}
