use std::sync::{Mutex, PoisonError};

use super::{Contestant, Loaded, Outcome, Results, ResultsError, RunOptions, UnseenPlaces, run};
use crate::evaluation::Task;

/// A dataset divided under a seed: one task for every contestant.
#[derive(Debug)]
pub struct Round<'a> {
    /// The dataset it is of.
    pub loaded: &'a Loaded,
    /// What was held out, in a word.
    pub held: String,
    /// Of the division and of contestants' dice.
    pub seed: u64,
    /// What is learned and asked.
    pub task: Task,
    /// What no beam saw, where the truth is known.
    pub unseen: Option<UnseenPlaces>,
    /// Checksum of the task.
    pub digest: String,
}

impl<'a> Round<'a> {
    /// With the checksum and the unseen places that follow.
    #[must_use]
    pub fn new(loaded: &'a Loaded, held: String, seed: u64, task: Task) -> Self {
        let digest = run::digest(&task);
        let scale = loaded.dataset.scale();
        let unseen = loaded.world.as_ref().map(|world| UnseenPlaces::of(world, &task, scale));
        Self { loaded, held, seed, task, unseen, digest }
    }
}

/// Contestants and tasks.
#[derive(Debug)]
pub struct Contest<'a> {
    /// The tasks.
    pub rounds: Vec<Round<'a>>,
    /// Each learns every task.
    pub contestants: Vec<Contestant>,
    /// How they are run.
    pub options: RunOptions,
    /// How many are held at once, each in a thread of its own.
    pub jobs: usize,
}

/// Hears how a contest goes; called from several threads.
pub trait Progress: Sync {
    /// A task begins: who, where, how many scans.
    fn begins(&self, job: usize, who: &str, scans: usize);
    /// So many scans are learned.
    fn learned(&self, job: usize, scans: usize);
    /// A task is over.
    fn ends(&self, job: usize, outcome: &Outcome);
}

impl Contest<'_> {
    /// Which outcomes there will be, as (contestant, round) in the order in which they are run.
    fn pairs(&self) -> impl Iterator<Item = (&Contestant, &Round<'_>)> {
        self.rounds.iter().flat_map(|round| self.contestants.iter().map(move |contestant| (contestant, round)))
    }

    /// Whether a kept outcome is that of a pair.
    fn is_of(&self, outcome: &Outcome, (contestant, round): (&Contestant, &Round<'_>)) -> bool {
        let RunOptions { deadline_s, checkpoints } = self.options;
        outcome.dataset == round.loaded.dataset.name
            && outcome.held == round.held
            && outcome.answers(&contestant.to_string(), &round.digest, round.seed, deadline_s, checkpoints)
    }

    /// How many outcomes are missing, of all.
    #[must_use]
    pub fn to_run(&self, results: &Results) -> (usize, usize) {
        let open = |pair: &(&Contestant, &Round<'_>)| !results.outcomes().iter().any(|kept| self.is_of(kept, *pair));
        (self.pairs().filter(open).count(), self.pairs().count())
    }

    /// Runs every contestant on every task, but those whose outcome is already kept; returns all outcomes, in the order of
    /// tasks and contestants.
    ///
    /// # Errors
    /// If an outcome cannot be kept: then no further task begins.
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
                        let (contestant, round) = {
                            let mut shared = next();
                            let Some(pair) = shared.0.next().filter(|_| shared.2.is_none()) else { return };
                            pair
                        };
                        let who = format!("{contestant} on {}, {} held out", round.loaded.dataset.name, round.held);
                        progress.begins(job, &who, round.task.training.len());
                        let outcome = run(contestant, round, &self.options, &mut |scans| progress.learned(job, scans));
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
