use std::sync::{Mutex, PoisonError};

use super::{Contestant, Loaded, Outcome, Results, ResultsError, RunOptions, UnseenPlaces, run};
use crate::evaluation::Exam;

/// One exam that contestants take.
#[derive(Debug)]
pub struct Sitting<'a> {
    /// The dataset it is of.
    pub loaded: &'a Loaded,
    /// What was held out, in a word.
    pub held: String,
    /// Of the division and of contestants' dice.
    pub seed: u64,
    /// What is learned and asked.
    pub exam: Exam,
    /// What no beam saw, where the truth is known.
    pub unseen: Option<UnseenPlaces>,
    /// Checksum of the exam.
    pub digest: String,
}

impl<'a> Sitting<'a> {
    /// With the checksum and the unseen places that follow.
    #[must_use]
    pub fn new(loaded: &'a Loaded, held: String, seed: u64, exam: Exam) -> Self {
        let digest = run::digest(&exam);
        let scale = loaded.dataset.scale();
        let unseen = loaded.world.as_ref().map(|world| UnseenPlaces::of(world, &exam, scale));
        Self { loaded, held, seed, exam, unseen, digest }
    }
}

/// Who takes which exams, how.
#[derive(Debug)]
pub struct Contest<'a> {
    /// The exams.
    pub sittings: Vec<Sitting<'a>>,
    /// Each takes every exam.
    pub contestants: Vec<Contestant>,
    /// How exams are held.
    pub options: RunOptions,
    /// How many are held at once, each in a thread of its own.
    pub jobs: usize,
}

/// Hears how a contest goes; called from several threads.
pub trait Progress: Sync {
    /// An exam begins: who, where, how many scans.
    fn begins(&self, job: usize, who: &str, scans: usize);
    /// So many scans are learned.
    fn learned(&self, job: usize, scans: usize);
    /// An exam is over.
    fn ends(&self, job: usize, outcome: &Outcome);
}

impl Contest<'_> {
    /// Which outcomes there will be, as (contestant, sitting) in the order in which they are run.
    fn pairs(&self) -> impl Iterator<Item = (&Contestant, &Sitting<'_>)> {
        self.sittings.iter().flat_map(|sitting| self.contestants.iter().map(move |contestant| (contestant, sitting)))
    }

    /// Whether a kept outcome is that of a pair.
    fn is_of(&self, outcome: &Outcome, (contestant, sitting): (&Contestant, &Sitting<'_>)) -> bool {
        let RunOptions { deadline_s, marks } = self.options;
        outcome.dataset == sitting.loaded.dataset.name
            && outcome.held == sitting.held
            && outcome.answers(&contestant.to_string(), &sitting.digest, sitting.seed, deadline_s, marks)
    }

    /// How many exams are to be taken, of all.
    #[must_use]
    pub fn to_run(&self, results: &Results) -> (usize, usize) {
        let open = |pair: &(&Contestant, &Sitting<'_>)| !results.outcomes().iter().any(|kept| self.is_of(kept, *pair));
        (self.pairs().filter(open).count(), self.pairs().count())
    }

    /// Has every contestant take every exam, but those whose outcome is already kept; returns all outcomes, in the order of
    /// exams and contestants.
    ///
    /// # Errors
    /// If an outcome cannot be kept: then no further exam begins.
    pub fn run(&self, results: &mut Results, progress: &dyn Progress) -> Result<Vec<Outcome>, ResultsError> {
        let pairs: Vec<_> = self.pairs().collect();
        let kept = |pair| results.outcomes().iter().any(|kept| self.is_of(kept, pair));
        let open: Vec<_> = pairs.iter().copied().filter(|pair| !kept(*pair)).collect();
        let shared = Mutex::new((open.into_iter(), &mut *results, None));
        std::thread::scope(|scope| {
            for job in 0..self.jobs.max(1) {
                let shared = &shared;
                scope.spawn(move || {
                    loop {
                        // A thread that panicked has left the list as whole as it was.
                        let next = || shared.lock().unwrap_or_else(PoisonError::into_inner);
                        let (contestant, sitting) = {
                            let mut shared = next();
                            let Some(pair) = shared.0.next().filter(|_| shared.2.is_none()) else { return };
                            pair
                        };
                        let who = format!("{contestant} on {}, {} held out", sitting.loaded.dataset.name, sitting.held);
                        progress.begins(job, &who, sitting.exam.lessons.len());
                        let outcome =
                            run(contestant, sitting, &self.options, &mut |scans| progress.learned(job, scans));
                        progress.ends(job, &outcome);
                        let mut shared = next();
                        if let Err(error) = shared.1.keep(outcome) {
                            shared.2 = Some(error);
                        }
                    }
                });
            }
        });
        let (_, _, error) = shared.into_inner().unwrap_or_else(PoisonError::into_inner);
        match error {
            Some(error) => Err(error),
            // The newest of several: a longer deadline may have come since.
            None => Ok(pairs
                .into_iter()
                .filter_map(|pair| results.outcomes().iter().rev().find(|kept| self.is_of(kept, pair)).cloned())
                .collect()),
        }
    }
}
