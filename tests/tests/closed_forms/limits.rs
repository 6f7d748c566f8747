//! What covers nothing is a point, and what is sampled finely enough is exact.

use bhm_core::{
    geometry::Point,
    kernel::{Averaging, CubicBSpline, Kernel, SquaredExponential, TwoScales},
    support::{GaussianSupport, PointSupport, RectangularSupport, Support},
};
use bhm_oracle::{Average, Bump, Extent};
use nalgebra::SMatrix;

use crate::{draw::wide, stream::Stream};

const CASES: usize = 10_000;
/// The spacing, and the length that stands for none: 1e-3 of the kernel's width changes it by (1e-3)².
const SPACING_M: f32 = 0.5;
const NOTHING_M: f32 = 2e-4;
/// A mean of up to 49 nodes whose weights sum to 1 within 1e-6, on a value of at most 1.
const ROUNDING: f32 = 3e-6;

fn place(stream: &mut Stream) -> Point<2> {
    Point::from_fn(|_, _| stream.between(-1.2, 1.2) as f32)
}

/// Every support and every place of nothing, of no size at all and of very little.
fn what_covers_nothing_is_a_point(kernel: &impl Kernel<2>) {
    let mut stream = Stream::new(13);
    let mut worst = 0.0_f32;
    for _ in 0..CASES {
        let at = place(&mut stream);
        let point = kernel.value(&at);
        let angle = stream.between(0.0, 6.3) as f32;
        let along = Point::<2>::new(angle.cos(), angle.sin());
        let rank_one = along * along.transpose();
        for size in [0.0, NOTHING_M * 1e-4, NOTHING_M] {
            let covariance = rank_one * (size * size);
            let gaussian = GaussianSupport::new(covariance).expect("a covariance");
            let round = GaussianSupport::new(SMatrix::from_diagonal_element(size * size)).expect("a covariance");
            let segment = along * size;
            let mut features = vec![
                gaussian.feature(kernel, &at),
                round.feature(kernel, &at),
                PointSupport.segment_feature(kernel, &at, &segment),
                gaussian.segment_feature(kernel, &at, &segment),
                PointSupport.segment_feature(&kernel.blurred(&covariance), &at, &segment),
                kernel.over_box(&at, &Point::from_element(size)),
                kernel.blurred(&covariance).over_box(&at, &Point::from_element(size)),
            ];
            for averaging in [Averaging::Exact, Averaging::Samples(5)] {
                if let Some(rectangle) = RectangularSupport::new(Point::from_element(size), averaging) {
                    features.push(rectangle.feature(kernel, &at));
                    features.push(rectangle.segment_feature(kernel, &at, &segment));
                }
            }
            for (which, feature) in features.iter().enumerate() {
                let off = (feature - point).abs();
                assert!(off <= ROUNDING, "{which} of size {size} at {at:?}: {feature} for {point}");
                worst = worst.max(off);
            }
        }
    }
    println!("what covers nothing is a point: absolute {worst:.1e} over {CASES} places");
}

#[test]
fn of_every_kernel() {
    let full = SquaredExponential::with_shape(SMatrix::from([[0.15, 0.05], [0.05, 0.1]])).expect("a shape");
    what_covers_nothing_is_a_point(&full);
    what_covers_nothing_is_a_point(&SquaredExponential::isotropic(0.15));
    what_covers_nothing_is_a_point(&TwoScales::new(0.15));
    what_covers_nothing_is_a_point(&CubicBSpline::new(SPACING_M));
}

/// Eqs. (12) and (14) as printed, samples in the middles of equal shares, err by a quarter with twice the samples.
fn samples_are_of_second_order(kernel: &impl Kernel<2>, bump: &Bump<2>, what: &str) {
    const COUNTS: [u32; 4] = [4, 8, 16, 32];
    let mut stream = Stream::new(12);
    let mut errors = [[0.0_f64; COUNTS.len()]; 3];
    for _ in 0..CASES / 4 {
        let at = place(&mut stream);
        let along = place(&mut stream);
        let sides = Point::from_fn(|_, _| stream.between(0.4, 1.0) as f32);
        let exact = |sides: &Point<2>, along: &Point<2>| {
            let extent = Extent { sides_m: wide(sides), along_m: wide(along), ..Extent::POINT };
            Average::new(bump, &extent, 1).at(&wide(&at))
        };
        let none = Point::zeros();
        let exact = [exact(&none, &along), exact(&sides, &none), exact(&sides, &along)];
        for (column, count) in COUNTS.into_iter().enumerate() {
            let rectangle = RectangularSupport::new(sides, Averaging::Samples(count)).expect("a rectangle");
            let segment: f32 = (0..count)
                .map(|i| kernel.value(&(at + along * ((i as f32 + 0.5) / count as f32 - 0.5))) / count as f32)
                .sum();
            let got = [segment, rectangle.feature(kernel, &at), rectangle.segment_feature(kernel, &at, &along)];
            for (row, (got, exact)) in got.iter().zip(exact).enumerate() {
                errors[row][column] += (f64::from(*got) - exact).abs() / (CASES / 4) as f64;
            }
        }
    }
    for (name, errors) in ["segment", "rectangle", "rectangle and segment"].iter().zip(errors) {
        println!(
            "{name} of {what} by {COUNTS:?} samples: mean errors {}",
            errors.map(|e| format!("{e:.1e}")).join(", ")
        );
        for pair in errors.windows(2) {
            let order = pair[0] / pair[1];
            assert!((3.5..4.8).contains(&order), "{name} of {what}: {order} for twice the samples");
        }
    }
}

#[test]
fn samples_tend_to_the_closed_form() {
    let g = 0.15_f32;
    let diagonal = |g: f64| [[g, 0.0], [0.0, g]];
    let bump = Bump::Exponentials(vec![(1.0, diagonal(g.into()))]);
    samples_are_of_second_order(&SquaredExponential::isotropic(g), &bump, "an exponential");
    let bump = Bump::Spline { spacing_m: SPACING_M.into() };
    samples_are_of_second_order(&CubicBSpline::new(SPACING_M), &bump, "a spline");
}
