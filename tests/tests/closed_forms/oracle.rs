//! Whether the oracle is one: refined it says the same, and where an integral is known it is that.

use bhm_oracle::{Average, Bump, Extent};

use crate::{
    cubic_b_spline,
    draw::{Case, Over, Shape, wide},
    stream::Stream,
};

/// The largest difference that twice the nodes along every direction make: relative where the value is above `floor`.
fn refined(cases: usize, floor: f64, mut draw: impl FnMut(&mut Stream) -> Case<2>) -> f64 {
    let mut stream = Stream::new(7);
    let differences = (0..cases).map(|_| {
        let case = draw(&mut stream);
        let at = |fineness| Average::new(&case.bump, &case.extent(), fineness).at(&wide(&case.middle_m));
        let (coarse, fine) = (at(1), at(2));
        (coarse - fine).abs() / fine.max(floor)
    });
    differences.fold(0.0, f64::max)
}

#[test]
fn refinement_changes_nothing() {
    let all = Over { support: true, spread: true, sides_widths: 10.0, ..Over::SEGMENT };
    let without_box = Over { sides_widths: 0.0, ..all };
    let short = Over { support: false, along_widths: 7.0, ..all };
    for (over, cases) in [(without_box, 1_000), (short, 10)] {
        let worst = refined(cases, 1e-8, |stream| Case::draw(stream, Shape::Full, &over));
        println!("the oracle, refined: relative {worst:.1e}");
        assert!(worst < 1e-8);
    }
    let polynomial = Over { sides_widths: 10.0, ..Over::SEGMENT };
    let worst = refined(1_000, 1e-8, |stream| cubic_b_spline::draw(stream, polynomial, 0.0));
    println!("the oracle of splines, refined: relative {worst:.1e}");
    assert!(worst < 1e-8);
    // The spline's third derivative jumps, which a trapezoid sees: enough to judge errors of 7e-4.
    let blurred = Over { support: true, ..Over::POINT };
    let worst = refined(300, 1.0, |stream| cubic_b_spline::draw(stream, blurred, 0.75));
    println!("the oracle of blurred splines, refined: absolute {worst:.1e}");
    assert!(worst < 1e-5);
}

/// `exp(−x²)` blurred by `N(0, ½)` along one axis is `exp(−x²/2)/√2`; over `[−1, 1]` it is `√π/2·erf(1)`.
#[test]
fn known_integrals() {
    let bump = Bump::Exponentials(vec![(1.0, [[1.0, 0.0], [0.0, 1.0]])]);
    let blur = Extent { covariance_m2: [[0.5, 0.0], [0.0, 0.0]], ..Extent::POINT };
    let exact = (-0.5_f64).exp() / 2.0_f64.sqrt();
    assert!((Average::new(&bump, &blur, 1).at(&[1.0, 0.0]) - exact).abs() < 1e-10);
    let along = Extent { along_m: [0.0, 2.0], ..Extent::POINT };
    let sides = Extent { sides_m: [0.0, 2.0], ..Extent::POINT };
    for extent in [along, sides] {
        assert!((Average::new(&bump, &extent, 1).at(&[0.0, 0.0]) - 0.746_824_132_812_427).abs() < 1e-12);
    }
    // The spline over all of its support is 1/β(0) = 3/2 of a spacing: 3/8 of its four.
    let spline = Bump::Spline { spacing_m: 0.5 };
    let whole = Extent { sides_m: [2.0, 0.0], ..Extent::POINT };
    assert!((Average::new(&spline, &whole, 1).at(&[0.0, 0.0]) - 0.375).abs() < 1e-14);
}
