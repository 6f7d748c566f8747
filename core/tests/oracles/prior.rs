//! The Matérn prior against exact integrals and dense algebra in `f64`, and what it says where nothing was observed.

use bhm_core::{
    geometry::Point,
    map::Map,
    posterior::Posterior,
    prior::{MaternPrior, PriorSettings},
    profile::{COMPACT, INDOOR, OUTDOOR, Profile},
    settings::Settings,
};
use bhm_oracle::{DensePosterior, TileBlend, prior};

use crate::{
    common::{Learner, Stream, labelled},
    map::TestMap,
};

const M: usize = 144;
const B: usize = 40;

fn with(prior: MaternPrior, profile: &Profile) -> Settings {
    Settings { prior: PriorSettings::Matern(prior), ..profile.settings }
}

fn written(settings: &Settings) -> Box<Posterior<M, B>> {
    let mut learner = Learner::<M, B>::flat(1.0);
    settings.model().unwrap().prior.write(&mut learner.posterior, &mut learner.scratch).unwrap();
    learner.posterior
}

/// Largest difference of a band from a dense matrix, relative to the geometric mean of the two diagonal entries.
fn difference(band: &[[f32; B]; M], dense: &[Vec<f64>]) -> f64 {
    let mut worst = 0.0_f64;
    for (i, row) in band.iter().enumerate() {
        for (j, entry) in row.iter().enumerate().take(M - i) {
            let scale = (dense[i][i] * dense[i + j][i + j]).sqrt();
            worst = worst.max((f64::from(*entry) - dense[i][i + j]).abs() / scale);
        }
    }
    worst
}

#[test]
fn precision_covariance_and_determinant_are_those_of_exact_integrals() {
    for profile in [COMPACT, INDOOR, OUTDOOR] {
        for range in [0.5, 1.0, 2.0, 6.0, 16.0, 32.0, 100.0] {
            let settings = with(MaternPrior { deviation: 30.0, range_m: range * profile.settings.spacing_m }, &profile);
            let belief = written(&settings);
            let exact = prior::of(&settings);
            let (precision, covariance) = (
                difference(&belief.information, &exact.information),
                difference(&belief.covariance, &exact.covariance),
            );
            // The smoother a field, the more its energy is a difference of large entries.
            let bound = if range <= 6.0 { 2e-4 } else { 1e-2 };
            assert!(precision < bound && covariance < bound, "range {range}: {precision:e}, {covariance:e}");
            let determinant = f64::from(belief.log_determinant[0]) + f64::from(belief.log_determinant[1]);
            assert!(
                (determinant - exact.log_determinant).abs() < f64::from(M as u32) * bound,
                "{determinant} {}",
                exact.log_determinant
            );
            assert!(belief.mean.iter().all(|mean| *mean == 0.0));
        }
    }
}

/// Every pair outside the band must be zero, or the band would cut the prior.
#[test]
fn the_band_holds_the_whole_precision() {
    let exact = prior::of(&COMPACT.settings);
    for (i, row) in exact.information.iter().enumerate() {
        for (j, entry) in row.iter().enumerate().skip(i + B) {
            assert_eq!(*entry, 0.0, "{i} {j}");
        }
    }
}

#[test]
fn without_a_tile_the_map_answers_with_the_field_and_without_a_step_at_its_border() {
    let mut map = TestMap::<M, B>::new(&COMPACT);
    let blend = TileBlend::of(&COMPACT.settings, None);
    let mut stream = Stream::new(5);
    for _ in 0..2_000 {
        let at = [stream.between(-30.0, 30.0), stream.between(-30.0, 30.0)];
        let got = map.mapper().occupancy(&Point::from(at.map(|x| x as f32)));
        let exact = blend.predict(&at.map(|x| f64::from(x as f32)));
        assert!(got.mean == 0.0 && (got.probability - 0.5).abs() < 1e-7);
        assert!((f64::from(got.variance) / exact.variance - 1.0).abs() < 1e-3, "{got:?} {exact:?}");
    }
    // One wall, seen from one side; then along lines that leave what was touched.
    let places: Vec<_> = (0..60).map(|i| [0.1 * i as f32 - 3.0, 1.3]).collect();
    map.integrate_observations(&labelled(&places, |at| at[0] > 0.0));
    let mut before: Option<(f32, f32)> = None;
    for i in 0..40_000 {
        let answer = map.mapper().occupancy(&[1.0 + 0.0007 * i as f32, 1.3].into());
        if let Some((probability, variance)) = before {
            assert!((answer.probability - probability).abs() < 5e-3, "{i}");
            assert!((answer.variance / variance - 1.0).abs() < 2e-2, "{i}: {variance} to {}", answer.variance);
        }
        before = Some((answer.probability, answer.variance));
    }
}

#[test]
fn neighbours_are_inferred_and_what_is_ranges_away_stays_unknown() {
    let prior = MaternPrior { deviation: 30.0, range_m: 1.5 };
    for profile in [COMPACT, INDOOR] {
        let mut map = TestMap::<M, B>::new(&Profile { settings: with(prior, &profile), ..profile });
        let blind = TestMap::<M, B>::new(&Profile { settings: with(prior, &profile), ..profile });
        // A patch of free points, sparser than the stencils, in the middle of a tile.
        let spacing_m = profile.settings.spacing_m;
        let middle_m = 5.5 * spacing_m;
        let patch: Vec<_> = (0..16).map(|i| [i % 4, i / 4].map(|k| middle_m + (k as f32 - 1.5) * spacing_m)).collect();
        map.integrate_observations(&labelled(&patch, |_| false));
        let share = |at: [f32; 2]| {
            let variance = |map: &TestMap<M, B>| map.mapper().occupancy(&Point::from(at)).variance;
            variance(&map) / variance(&blind)
        };
        let unobserved = map.mapper().view().unobserved_at(&[middle_m, middle_m].into());
        assert_eq!(unobserved, blind.mapper().occupancy(&[middle_m, middle_m].into()));
        assert!(share([middle_m, middle_m]) < 0.05, "{}", share([middle_m, middle_m]));
        let beside = map.mapper().occupancy(&[middle_m + 2.2 * spacing_m, middle_m].into());
        assert!(beside.probability < 0.4 && beside.mean < -5.0, "a neighbour is believed to be free: {beside:?}");
        let away = middle_m + 1.5 * spacing_m + 3.0 * prior.range_m;
        assert!(share([away, middle_m]) > 0.9, "{}", share([away, middle_m]));
        let answer = map.mapper().occupancy(&[away, middle_m].into());
        assert!((answer.probability - 0.5).abs() < 0.05, "{answer:?}");
    }
}

#[test]
fn a_prior_of_splines_is_refused_for_other_kernels() {
    use bhm_core::kernel::{KernelSettings, SquaredExponentialSettings};
    let kernel = KernelSettings::SquaredExponential(SquaredExponentialSettings::DEFAULT);
    let error = Settings { kernel, ..COMPACT.settings }.model().unwrap_err();
    assert_eq!(error.to_string(), "prior matern: it is not defined for this kernel");
    assert_eq!(COMPACT.settings.with_kernel(kernel).prior.name(), "white");
}

/// A Bayesian Hilbert map with this prior is a Gaussian process with the field's covariance: the coarser the splines, the
/// further off.
#[test]
fn a_dense_prior_has_the_deviation_that_was_asked_for() {
    for deviation in [3.0, 30.0] {
        let settings = with(MaternPrior { deviation, range_m: 1.5 }, &COMPACT);
        let belief: DensePosterior = prior::of(&settings);
        let blend = TileBlend::of(&settings, None);
        assert_eq!(belief.information.len(), M);
        // The middle of the tile whose nodes are 0 to 11, where it answers alone.
        let middle = blend.predict(&[5.5 * 0.5; 2]);
        assert!((middle.variance.sqrt() - f64::from(deviation)).abs() < 1e-3 * f64::from(deviation));
    }
}
