//! Supports that were learned: one of its own for each lattice node of a window, what they were learned with, and the files
//! that they are kept in.
//!
//! The core takes a table ([`SupportTable`]) and neither reads nor writes files of one. Here is what does: [`LearnedSupports`].
//! Maps, map files and shared memory carry it; what they say of a place is the same only with the same table.
//!
//! A file of supports holds, in its frame (see [`framed`](crate::framed)), as postcard: lattice, window, what the supports were
//! learned with, names of the kinds of support, and for each node of the window (the last axis fastest) which kind its
//! support is and its numbers.
//!
//! A support is written as its kind's name and plain numbers, so that a further kind needs no line here. A file is not
//! trusted: [`decode`] takes any bytes without panicking, and allocates little more than their length.

mod coding;
mod error;
mod file;
mod relevance;
mod table;
#[cfg(test)]
pub(crate) mod test_supports;
#[cfg(test)]
mod tests;

pub(crate) use coding::Coded;
#[cfg(feature = "ipc")]
pub(crate) use coding::Kinds;
pub use error::{SupportsBytesError, SupportsError, SupportsFileError};
pub use file::{VERSION, decode, encode, load, save};
pub use relevance::{LearnedRelevance, MAX_NODES, RelevanceError, RelevanceOptions, learn_relevance, observe};
pub(crate) use table::table_of;
pub use table::{LearnedSupports, LearnedWith, MAX_SOURCE_BYTES};

#[cfg(doc)]
use bhm_core::support::SupportTable;
