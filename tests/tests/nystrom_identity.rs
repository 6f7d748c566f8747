//! Eq. (10): the Nyström features `φ̃(x) = L⁻¹ k(x)`, `K = LLᵀ` the kernel between the supports, on the dense path.
//!
//! They reproduce the kernel at the supports, `Φ̃ᵀΦ̃ = K`; with them a flat prior is the Gaussian process's, and learning
//! with them is learning the weights of `k(x)` itself under the prior precision `K`. Supports stand anywhere: `B = M`.
#![allow(clippy::needless_range_loop, reason = "indices as the formulas have them")]

mod common;

use bhm_core::{
    geometry::Point,
    kernel::{Kernel, SquaredExponential},
    rule::{AnyRule, JaakkolaJordan, XiStart as CoreXiStart},
};
use bhm_oracle::{DensePosterior, Factor, Kernel as ExactKernel, Matrix, Rule, XiStart, quadratic, times};
use common::{Learner, SparseRow, Stream, observations};

const M: usize = 40;
const SHAPE_M2: f32 = 0.15;
const JAAKKOLA: AnyRule = AnyRule::JaakkolaJordan(JaakkolaJordan { start: CoreXiStart::Constant(1.0) });
const EXACT_JAAKKOLA: Rule = Rule::JaakkolaJordan { start: XiStart::Constant(1.0) };

/// An entry of `K` in `f32`: the exponent, at most 1 wherever the value counts, is right to a few roundings.
const ENTRY: f64 = 1e-6;
/// The condition of `K` below is under 1e3 and that of what is learned under 1e4, at which `f32` is right to a few times
/// `1e4 · 6e-8`.
const RELATIVE: f64 = 2e-3;

/// Supports anywhere in four metres, none so close to another that `K` would be singular in `f32`.
fn supports(stream: &mut Stream) -> Vec<Point<2>> {
    let mut supports: Vec<Point<2>> = Vec::new();
    while supports.len() < M {
        let at = Point::<2>::new(stream.between(0.0, 4.0) as f32, stream.between(0.0, 4.0) as f32);
        let apart = |other: &Point<2>| (at - other).dot(&(at - other)) > 0.35 * 0.35;
        if supports.iter().all(apart) {
            supports.push(at);
        }
    }
    supports
}

/// `k(x)` as the core evaluates it.
fn row(supports: &[Point<2>], at: &Point<2>) -> Vec<f64> {
    let kernel = SquaredExponential::<2>::isotropic(SHAPE_M2);
    supports.iter().map(|support| f64::from(kernel.value(&(at - support)))).collect()
}

/// `K` in `f64`, from the supports as rounded.
fn exact_kernel(supports: &[Point<2>]) -> Matrix {
    let kernel = ExactKernel::SquaredExponential { shape_m2: f64::from(SHAPE_M2) };
    let wide = |p: &Point<2>| [f64::from(p.x), f64::from(p.y)];
    let value = |a: [f64; 2], b: [f64; 2]| kernel.value(&[a[0] - b[0], a[1] - b[1]]);
    supports.iter().map(|a| supports.iter().map(|b| value(wide(a), wide(b))).collect()).collect()
}

/// `K⁻¹` and `L⁻¹`.
fn inverses(matrix: &Matrix) -> (Matrix, Matrix) {
    let n = matrix.len();
    let mut lower = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            let rest = matrix[i][j] - (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
            lower[i][j] = if i == j { rest.sqrt() } else { rest / lower[j][j] };
        }
    }
    let mut inverse = vec![vec![0.0; n]; n];
    for column in 0..n {
        for i in column..n {
            let known: f64 = (column..i).map(|k| lower[i][k] * inverse[k][column]).sum();
            inverse[i][column] = (f64::from(u8::from(i == column)) - known) / lower[i][i];
        }
    }
    (Factor::of(matrix).expect("positive definite").inverse(), inverse)
}

#[test]
fn features_reproduce_the_kernel_at_the_supports() {
    let mut worst = 0.0_f64;
    for seed in 0..20 {
        let mut stream = Stream::new(seed);
        let supports = supports(&mut stream);
        let exact = exact_kernel(&supports);
        let (inverse, lower_inverse) = inverses(&exact);
        let features = |at: &Point<2>| times(&lower_inverse, &row(&supports, at));
        let all: Vec<Vec<f64>> = supports.iter().map(features).collect();
        // With k̂ = k + e from the core: k̂ᵢᵀK⁻¹k̂ⱼ = Kᵢⱼ + eᵢⱼ + eⱼᵢ + eᵢᵀK⁻¹eⱼ, the last at most M ε² ‖K⁻¹‖.
        let norm = inverse.iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max);
        let tolerance = 2.0 * ENTRY + M as f64 * ENTRY * ENTRY * norm;
        assert!(tolerance < 3.0 * ENTRY, "a condition at which the identity says nothing: {norm}");
        for i in 0..M {
            for j in 0..M {
                let product: f64 = all[i].iter().zip(&all[j]).map(|(a, b)| a * b).sum();
                worst = worst.max((product - exact[i][j]).abs());
                assert!((product - exact[i][j]).abs() <= tolerance, "{i}, {j}: {product} for {}", exact[i][j]);
            }
        }
        // Anywhere else what is missing of k(x, x) = 1 is a variance.
        for _ in 0..100 {
            let at = Point::<2>::new(stream.between(-1.0, 5.0) as f32, stream.between(-1.0, 5.0) as f32);
            let known: f64 = features(&at).iter().map(|x| x * x).sum();
            assert!((0.0..=1.0 + 1e-3).contains(&known), "{known} of 1 at {at:?}");
        }
    }
    println!("Nyström: ΦᵀΦ is K within {worst:.1e}");
}

/// The kernel's own weights, prior precision `K`, as the core keeps them.
fn learner_with(information: &Matrix, covariance: &Matrix) -> Learner<M, M> {
    let mut learner = Learner::<M, M>::flat(1.0);
    for i in 0..M {
        for j in i..M {
            learner.posterior.information[i][j - i] = information[i][j] as f32;
            learner.posterior.covariance[i][j - i] = covariance[i][j] as f32;
        }
    }
    let log_determinant = Factor::of(information).expect("positive definite").log_determinant();
    learner.posterior.log_determinant =
        [log_determinant as f32, (log_determinant - f64::from(log_determinant as f32)) as f32];
    learner
}

/// Mean and variance of a row under what a learner believes, in `f64`.
fn moments(learner: &Learner<M, M>, row: &[f64]) -> (f64, f64) {
    let posterior = &learner.posterior;
    let mut covariance = vec![vec![0.0; M]; M];
    for i in 0..M {
        for j in i..M {
            covariance[i][j] = f64::from(posterior.covariance[i][j - i]);
            covariance[j][i] = covariance[i][j];
        }
    }
    let mean = posterior.mean.iter().zip(row).map(|(m, x)| f64::from(*m) * x).sum();
    (mean, quadratic(&covariance, row))
}

#[test]
fn learning_with_them_is_learning_under_the_kernel_as_prior() {
    for seed in 0..8 {
        let mut stream = Stream::new(1_000 + seed);
        let supports = supports(&mut stream);
        let exact = exact_kernel(&supports);
        let (inverse, lower_inverse) = inverses(&exact);
        let mut nystrom = Learner::<M, M>::flat(1.0);
        let mut plain = learner_with(&exact, &inverse);
        let mut dense = DensePosterior::prior(&[1.0; M]);
        let sparse = |values: &[f64], occupied| SparseRow {
            entries: values.iter().enumerate().map(|(i, value)| (i as u32, *value as f32)).collect(),
            occupied,
        };
        for _ in 0..3 {
            let places: Vec<Point<2>> = (0..40)
                .map(|_| Point::<2>::new(stream.between(0.0, 4.0) as f32, stream.between(0.0, 4.0) as f32))
                .collect();
            let rows = places.iter().map(|at| row(&supports, at));
            let (transformed, plain_rows): (Vec<_>, Vec<_>) = rows
                .zip(&places)
                .map(|(row, at)| (sparse(&times(&lower_inverse, &row), at.x > 2.0), sparse(&row, at.x > 2.0)))
                .unzip();
            nystrom.update(&transformed, &JAAKKOLA, 3).expect("factors");
            plain.update(&plain_rows, &JAAKKOLA, 3).expect("factors");
            dense.update(&observations::<M>(&transformed), &EXACT_JAAKKOLA, 3).expect("factors");
        }
        let mut worst = [0.0_f64; 2];
        for _ in 0..200 {
            let at = Point::<2>::new(stream.between(-0.5, 4.5) as f32, stream.between(-0.5, 4.5) as f32);
            let row = row(&supports, &at);
            let features = times(&lower_inverse, &row);
            let mean: f64 = dense.mean.iter().zip(&features).map(|(m, x)| m * x).sum();
            let variance = quadratic(&dense.covariance, &features);
            for (which, (got_mean, got_variance)) in
                [moments(&nystrom, &features), moments(&plain, &row)].into_iter().enumerate()
            {
                // In units of what the prior leaves open: at most 1.
                let off = (got_mean - mean).abs().max((got_variance - variance).abs());
                worst[which] = worst[which].max(off);
                assert!(
                    off <= RELATIVE * (1.0 + mean.abs()),
                    "seed {seed}: {got_mean} ± {got_variance} for {mean} ± {variance}"
                );
            }
        }
        println!("seed {seed}: off by {:.1e} with Nyström's features, {:.1e} with the kernel's", worst[0], worst[1]);
    }
}
