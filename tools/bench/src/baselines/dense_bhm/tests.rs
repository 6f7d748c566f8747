use bhm_core::profile::COMPACT;
use bhm_host::dataset::LabelledPoints;
use bhm_oracle::{DensePosterior, Observation, Rule, XiStart};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{
    super::{Setup, lattice::Lattice},
    lattice::{over, row},
    model::open,
};
use crate::evaluation::TrainingScan;

fn setup(extent_m: [f32; 2], size: f32) -> Setup {
    let area_m = [[-1.0, 2.0], [-1.0 + extent_m[0], 2.0 + extent_m[1]]];
    Setup { area_m, size, limits: COMPACT.settings.limits, profile: COMPACT, seed: 1 }
}

/// Every feature, of the same nodes, with nothing left out.
fn features(lattice: &Lattice, [x, y]: [f32; 2]) -> Vec<f64> {
    let [h, columns] = [lattice.spacing_m, lattice.shape[0] as f64];
    (0..lattice.count())
        .map(|i| {
            let [column, row] = [i as f64 % columns, (i as f64 / columns).floor()];
            let [dx, dy] =
                [(lattice.origin[0] + column) * h - f64::from(x), (lattice.origin[1] + row) * h - f64::from(y)];
            (-(dx * dx + dy * dy) / (0.6 * h * h)).exp()
        })
        .collect()
}

#[test]
fn scans_are_learned_as_the_reference_learns_them() {
    let setup = setup([2.6, 1.9], 0.5);
    let lattice = over(&setup).unwrap();
    assert_eq!(lattice.shape, [7, 5]);
    let mut baseline = open(&setup).unwrap();
    let mut reference = DensePosterior::prior(&[1e-4; 35]);
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut place = || [-1.2 + 3.0 * rng.random::<f32>(), 1.9 + 2.2 * rng.random::<f32>()];
    for scan in 0..3 {
        let points_m: Vec<_> = (0..25).map(|_| place()).collect();
        let occupied: Vec<_> = points_m.iter().map(|[x, _]| *x > 0.5).collect();
        let observe =
            |(at_m, occupied): (&[f32; 2], &bool)| Observation { phi: features(&lattice, *at_m), occupied: *occupied };
        let observations: Vec<_> = points_m.iter().zip(&occupied).map(observe).collect();
        reference.update(&observations, &Rule::JaakkolaJordan { start: XiStart::Constant(1.0) }, 2).unwrap();
        baseline.integrate(&TrainingScan::of_points(LabelledPoints { scan, points_m, occupied }, None)).unwrap();
    }
    let asked_m: Vec<_> = (0..50).map(|_| place()).collect();
    for (at_m, found) in asked_m.iter().zip(baseline.predict(&asked_m)) {
        let expected = reference.predict(&features(&lattice, *at_m));
        let variance = found.variance.unwrap();
        // A variance is of the order of 1e4 where nothing was learned, and a dropped feature is 1e-12 of it.
        assert!((variance - expected.variance).abs() < 1e-7 * (1.0 + expected.variance), "{variance} {expected:?}");
        let logit = expected.mean / (1.0 + std::f64::consts::PI * expected.variance / 8.0).sqrt();
        assert!((found.logit - logit).abs() < 1e-6, "{found:?} {expected:?}");
    }
}

#[test]
fn rows_hold_every_feature_that_counts() {
    let lattice = over(&setup([12.0, 9.0], 0.4)).unwrap();
    for at_m in [[2.03, 5.51], [-1.0, 2.0], [11.1, 11.2], [-2.1, 4.0], [40.0, 4.0], [-40.0, 4.0]] {
        let row = row(&lattice, at_m);
        let mut left = features(&lattice, at_m);
        for (i, phi) in &row {
            assert!((left[*i] - phi).abs() < 1e-12, "{at_m:?} {i}");
            left[*i] = 0.0;
        }
        assert!(left.iter().all(|phi| *phi < 1e-12), "{at_m:?}");
        assert!(row.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }
    assert!(row(&lattice, [f32::NAN, 4.0]).is_empty());
}

#[test]
fn too_many_supports_are_made_fewer_and_that_is_said() {
    for extent_m in [[600.0, 300.0], [1e6, 0.0], [0.0, 0.0], [70.0, 70.0]] {
        let lattice = over(&setup(extent_m, 0.5)).unwrap();
        assert!(lattice.count() <= 6_000, "{lattice:?}");
        // Not coarser than it need be, but for what rounding up to whole cells takes.
        assert!(lattice.spacing_m == 0.5 || lattice.count() > 5_600, "{lattice:?}");
    }
    let small = setup([4.0, 4.0], 0.5);
    assert!(!open(&small).unwrap().description().contains("widened"));
    let long = Setup { area_m: [[0.0, 0.0], [400.0, 0.0]], size: 0.04, ..small };
    let lattice = over(&long).unwrap();
    assert!(lattice.spacing_m > 0.04 && lattice.shape[1] == 1, "{lattice:?}");
    assert!(over(&Setup { size: 0.0, ..small }).is_err());
    assert!(over(&Setup { area_m: [[0.0, 0.0], [f32::INFINITY, 1.0]], ..small }).is_err());
}
