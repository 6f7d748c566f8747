//! Scans in, posteriors out, between processes through shared memory, without a copy on the way.
//!
//! The only place that names iceoryx2. Four services, each publish–subscribe; all but `supports` with an event of the same
//! name that wakes its readers:
//!
//! | service | from | to | what happens when the reader is slow |
//! |---|---|---|---|
//! | `scan` | one [`ScanSource`] (or [`PacedSource`]) | the mapper's [`ScanSink`] | the oldest scan is overwritten; a paced source waits instead |
//! | `posterior` | the mapper's [`PosteriorPublisher`] | several [`PosteriorSubscriber`]s | it skips posteriors; what it holds stays valid |
//! | `supports` | the mapper's [`PosteriorPublisher`], if nodes of its map have supports of their own | several [`PosteriorSubscriber`]s | it finds them when it comes: they are sent once and kept |
//! | `status` | the mapper's [`StatusPublisher`] | sources and onlookers | it skips to the newest |
//!
//! Every message is `#[repr(C)]`, begins with a magic number and a layout version, and is checked before it is used: a
//! peer is a stranger. The name of its type holds the version as well, so that a peer of another version is refused when
//! it connects.
//!
//! A posterior answers with the mapper's features. Where nodes have supports of their own ([`LearnedSupports`]), its header
//! names them by their digest; a reader takes them from the service `supports` and refuses to answer without them.
//!
//! Processes meet in a [`Domain`]. A process joins it once and opens its ports on the [`Participant`] that it gets; ports
//! stay on one thread, which needs a stack of 1 MiB.
//!
//! Reserved words of a message must be zero. Numbers are in the machine's own byte order: shared memory does not leave it.

#[cfg(doc)]
use crate::supports::LearnedSupports;

mod any_posterior;
mod domain;
mod error;
mod layout;
mod paced_source;
mod posterior_message;
mod posterior_rejected;
mod posterior_sample;
mod posterior_service;
mod posterior_source;
mod scan_message;
mod scan_service;
mod shared_memory;
mod status_message;
mod status_service;
mod supports_message;
mod supports_reader;
mod supports_service;
mod temporary_domain;
#[cfg(test)]
mod tests;
mod topic;
mod wake;
mod wire;

pub use any_posterior::{AnyPosterior, AnyPosteriorSubscriber, open_posterior_any};
pub use domain::{Domain, Participant};
pub use error::{IpcError, Received};
pub use layout::LayoutError;
pub use paced_source::{PacedSource, Sent};
pub use posterior_message::{EncodedSettings, PosteriorHeader, PosteriorModel, PosteriorTile};
pub use posterior_rejected::PosteriorRejected;
pub use posterior_sample::PosteriorSample;
pub use posterior_service::{DEFAULT_CONSUMERS, PosteriorNews, PosteriorPublisher, PosteriorSubscriber};
pub use posterior_source::{PosteriorSource, SourceTile};
pub use scan_message::{NumberedScan, Place, ScanAddress, ScanMessage, ScanMessageRejected};
pub use scan_service::{SCAN_BUFFER, ScanSample, ScanSink, ScanSource};
pub use shared_memory::SharedMemoryError;
pub use status_message::{MAX_COUNTERS, NamedCounter, Progress, StatusMessage, StatusRejected};
pub use status_service::{StatusPublisher, StatusSample, StatusSubscriber};
pub use supports_message::{MAX_SUPPORT_KINDS, SupportMessage, SupportsHeader, SupportsRejected};
pub use temporary_domain::TemporaryDomain;
pub use wire::fresh_id;
