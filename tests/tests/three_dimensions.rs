//! Lattice, window, basis and posterior are written for any dimension: a box of 5 × 5 × 5 supports against the oracle.

mod common;

use bhm_core::{
    basis::Basis,
    geometry::Point,
    kernel::{Averaging, CubicBSplineSettings, KernelSettings, SquaredExponentialSettings},
    lattice::{Lattice, Window, offsets},
    rule::AnyRule,
    support::{AnySupport, SupportTable, Supports},
};
use bhm_oracle::{DenseMap, DensePosterior, Features, Kernel, Prediction, Rule, XiStart};
use common::{Differences, Learner, SAFEGUARD, SparseRow, Stream};

const WIDTH: usize = 5;
const STENCIL: usize = 4;
const M: usize = WIDTH * WIDTH * WIDTH;
const B: usize = (STENCIL - 1) * (1 + WIDTH + WIDTH * WIDTH) + 1;
const SPACING_M: f32 = 0.4;
const ORIGIN_M: [f32; 3] = [-0.7, 0.2, 1.1];
const PRIOR: f32 = 1e-3;

/// What the specification allows for ordinary runs in the plane.
const LARGEST: f64 = 5e-3;
/// The derivative of features that are right to `f32`, per metre: their slope is of order 1/h.
const SLOPE_PER_M: f64 = 1e-4;

fn row(basis: &Basis<3>, at: [f32; 3], occupied: bool) -> SparseRow {
    let window = Window { first: [0; 3], width: [WIDTH; 3] };
    let features = basis.features(&Point::from(at)).expect("a place on the lattice");
    let first = window.index_of_whole(&features.stencil.first, STENCIL).expect("a whole stencil");
    let strides = window.strides();
    let entries = offsets([STENCIL; 3])
        .zip(&features.values)
        .map(|(offset, value)| {
            ((first + (0..3).map(|axis| offset[axis] * strides[axis]).sum::<usize>()) as u32, *value)
        })
        .collect();
    SparseRow { entries, occupied }
}

fn compare(kernel: KernelSettings, exact: Kernel, rule: &AnyRule, exact_rule: &Rule) {
    let window = Window { first: [0; 3], width: [WIDTH; 3] };
    assert_eq!((window.supports(), window.band(STENCIL)), (M, B));
    let lattice = Lattice::<3> { origin_m: Point::from(ORIGIN_M), spacing_m: SPACING_M, stencil: STENCIL };
    let supports = Supports { everywhere: AnySupport::default(), table: SupportTable::EMPTY };
    let basis = Basis::new(lattice, kernel.build(SPACING_M), supports, Averaging::Exact, false);
    let features = Features::<3> {
        origin_m: ORIGIN_M.map(f64::from),
        spacing_m: f64::from(SPACING_M),
        width: [WIDTH; 3],
        stencil: STENCIL,
        kernel: exact,
        bias: false,
    };
    let mut dense = DenseMap::new(features, DensePosterior::prior(&[f64::from(PRIOR); M]));
    let mut learner = Learner::<M, B>::flat(PRIOR).on_lattice::<3>(WIDTH, STENCIL);
    let mut stream = Stream::new(3);
    // Whole stencils lie between the second and the last but one support: two cells a side.
    let mut place = || [0, 1, 2].map(|axis| ORIGIN_M[axis] + SPACING_M * stream.between(1.01, 2.99) as f32);
    for _ in 0..20 {
        let batch: Vec<([f32; 3], bool)> = (0..60).map(|_| place()).map(|at| (at, at[2] > 1.9 + 0.2 * at[0])).collect();
        let rows: Vec<_> = batch.iter().map(|(at, occupied)| row(&basis, *at, *occupied)).collect();
        learner.update(&rows, rule, 3).expect("positive definite");
        let points: Vec<_> = batch.iter().map(|(at, occupied)| (at.map(f64::from), *occupied)).collect();
        dense.learn(&points, exact_rule, 3).expect("positive definite");
    }
    let (mut differences, mut slopes) = (Differences::default(), Differences::default());
    for _ in 0..2_000 {
        let at = place();
        let row = row(&basis, at, false);
        let moments = learner.posterior.view().moments(&learner.banded(&row).as_row());
        let got = Prediction::from_moments(f64::from(moments.mean), f64::from(moments.variance));
        differences.add(got.probability - dense.predict(&at.map(f64::from)).expect("inside").probability);
        // The gradient of every feature along every axis, by differences of the oracle's.
        let stencil = basis.lattice.stencil_at(&Point::from(at)).expect("on the lattice");
        let gradients = basis.gradients(&stencil);
        for axis in 0..3 {
            const STEP_M: f64 = 1e-6;
            let moved = |sign: f64| {
                let mut at = at.map(f64::from);
                at[axis] += sign * STEP_M;
                features.at(&at)
            };
            let (ahead, behind) = (moved(1.0), moved(-1.0));
            for ((index, _), gradient) in row.entries.iter().zip(&gradients.values) {
                let exact = (ahead[*index as usize] - behind[*index as usize]) / (2.0 * STEP_M);
                slopes.add(f64::from(gradient[axis]) - exact);
            }
        }
    }
    println!("{} in three dimensions, {}: {differences}; gradients of features {slopes}", kernel.name(), rule.name());
    assert!(differences.largest <= LARGEST, "{differences}");
    assert!(slopes.largest <= SLOPE_PER_M, "{slopes}");
}

#[test]
fn a_box_of_supports_agrees_with_the_oracle() {
    let spacing_m = f64::from(SPACING_M);
    let kernels = [
        (KernelSettings::CubicBSpline(CubicBSplineSettings::DEFAULT), Kernel::CubicBSpline { spacing_m }),
        (
            KernelSettings::SquaredExponential(SquaredExponentialSettings { shape: 0.6 }),
            Kernel::SquaredExponential { shape_m2: 0.6 * spacing_m * spacing_m },
        ),
    ];
    for (kernel, exact) in kernels {
        for rule in AnyRule::ALL {
            let exact_rule = match rule {
                AnyRule::GaussianVariational(_) => Rule::GaussianVariational { xi_cap: 4.0, safeguard: SAFEGUARD },
                AnyRule::JaakkolaJordan(_) => Rule::JaakkolaJordan { start: XiStart::PredictedUpTo(4.0) },
            };
            compare(kernel, exact, rule, &exact_rule);
        }
    }
}
