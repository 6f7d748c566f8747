use std::io;
use std::path::PathBuf;

use bhm_core::tile::TileIndex;

use super::VERSION;
use crate::map::UnknownShape;

/// Why a map file could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum MapFileError {
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
        problem: SnapshotError,
    },
}

/// Why bytes are not a usable map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SnapshotError {
    /// It does not begin like one.
    #[error("expected a map file, found {found}")]
    NotAMap {
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
    /// The header cannot be decoded.
    #[error("header: {reason}")]
    Header {
        /// What the decoder said.
        reason: String,
    },
    /// A value of the header that cannot be.
    #[error("header: {name} expected {expected}")]
    HeaderValue {
        /// Which.
        name: &'static str,
        /// What it should be.
        expected: &'static str,
    },
    /// Settings that contradict themselves, or that this program was not compiled for.
    #[error("settings: {0}")]
    Unusable(#[from] UnknownShape),
    /// A tile's values that cannot be.
    #[error("tile {index:?}: expected {expected}")]
    Tile {
        /// Which tile.
        index: TileIndex<2>,
        /// What its values should be.
        expected: &'static str,
    },
}
