use bhm_core::tile::TileIndex;

use crate::framed::{FileError, FrameError};
use crate::map::UnknownShape;

/// Why a map file could not be written or read.
pub type MapFileError = FileError<SnapshotError>;

/// Why bytes are not a usable map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SnapshotError {
    /// The bytes are not a whole, unaltered map file of this version.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The header cannot be decoded.
    #[error("header: {reason}")]
    Header {
        /// What the decoder said.
        reason: String,
    },
    /// A value of the header out of its range.
    #[error("header: {name}: expected {expected}")]
    HeaderValue {
        /// Name of the value.
        name: &'static str,
        /// The values that are usable.
        expected: &'static str,
    },
    /// Settings that contradict themselves, or that this program was not compiled for.
    #[error("settings: {0}")]
    Unusable(#[from] UnknownShape),
    /// Values of a tile that no posterior has.
    #[error("tile {index:?}: expected {expected}")]
    Tile {
        /// Index of the tile.
        index: TileIndex<2>,
        /// The values that are usable.
        expected: &'static str,
    },
}
