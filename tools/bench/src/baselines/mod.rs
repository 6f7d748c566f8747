//! Ways of mapping that are compared with each other; our own mapper is one of them, with no path of its own.
//!
//! A [`Baseline`] is shown a log scan by scan ([`TrainingScan`]) and asked about points. Each is one file here that lists what it
//! offers as `ENTRIES`; to add one, write its file and name it in the list at the end of this one. Those that need dense linear
//! algebra are compiled with the feature `dense` alone; without it the list names them, and opening one says what is missing.

/// How a method that needs dense linear algebra is opened; where that is not compiled in, opening one says so.
macro_rules! dense {
    ($open:expr) => {{
        #[cfg(feature = "dense")]
        let open: $crate::baselines::Open = $open;
        #[cfg(not(feature = "dense"))]
        let open = $crate::baselines::needs_dense;
        open
    }};
}

mod counting_grid;
#[cfg(feature = "dense")]
mod dense_algebra;
mod dense_bhm;
#[cfg(all(test, feature = "dense"))]
mod dense_tests;
mod diagonal_bhm;
mod gaussian_process;
mod grid;
mod hilbert_map;
#[cfg(feature = "dense")]
mod kernel;
mod lattice;
mod log_odds_grid;
#[cfg(feature = "dense")]
mod logistic;
mod ours;
#[cfg(test)]
mod test_support;
mod vsdgpom;

use bhm_core::{beam::BeamLimits, profile::Profile};

use crate::evaluation::TrainingScan;

/// What a baseline says of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Log-odds of `p(occupied)`, uncertainty already taken into account; finite.
    pub logit: f64,
    /// Variance of the log-odds, where the method knows one.
    pub variance: Option<f64>,
}

/// A baseline could not go on; its state is that of before the scan, or it is not to be asked again.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Failed(pub String);

/// A way of mapping.
pub trait Baseline: Send {
    /// What was made of the setup, for people: sizes after they were fitted to the area, and the like.
    fn description(&self) -> String;

    /// Learns one scan. What its time is: all that is needed until the next scan may come.
    ///
    /// # Errors
    /// If the method breaks down, with the reason.
    fn integrate(&mut self, shown: &TrainingScan) -> Result<(), Failed>;

    /// Answers, one for each point (metres, in the map frame), in their order. Not learning: asked twice, it answers the same.
    fn predict(&mut self, points_m: &[[f32; 2]]) -> Vec<Prediction>;

    /// Bytes of state that a further scan needs.
    fn memory_bytes(&self) -> usize;

    /// Units of work so far whose cost should not depend on the history, for a method that has tiles: tiles times passes, and
    /// rows of tiles times passes.
    fn work(&self) -> Option<[u64; 2]> {
        None
    }
}

/// What a baseline is made for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// Least and greatest x and y that any training point has, with a margin: what a method of fixed area must cover, metres.
    pub area_m: [[f32; 2]; 2],
    /// The size that the [`Entry`] speaks of.
    pub size: f32,
    /// How far beams are believed; what is learned already keeps to it.
    pub limits: BeamLimits,
    /// What our mapper begins with.
    pub profile: Profile,
    /// Where a method throws dice.
    pub seed: u64,
}

/// What the one number means that a baseline can be told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Size {
    /// A length in metres, finer with smaller numbers: of cells, or between supports. Sites of hundreds of metres scale it.
    Metres(f32),
    /// A number of things, named here: features, inducing points, points.
    Count(f32, &'static str),
}

/// Makes a baseline.
pub type Open = fn(&Setup) -> Result<Box<dyn Baseline>, Failed>;

/// One way of mapping, as it can be chosen.
#[derive(Clone, Copy)]
pub struct Entry {
    /// Its name at the command line.
    pub name: &'static str,
    /// In a line, what it is.
    pub summary: &'static str,
    /// Where it was published, and in what this one deviates.
    pub source: &'static str,
    /// What its size means, with the default.
    pub size: Size,
    /// Makes one.
    pub open: Open,
}

/// Everything there is, in the order in which tables list it.
pub fn all() -> impl Iterator<Item = &'static Entry> {
    FILES.iter().flat_map(|file| file.iter())
}

/// For a method that is not compiled in.
#[cfg(not(feature = "dense"))]
fn needs_dense(_: &Setup) -> Result<Box<dyn Baseline>, Failed> {
    Err(Failed("needs dense linear algebra: build with --features dense".to_owned()))
}

const FILES: &[&[Entry]] = &[
    ours::ENTRIES,
    counting_grid::ENTRIES,
    log_odds_grid::ENTRIES,
    hilbert_map::ENTRIES,
    gaussian_process::ENTRIES,
    vsdgpom::ENTRIES,
    dense_bhm::ENTRIES,
    diagonal_bhm::ENTRIES,
];
