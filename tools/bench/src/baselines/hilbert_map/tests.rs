use rand::Rng;

use super::*;
use crate::baselines::test_support::{of_points, setup};

/// Forty points of six features in [−1, 1], whose labels no weights separate.
fn problem() -> (Vec<[f32; 6]>, Vec<bool>) {
    let mut dice = ChaCha8Rng::seed_from_u64(5);
    let rows = (0..40).map(|_| [0; 6].map(|_: i32| dice.random_range(-1.0..1.0_f32))).collect();
    (rows, (0..40).map(|_| dice.random()).collect())
}

/// `1/N Σ −ln p(y) + λ₁|w|₁ + λ₂/2 |w|²`, in probabilities.
fn objective(weights: &[f64], net: ElasticNet, (rows, labels): &(Vec<[f32; 6]>, Vec<bool>)) -> f64 {
    let penalty = |w: &f64| f64::from(net.l1) * w.abs() + f64::from(net.l2) / 2.0 * w * w;
    let surprise = |(row, occupied): (&[f32; 6], &bool)| {
        let logit: f64 = row.iter().zip(weights).map(|(f, w)| f64::from(*f) * w).sum();
        let p = 1.0 / (1.0 + (-logit).exp());
        -(if *occupied { p } else { 1.0 - p }).ln()
    };
    let mean = rows.iter().zip(labels).map(surprise).sum::<f64>() / rows.len() as f64;
    mean + weights.iter().map(penalty).sum::<f64>()
}

/// The batch optimum by a search that knows no gradients: one coordinate after another, in steps that shrink.
fn optimum(net: ElasticNet, problem: &(Vec<[f32; 6]>, Vec<bool>)) -> Vec<f64> {
    let mut weights = vec![0.0; 6];
    let mut step = 1.0;
    while step > 1e-7 {
        let before = objective(&weights, net, problem);
        for at in 0..6 {
            for change in [-step, step] {
                let mut tried = weights.clone();
                tried[at] += change;
                // A weight that the net holds at zero is tried there too.
                if tried[at].abs() < 1e-9 {
                    tried[at] = 0.0;
                }
                if objective(&tried, net, problem) < objective(&weights, net, problem) {
                    weights = tried;
                }
            }
        }
        if objective(&weights, net, problem) >= before {
            step /= 2.0;
        }
    }
    weights
}

/// What many steps settle around: the learner's own averages of sparse rows, and of dense ones, which have none, the mean over
/// the last half of the steps.
fn learned(net: ElasticNet, problem: &(Vec<[f32; 6]>, Vec<bool>), dense: bool) -> Vec<f64> {
    const STEPS: usize = 200_000;
    let mut weights = Weights::new(6, 0.5, 1e-2, net);
    let mut dice = ChaCha8Rng::seed_from_u64(1);
    let indices = [0, 1, 2, 3, 4, 5];
    let mut means = vec![0.0; 6];
    for step in 0..STEPS {
        let at = dice.random_range(0..problem.0.len());
        let row = if dense { Row::Dense(&problem.0[at]) } else { Row::Sparse(&indices, &problem.0[at]) };
        weights.learn(row, problem.1[at]);
        if step >= STEPS / 2 {
            means.iter_mut().zip(&weights.now).for_each(|(mean, now)| *mean += f64::from(*now) / (STEPS / 2) as f64);
        }
    }
    if dense { means } else { weights.averages.into_iter().map(f64::from).collect() }
}

#[test]
fn gradient_steps_reach_the_batch_optimum() {
    // Values stray by 0.04 with these rates, `√(r/2 · variance/curvature)`; means of 50 000 and more, correlated over `1/(r ·
    // curvature)` ≈ 2 000 steps, by a fifth of it, with room for three times as much.
    const TOLERANCE: f64 = 0.025;
    let problem = problem();
    for net in [ElasticNet { l1: 0.0, l2: 0.05 }, ElasticNet { l1: 0.03, l2: 0.02 }] {
        let expected = optimum(net, &problem);
        for dense in [true, false] {
            for (found, expected) in learned(net, &problem, dense).iter().zip(&expected) {
                assert!((found - expected).abs() < TOLERANCE, "{net:?}, {dense}: {found} is not {expected}");
            }
        }
    }
}

#[test]
fn steps_at_once_are_the_steps_one_by_one() {
    for net in [ElasticNet { l1: 1e-3, l2: 2e-3 }, ElasticNet { l1: 1e-3, l2: 0.0 }, ElasticNet { l1: 0.0, l2: 2e-3 }] {
        for weight in [1.5_f32, -0.7, 0.01, 0.0] {
            let mut slowly = weight;
            for steps in 0..400 {
                let at_once = net.steps(weight, 0.9, steps);
                // Four hundred roundings of an f32.
                assert!(
                    (at_once - slowly).abs() < 400.0 * f32::EPSILON,
                    "{net:?} {weight} {steps}: {at_once}, {slowly}"
                );
                slowly = net.step(slowly, 0.9);
            }
        }
    }
    assert_eq!(ElasticNet { l1: 1e-3, l2: 2e-3 }.steps(1.0, 1e3, u64::MAX), 0.0);
}

/// The same stream, once as sparse rows and once with the zeros written out.
#[test]
fn lazy_and_eager_weights_are_the_same() {
    let net = ElasticNet { l1: 1e-4, l2: 1e-3 };
    let [mut lazy, mut eager] = [0; 2].map(|_| Weights::new(8, 0.5, 1e-2, net));
    let mut dice = ChaCha8Rng::seed_from_u64(2);
    for _ in 0..3_000 {
        let first = dice.random_range(0..7_u32);
        let values = [dice.random::<f32>(), dice.random::<f32>()];
        let occupied = first < 3;
        let mut all = [0.0; 8];
        all[first as usize..first as usize + 2].copy_from_slice(&values);
        lazy.learn(Row::Sparse(&[first, first + 1], &values), occupied);
        eager.learn(Row::Dense(&all), occupied);
    }
    for at in 0..8 {
        let missed = lazy.steps - lazy.shrunk[at];
        let lazy = net.steps(lazy.now[at], 0.5 / lazy.squares[at].sqrt(), missed);
        assert!((lazy - eager.now[at]).abs() < 1e-4, "weight {at}: {lazy}, {}", eager.now[at]);
    }
}

/// A wall at x = 1 in free space; every kind of features finds it, twice the same, and asking changes nothing.
#[test]
fn a_wall_is_learned_the_same_twice() {
    let mut dice = ChaCha8Rng::seed_from_u64(4);
    let mut scan = |number: u64| {
        let mut points = Vec::new();
        for _ in 0..100 {
            let y_m = dice.random_range(-1.5..1.5_f32);
            points.push(([1.0, y_m], true));
            points.push(([dice.random_range(-1.5..0.6_f32), y_m], false));
        }
        of_points(number, &points, None)
    };
    let training: Vec<TrainingScan> = (0..20).map(&mut scan).collect();
    for entry in ENTRIES {
        let size = match entry.size {
            Size::Metres(spacing_m) => spacing_m,
            Size::Count(..) => 200.0,
        };
        let setup = setup([[-2.5, -2.5], [2.5, 2.5]], size);
        if cfg!(not(feature = "dense")) && entry.name == "hilbert-nystrom" {
            assert!((entry.open)(&setup).is_err());
            continue;
        }
        let learn = || {
            let mut map = (entry.open)(&setup).unwrap();
            training.iter().for_each(|shown| map.integrate(shown).unwrap());
            map.integrate(&of_points(99, &[([1e30, -1e30], true)], None)).unwrap();
            map.integrate(&of_points(100, &[], None)).unwrap();
            map
        };
        let (mut map, mut again) = (learn(), learn());
        let asked = [[1.0, 0.0], [-0.5, 0.3], [1.0, -1.0], [1e30, 1e30]];
        let found = map.predict(&asked);
        assert_eq!(found, again.predict(&asked), "{}", entry.name);
        assert_eq!(found, map.predict(&asked), "{}", entry.name);
        assert!(found[0].logit > 1.0 && found[1].logit < -1.0 && found[2].logit > 1.0, "{}: {found:?}", entry.name);
        assert!(found[3].logit.is_finite() && map.memory_bytes() > 0);
    }
}
