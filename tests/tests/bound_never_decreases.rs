//! The paper's objective rises from pass to pass, and is the number that its formula gives in `f64`.

mod common;

use bhm_core::{
    beam::Observation,
    profile::COMPACT,
    rule::{AnyRule, JaakkolaJordan, XiStart as CoreXiStart},
};
use bhm_oracle::{Features, Kernel, Rule, XiStart};
use common::{Learner, SparseRow, Stream, drives, observations, points_of};

const PASSES: u32 = 20;

/// The specification: what `f32` may take back of a bound that never decreases, `1e-5·(1 + |L|)`.
///
/// Where `|L|` is small, pivots and terms round by more than this (see [`absolute`]), whatever adds them up; how much more is
/// printed.
fn rounding(bound: f64) -> f64 {
    1e-5 * (1.0 + bound.abs())
}

/// What `f32` may add to or take from the bound itself: each of `N` terms is right to a few units in the last place of a
/// number of order 10, each of `M` pivots to as many of the entry that it is left of, and they add up at worst in step.
///
/// `left_of` is the sum of entries over pivots, or what is not less: `Σ Λᵢᵢ Σᵢᵢ`, `M` where nothing is correlated.
fn absolute(bound: f64, left_of: f64, rows: usize) -> f64 {
    rounding(bound) + f64::from(f32::EPSILON) * 10.0 * (left_of + rows as f64)
}

fn lattice(width: usize) -> Features<2> {
    Features {
        origin_m: [0.0, 0.0],
        spacing_m: 0.5,
        width: [width; 2],
        stencil: 4,
        kernel: Kernel::CubicBSpline { spacing_m: 0.5 },
        bias: false,
    }
}

fn row(features: &Features<2>, at: &[f64; 2], occupied: bool) -> SparseRow {
    let entries = features.at(at).into_iter().enumerate().filter(|(_, v)| *v > 0.0).map(|(i, v)| (i as u32, v as f32));
    SparseRow { entries: entries.collect(), occupied }
}

/// Scan after scan, each in 1, 2, … passes from the same prior; returns the largest fall as a share of the specification's
/// `1e-5·(1 + |L|)`, and the largest difference from the oracle as a share of what is allowed.
fn check<const M: usize, const B: usize>(
    width: usize,
    scans: &[Vec<SparseRow>],
    precision: f32,
    start: CoreXiStart,
) -> [f64; 2] {
    let rule = AnyRule::JaakkolaJordan(JaakkolaJordan { start });
    let oracle_rule = Rule::JaakkolaJordan {
        start: match start {
            CoreXiStart::Constant(xi) => XiStart::Constant(f64::from(xi)),
            CoreXiStart::PredictedUpTo(cap) => XiStart::PredictedUpTo(f64::from(cap)),
        },
    };
    let mut learner = Learner::<M, B>::flat(precision).on_lattice::<2>(width, 4);
    let mut worst = [0.0_f64; 2];
    for rows in scans {
        let mut belief = learner.dense().unwrap();
        let exact = belief.update(&observations::<M>(rows), &oracle_rule, PASSES as usize).unwrap().objectives;
        let left_of: f64 = (0..M).map(|i| belief.information[i][i] * belief.covariance[i][i]).sum();
        let mut last = f64::NEG_INFINITY;
        for passes in 1..=PASSES {
            let mut trial = learner.clone();
            let report = trial.update(rows, &rule, passes).expect("positive definite");
            let (bound, exact) = (f64::from(report.objective), exact[passes as usize - 1]);
            assert_eq!(report.safeguards, 0, "a bound that never decreases needs no safeguard");
            assert!(bound >= last - absolute(last, left_of, rows.len()), "pass {passes}: {last} fell to {bound}");
            let allowed = absolute(exact, left_of, rows.len());
            assert!((bound - exact).abs() <= allowed, "pass {passes}: {bound} against {exact}, allowed {allowed:e}");
            if last.is_finite() {
                worst[0] = worst[0].max((last - bound) / rounding(last));
            }
            worst[1] = worst[1].max((bound - exact).abs() / allowed);
            last = bound;
        }
        learner.update(rows, &rule, 2).expect("positive definite");
    }
    worst
}

#[test]
fn on_random_rows() {
    let features = lattice(8);
    let mut worst = [0.0_f64; 2];
    for seed in 0..40 {
        let mut stream = Stream::new(seed);
        let precision = 10.0_f64.powf(stream.between(-4.0, 1.0)) as f32;
        let scans: Vec<Vec<SparseRow>> = (0..3)
            .map(|_| {
                (0..1 + stream.below(120))
                    .map(|_| {
                        let at = [stream.between(0.51, 2.99), stream.between(0.51, 2.99)];
                        row(&features, &at, stream.unit() < 0.4)
                    })
                    .collect()
            })
            .collect();
        for start in [CoreXiStart::Constant(1.0), CoreXiStart::PredictedUpTo(4.0)] {
            let found = check::<64, 28>(8, &scans, precision, start);
            worst = [worst[0].max(found[0]), worst[1].max(found[1])];
        }
    }
    println!(
        "random rows: largest fall {:.3} of 1e-5(1 + |L|), difference {:.3} of what is allowed",
        worst[0], worst[1]
    );
}

#[test]
fn on_the_rows_of_a_drive() {
    for drive in drives() {
        // Twelve supports a side, of which those in the middle are where the drive is busy.
        let features = Features { origin_m: drive.busy_m.map(|x| f64::from(x) - 2.75), ..lattice(12) };
        let inside = |point: &Observation<2>| {
            let at = [f64::from(point.place.middle_m().x), f64::from(point.place.middle_m().y)];
            features.hold_whole(4, &at).then(|| row(&features, &at, point.occupied))
        };
        let scans: Vec<Vec<SparseRow>> = drive
            .scans
            .iter()
            .map(|scan| points_of(scan, &COMPACT.settings).iter().filter_map(inside).collect::<Vec<_>>())
            .filter(|rows| rows.len() > 40)
            .take(12)
            .collect();
        assert_eq!(scans.len(), 12, "{}", drive.name);
        for start in [CoreXiStart::Constant(1.0), CoreXiStart::PredictedUpTo(4.0)] {
            let [fall, difference] = check::<144, 40>(12, &scans, 1e-4, start);
            println!(
                "{}, {start:?}: fall {fall:.3} of 1e-5(1 + |L|), difference {difference:.3} of what is allowed",
                drive.name
            );
        }
    }
}
