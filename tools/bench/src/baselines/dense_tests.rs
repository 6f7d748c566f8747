//! What every baseline of dense linear algebra must bear, whatever it computes.

use bhm_core::profile::COMPACT;
use bhm_host::dataset::LabelledPoints;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Entry, Prediction, Setup, dense_bhm, gaussian_process, vsdgpom};
use crate::evaluation::TrainingScan;

/// Small, so that many can be made.
fn entries() -> impl Iterator<Item = (&'static Entry, Setup)> {
    let sizes = [(vsdgpom::ENTRIES, 60.0), (gaussian_process::ENTRIES, 40.0), (dense_bhm::ENTRIES, 0.5)];
    let setup = |size| Setup {
        area_m: [[-3.0, -2.0], [5.0, 4.0]],
        size,
        limits: COMPACT.settings.limits,
        profile: COMPACT,
        seed: 9,
    };
    sizes.into_iter().flat_map(move |(entries, size)| entries.iter().map(move |entry| (entry, setup(size))))
}

fn shown(scan: u64, points: impl IntoIterator<Item = ([f32; 2], bool)>) -> TrainingScan {
    let (points_m, occupied) = points.into_iter().unzip();
    TrainingScan::of_points(LabelledPoints { scan, points_m, occupied }, None)
}

/// A room of 4 m x 3 m: hits on its walls, free points within.
fn room(scan: u64, count: usize) -> TrainingScan {
    let mut rng = ChaCha8Rng::seed_from_u64(scan);
    let point = |i: usize| {
        let [x, y] = [4.0 * rng.random::<f32>(), 3.0 * rng.random::<f32>()];
        match i % 4 {
            0 => ([x, 3.0 * rng.random_range(0..2) as f32], true),
            1 => ([4.0 * rng.random_range(0..2) as f32, y], true),
            _ => ([0.2 + 0.9 * x, 0.2 + 0.85 * y], false),
        }
    };
    shown(scan, (0..count).map(point).collect::<Vec<_>>())
}

fn asked() -> Vec<[f32; 2]> {
    let mut asked: Vec<_> =
        (0..40 * 30).map(|i| [-3.0 + 0.2 * (i % 40) as f32, -2.0 + 0.2 * (i / 40) as f32]).collect();
    asked.extend([[1e6, -1e6], [0.0, 3.0e38], [f32::NAN, 0.0]]);
    asked
}

fn assert_sound(entry: &Entry, answers: &[Prediction]) {
    for (answer, at_m) in answers.iter().zip(asked()) {
        let variance = answer.variance.unwrap();
        assert!(
            answer.logit.is_finite() && variance.is_finite() && variance >= 0.0,
            "{}: {at_m:?} {answer:?}",
            entry.name
        );
    }
}

#[test]
fn hostile_lessons_are_borne() {
    let unfriendly = || {
        [
            shown(0, []),
            shown(1, [([1.0, 1.0], true)]),
            shown(2, vec![([1.0, 1.0], true); 900]),
            shown(3, vec![([1.0, 1.0], false); 900]),
            shown(4, [([1e7, -1e7], true), ([-300.0, 2.0], false), ([3e38, 3e38], true)]),
            shown(5, [([f32::NAN, 1.0], true), ([f32::INFINITY, 1.0], false)]),
            shown(6, (0..300).map(|i| ([0.01 * i as f32, 0.5], true))),
            room(7, 6_000),
            shown(8, []),
        ]
    };
    for (entry, setup) in entries() {
        let mut baseline = (entry.open)(&setup).unwrap();
        assert_sound(entry, &baseline.predict(&asked()));
        for shown in unfriendly() {
            baseline.integrate(&shown).unwrap_or_else(|error| panic!("{}: {} {error}", entry.name, shown.scan));
            assert_sound(entry, &baseline.predict(&asked()));
        }
        // And each of them as the first.
        for shown in unfriendly() {
            let mut baseline = (entry.open)(&setup).unwrap();
            baseline.integrate(&shown).unwrap_or_else(|error| panic!("{}: {} {error}", entry.name, shown.scan));
            assert_sound(entry, &baseline.predict(&asked()));
        }
    }
}

#[test]
fn a_room_is_learned_and_the_rest_is_unknown() {
    for (entry, setup) in entries() {
        let mut baseline = (entry.open)(&setup).unwrap();
        (0..12).for_each(|scan| baseline.integrate(&room(scan, 200)).unwrap());
        let answers = baseline.predict(&[[2.0, 1.5], [1.0, 1.0], [2.0, 3.0], [0.0, 1.5], [-2.8, -1.8], [90.0, 90.0]]);
        let logits: Vec<_> = answers.iter().map(|answer| answer.logit).collect();
        assert!(logits[..2].iter().all(|logit| *logit < -1.0), "{} {answers:?}", entry.name);
        assert!(logits[2..4].iter().all(|logit| *logit > 1.0), "{} {answers:?}", entry.name);
        assert!(logits[4..].iter().all(|logit| logit.abs() < 0.1), "{} {answers:?}", entry.name);
        assert!(answers[0].variance < answers[4].variance, "{} {answers:?}", entry.name);
        assert!(baseline.memory_bytes() > 1_000, "{}", entry.name);
    }
}

#[test]
fn the_same_lessons_give_the_same_answers_bit_for_bit() {
    for (entry, setup) in entries() {
        let answers = || {
            let mut baseline = (entry.open)(&setup).unwrap();
            (0..6).for_each(|scan| baseline.integrate(&room(scan, 150)).unwrap());
            let answers = baseline.predict(&asked());
            assert_eq!(answers, baseline.predict(&asked()), "{}", entry.name);
            // Nor does a question depend on those it comes with, but for the order of a sum.
            for (alone, among) in baseline.predict(&asked()[500..503]).iter().zip(&answers[500..]) {
                assert!((alone.logit - among.logit).abs() < 1e-9, "{}: {alone:?} {among:?}", entry.name);
            }
            answers.iter().map(|answer| [answer.logit, answer.variance.unwrap()].map(f64::to_bits)).collect::<Vec<_>>()
        };
        assert_eq!(answers(), answers(), "{}", entry.name);
    }
}

#[test]
fn senseless_sizes_and_areas_are_refused() {
    for (entry, setup) in entries() {
        let outer = Setup { area_m: [[0.0, 0.0], [f32::INFINITY, 1.0]], ..setup };
        let nan = Setup { area_m: [[0.0, f32::NAN], [1.0, 1.0]], ..setup };
        for setup in [outer, nan, Setup { size: 0.0, ..setup }, Setup { size: f32::NAN, ..setup }] {
            assert!((entry.open)(&setup).is_err(), "{} {setup:?}", entry.name);
        }
    }
}
