//! What a computer adds to the core: memory and an archive for maps, services over shared memory, a simulated robot,
//! recorded logs, map files, learned supports.

pub mod dataset;
pub mod framed;
pub mod ipc;
pub mod map;
mod replace;
mod scan_record;
mod signals;
pub mod sim;
pub mod snapshot;
pub mod supports;

pub use scan_record::ScanRecord;
pub use signals::stop_on_signals;

/// The README's example, compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;
