//! The loop on a computer: scans and posteriors through shared memory, a map that owns its memory and keeps an archive.

mod bridge;
mod link;
mod path;
mod recorded_map;
#[cfg(test)]
mod tests;

use std::boxed::Box;
use std::error::Error;
use std::sync::atomic::AtomicBool;
use std::vec::Vec;

use bhm_core::{
    geometry::Pose,
    profile::Profile,
    settings::SettingsError,
    shape::{self, ShapeVisitor},
};
use bhm_host::{
    ipc::{DEFAULT_CONSUMERS, Domain, IpcError},
    map::{self, AnyMap, OwnedMapper, UnknownShape},
    supports::LearnedSupports,
};

use crate::{Counters, End, Onboard, Options, UpdateTime};
pub use bridge::{BridgeCounters, BridgeError, BridgeOptions, BridgeSummary, run_bridge};
use link::SharedMemoryLink;
pub(crate) use recorded_map::RecordedMap;

/// What the onboard process is asked to do.
#[derive(Clone, Debug, PartialEq)]
pub struct OnboardOptions {
    /// How the loop behaves.
    pub run: Options,
    /// Consumers of the posterior that shared memory is taken for; each costs three posteriors.
    pub consumers: usize,
    /// Most poses of the robot's path that are kept; a longer path is thinned evenly.
    pub path_poses: usize,
    /// Supports of their own that nodes of the map have; consumers get them before the first posterior.
    pub supports: Option<LearnedSupports>,
}

impl Default for OnboardOptions {
    fn default() -> Self {
        Self { run: Options::default(), consumers: DEFAULT_CONSUMERS, path_poses: 16_384, supports: None }
    }
}

/// What the onboard process did.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Why it ended.
    pub end: End,
    /// Everything that happened.
    pub counters: Counters,
    /// How long updates took; `None` if there was none.
    pub update: Option<UpdateTime>,
    /// What told this run from every other.
    pub mapper: u64,
    /// Where the sensor stood at the scans that were learned, thinned evenly if there were many.
    pub path: Vec<Pose>,
    /// What shared memory last said, if it ever failed.
    pub last_fault: Option<IpcError>,
}

/// What the caller says if it cannot do with the finished map what it wanted to.
pub type FinishFailed = Box<dyn Error + Send + Sync>;

/// Why the onboard process could not begin, or not end well.
#[derive(Debug, thiserror::Error)]
pub enum OnboardError {
    /// The profile needs tiles of a shape that is not compiled in, asks for too much memory, or contradicts itself.
    #[error(transparent)]
    Shape(#[from] UnknownShape),
    /// The profile contradicts itself.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// Shared memory refused, for instance because a mapper is already running.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The map is made, but the caller could not finish with it.
    #[error(transparent)]
    Finish(FinishFailed),
}

/// Maps what arrives in the domain until `stop` is raised, or the source ends if the options say so.
///
/// At the end `finish` gets the map, archive included, while the domain is still held: whoever waits for the mapper to go
/// finds what `finish` saved.
///
/// The thread it runs on needs a stack of 1 MiB. See `bhm_host::stop_on_signals` for a flag that SIGINT and SIGTERM raise.
///
/// # Errors
/// See [`OnboardError`].
pub fn run_onboard(
    profile: &Profile,
    domain: &Domain,
    options: &OnboardOptions,
    stop: &AtomicBool,
    finish: impl FnOnce(&dyn AnyMap, &Summary) -> Result<(), FinishFailed>,
) -> Result<Summary, OnboardError> {
    let shape = map::shape(profile)?;
    let run = Run { profile, domain, options, stop, finish: Box::new(finish) };
    shape::visit(shape, run).map_err(UnknownShape::from)?
}

/// What is done with the finished map. Not generic: each caller would compile the loop again, for every shape.
type Finish<'f> = Box<dyn FnOnce(&dyn AnyMap, &Summary) -> Result<(), FinishFailed> + 'f>;

struct Run<'a> {
    profile: &'a Profile,
    domain: &'a Domain,
    options: &'a OnboardOptions,
    stop: &'a AtomicBool,
    finish: Finish<'a>,
}

impl ShapeVisitor for Run<'_> {
    type Output = Result<Summary, OnboardError>;

    fn visit<const M: usize, const B: usize>(self) -> Self::Output {
        run::<M, B>(self)
    }
}

fn run<const M: usize, const B: usize>(
    Run { profile, domain, options, stop, finish }: Run<'_>,
) -> Result<Summary, OnboardError> {
    let OnboardOptions { run, consumers, path_poses, ref supports } = *options;
    // Before anybody is shown supports that are not the map's.
    supports.as_ref().map_or(Ok(()), |supports| supports.matches(&profile.settings)).map_err(UnknownShape::from)?;
    let link = SharedMemoryLink::open(domain, profile.capacities.tiles, consumers, supports.clone(), stop)?;
    let mapper = link.mapper();
    let map = OwnedMapper::<M, B>::with_supports(profile, supports.clone())?;
    let mut onboard = Onboard::new(RecordedMap::new(map, path_poses), link, run);
    let end = onboard.run();
    let (counters, update) = (*onboard.counters(), onboard.update_time());
    let last_fault = onboard.last_fault().cloned();
    let (map, link) = onboard.into_parts();
    let (map, path) = map.into_parts();
    let summary = Summary { end, counters, update, mapper, path, last_fault };
    finish(&map, &summary).map_err(OnboardError::Finish)?;
    drop(link);
    Ok(summary)
}
