use bhm_core::profile::COMPACT;
use bhm_host::dataset::LabelledPoints;
use bhm_oracle::{DensePosterior, Factor, Observation};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{
    super::{Setup, kernel::SquaredExponential},
    inducing::{discover, is_new_ground},
    model::open,
    posterior::{Posterior, Weighted},
};

use crate::evaluation::TrainingScan;

const KERNEL: SquaredExponential = SquaredExponential { variance: 6.0, length_m: 0.8 };

/// Points with labels that a line divides, but for a few of them.
fn data(count: usize, seed: u64) -> Vec<Weighted> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut point = |_| {
        let at_m = [rng.random::<f64>() * 3.0, rng.random::<f64>() * 3.0];
        Weighted { at_m, occupied: (at_m[0] > 1.5) != (rng.random::<f64>() < 0.1), weight: 1.0 }
    };
    (0..count).map(&mut point).collect()
}

fn places(data: &[Weighted]) -> Vec<[f64; 2]> {
    data.iter().map(|point| point.at_m).collect()
}

/// Learned from all points at once, these being the inducing points, until nothing changes.
fn converged(data: &[Weighted]) -> Posterior {
    let mut posterior = Posterior::prior(KERNEL).unwrap();
    posterior.extend(&places(data)).unwrap();
    let weighted = |rate| data.iter().map(|point| Weighted { weight: rate, ..*point }).collect::<Vec<_>>();
    posterior.step(&weighted(1.0), 1.0).unwrap();
    (0..200).for_each(|_| posterior.step(&weighted(0.5), 0.5).unwrap());
    posterior
}

/// A belief about the log-odds at the points themselves: `Λ = K⁻¹ + diag(c)`, `Λμ = r`, of sites `(c, r)`.
fn belief(prior: &DensePosterior, sites: &[(f64, f64)]) -> DensePosterior {
    let mut information = prior.information.clone();
    sites.iter().enumerate().for_each(|(i, (curvature, _))| information[i][i] += curvature);
    DensePosterior::from_information(information, sites.iter().map(|(_, pull)| *pull).collect()).unwrap()
}

/// With the data as inducing points and all of them in each step, it ends at the greatest evidence lower bound of any Gaussian:
/// the bound is the reference's, with its own quadrature, and no site moved either way rises above.
#[test]
fn full_batches_end_at_the_greatest_evidence_lower_bound() {
    let data = data(14, 3);
    let posterior = converged(&data);
    let gram = |i: usize, j: usize| {
        let ([x, y], [u, v]) = (data[i].at_m, data[j].at_m);
        let jitter = if i == j { 1e-6 * KERNEL.variance } else { 0.0 };
        KERNEL.variance * (-((x - u).powi(2) + (y - v).powi(2)) / (2.0 * KERNEL.length_m.powi(2))).exp() + jitter
    };
    let all = 0..data.len();
    let covariance: Vec<Vec<f64>> = all.clone().map(|i| all.clone().map(|j| gram(i, j)).collect()).collect();
    let information = Factor::of(&covariance).unwrap().inverse();
    let prior = DensePosterior::from_information(information, vec![0.0; data.len()]).unwrap();
    let unit = |i: usize| all.clone().map(|j| f64::from(u8::from(i == j))).collect();
    let observations: Vec<_> = all.clone().map(|i| Observation { phi: unit(i), occupied: data[i].occupied }).collect();

    // The sites that give the marginals which the posterior has, found from these alone.
    let moments = posterior.moments(&places(&data));
    let mut sites = vec![(0.1, 0.0); data.len()];
    for _ in 0..2_000 {
        let now = belief(&prior, &sites);
        for (i, site) in sites.iter_mut().enumerate() {
            let variance = now.covariance[i][i];
            site.0 = (site.0 + 0.5 * (1.0 / moments[i].variance - 1.0 / variance)).max(0.0);
        }
        let now = belief(&prior, &sites);
        let wanted: Vec<_> = moments.iter().map(|moments| moments.mean).collect();
        let pulls = bhm_oracle::times(&now.information, &wanted);
        sites.iter_mut().zip(pulls).for_each(|(site, pull)| site.1 = pull);
    }
    let best = belief(&prior, &sites);
    for (i, moments) in moments.iter().enumerate() {
        assert!((best.mean[i] - moments.mean).abs() < 1e-5, "{i}: {} {moments:?}", best.mean[i]);
        assert!((best.covariance[i][i] - moments.variance).abs() < 1e-5, "{i}: {} {moments:?}", best.covariance[i][i]);
    }
    let bound = |sites: &[(f64, f64)]| belief(&prior, sites).evidence_lower_bound(&prior, &observations);
    let greatest = bound(&sites);
    let step = 1e-3;
    for i in 0..2 * data.len() {
        let moved = |by: f64| {
            let mut sites = sites.clone();
            let site = &mut sites[i / 2];
            *(if i.is_multiple_of(2) { &mut site.0 } else { &mut site.1 }) += by;
            bound(&sites)
        };
        let slope = (moved(step) - moved(-step)) / (2.0 * step);
        assert!(slope.abs() < 1e-4, "{i}: {slope}");
        assert!(moved(0.01) < greatest && moved(-0.01) < greatest, "{i}: {} {} {greatest}", moved(0.01), moved(-0.01));
    }
}

/// `q(u, u') = q(u) p(u'|u)`.
#[test]
fn further_inducing_points_change_no_belief() {
    let data = data(40, 5);
    let mut posterior = Posterior::prior(KERNEL).unwrap();
    posterior.extend(&places(&data[..10])).unwrap();
    posterior.step(&data, 1.0).unwrap();
    let asked_m: Vec<_> = (0..30).map(|i| [0.2 * f64::from(i), 0.17 * f64::from(i)]).collect();
    let before = posterior.moments(&asked_m);
    assert!(before.iter().any(|moments| moments.mean.abs() > 1.0));
    posterior.extend(&places(&data[10..])).unwrap();
    assert_eq!(posterior.inducing_m().len(), 40);
    for (before, after) in before.iter().zip(posterior.moments(&asked_m)) {
        assert!((before.mean - after.mean).abs() < 1e-9, "{before:?} {after:?}");
        assert!((before.variance - after.variance).abs() < 1e-9, "{before:?} {after:?}");
    }
    // The far end of the asked points is far from all that was learned.
    assert!((before[29].variance - KERNEL.variance).abs() < 0.5, "{:?}", before[29]);
}

/// A point of weight two is that point twice.
#[test]
fn weights_are_counts() {
    let data = data(12, 7);
    let doubled: Vec<_> = data.iter().map(|point| Weighted { weight: 2.0, ..*point }).collect();
    let twice = [&data[..], &data[..]].concat();
    let [heavy, often] = [doubled, twice].map(|batch| {
        let mut posterior = Posterior::prior(KERNEL).unwrap();
        posterior.extend(&places(&data)).unwrap();
        posterior.step(&batch, 0.3).unwrap();
        posterior.step(&batch, 0.3).unwrap();
        posterior.moments(&[[1.0, 1.0], [2.5, 0.4]])
    });
    for (heavy, often) in heavy.iter().zip(&often) {
        assert!((heavy.mean - often.mean).abs() < 1e-9 && (heavy.variance - often.variance).abs() < 1e-9);
    }
}

#[test]
fn new_ground_is_covered_within_the_room_there_is() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let points_m: Vec<_> = (0..2_000).map(|_| [9.0 * rng.random::<f64>(), 5.0 * rng.random::<f64>()]).collect();
    let mut known_m: Vec<[f64; 2]> = Vec::new();
    for _ in 0..20 {
        known_m.extend(discover(&known_m, &points_m, 0.8, 1_000, 4));
    }
    assert!(!is_new_ground(&known_m, &points_m, 0.8));
    // One for each square of the spacing is 70; half of it apart, 360 discs of a quarter of it would fill the ground.
    assert!((70..360).contains(&known_m.len()), "{}", known_m.len());
    for (i, a) in known_m.iter().enumerate() {
        assert!(known_m[..i].iter().all(|b| (a[0] - b[0]).hypot(a[1] - b[1]) >= 0.4), "{i} {a:?}");
    }
    assert!(discover(&known_m, &points_m, 0.8, 1_000, 4).is_empty());
    assert_eq!(discover(&[], &points_m, 0.8, 9, 4).len(), 9);
    assert!(discover(&[], &points_m, 0.8, 0, 4).is_empty() && is_new_ground(&[], &points_m, 0.8));
}

/// A corridor that is walked along: inducing points become more up to the cap; then they are clustered anew, and what was
/// learned at the beginning is still known.
#[test]
fn what_has_no_room_left_is_clustered_anew_and_not_forgotten() {
    let area_m = [[0.0, -3.0], [40.0, 3.0]];
    let setup = Setup { area_m, size: 40.0, limits: COMPACT.settings.limits, profile: COMPACT, seed: 2 };
    let mut baseline = open(&setup).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let mut before = 0;
    for scan in 0..60 {
        let mut point = |i: usize| {
            let x = 0.6 * scan as f32 + 4.0 * rng.random::<f32>();
            if i.is_multiple_of(2) { ([x, 2.5], true) } else { ([x, -2.5 + 3.0 * rng.random::<f32>()], false) }
        };
        let (points_m, occupied) = (0..100).map(&mut point).unzip();
        baseline.integrate(&TrainingScan::of_points(LabelledPoints { scan, points_m, occupied }, None)).unwrap();
        if scan == 9 {
            before = baseline.memory_bytes();
        }
    }
    let description = baseline.description();
    assert!(description.contains("of 40 inducing") && !description.contains("anew 0 times"), "{description}");
    assert!(baseline.memory_bytes() > before + 5_000 * 12, "{before}");
    for x in [2.0, 8.0, 20.0, 34.0] {
        let answers = baseline.predict(&[[x, 2.5], [x, -1.0]]);
        assert!(answers[0].logit > 0.5 && answers[1].logit < -0.5, "{x}: {answers:?}");
    }
}

/// Learning adds to what inducing points of several times know, in whatever order they came.
#[test]
fn inducing_points_that_come_in_parts_learn_as_those_that_came_at_once() {
    let data = data(60, 11);
    let [parts, once] = [&[7, 20, 40][..], &[40]].map(|ends| {
        let mut posterior = Posterior::prior(KERNEL).unwrap();
        let mut begin = 0;
        for end in ends {
            posterior.extend(&places(&data[begin..*end])).unwrap();
            begin = *end;
        }
        posterior.step(&data, 0.4).unwrap();
        posterior.moments(&places(&data))
    });
    for (parts, once) in parts.iter().zip(&once) {
        assert!((parts.mean - once.mean).abs() < 1e-8, "{parts:?} {once:?}");
        assert!((parts.variance - once.variance).abs() < 1e-8, "{parts:?} {once:?}");
    }
}

/// A corridor much longer than the covariance reaches: leaving out what is far changes nothing, nor does the company in which
/// a point is asked about.
#[test]
fn what_is_far_is_left_out_without_loss() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let mut point = |_| {
        let at_m = [40.0 * rng.random::<f64>(), rng.random::<f64>()];
        Weighted { at_m, occupied: at_m[0].sin() > 0.0, weight: 1.0 }
    };
    let data: Vec<_> = (0..300).map(&mut point).collect();
    let mut posterior = Posterior::prior(KERNEL).unwrap();
    let inducing_m: Vec<_> = (0..80).map(|i| [0.5 * f64::from(i * 7 % 80), 0.5]).collect();
    posterior.extend(&inducing_m).unwrap();
    posterior.step(&data, 0.2).unwrap();
    posterior.step(&data, 0.2).unwrap();
    let together = posterior.moments(&places(&data));
    for (point, together) in data.iter().zip(&together) {
        let [alone] = posterior.moments(&[point.at_m])[..] else { panic!() };
        assert!((alone.mean - together.mean).abs() < 1e-6, "{alone:?} {together:?}");
        assert!((alone.variance - together.variance).abs() < 1e-6, "{alone:?} {together:?}");
    }
    let right = data.iter().zip(&together).filter(|(point, moments)| (moments.mean > 0.0) == point.occupied).count();
    assert!(right > 270, "{right}");
}

/// What one posterior learned is said by another's inducing points.
#[test]
fn what_another_believes_is_adopted() {
    let data = data(40, 13);
    let known = converged(&data);
    let mut posterior = Posterior::prior(KERNEL).unwrap();
    posterior.extend(&places(&data)).unwrap();
    posterior.adopt(&data, &known).unwrap();
    for (adopted, known) in posterior.moments(&places(&data)).iter().zip(known.moments(&places(&data))) {
        assert!((adopted.mean - known.mean).abs() < 1e-4, "{adopted:?} {known:?}");
        assert!((adopted.variance - known.variance).abs() < 1e-4, "{adopted:?} {known:?}");
    }
}
