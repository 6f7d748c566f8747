//! The squared exponential and its two-scale sum, in every composition.

use bhm_core::reference::{Average, Bump, Extent};

use crate::{
    draw::{Case, Over, Shape, wide},
    stream::Stream,
    tally::{CLOSED, Tally, Tolerance},
};

const CASES: usize = 10_000;
/// As wide as the documentation promises quadrature over boxes for.
const BOX: Over = Over { sides_widths: 5.0, ..Over::POINT };

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
    let over = Over { along_m: 100.0, along_widths: 5.0, ..BOX };
    in_plane_and_space("box, segment", Shape::Isotropic, over, CASES);
    in_plane_and_space("box, segment, two scales", Shape::TwoScales, over, CASES);
    in_plane_and_space("box, segment, full", Shape::Full, over, CASES / 10);
    in_plane_and_space("box, uncertain segment", Shape::Isotropic, Over { spread: true, ..over }, CASES / 10);
}

/// The oracle with twice the nodes along every direction is the same oracle.
#[test]
fn the_oracle_is_refined_enough() {
    let all = Over { support: true, spread: true, sides_widths: 10.0, ..Over::SEGMENT };
    let mut worst = 0.0_f64;
    for (over, cases) in
        [(Over { sides_widths: 0.0, ..all }, 1_000), (Over { support: false, along_widths: 5.0, ..all }, 20)]
    {
        let mut stream = Stream::new(7);
        for _ in 0..cases {
            let case = Case::<2>::draw(&mut stream, Shape::Full, &over);
            let [coarse, fine] =
                [1, 2].map(|fineness| Average::new(&case.bump, &case.extent(), fineness).at(&wide(&case.middle_m)));
            if fine > 1e-8 {
                worst = worst.max((coarse / fine - 1.0).abs());
            }
        }
    }
    println!("the oracle, refined: relative {worst:.1e}");
    assert!(worst < 1e-8);
    // And by hand: exp(−x²) blurred by N(0, ½) along one axis is exp(−x²/2)/√2; over [−1, 1] it is √π/2·erf(1).
    let bump = Bump::Exponentials(vec![(1.0, [[1.0, 0.0], [0.0, 1.0]])]);
    let blur = Extent { covariance_m2: [[0.5, 0.0], [0.0, 0.0]], ..Extent::POINT };
    let exact = (-0.5_f64).exp() / 2.0_f64.sqrt();
    assert!((Average::new(&bump, &blur, 1).at(&[1.0, 0.0]) - exact).abs() < 1e-10);
    let segment = Extent { along_m: [0.0, 2.0], ..Extent::POINT };
    assert!((Average::new(&bump, &segment, 1).at(&[0.0, 0.0]) - 0.746_824_132_812_427).abs() < 1e-12);
}
