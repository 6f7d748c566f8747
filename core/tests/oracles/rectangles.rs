//! A sampled rectangle is the mean of the kernel over the middles of equal shares of it.

use bhm_core::{
    geometry::Point,
    kernel::{Averaging, Kernel, SquaredExponential},
    support::{RectangularSupport, Support},
};

use crate::common::Stream;

const SHAPE_M2: f64 = 0.2;

#[test]
fn a_sampled_rectangle_is_the_mean_over_the_middles_of_its_shares() {
    let kernel = SquaredExponential::<2>::isotropic(SHAPE_M2 as f32);
    let mut stream = Stream::new(81);
    for count in [1_u32, 2, 3, 7] {
        let sides = [0, 1].map(|_| stream.between(0.1, 1.5));
        let support = RectangularSupport::new(Point::from(sides.map(|x| x as f32)), Averaging::Samples(count))
            .expect("a support");
        for _ in 0..100 {
            let at = [0, 1].map(|_| stream.between(-1.0, 1.0));
            let (mut value, mut slope) = (0.0, [0.0; 2]);
            for i in 0..count {
                for j in 0..count {
                    let middle = |number: u32, side: f64| side * ((2 * number + 1) as f64 / (2 * count) as f64 - 0.5);
                    let d = [at[0] + middle(i, sides[0]), at[1] + middle(j, sides[1])];
                    let here = (-(d[0] * d[0] + d[1] * d[1]) / SHAPE_M2).exp() / f64::from(count * count);
                    value += here;
                    slope[0] -= 2.0 * d[0] / SHAPE_M2 * here;
                    slope[1] -= 2.0 * d[1] / SHAPE_M2 * here;
                }
            }
            // Each of the summands is right to a few units in the last place of 1, at a place right to as many of a metre.
            let at = Point::from(at.map(|x| x as f32));
            assert!((f64::from(support.feature(&kernel, &at)) - value).abs() < 2e-6, "{count} samples at {at}");
            let got = support.feature_gradient(&kernel, &at);
            for axis in 0..2 {
                assert!((f64::from(got[axis]) - slope[axis]).abs() < 2e-5, "{count} samples at {at}");
            }
        }
        // One sample is the middle: the kernel itself.
        if count == 1 {
            let at = Point::<2>::new(0.3, -0.2);
            assert_eq!(support.feature(&kernel, &at), kernel.value(&at));
        }
    }
}
