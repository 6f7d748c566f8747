//! Map files: everything a map has learned, so that it can be asked, drawn, or go on learning as if never saved.
//!
//! ```text
//! offset  bytes  what
//!      0      8  magic, "BHM map\n"
//!      8      4  format version, little-endian like every number here
//!     12      8  length of the file
//!     20      4  length of the header
//!     24      …  header, postcard: shape, settings, capacities, learned supports if any, profile, path, counters, and a
//!                key for each tile
//!      …      …  one record for each tile, in the order of the keys, ascending by index: all numbers of its posterior
//!     -4      4  CRC-32 of everything before it
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
//! Version 2 has settings of supports, beam rules and segments, choices by name, and learned supports; version 1 had none
//! of these. The version changes with anything that changes the meaning of a byte, the order of an enumeration's variants included.

mod decode;
mod encode;
mod error;
mod header;
mod record;
mod settings;
#[cfg(test)]
mod tests;

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

pub use decode::decode;
pub(crate) use encode::write;
pub use error::{MapFileError, SnapshotError};

use crate::{map::AnyMap, replace::replace};

/// The format version that is written, and the only one that is read.
pub const VERSION: u32 = 2;

/// The first bytes of every map file. The line feed shows a file that was transferred as text.
const MAGIC: [u8; 8] = *b"BHM map\n";

/// Bytes before the header.
const PREFIX_BYTES: usize = 24;

/// Bytes of the checksum at the end.
const CHECKSUM_BYTES: usize = 4;

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
    let unwritable = |source| MapFileError::Unwritable { path: path.to_owned(), source };
    replace(path, |to| map.write_snapshot(extras, to)).map_err(unwritable)
}

/// Reads a map file.
///
/// # Errors
/// If the file cannot be read, or is not a map file that this program understands, whole and undamaged.
pub fn load(path: &Path) -> Result<Snapshot, MapFileError> {
    let unreadable = |source| MapFileError::Unreadable { path: path.to_owned(), source };
    let bad = |problem| MapFileError::Bad { path: path.to_owned(), problem };
    let file = File::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    // The beginning alone first: what is no map file is not read to its end.
    (&file).take(PREFIX_BYTES as u64).read_to_end(&mut bytes).map_err(unreadable)?;
    let prefix = decode::Prefix::of(&bytes).map_err(bad)?;
    read_rest(file, prefix.length, &mut bytes).map_err(unreadable)?;
    decode(&bytes).map_err(bad)
}

/// Reads on, by one byte more than there should be at most.
fn read_rest(file: File, length: u64, bytes: &mut Vec<u8>) -> io::Result<()> {
    let left = length.saturating_sub(bytes.len() as u64).saturating_add(1);
    file.take(left).read_to_end(bytes).map(drop)
}
