use bhm_oracle::{Factor, quadratic, sigmoid, times};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{super::kernel::SquaredExponential, laplace::Laplace, region::Region};

const KERNEL: SquaredExponential = SquaredExponential { variance: 9.0, length_m: 0.7 };

fn data(count: usize) -> (Vec<[f64; 2]>, Vec<bool>) {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let point = |_| {
        let at_m = [rng.random::<f64>() * 2.0, rng.random::<f64>() * 2.0];
        (at_m, (at_m[1] > 1.0) != (rng.random::<f64>() < 0.15))
    };
    (0..count).map(point).unzip()
}

/// The mode as the fixed point `f = K ∇ log p(y|f)`, by small steps and no second derivatives; mean and variance of the
/// log-odds from `K` and `(K + W⁻¹)⁻¹` as they are written in the textbook.
fn naive(points_m: &[[f64; 2]], occupied: &[bool], asked_m: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let k = |a: [f64; 2], b: [f64; 2]| {
        let squared = (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
        KERNEL.variance * (-squared / (2.0 * KERNEL.length_m.powi(2))).exp()
    };
    let gram: Vec<Vec<f64>> = points_m.iter().map(|a| points_m.iter().map(|b| k(*a, *b)).collect()).collect();
    let pull = |f: &[f64]| -> Vec<f64> {
        f.iter().zip(occupied).map(|(f, y)| f64::from(u8::from(*y)) - sigmoid(*f)).collect()
    };
    let mut f = vec![0.0; points_m.len()];
    for _ in 0..20_000 {
        let target = times(&gram, &pull(&f));
        f.iter_mut().zip(target).for_each(|(f, target)| *f += 0.02 * (target - *f));
    }
    let mut noisy = gram.clone();
    f.iter().enumerate().for_each(|(i, f)| noisy[i][i] += 1.0 / (sigmoid(*f) * sigmoid(-f)));
    let inverse = Factor::of(&noisy).unwrap().inverse();
    let ask = |asked_m: &[f64; 2]| {
        let cross: Vec<_> = points_m.iter().map(|at_m| k(*at_m, *asked_m)).collect();
        let mean = cross.iter().zip(pull(&f)).map(|(k, pull)| k * pull).sum();
        [mean, KERNEL.variance - quadratic(&inverse, &cross)]
    };
    asked_m.iter().map(ask).collect()
}

#[test]
fn newtons_mode_is_the_one_that_small_steps_find() {
    let (points_m, occupied) = data(25);
    let asked_m: Vec<_> = (0..20).map(|i| [0.15 * f64::from(i), 2.2 - 0.1 * f64::from(i)]).collect();
    let expected = naive(&points_m, &occupied, &asked_m);
    assert!(expected.iter().any(|[mean, _]| mean.abs() > 1.5), "{expected:?}");
    // From nothing, and from where no sensible fit ends.
    for start in [vec![0.0; 25], vec![3.0; 25]] {
        let fit = Laplace::fit(&KERNEL, &points_m, &occupied, start).unwrap();
        for (found, expected) in fit.moments(&KERNEL, &points_m, &asked_m).iter().zip(&expected) {
            assert!((0..2).all(|i| (found[i] - expected[i]).abs() < 1e-4), "{found:?} {expected:?}");
        }
    }
}

/// One point: the mode solves `f = k σ(−f)`, found by bisection.
#[test]
fn one_point_has_the_mode_of_its_equation() {
    let kernel = SquaredExponential { variance: 4.0, length_m: 1.0 };
    let fit = Laplace::fit(&kernel, &[[0.0, 0.0]], &[true], vec![0.0]).unwrap();
    let [[mean, variance]] = fit.moments(&kernel, &[[0.0, 0.0]], &[[0.0, 0.0]])[..] else { panic!("one answer") };
    let (mut low, mut high) = (0.0, 4.0);
    for _ in 0..60 {
        let middle: f64 = 0.5 * (low + high);
        *(if middle < 4.0 / (1.0 + middle.exp()) { &mut low } else { &mut high }) = middle;
    }
    assert!((mean - low).abs() < 1e-6, "{mean} {low}");
    let curvature = sigmoid(low) * sigmoid(-low);
    assert!((variance - 1.0 / (0.25 + curvature)).abs() < 1e-6, "{variance}");
}

#[test]
fn a_region_keeps_a_uniform_sample_and_fits_only_what_changed() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut early = 0;
    for _ in 0..400 {
        let mut region = Region::default();
        for i in 0..100 {
            region.offer([f64::from(i), 0.0], false, 10, &mut rng);
        }
        early += region.points_m().iter().filter(|[x, _]| *x < 50.0).count();
    }
    // 4 000 kept, half of them early: five standard deviations are 158.
    assert!((1_842..2_158).contains(&early), "{early}");

    let (points_m, occupied) = data(30);
    let mut region = Region::default();
    points_m.iter().zip(&occupied).for_each(|(at_m, occupied)| region.offer(*at_m, *occupied, 30, &mut rng));
    assert_eq!(region.moments(&KERNEL, &[[1.0, 1.0]]), [[0.0, KERNEL.variance]]);
    assert!(region.refit(&KERNEL).unwrap());
    assert!(!region.refit(&KERNEL).unwrap());
    let found = region.moments(&KERNEL, &[[1.0, 1.7]]);
    let expected = naive(&points_m, &occupied, &[[1.0, 1.7]]);
    assert!((0..2).all(|i| (found[0][i] - expected[0][i]).abs() < 1e-4), "{found:?} {expected:?}");
}
