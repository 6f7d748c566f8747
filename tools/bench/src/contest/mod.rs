//! Contests between [`baselines`](crate::baselines): the same data, the same questions, the same scores.
//!
//! A [`Dataset`] is divided into a [`Task`](crate::evaluation::Task), which each [`Contestant`] learns and is tested on; an
//! [`Outcome`] is all that is kept of it. A [`Contest`] has any number of tasks and contestants, runs them on as many threads as wanted, and
//! keeps each outcome in a file as it comes, so that a contest that was cut short goes on where it was.
//!
//! Time is the processor's, of the one thread that learns: on a machine that is shared it says more than a clock.

mod contestant;
mod dataset;
mod hold;
mod outcome;
mod results;
mod run;
mod runner;
mod standings;
mod table;
mod unseen;

pub use contestant::{Contestant, UnknownContestant};
pub(crate) use dataset::as_points;
pub use dataset::{Dataset, DatasetProblem, Loaded, Origin};
pub use hold::{hold, load, rounds};
pub use outcome::{Checkpoint, Ending, Outcome, Quantiles, UnseenScores};
pub use results::{Results, ResultsError};
pub(crate) use run::median;
pub use run::{RunOptions, run, setup};
pub use runner::{Contest, Progress, Round};
pub(crate) use standings::grouped;
pub use standings::{Standing, Standings, standings};
pub use table::{rows, spread};
pub use unseen::UnseenPlaces;
