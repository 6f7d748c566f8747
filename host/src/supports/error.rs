use bhm_core::{lattice::Node, support::TableError};

use crate::framed::{FileError, FrameError};

/// Why supports cannot be used, wherever they come from.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SupportsError {
    /// There is no learned support.
    #[error("no learned support, expected at least one")]
    Empty,
    /// The window is not usable, or the supports are not as many as its nodes.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A value out of its range.
    #[error("{name} of the supports: expected {expected}")]
    Value {
        /// Name of the value.
        name: &'static str,
        /// The values that are usable.
        expected: &'static str,
    },
    /// A kind of support that this program does not have.
    #[error("support at node {node:?}: this program has no kind of support {kind}")]
    Kind {
        /// The support's node.
        node: Node<2>,
        /// The kind's place in the list of kinds that the file or message holds.
        kind: u32,
    },
    /// Numbers that are not those of a support of its kind.
    #[error("support at node {node:?}: expected the finite numbers of a {kind}")]
    Numbers {
        /// The support's node.
        node: Node<2>,
        /// Name of the support's kind.
        kind: &'static str,
    },
    /// The supports were learned on a lattice of another spacing than the map's.
    #[error("the supports were learned at a spacing of {learned_m} m, the map has {map_m} m")]
    Spacing {
        /// Spacing that the supports were learned at, metres.
        learned_m: f32,
        /// The map's spacing, metres.
        map_m: f32,
    },
    /// The supports were learned on a lattice with another origin than the map's.
    #[error("the supports were learned on a lattice with node 0 at {learned_m:?} m, the map's is at {map_m:?} m")]
    Origin {
        /// Where node 0 of the supports' lattice lies, metres.
        learned_m: [f32; 2],
        /// Where node 0 of the map's lattice lies, metres.
        map_m: [f32; 2],
    },
}

/// Why bytes are not a usable file of supports.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SupportsBytesError {
    /// The bytes are not a whole, unaltered file of supports of this version.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The contents of the file cannot be decoded.
    #[error("contents: {reason}")]
    Contents {
        /// What the decoder said.
        reason: String,
    },
    /// The values in the file are not usable as supports.
    #[error(transparent)]
    Supports(#[from] SupportsError),
}

/// Why a file of supports could not be written or read.
pub type SupportsFileError = FileError<SupportsBytesError>;
