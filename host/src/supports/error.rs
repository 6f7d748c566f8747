use bhm_core::{lattice::Node, support::TableError};

use crate::framed::{FileError, FrameError};

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
    /// The bytes are not a whole, unaltered file of supports of this version.
    #[error(transparent)]
    Frame(#[from] FrameError),
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
pub type SupportsFileError = FileError<SupportsBytesError>;
