//! What a computer adds to the core: memory and an archive for maps, services over shared memory, a simulated robot,
//! recorded logs, map files, learned supports.
//!
//! Features, all on by default: `ipc` brings the services over shared memory (and iceoryx2), `sim` the simulated robot (and a
//! random generator), `signals` a flag that signals raise (and signal-hook). A program that only reads maps needs none.

pub mod dataset;
pub mod framed;
#[cfg(feature = "ipc")]
pub mod ipc;
pub mod map;
mod replace;
mod scan_record;
#[cfg(feature = "signals")]
mod signals;
#[cfg(feature = "sim")]
pub mod sim;
pub mod snapshot;
pub mod supports;

pub use scan_record::ScanRecord;
#[cfg(feature = "signals")]
pub use signals::stop_on_signals;

/// The README's example, compiled and run with the tests.
#[cfg(all(doctest, feature = "ipc"))]
#[doc = include_str!("../../README.md")]
pub struct Readme;
