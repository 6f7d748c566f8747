//! The cubic B-spline, in every composition.

use bhm_core::kernel::{CubicBSplineSettings, KernelSettings};
use bhm_oracle::Bump;

use crate::{
    draw::{Case, Over, logarithmic},
    stream::Stream,
    tally::{CLOSED, Tally, Tolerance},
};

const CASES: usize = 10_000;

/// Only absolute.
pub const fn absolute(absolute: f64) -> Tolerance {
    Tolerance { relative: f64::NAN, floor: f64::INFINITY, absolute }
}

/// What the kernel states for standard deviations up to 0.3 and up to 0.75 spacings.
pub const BLURRED_LITTLE: Tolerance = absolute(7e-4);
const BLURRED_MUCH: Tolerance = absolute(6e-3);

/// A spline, and covariances up to a standard deviation of `deviation` spacings.
pub fn draw<const D: usize>(stream: &mut Stream, over: Over, deviation: f64) -> Case<D> {
    let spacing_m = logarithmic(stream, 0.1, 1.0) as f32;
    let kernel = KernelSettings::CubicBSpline(CubicBSplineSettings::DEFAULT).build(spacing_m);
    let spacing_m = f64::from(spacing_m);
    // Half a spacing for a width: 4.3 of them are as far as the spline reaches.
    let kernel = (kernel, Bump::Spline { spacing_m }, 0.5 * spacing_m);
    Case::about(stream, kernel, (deviation * spacing_m).powi(2), &over)
}

fn agrees<const D: usize>(what: &str, over: Over, deviation: f64, cases: usize, tolerance: Tolerance) {
    let mut stream = Stream::new(1_946);
    let mut tally = Tally::new(&format!("{what}, {D}-D"), tolerance);
    for _ in 0..cases {
        let case = draw::<D>(&mut stream, over, deviation);
        tally.add(case.feature(), case.exact(), &case);
    }
    tally.finish();
}

#[test]
fn segments() {
    agrees::<2>("spline, segment", Over { along_widths: 8.0, ..Over::SEGMENT }, 0.0, CASES, CLOSED);
    agrees::<3>("spline, segment", Over { along_widths: 8.0, ..Over::SEGMENT }, 0.0, CASES / 10, CLOSED);
    agrees::<2>("spline, segment of any length", Over::SEGMENT, 0.0, CASES, CLOSED);
}

#[test]
fn boxes() {
    let over = Over { sides_widths: 20.0, ..Over::POINT };
    agrees::<2>("spline, box", over, 0.0, CASES, CLOSED);
    agrees::<3>("spline, box", over, 0.0, CASES / 10, CLOSED);
}

#[test]
fn blurred() {
    let over = Over { support: true, ..Over::POINT };
    agrees::<2>("spline blurred by up to 0.3 spacings", over, 0.3, CASES, BLURRED_LITTLE);
    agrees::<2>("spline blurred by up to 0.75 spacings", over, 0.75, CASES, BLURRED_MUCH);
}

#[test]
fn blurred_segments() {
    let over = Over { support: true, along_widths: 8.0, ..Over::SEGMENT };
    agrees::<2>("spline blurred by up to 0.3 spacings, segment", over, 0.3, CASES / 50, BLURRED_LITTLE);
    agrees::<2>("spline blurred by up to 0.75 spacings, segment", over, 0.75, CASES / 50, BLURRED_MUCH);
}

#[test]
fn boxes_and_segments() {
    let over = Over { sides_widths: 10.0, along_widths: 4.0, ..Over::SEGMENT };
    agrees::<2>("spline, box, segment", over, 0.0, CASES, absolute(3e-5));
}
