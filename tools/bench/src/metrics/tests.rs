use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};

use super::{CALIBRATION_BINS, ScoreError, Scores};

/// The sums of at most 200 terms of order 40 differ by their rounding only.
const ROUNDING: f64 = 1e-12;

/// `1 − p` cancels in the naive formulae: at |z| ≤ 10 it keeps 1e-16 / 4.5e-5 of its value, and so does its logarithm.
const NAIVE_ROUNDING: f64 = 1e-11;

fn assert_close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "found {found}, expected {expected}");
}

/// Definitions spelled out in probabilities, with none of the care that large logits need.
struct Naive {
    auc: Option<f64>,
    nll: f64,
    brier: f64,
    ece: f64,
    accuracy: f64,
}

impl Naive {
    fn of(logits: &[f64], labels: &[bool]) -> Self {
        let n = logits.len() as f64;
        let y: Vec<f64> = labels.iter().map(|&l| if l { 1.0 } else { 0.0 }).collect();
        let p: Vec<f64> = logits.iter().map(|z| z.exp() / (1.0 + z.exp())).collect();
        let all = || 0..logits.len();
        let mean = |score: &dyn Fn(usize) -> f64| all().map(score).sum::<f64>() / n;

        let (mut pairs, mut wins) = (0.0, 0.0);
        for i in all().filter(|&i| labels[i]) {
            for j in all().filter(|&j| !labels[j]) {
                pairs += 1.0;
                wins += if logits[i] > logits[j] { 1.0 } else { f64::from(u8::from(logits[i] == logits[j])) * 0.5 };
            }
        }
        let ece = (0..CALIBRATION_BINS)
            .map(|b| {
                let edge = |b: usize| b as f64 / CALIBRATION_BINS as f64;
                let within: Vec<usize> = all().filter(|&i| p[i] >= edge(b) && p[i] < edge(b + 1)).collect();
                let share = within.len() as f64;
                let mean_of = |v: &[f64]| within.iter().map(|&i| v[i]).sum::<f64>() / share;
                if within.is_empty() { 0.0 } else { share / n * (mean_of(&p) - mean_of(&y)).abs() }
            })
            .sum();
        Self {
            auc: (pairs > 0.0).then(|| wins / pairs),
            nll: mean(&|i| -(y[i] * p[i].ln() + (1.0 - y[i]) * (1.0 - p[i]).ln())),
            brier: mean(&|i| (p[i] - y[i]).powi(2)),
            ece,
            accuracy: mean(&|i| f64::from(u8::from((p[i] >= 0.5) == labels[i]))),
        }
    }
}

#[test]
fn scores_agree_with_the_naive_definitions() {
    // Steps of 0.625 make ties frequent, and p never falls on the edge of a bin but at z = 0, in the middle of one.
    let prediction = (-16_i32..=16, any::<bool>()).prop_map(|(step, label)| (f64::from(step) * 0.625, label));
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]);
    let mut runner = TestRunner::new_with_rng(ProptestConfig { failure_persistence: None, ..<_>::default() }, rng);
    runner
        .run(&prop::collection::vec(prediction, 1..200), |predictions| {
            let (logits, labels): (Vec<f64>, Vec<bool>) = predictions.into_iter().unzip();
            let scores = Scores::of(&logits, &labels).expect("finite and paired");
            let naive = Naive::of(&logits, &labels);
            prop_assert_eq!(scores.points, labels.len());
            prop_assert_eq!(scores.positives, labels.iter().filter(|l| **l).count());
            prop_assert_eq!(scores.auc, naive.auc);
            assert_close(scores.nll, naive.nll, NAIVE_ROUNDING);
            assert_close(scores.brier, naive.brier, ROUNDING);
            assert_close(scores.ece, naive.ece, ROUNDING);
            assert_close(scores.accuracy, naive.accuracy, ROUNDING);
            Ok(())
        })
        .expect("both ways of computing agree");
}

#[test]
fn four_points_by_hand() {
    // p = 3/4, 1/4, 1/2, 1/4 and the third point is wrong at p = 1/2, which counts as occupied.
    let ln3 = 3.0_f64.ln();
    let scores = Scores::of(&[ln3, -ln3, 0.0, -ln3], &[true, true, false, false]).unwrap();
    assert_eq!((scores.points, scores.positives), (4, 2));
    // Pairs: 3/4 beats both; 1/4 loses to 1/2 and ties with 1/4.
    assert_eq!(scores.auc, Some(2.5 / 4.0));
    assert_close(scores.nll, (2.0 * (4.0_f64 / 3.0).ln() + 4.0_f64.ln() + 2.0_f64.ln()) / 4.0, ROUNDING);
    assert_close(scores.brier, (1.0 / 16.0 + 9.0 / 16.0 + 1.0 / 4.0 + 1.0 / 16.0) / 4.0, ROUNDING);
    assert_close(scores.ece, (0.25 + 0.5 + 0.5) / 4.0, ROUNDING);
    assert_close(scores.accuracy, 0.5, ROUNDING);
}

#[test]
fn order_of_the_classes() {
    let labels = [false, false, true, true];
    let auc = |logits: [f32; 4]| Scores::of(&logits, &labels).unwrap().auc;
    assert_eq!(auc([-2.0, -1.0, 1.0, 2.0]), Some(1.0));
    assert_eq!(auc([2.0, 1.0, -1.0, -2.0]), Some(0.0));
    assert_eq!(auc([0.0, -0.0, 0.0, -0.0]), Some(0.5));
}

#[test]
fn huge_logits_keep_their_rank_and_their_price() {
    let scores = Scores::of(&[1e4, 9e3, -1e4, -1e4], &[true, false, false, true]).unwrap();
    assert_close(scores.nll, (9e3 + 1e4) / 4.0, 1e4 * f64::EPSILON);
    assert_eq!(scores.auc, Some(2.5 / 4.0));
    assert_eq!((scores.brier, scores.ece, scores.accuracy), (0.5, 0.5, 0.5));
}

#[test]
fn small_surprise_is_not_rounded_away() {
    // −ln p = exp(−z) − exp(−2z)/2 + …, of which 1 − p in f64 would keep nothing at z = 40.
    let nll = Scores::of(&[40.0], &[true]).unwrap().nll;
    assert_close(nll / (-40.0_f64).exp(), 1.0, 1e-15);
}

#[test]
fn one_class_has_no_auc() {
    let scores = Scores::of(&[1.0_f32, -1.0], &[true, true]).unwrap();
    assert_eq!((scores.auc, scores.positives, scores.accuracy), (None, 2, 0.5));
}

#[test]
fn what_cannot_be_scored_is_named() {
    assert_eq!(Scores::of::<f64>(&[], &[]), Err(ScoreError::Empty));
    assert_eq!(Scores::of(&[1.0, 2.0], &[true]), Err(ScoreError::Lengths { logits: 2, labels: 1 }));
    let infinite = Scores::of(&[0.0, f64::INFINITY], &[true, false]);
    assert_eq!(infinite, Err(ScoreError::NotFinite { index: 1, logit: f64::INFINITY }));
    let nan = Scores::of(&[f32::NAN], &[true]).unwrap_err();
    assert_eq!(nan.to_string(), "prediction 0 is not finite: NaN");
}
