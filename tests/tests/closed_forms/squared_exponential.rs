//! The squared exponential and its two-scale sum, in every composition.

use crate::{
    draw::{Case, Over, Shape},
    stream::Stream,
    tally::{CLOSED, Tally, Tolerance},
};

const CASES: usize = 10_000;
/// As wide as the documentation promises quadrature over boxes for.
const BOX: Over = Over { sides_widths: 7.0, ..Over::POINT };

fn agrees<const D: usize>(what: &str, shape: Shape, over: Over, cases: usize, tolerance: Tolerance) {
    let mut stream = Stream::new(20_180 + cases as u64);
    let mut tally = Tally::new(&format!("{what}, {D}-D"), tolerance);
    for _ in 0..cases {
        let case = Case::<D>::draw(&mut stream, shape, &over);
        tally.add(case.feature(), case.exact(), &case);
    }
    tally.finish();
}

/// In the plane and, for fewer cases, in space.
fn in_plane_and_space(what: &str, shape: Shape, over: Over, cases: usize) {
    agrees::<2>(what, shape, over, cases, CLOSED);
    agrees::<3>(what, shape, over, cases / 50, CLOSED);
}

#[test]
fn blurred_by_a_support() {
    for (name, shape) in [("isotropic", Shape::Isotropic), ("full", Shape::Full), ("two scales", Shape::TwoScales)] {
        in_plane_and_space(
            &format!("Gaussian support (13), {name}"),
            shape,
            Over { support: true, ..Over::POINT },
            CASES,
        );
    }
}

#[test]
fn blurred_twice() {
    for (name, shape) in [("isotropic", Shape::Isotropic), ("full", Shape::Full), ("two scales", Shape::TwoScales)] {
        let over = Over { support: true, spread: true, ..Over::POINT };
        in_plane_and_space(&format!("Gaussian support, uncertain point, {name}"), shape, over, CASES);
    }
}

#[test]
fn segments() {
    for (name, shape) in [("isotropic", Shape::Isotropic), ("full", Shape::Full), ("two scales", Shape::TwoScales)] {
        in_plane_and_space(&format!("segment (11), {name}"), shape, Over::SEGMENT, CASES);
    }
}

#[test]
fn segments_blurred_once_and_twice() {
    for (name, shape) in [("isotropic", Shape::Isotropic), ("full", Shape::Full), ("two scales", Shape::TwoScales)] {
        let once = Over { support: true, ..Over::SEGMENT };
        in_plane_and_space(&format!("Gaussian support, segment, {name}"), shape, once, CASES);
        let twice = Over { spread: true, ..once };
        in_plane_and_space(&format!("Gaussian support, uncertain segment, {name}"), shape, twice, CASES);
    }
}

#[test]
fn boxes_in_closed_form() {
    let over = Over { sides_widths: 10.0, ..BOX };
    in_plane_and_space("box (14), isotropic", Shape::Isotropic, over, CASES);
    in_plane_and_space("box (14), two scales", Shape::TwoScales, over, CASES);
}

#[test]
fn boxes_by_quadrature() {
    in_plane_and_space("box, full", Shape::Full, BOX, CASES);
    in_plane_and_space("box, uncertain point", Shape::Isotropic, Over { spread: true, ..BOX }, CASES);
    in_plane_and_space("box, uncertain point, two scales", Shape::TwoScales, Over { spread: true, ..BOX }, CASES);
}

#[test]
fn boxes_and_segments() {
    let over = Over { along_m: 100.0, along_widths: 7.0, ..BOX };
    in_plane_and_space("box, segment", Shape::Isotropic, over, CASES);
    in_plane_and_space("box, segment, two scales", Shape::TwoScales, over, CASES);
    in_plane_and_space("box, segment, full", Shape::Full, over, CASES / 10);
    in_plane_and_space("box, uncertain segment", Shape::Isotropic, Over { spread: true, ..over }, CASES / 10);
}
