//! The default rule at twenty passes, on any input: the evidence lower bound of what is committed, computed in `f64`, is
//! not below the first pass's by more than stated.

mod common;

use std::cell::RefCell;

use bhm_core::rule::{AnyRule, GaussianVariational};
use bhm_oracle::{DensePosterior, Observation, Prediction};
use common::{Learner, SAFEGUARD, SparseRow, Stream, observations, spline_row};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestError, TestRunner};

const M: usize = 64;
const B: usize = 28;
const PASSES: u32 = 20;
const RULE: AnyRule = AnyRule::GaussianVariational(GaussianVariational { xi_cap: 4.0 });

/// What `f32` can know of the bound: a factor of a matrix of condition κ is right to `ε·κ` in each of `M` pivots and each of
/// `N` fitted values (first order, no cancellation between them assumed; the 4 is for the several roundings of each).
fn rounding(condition: f64, rows: usize) -> f64 {
    4.0 * (M + rows) as f64 * f64::from(f32::EPSILON) / 2.0 * condition
}

/// Whether `f32` can tell the matrix from a singular one at all: `N` equal terms, added one after the other, round the same
/// way each time, and a factor loses a little more in each of `M` rows.
fn hopeless(condition: f64, rows: usize) -> bool {
    (M + rows) as f64 * f64::from(f32::EPSILON) / 2.0 * condition > 1.0
}

/// What happened, over all scans of all cases.
#[derive(Debug)]
struct Seen {
    /// Largest fall below the first pass as a share of what is allowed.
    worst: f64,
    /// The largest fall where rounding is less than the safeguard's own tolerance, as a share of that.
    worst_well_conditioned: f64,
    updates: usize,
    /// Not one of twenty passes could be factored; nothing was learned.
    failed: usize,
    /// The first could not.
    first_failed: usize,
}

impl Seen {
    const NOTHING: Self = Self {
        worst: f64::NEG_INFINITY,
        worst_well_conditioned: f64::NEG_INFINITY,
        updates: 0,
        failed: 0,
        first_failed: 0,
    };
}

/// An upper estimate of the condition of the first pass's matrix: no observation weighs more than ¼.
fn condition(before: &DensePosterior, rows: &[Observation]) -> f64 {
    let mut largest = 0.0_f64;
    let mut smallest = f64::INFINITY;
    for i in 0..M {
        let added: f64 = rows.iter().map(|row| 0.25 * row.phi[i] * row.phi.iter().sum::<f64>()).sum();
        largest = largest.max(before.information[i][i] + added);
        smallest = smallest.min(1.0 / before.covariance[i][i]);
    }
    largest / smallest
}

/// Learns scan after scan.
fn check(precision: f32, scans: &[Vec<SparseRow>], seen: &mut Seen) -> Result<(), TestCaseError> {
    let mut learner = Learner::<M, B>::flat(precision).on_lattice::<2>(8, 4);
    for (number, rows) in scans.iter().enumerate() {
        let Ok(before) = learner.dense() else { break };
        let dense_rows = observations::<M>(rows);
        let condition = condition(&before, &dense_rows);
        let untouched = learner.posterior.clone();
        let mut once = learner.clone();
        let first = once.update(rows, &RULE, 1);
        let report = learner.update(rows, &RULE, PASSES);
        seen.updates += 1;
        let posterior = &learner.posterior;
        if report.is_err() {
            prop_assert!(*posterior == untouched, "a failed update changed something");
            prop_assert!(hopeless(condition, rows.len()), "scan {number}: {report:?} at condition {condition:e}");
            seen.failed += 1;
            continue;
        }
        prop_assert!(posterior.mean.iter().chain(posterior.covariance.as_flattened()).all(|value| value.is_finite()));
        prop_assert!(posterior.information.as_flattened().iter().all(|value| value.is_finite()));
        for row in rows {
            let moments = posterior.view().moments(&learner.banded(row).as_row());
            let probability =
                Prediction::from_moments(f64::from(moments.mean), f64::from(moments.variance)).probability;
            prop_assert!((0.0..=1.0).contains(&probability));
        }
        let (Ok(_), Ok(baseline), Ok(after)) = (first, once.dense(), learner.dense()) else {
            prop_assert!(hopeless(condition, rows.len()), "scan {number}: no belief in f64 at condition {condition:e}");
            seen.first_failed += usize::from(first.is_err());
            continue;
        };
        let baseline = baseline.evidence_lower_bound(&before, &dense_rows);
        let committed = after.evidence_lower_bound(&before, &dense_rows);
        let tolerance = SAFEGUARD.absolute + SAFEGUARD.relative * baseline.abs();
        let rounding = rounding(condition, rows.len());
        let fall = baseline - committed;
        if rounding < tolerance {
            seen.worst_well_conditioned = seen.worst_well_conditioned.max(fall / tolerance);
        }
        seen.worst = seen.worst.max(fall / (tolerance + rounding));
        prop_assert!(
            fall <= tolerance + rounding,
            "scan {number} of {} rows, prior {precision:e}: {committed} is {fall:e} below the first pass's {baseline}, \
             allowed {tolerance:e} and for f32 at condition {condition:e} {rounding:e}; {report:?}",
            rows.len(),
        );
    }
    Ok(())
}

/// A place inside the region of whole stencils.
fn place() -> impl Strategy<Value = [f64; 2]> {
    [1.0..5.999, 1.0..5.999_f64]
}

/// Points that somebody drew to hurt: lone ones, contradictions at one place, thousands of repeats, dense clouds.
fn scan() -> impl Strategy<Value = Vec<SparseRow>> {
    let lone = (place(), any::<bool>()).prop_map(|(at, occupied)| vec![spline_row(at, occupied)]);
    let contradiction = (place(), 1..400_usize, 1..400_usize).prop_map(|(at, hits, misses)| {
        let (hit, miss) = (spline_row(at, true), spline_row(at, false));
        std::iter::repeat_n(hit, hits).chain(std::iter::repeat_n(miss, misses)).collect()
    });
    let repeats = (place(), any::<bool>(), 1_000..4_000_usize)
        .prop_map(|(at, occupied, count)| std::iter::repeat_n(spline_row(at, occupied), count).collect());
    let cloud = (0.0..=1.0_f64, prop::collection::vec((place(), 0.0..1.0_f64), 1..300))
        .prop_map(|(hits, points)| points.into_iter().map(|(at, u)| spline_row(at, u < hits)).collect());
    let checkers = prop::collection::vec(place(), 1..300).prop_map(|points| {
        points.into_iter().map(|at| spline_row(at, (at[0].floor() + at[1].floor()) as i64 % 2 == 0)).collect()
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

/// Of `cases` drawn cases each.
fn on_any_input(cases: u32, exponents: std::ops::Range<f64>) -> Seen {
    let config = Config {
        cases,
        rng_seed: RngSeed::Fixed(20_240_229),
        failure_persistence: None,
        max_shrink_iters: 60,
        ..Config::default()
    };
    let seen = RefCell::new(Seen::NOTHING);
    let run = TestRunner::new(config).run(&(exponents, scans()), |(exponent, scans)| {
        check(10.0_f64.powf(exponent) as f32, &scans, &mut seen.borrow_mut())
    });
    match run {
        Ok(()) => {}
        Err(TestError::Abort(reason)) => panic!("{reason}"),
        // The whole input is thousands of rows: the count and the first of each scan say what it is.
        Err(TestError::Fail(reason, (exponent, scans))) => {
            let summary: Vec<_> = scans.iter().map(|rows| (rows.len(), &rows[0])).collect();
            panic!("{reason}\nprior 1e{exponent}, scans of {summary:?}");
        }
    }
    seen.into_inner()
}

#[test]
fn on_any_input_from_ordinary_priors() {
    println!("prior 1e-4 to 1e2: {:?}", on_any_input(150, -4.0..2.0));
}

#[test]
fn on_any_input_from_priors_that_know_nothing() {
    println!("prior 1e-6 to 1e-4: {:?}", on_any_input(100, -6.0..-4.0));
}

/// The cases that diverge by hundreds of nats without a safeguard: a prior that knows nothing, and scans like a lidar's.
#[test]
fn from_a_wide_open_prior() {
    let mut seen = Seen::NOTHING;
    for seed in 0..60 {
        let mut stream = Stream::new(seed);
        let scans: Vec<Vec<SparseRow>> = (0..3)
            .map(|_| {
                (0..1 + stream.below(150))
                    .map(|_| spline_row([stream.between(1.0, 5.99), stream.between(1.0, 5.99)], stream.unit() < 0.3))
                    .collect()
            })
            .collect();
        let precision = [1e-6, 1e-5, 1e-4][seed as usize % 3];
        check(precision, &scans, &mut seen).unwrap();
    }
    println!("wide open prior: {seen:?}");
}
