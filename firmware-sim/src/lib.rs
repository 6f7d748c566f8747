//! The onboard program: receives scans, learns them, publishes the posterior, keeps evicted tiles and brings them back.
//!
//! The loop is [`Onboard`]. It is portable: no `std`, no heap, no clock of its own, and everything it touches stands behind two
//! traits. [`Link`] is the world (shared memory here, a serial line on a microcontroller), [`OnboardMap`] is the map.
//! Whatever happens is counted by name in [`Counters`].
//!
//! With the feature `ipc` (default), `run_onboard` wires the loop to shared memory.
#![no_std]

#[cfg(any(test, feature = "ipc"))]
extern crate std;

mod archive;
pub mod budget;
mod counters;
#[cfg(feature = "ipc")]
mod ipc;
mod link;
mod map;
mod onboard;
pub mod serial;
#[cfg(test)]
mod tests;

pub use archive::LentArchive;
pub use counters::Counters;
#[cfg(feature = "ipc")]
pub use ipc::{
    BridgeCounters, BridgeError, BridgeOptions, BridgeSummary, FinishFailed, OnboardError, OnboardOptions, Summary,
    run_bridge, run_onboard,
};
pub use link::{Incoming, IncomingScan, Link, News, Patience, Report, Unusable, UpdateTime};
pub use map::{LentMap, OnboardMap};
pub use onboard::{End, Onboard, Options, Step, Until};
