//! Further than six spacings from any observation the map says that it does not know.

mod common;

use bhm_core::{
    beam::Observation,
    geometry::Point,
    kernel::{CubicBSplineSettings, KernelSettings, SquaredExponentialSettings},
    map::{Map, Occupancy},
    profile::{COMPACT, Capacities, Profile},
    settings::{BiasSettings, Settings},
};
use bhm_host::map::OwnedMapper;
use common::{Stream, drives, points_of};

/// The specification.
const SPACINGS: f32 = 6.0;
const PROBABILITY: std::ops::RangeInclusive<f32> = 0.45..=0.55;
const VARIANCE_RATIO: f32 = 10.0;

fn profile(kernel: KernelSettings, bias: bool) -> Profile {
    Profile {
        settings: Settings { bias: bias.then_some(BiasSettings::DEFAULT), ..COMPACT.settings }.with_kernel(kernel),
        capacities: Capacities { tiles: 512, observations: 32_768, rows: 32_768, touched: 1_024 },
        ..COMPACT
    }
}

struct Seen {
    probabilities: [f32; 2],
    least_variance: f32,
    inside_touched: usize,
    elsewhere: usize,
}

/// Asks at places far from every observation, of which many lie inside tiles that learned.
fn check<const M: usize, const B: usize>(profile: &Profile, batches: &[Vec<Observation<2>>], what: &str) {
    let settings = &profile.settings;
    let mut map = OwnedMapper::<M, B>::new(profile).unwrap();
    let mut observed: Vec<[f32; 2]> = Vec::new();
    for batch in batches {
        let report = map.integrate_observations(batch).unwrap();
        assert_eq!(report.tiles_failed + report.tiles_evicted, 0);
        observed.extend(batch.iter().map(|observation| <[f32; 2]>::from(observation.place.middle_m())));
    }
    let view = map.mapper().view();
    let mut variances: Vec<f32> = observed.iter().map(|at| view.occupancy(&Point::from(*at)).variance).collect();
    variances.sort_by(f32::total_cmp);
    let well_observed = variances[variances.len() / 2];

    let mut stream = Stream::new(5);
    let apart_m = SPACINGS * settings.spacing_m;
    let mut seen = Seen { probabilities: [1.0, 0.0], least_variance: f32::INFINITY, inside_touched: 0, elsewhere: 0 };
    for _ in 0..12_000 {
        let near = observed[stream.below(observed.len())];
        let reach = [5.0, 10.0, 30.0][stream.below(3)];
        let at = near.map(|x| x + (stream.between(-1.0, 1.0) * reach) as f32);
        let far = |other: &[f32; 2]| (at[0] - other[0]).powi(2) + (at[1] - other[1]).powi(2) > apart_m * apart_m;
        if !observed.iter().all(far) {
            continue;
        }
        let first = view.basis.lattice.stencil_at(&Point::from(at)).unwrap().first;
        if view.tiling.holding(&first).any(|tile| map.mapper().tiles().get(&tile).is_some()) {
            seen.inside_touched += 1;
        } else {
            seen.elsewhere += 1;
        }
        let answer = view.occupancy(&Point::from(at));
        seen.probabilities =
            [seen.probabilities[0].min(answer.probability), seen.probabilities[1].max(answer.probability)];
        seen.least_variance = seen.least_variance.min(answer.variance);
        assert!(PROBABILITY.contains(&answer.probability), "{what}: at {at:?} {answer:?}");
        assert!(answer.variance >= VARIANCE_RATIO * well_observed, "{what}: at {at:?} {answer:?}, {well_observed}");
    }
    println!(
        "{what}: {} places in tiles that learned, {} elsewhere; p {:?}, least variance {:.3e}, of a well-observed place \
         {well_observed:.3e}",
        seen.inside_touched, seen.elsewhere, seen.probabilities, seen.least_variance
    );
    assert!(seen.inside_touched >= 20 && seen.elsewhere >= 20);
    for bad in [[f32::NAN, 0.0], [0.0, f32::INFINITY], [1e9, 0.0], [0.0, -1e30]] {
        assert_eq!(view.occupancy(&Point::from(bad)), Occupancy::UNKNOWN);
        assert_eq!(view.gradient(&Point::from(bad)).probability, Point::<2>::zeros());
    }
}

fn every_kernel(bias: bool, batches: impl Fn(&Settings) -> Vec<Vec<Observation<2>>>, what: &str) {
    let spline = profile(KernelSettings::CubicBSpline(CubicBSplineSettings::DEFAULT), bias);
    check::<144, 40>(&spline, &batches(&spline.settings), &format!("{what}, B-spline, bias {bias}"));
    let exponential = profile(KernelSettings::SquaredExponential(SquaredExponentialSettings::DEFAULT), bias);
    let what = format!("{what}, squared exponential, bias {bias}");
    check::<196, 76>(&exponential, &batches(&exponential.settings), &what);
}

/// Thirty scans of a drive.
fn driven(bias: bool) {
    for drive in drives() {
        let batches = |settings: &Settings| {
            drive.scans.iter().step_by(drive.scans.len() / 30).map(|scan| points_of(scan, settings)).collect()
        };
        every_kernel(bias, batches, drive.name);
    }
}

/// A few places, each told the same thing two hundred times over: what is certain here must not leak there.
fn certain_places(bias: bool) {
    let batches = |_: &Settings| {
        let batch: Vec<_> = (0..12)
            .flat_map(|i| {
                let at = [(i % 4) as f32 * 9.3 + 0.7, (i / 4) as f32 * 8.1 + 0.9];
                (0..5).map(move |k| Observation::at_point([at[0] + 0.1 * k as f32, at[1]].into(), i % 3 == 0))
            })
            .collect();
        vec![batch; 200]
    };
    every_kernel(bias, batches, "certain places");
}

/// All of one kind: a bias would love to call the whole world free.
fn all_free(bias: bool) {
    let batches = |_: &Settings| {
        let batch: Vec<_> = (0..400)
            .map(|i| Observation::at_point([(i % 20) as f32 * 0.2, (i / 20) as f32 * 0.2].into(), false))
            .collect();
        vec![batch; 20]
    };
    every_kernel(bias, batches, "all free");
}

#[test]
fn around_a_drive() {
    driven(false);
}

#[test]
fn around_single_places_that_are_certain() {
    certain_places(false);
}

#[test]
fn where_everything_seen_was_free() {
    all_free(false);
}

#[test]
fn around_a_drive_with_a_bias() {
    driven(true);
}

#[test]
fn around_single_places_that_are_certain_with_a_bias() {
    certain_places(true);
}

#[test]
fn where_everything_seen_was_free_with_a_bias() {
    all_free(true);
}
