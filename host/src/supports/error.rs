use std::io;
use std::path::PathBuf;

use bhm_core::{lattice::Node, support::TableError};

use super::VERSION;

/// Why supports cannot be used, wherever they come from.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SupportsError {
    /// There is not one.
    #[error("not one learned support")]
    Empty,
    /// The window is none, or they are not as many as its nodes.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A value that cannot be.
    #[error("{name} of the supports: expected {expected}")]
    Value {
        /// Which.
        name: &'static str,
        /// What it should be.
        expected: &'static str,
    },
    /// A kind of support that is not known here.
    #[error("support at node {node:?}: its kind {kind} is not known here")]
    Kind {
        /// Where.
        node: Node<2>,
        /// Its place in the list of kinds.
        kind: u32,
    },
    /// Numbers that describe no support.
    #[error("support at node {node:?}: expected the finite numbers of a {kind}")]
    Numbers {
        /// Where.
        node: Node<2>,
        /// The name of its kind.
        kind: &'static str,
    },
    /// They were learned on a lattice of another spacing.
    #[error("the supports were learned at a spacing of {learned_m} m, the map has {map_m} m")]
    Spacing {
        /// Theirs.
        learned_m: f32,
        /// The map's.
        map_m: f32,
    },
    /// They were learned on a lattice with another origin.
    #[error("the supports were learned on a lattice with node 0 at {learned_m:?} m, the map's is at {map_m:?} m")]
    Origin {
        /// Theirs.
        learned_m: [f32; 2],
        /// The map's.
        map_m: [f32; 2],
    },
}

/// Why bytes are not a usable file of supports.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SupportsBytesError {
    /// It does not begin like one.
    #[error("expected a file of learned supports, found {found}")]
    NotSupports {
        /// What it looks like.
        found: String,
    },
    /// It was written by another version of this program.
    #[error("format version {found}, only {VERSION} is understood")]
    Version {
        /// The version it states.
        found: u32,
    },
    /// It ends too early.
    #[error("cut short at byte {found} of {expected}")]
    Cut {
        /// Bytes it should have.
        expected: u64,
        /// Bytes it has.
        found: u64,
    },
    /// Something follows its end.
    #[error("goes on after its end at byte {expected}")]
    TooLong {
        /// Bytes it should have.
        expected: u64,
    },
    /// It was altered after it was written.
    #[error("damaged: checksum {computed:08x}, expected {stored:08x}")]
    Checksum {
        /// The checksum at its end.
        stored: u32,
        /// The checksum of what it holds.
        computed: u32,
    },
    /// What it holds cannot be decoded.
    #[error("contents: {reason}")]
    Contents {
        /// What the decoder said.
        reason: String,
    },
    /// What it holds are no supports.
    #[error(transparent)]
    Supports(#[from] SupportsError),
}

/// Why a file of supports could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum SupportsFileError {
    /// The file cannot be opened or read.
    #[error("cannot read {}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The file cannot be created, written or put in its place.
    #[error("cannot write {}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The file holds something that cannot be used.
    #[error("{}: {problem}", path.display())]
    Bad {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: SupportsBytesError,
    },
}
