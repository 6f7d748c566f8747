//! A matrix that `f32` cannot factor well is factored with a little more on its diagonal, and that is what is committed.

use bhm_core::{
    profile::COMPACT,
    rule::{AnyRule, GaussianVariational},
};
use bhm_oracle::{Factor, Features, Kernel, Matrix};

use crate::common::{Inverse, Learner, SparseRow, Stream, observations};

/// What the core documents: a pivot below this share of the entry it started from is nothing but rounding, …
const LEAST_PIVOT: f64 = 1e-5;
/// … and the matrix is then factored again with this share of its diagonal added.
const ADDED: f64 = 3e-5;

const RULE: AnyRule = AnyRule::GaussianVariational(GaussianVariational { xi_cap: 4.0 });

/// Two weights of which the second's pivot is this share of its diagonal entry, and a third by itself.
fn nearly_singular(share: f64) -> Learner<3, 2> {
    let mut learner = Learner::<3, 2>::flat(1.0);
    // 1 − r² = share.
    learner.posterior.information[0][1] = (1.0 - share).sqrt() as f32;
    let log_determinant = self::share(&learner).ln();
    let high = log_determinant as f32;
    learner.posterior.log_determinant = [high, (log_determinant - f64::from(high)) as f32];
    learner
}

/// The share in the matrix as it was rounded.
fn share(learner: &Learner<3, 2>) -> f64 {
    1.0 - f64::from(learner.posterior.information[0][1]).powi(2)
}

fn inverse_of(matrix: &Matrix) -> Matrix {
    Factor::of(matrix).expect("positive definite in f64").inverse()
}

#[test]
fn a_pivot_that_is_mostly_rounding_is_not_believed() {
    let rows = [SparseRow { entries: vec![(2, 1.0)], occupied: true }];
    let (mut below, mut above) = (0, 0);
    for exponent in 0..60 {
        let mut learner = nearly_singular(1e-3 * 0.85_f64.powi(exponent));
        let (before, belief) = (learner.information(), learner.dense().expect("a belief"));
        let share = share(&learner);
        // In `f32` the pivot is the difference of 1 and a number that is right to a unit in its last place.
        if (share - LEAST_PIVOT).abs() < 3.0 * f64::from(f32::EPSILON) {
            continue;
        }
        let report = learner.update(&rows, &RULE, COMPACT.settings.passes).unwrap();
        let conditioned = share < LEAST_PIVOT;
        *if conditioned { &mut below } else { &mut above } += 1;
        let expected = if conditioned { report.passes } else { 0 };
        assert_eq!(report.conditioned, expected, "a pivot of {share:e}");
        let committed = learner.information();
        for i in 0..2 {
            // Λ + j·diag(Λ), rounded once.
            let exact = before[i][i] * if conditioned { 1.0 + ADDED } else { 1.0 };
            assert!((committed[i][i] - exact).abs() <= f64::from(f32::EPSILON), "a pivot of {share:e}: {committed:?}");
        }
        assert_eq!(committed[0][1], before[0][1]);
        let inverse = inverse_of(&committed);
        // The pivot's own rounding, of numbers near 1, is all that the inverse of two by two depends on; twice, for Λ's and
        // for the factor's.
        let least = if conditioned { 2.0 * ADDED } else { share };
        let allowed = 4.0 * f64::from(f32::EPSILON) / least;
        for (i, j) in [(0, 0), (0, 1), (1, 1)] {
            let off = (f64::from(learner.posterior.covariance[i][j - i]) / inverse[i][j] - 1.0).abs();
            assert!(off <= allowed, "a pivot of {share:e}: Σ[{i}][{j}] off by {off:e}, allowed {allowed:e}");
        }
        // The bound is that of what is committed. Its parts, the determinant and the trace, are as right as the pivot; the
        // likelihood is right to 5e-5 nats.
        let after = learner.dense().expect("a belief");
        let elbo = after.evidence_lower_bound(&belief, &observations::<3>(&rows));
        let off = (f64::from(report.objective) - elbo).abs();
        assert!(off <= 5e-5 + allowed, "a pivot of {share:e}: {} for {elbo}", report.objective);
    }
    assert!(below > 10 && above > 10, "{below} below and {above} above");
}

const M: usize = 64;
const B: usize = 28;

fn row(at: [f64; 2], occupied: bool) -> SparseRow {
    let features = Features {
        origin_m: [0.0, 0.0],
        spacing_m: 1.0,
        width: [8, 8],
        stencil: 4,
        kernel: Kernel::CubicBSpline { spacing_m: 1.0 },
        bias: false,
    };
    let phi = features.at(&at);
    let entries = phi.iter().enumerate().filter(|(_, v)| **v > 0.0).map(|(i, v)| (i as u32, *v as f32));
    SparseRow { entries: entries.collect(), occupied }
}

/// Hundreds of observations of one spot from a prior that knows nothing: what was added to the diagonal is committed with the
/// rest, so that `Σ` stays the inverse of `Λ`.
#[test]
fn what_was_added_to_the_diagonal_is_committed() {
    // Each pivot is the rest of an entry that is right to half a unit in the last place, and no less than LEAST_PIVOT of it; a
    // variance depends on the pivots of the sixteen weights that the spot sees.
    let allowed = 16.0 * f64::from(f32::EPSILON) / 2.0 / LEAST_PIVOT;
    let (mut conditioned, mut worst) = (0, 0.0_f64);
    for seed in 0..60 {
        let mut stream = Stream::new(seed);
        let precision = 10_f64.powf(stream.between(-6.0, -4.0)) as f32;
        let at = [stream.between(1.0, 5.99), stream.between(1.0, 5.99)];
        let rows: Vec<_> = (0..100 + stream.below(900)).map(|_| row(at, stream.unit() < 0.5)).collect();
        let mut learner = Learner::<M, B>::flat(precision).on_lattice::<2>(8, 4);
        let report = learner.update(&rows, &RULE, COMPACT.settings.passes).expect("conditioned, not refused");
        if report.conditioned < report.passes {
            continue;
        }
        conditioned += 1;
        let off = Inverse::of(&learner).off;
        assert!(off <= allowed, "{} rows at prior {precision:e}: Σ off by {off:e}; {report:?}", rows.len());
        worst = worst.max(off);
    }
    println!("{conditioned} updates needed more on the diagonal; Σ off by {worst:.1e}, allowed {allowed:.1e}");
    assert!(conditioned >= 50, "{conditioned}");
}
