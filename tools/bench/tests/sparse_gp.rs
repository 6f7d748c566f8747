//! The sparse Gaussian process is as good as an independent implementation made it on the same points.
#![cfg(feature = "dense")]

use bhm_bench::{
    baselines::{self, Setup, Size},
    evaluation::Task,
    metrics::Scores,
};
use bhm_core::profile::COMPACT;
use bhm_host::dataset::{LabelledPoints, PointLog};
use bhm_oracle::recorded;

/// A GPyTorch model of as many inducing points, trained offline, reached an AUC of .978 and a NLL of .182.
#[test]
fn eight_hundred_inducing_points_map_the_intel_log() {
    let read = |part: &str| -> Option<Vec<LabelledPoints>> {
        Some(PointLog::read(&recorded(&format!("intel-beams-{part}.csv.gz"))?).unwrap().scans)
    };
    let (Some(train), Some(test)) = (read("train"), read("test")) else { return };
    let task = Task::of_points(train, test, COMPACT.settings.limits, |_| None);
    let entry = baselines::all().find(|entry| entry.name == "vsdgpom").unwrap();
    let Size::Count(size, _) = entry.size else { panic!("{:?}", entry.size) };
    assert_eq!(size, 800.0);
    let setup = Setup { area_m: task.area_m().unwrap(), size, limits: task.limits, profile: COMPACT, seed: 1 };
    let mut baseline = (entry.open)(&setup).unwrap();
    task.training.iter().for_each(|shown| baseline.integrate(shown).unwrap());
    let answers = baseline.predict(&task.test.points_m);
    let logits: Vec<_> = answers.iter().map(|answer| answer.logit).collect();
    let scores = Scores::of(&logits, &task.test.occupied).unwrap();
    eprintln!("{}: {scores:?}", baseline.description());
    assert!(scores.auc.unwrap() >= 0.972 && scores.nll <= 0.21, "{scores:?}");
}
