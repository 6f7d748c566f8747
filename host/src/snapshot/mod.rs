//! Map files: everything a map has learned, so that it can be asked, drawn, or go on learning as if never saved.
//!
//! ```text
//! bytes  what stands in the frame (see [`framed`](crate::framed))
//!     4  length of the header, little-endian
//!     …  header, postcard: shape, settings, capacities, learned supports if any, profile, path, counters, and a key for
//!        each tile
//!     …  one record for each tile, in the order of the keys, ascending by index: all numbers of its posterior
//! ```
//!
//! A record is the postcard encoding of a tuple of `f32`, which is their little-endian bytes: all records of a file are
//! equally long, so that a cut is noticed before anything is decoded. The covariance, which could be computed from the
//! information matrix, is stored, since queries need it and a file that is only asked should not be factored first; it
//! doubles the file, to 47 KB a tile at 12 × 12 supports.
//!
//! A file is not trusted: lengths and capacities are checked before anything is allocated by them, numbers before they are
//! used. [`decode`] takes any bytes without panicking.
//!
//! Learned supports are part of what a map says, so that a map file holds them whole (see [`supports`](crate::supports)): it
//! needs no other file to be asked or continued.
//!
//! Version 3 has settings as the core encodes them; versions 1 and 2, a list of numbers, are refused. The version changes with
//! anything that changes the meaning of a byte: a further field of the settings, or another order of an enumeration's variants.
//! A further variant at the end of one changes none.

mod decode;
mod encode;
mod error;
mod header;
mod record;
#[cfg(all(test, feature = "sim"))]
mod tests;

use std::path::Path;

pub use decode::decode;
pub(crate) use encode::write;
pub use error::{MapFileError, SnapshotError};

use crate::{
    framed::{self, FileKind},
    map::AnyMap,
};

/// The format version that is written, and the only one that is read.
pub const VERSION: u32 = 3;

const FILE_KIND: FileKind = FileKind { magic: *b"BHM map\n", version: VERSION, name: "a map file" };

/// What a map file holds besides the map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extras {
    /// Name of the profile that the map was made with, for people: the settings themselves are in the map.
    pub profile: String,
    /// Where the robot was at each scan, in order, metres.
    pub path_m: Vec<[f32; 2]>,
}

/// A map read from a file.
pub struct Snapshot {
    /// The map, ready to go on.
    pub map: Box<dyn AnyMap>,
    /// What else the file held.
    pub extras: Extras,
}

/// Writes a map file, replacing one of that name only when it is complete: a crash leaves the old one.
///
/// # Errors
/// If the file cannot be written.
pub fn save(path: &Path, map: &dyn AnyMap, extras: &Extras) -> Result<(), MapFileError> {
    framed::save(path, |to| map.write_snapshot(extras, to))
}

/// Reads a map file.
///
/// # Errors
/// If the file cannot be read, or is not a map file that this program understands, whole and undamaged.
pub fn load(path: &Path) -> Result<Snapshot, MapFileError> {
    FILE_KIND.load(path, decode)
}
