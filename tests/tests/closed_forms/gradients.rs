//! Gradients against differences of the oracle, in units of the kernel's width.

use bhm_oracle::Average;

use crate::{
    cubic_b_spline::draw,
    draw::{Case, Over, Shape, wide},
    stream::Stream,
    tally::{Tally, Tolerance},
};

const CASES: usize = 10_000;

/// Of values below 1 that are right to 1e-6 and are added up a few times.
const SMOOTH: Tolerance = Tolerance { relative: 1e-4, floor: 1e-2, absolute: 1e-6 };
/// A box's is a difference of two averages over a side: that divides their rounding, a few 1e-7, by a side of 0.01 widths.
const DIFFERENCE: Tolerance = Tolerance { relative: 1e-3, floor: 0.1, absolute: 1e-4 };

fn agree<const D: usize>(what: &str, tolerance: Tolerance, mut draw: impl FnMut(&mut Stream) -> Case<D>) {
    let mut stream = Stream::new(1_707);
    let mut tally = Tally::new(&format!("gradient, {what}, {D}-D"), tolerance);
    for _ in 0..CASES {
        let case = draw(&mut stream);
        let got = case.support().feature_gradient(&case.kernel, &case.middle_m);
        let average = Average::new(&case.bump, &case.extent(), 1);
        let exact = average.gradient(&wide(&case.middle_m), 1e-3 * case.width_m);
        for axis in 0..D {
            tally.add(got[axis] * case.width_m as f32, exact[axis] * case.width_m, &case);
        }
    }
    tally.finish();
}

const GAUSSIAN: Over = Over { support: true, ..Over::POINT };
const BOX: Over = Over { sides_widths: 5.0, sides_at_least: 0.01, ..Over::POINT };

#[test]
fn of_squared_exponentials() {
    for (name, shape) in [("isotropic", Shape::Isotropic), ("full", Shape::Full), ("two scales", Shape::TwoScales)] {
        agree::<2>(&format!("point, {name}"), SMOOTH, |stream| Case::draw(stream, shape, &Over::POINT));
        agree::<2>(&format!("Gaussian, {name}"), SMOOTH, |stream| Case::draw(stream, shape, &GAUSSIAN));
        agree::<2>(&format!("box, {name}"), DIFFERENCE, |stream| Case::draw(stream, shape, &BOX));
    }
}

#[test]
fn of_splines() {
    // Differences of the oracle see the spline's knots: their error is the step squared, 1e-6.
    agree("point, spline", Tolerance { absolute: 3e-6, ..SMOOTH }, |stream| draw::<2>(stream, Over::POINT, 0.0));
    agree("box, spline", DIFFERENCE, |stream| draw::<2>(stream, BOX, 0.0));
}
