//! The default rule at twenty passes, on any input: the evidence lower bound of what is committed, computed in `f64`, is
//! not below the first pass's by more than stated.

mod common;

use bhm_core::{
    reference::{Features, Kernel},
    rule::{AnyRule, GaussianVariational},
};
use common::{Learner, SAFEGUARD, SparseRow, Stream, observations};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const M: usize = 64;
const B: usize = 28;
const PASSES: u32 = 20;
const RULE: AnyRule = AnyRule::GaussianVariational(GaussianVariational { xi_cap: 4.0 });

fn lattice() -> Features<2> {
    Features {
        origin_m: [0.0, 0.0],
        spacing_m: 1.0,
        width: [8, 8],
        stencil: 4,
        kernel: Kernel::CubicBSpline { spacing_m: 1.0 },
        bias: false,
    }
}

fn row(at: [f64; 2], occupied: bool) -> SparseRow {
    let phi = lattice().at(&at);
    let entries = phi.iter().enumerate().filter(|(_, v)| **v > 0.0).map(|(i, v)| (i as u32, *v as f32));
    SparseRow { entries: entries.collect(), occupied }
}

/// How much lower the committed belief may be, nats: the safeguard's tolerance for one pass, since the first pass is the
/// baseline; and what `f32` costs where the observations are many, one part in 1e5 of the bound, which that includes.
fn allowed(first: f64) -> f64 {
    SAFEGUARD.absolute + SAFEGUARD.relative * first.abs()
}

/// Learns scan after scan; returns the largest fall below the first pass as a share of what is allowed.
fn check(precision: f32, scans: &[Vec<SparseRow>]) -> Result<f64, TestCaseError> {
    let mut learner = Learner::<M, B>::flat(precision);
    let mut worst = f64::NEG_INFINITY;
    for (number, rows) in scans.iter().enumerate() {
        let before = learner.dense();
        let dense_rows = observations::<M>(rows);
        let mut once = learner.clone();
        prop_assert!(once.update(rows, &RULE, 1).is_ok());
        let first = once.dense().evidence_lower_bound(&before, &dense_rows);
        let report = learner.update(rows, &RULE, PASSES);
        prop_assert!(report.is_ok(), "scan {number}: {report:?}");
        let after = learner.dense();
        let committed = after.evidence_lower_bound(&before, &dense_rows);
        let share = (first - committed) / allowed(first);
        worst = worst.max(share);
        prop_assert!(
            share <= 1.0,
            "scan {number} of {} rows, prior {precision:e}: {committed} is {:e} below the first pass's {first}, allowed \
             {:e}; {report:?}",
            rows.len(),
            first - committed,
            allowed(first)
        );
        let posterior = &learner.posterior;
        prop_assert!(posterior.mean.iter().chain(posterior.covariance.as_flattened()).all(|value| value.is_finite()));
        prop_assert!(posterior.information.as_flattened().iter().all(|value| value.is_finite()));
        for row in &dense_rows {
            let probability = after.predict(&row.phi).probability;
            prop_assert!((0.0..=1.0).contains(&probability));
        }
    }
    Ok(worst)
}

/// A place inside the region of whole stencils.
fn place() -> impl Strategy<Value = [f64; 2]> {
    [1.0..5.999, 1.0..5.999_f64]
}

/// Points that somebody drew to hurt: lone ones, contradictions at one place, thousands of repeats, dense clouds.
fn scan() -> impl Strategy<Value = Vec<SparseRow>> {
    let lone = (place(), any::<bool>()).prop_map(|(at, occupied)| vec![row(at, occupied)]);
    let contradiction = (place(), 1..400_usize, 1..400_usize).prop_map(|(at, hits, misses)| {
        let (hit, miss) = (row(at, true), row(at, false));
        std::iter::repeat_n(hit, hits).chain(std::iter::repeat_n(miss, misses)).collect()
    });
    let repeats = (place(), any::<bool>(), 1_000..4_000_usize)
        .prop_map(|(at, occupied, count)| std::iter::repeat_n(row(at, occupied), count).collect());
    let cloud = (0.0..=1.0_f64, prop::collection::vec((place(), 0.0..1.0_f64), 1..300))
        .prop_map(|(hits, points)| points.into_iter().map(|(at, u)| row(at, u < hits)).collect());
    let checkers = prop::collection::vec(place(), 1..300).prop_map(|points| {
        points.into_iter().map(|at| row(at, (at[0].floor() + at[1].floor()) as i64 % 2 == 0)).collect()
    });
    prop_oneof![lone, contradiction, repeats, cloud, checkers]
}

/// Scans of any kind, or one scan again and again with its labels turned over each time.
fn scans() -> impl Strategy<Value = Vec<Vec<SparseRow>>> {
    let any_kind = prop::collection::vec(scan(), 1..5);
    let flipping = (scan(), 2..6_usize).prop_map(|(rows, times)| {
        (0..times)
            .map(|time| {
                let turned = |row: &SparseRow| SparseRow { occupied: row.occupied ^ (time % 2 == 1), ..row.clone() };
                rows.iter().map(turned).collect()
            })
            .collect()
    });
    prop_oneof![2 => any_kind, 1 => flipping]
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 150,
        rng_seed: RngSeed::Fixed(20_240_229),
        failure_persistence: None,
        max_shrink_iters: 60,
        ..ProptestConfig::default()
    })]

    #[test]
    fn on_any_input(exponent in -6.0..2.0_f64, scans in scans()) {
        check(10.0_f64.powf(exponent) as f32, &scans)?;
    }
}

/// The cases that diverge by hundreds of nats without a safeguard: a prior that knows nothing, and scans like a lidar's.
#[test]
fn from_a_wide_open_prior() {
    let mut worst = f64::NEG_INFINITY;
    for seed in 0..60 {
        let mut stream = Stream::new(seed);
        let scans: Vec<Vec<SparseRow>> = (0..3)
            .map(|_| {
                (0..1 + stream.below(150))
                    .map(|_| row([stream.between(1.0, 5.99), stream.between(1.0, 5.99)], stream.unit() < 0.3))
                    .collect()
            })
            .collect();
        let precision = [1e-6, 1e-5, 1e-4][seed as usize % 3];
        worst = worst.max(check(precision, &scans).unwrap());
    }
    println!("wide open prior: largest fall below the first pass, as a share of what is allowed: {worst:.3}");
}
