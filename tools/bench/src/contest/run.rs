use std::{hash::Hasher, time::Duration};

use cpu_time::ThreadTime;

use super::{
    Checkpoint, Contestant, Ending, Loaded, Outcome, Quantiles, UnseenPlaces, UnseenScores, outcome::over_scans,
};
use crate::{
    baselines::{Baseline, Failed, Prediction, Setup},
    evaluation::{Task, TestPoints, Timing, TrainingScan},
    metrics::{ScoreError, Scores, sigmoid},
};

/// Test points that a checkpoint is scored on, at most: some methods answer slowly.
const POINTS_OF_A_CHECKPOINT: usize = 4_000;

/// How contestants are run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunOptions {
    /// Processor time for learning, seconds.
    pub deadline_s: Option<f64>,
    /// How many checkpoints there are on the way; the last is at the end.
    pub checkpoints: usize,
}

/// Has a contestant learn and answer a task. `after_scan` hears how many scans are learned.
///
/// Whatever goes wrong is part of the outcome.
pub fn run(
    contestant: &Contestant,
    round: &super::Round,
    options: &RunOptions,
    after_scan: &mut dyn FnMut(usize),
) -> Outcome {
    let super::Round { loaded, task, unseen, .. } = round;
    let mut outcome = Outcome::before(contestant, round, options);
    let mut baseline = match (contestant.entry.open)(&setup(contestant, loaded, task, round.seed)) {
        Ok(baseline) => baseline,
        Err(Failed(why)) => return Outcome { ending: Ending::Failed { why }, ..outcome },
    };
    let mut durations = Vec::with_capacity(task.training.len());
    let mut spent = Duration::ZERO;
    let mut last_work = baseline.work();
    for (shown, number) in task.training.iter().zip(1..) {
        let start = ThreadTime::now();
        let learned = measured_update(&mut *baseline, shown);
        let duration = start.elapsed();
        if let Err(Failed(why)) = learned {
            outcome.ending = Ending::Failed { why };
            break;
        }
        spent += duration;
        durations.push(duration);
        outcome.update_ms.push(duration.as_secs_f32() * 1e3);
        let work = baseline.work();
        outcome.work.extend(work.zip(last_work).map(|(now, before)| [now[0] - before[0], now[1] - before[1]]));
        last_work = work;
        outcome.learned = number;
        after_scan(number);
        // The k-th of n checkpoints when k n-ths are learned.
        let due = |learned: usize| learned * options.checkpoints / task.training.len();
        if due(number) > due(number - 1) {
            outcome.curve.extend(checkpoint(&mut *baseline, &task.test, shown.scan, number));
        }
        if options.deadline_s.is_some_and(|deadline_s| spent.as_secs_f64() > deadline_s) && number < task.training.len()
        {
            outcome.ending = Ending::Deadline;
            break;
        }
    }
    outcome.description = baseline.description();
    outcome.memory_bytes = baseline.memory_bytes();
    outcome.growth = growth(&outcome.update_ms);
    outcome.timing = Timing::of(durations);
    if let Err(error) = judge(&mut outcome, &mut *baseline, task, unseen.as_ref()) {
        outcome.ending = Ending::Failed { why: error.to_string() };
    }
    outcome
}

/// One update, kept out of line so that an instrument can count it by name.
#[inline(never)]
fn measured_update(baseline: &mut dyn Baseline, shown: &TrainingScan) -> Result<(), Failed> {
    baseline.integrate(shown)
}

/// What a contestant is made for.
#[must_use]
pub fn setup(contestant: &Contestant, loaded: &Loaded, task: &Task, seed: u64) -> Setup {
    Setup {
        area_m: task.area_m().unwrap_or_default(),
        size: contestant.size_on(loaded.dataset.scale()),
        limits: task.limits,
        profile: loaded.dataset.profile,
        seed,
    }
}

impl Outcome {
    fn before(contestant: &Contestant, round: &super::Round, options: &RunOptions) -> Self {
        Self {
            contestant: contestant.to_string(),
            dataset: round.loaded.dataset.name.clone(),
            held: round.held.clone(),
            seed: round.seed,
            task: round.digest.clone(),
            deadline_s: options.deadline_s,
            scans: round.task.training.len(),
            ..Self::default()
        }
    }
}

fn judge(
    outcome: &mut Outcome,
    baseline: &mut dyn Baseline,
    task: &Task,
    unseen: Option<&UnseenPlaces>,
) -> Result<(), ScoreError> {
    let Some(last) = outcome.learned.checked_sub(1) else { return Ok(()) };
    let everything = outcome.learned == task.training.len();
    let asked = if everything { task.test.clone() } else { task.test.until(task.training[last].scan, usize::MAX) };
    if asked.points_m.is_empty() {
        return Ok(());
    }
    let logits = logits(baseline.predict(&asked.points_m));
    outcome.scores = Some(Scores::of(&logits, &asked.occupied)?);
    [outcome.auc_over_scans, outcome.nll_over_scans] = over_scans(&logits, &asked)?;
    if let Some(places) = unseen.filter(|places| everything && !places.points_m.is_empty()) {
        outcome.unseen = unseen_scores(baseline, places)?;
    }
    Ok(())
}

fn logits(predictions: Vec<Prediction>) -> Vec<f64> {
    predictions.into_iter().map(|prediction| prediction.logit).collect()
}

fn unseen_scores(baseline: &mut dyn Baseline, places: &UnseenPlaces) -> Result<Option<UnseenScores>, ScoreError> {
    let logits = logits(baseline.predict(&places.points_m));
    let scores = Scores::of(&logits, &places.occupied)?;
    let probabilities = |wanted: bool| {
        let of = logits.iter().zip(&places.occupied).filter(|(_, occupied)| **occupied == wanted);
        Quantiles::of(of.map(|(logit, _)| sigmoid(*logit)).collect())
    };
    Ok(probabilities(true).zip(probabilities(false)).map(|(inside, outside)| UnseenScores { scores, inside, outside }))
}

fn checkpoint(baseline: &mut dyn Baseline, test: &TestPoints, scan: u64, scans: usize) -> Option<Checkpoint> {
    let asked = test.until(scan, POINTS_OF_A_CHECKPOINT);
    let scores = Scores::of(&logits(baseline.predict(&asked.points_m)), &asked.occupied).ok()?;
    Some(Checkpoint { scans, auc: scores.auc, nll: scores.nll })
}

/// The value in the middle; of an even number the upper one.
pub(crate) fn median(values: &[f32]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f32::total_cmp);
    f64::from(sorted[sorted.len() / 2])
}

/// Median of the last quarter relative to that of the first; `None` for fewer than eight updates.
fn growth(update_ms: &[f32]) -> Option<f64> {
    let quarter = update_ms.len() / 4;
    let first = (quarter >= 2).then(|| median(&update_ms[..quarter])).filter(|first| *first > 0.0)?;
    Some(median(&update_ms[update_ms.len() - quarter..]) / first)
}

/// Checksum of everything that is learned and asked, in hexadecimal.
pub(super) fn digest(task: &Task) -> String {
    let mut hasher = crc32fast::Hasher::new();
    let mut count = 0_u64;
    let mut add = |scan: u64, point_m: [f32; 2], occupied: bool| {
        hasher.write_u64(scan);
        point_m.iter().for_each(|x| hasher.write_u32(x.to_bits()));
        hasher.write_u8(u8::from(occupied));
        count += 1;
    };
    for shown in &task.training {
        shown.points().for_each(|(point_m, occupied)| add(shown.scan, point_m, occupied));
    }
    let TestPoints { points_m, occupied, scans } = &task.test;
    points_m.iter().zip(occupied).zip(scans).for_each(|((point_m, occupied), scan)| add(*scan, *point_m, *occupied));
    format!("{:08x}-{count}", hasher.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_compares_medians_of_quarters() {
        assert_eq!(growth(&[1.0, 1.0, 9.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 2.0, 2.0, 0.1]), Some(2.0));
        assert_eq!(growth(&[1.0; 7]), None);
        assert_eq!(growth(&[0.0; 8]), None);
    }
}
