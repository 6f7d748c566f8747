use std::path::Path;

use super::{LearnedSupports, SupportsBytesError, SupportsFileError, coding::Coded};
use crate::framed::{self, FileKind};

/// The format version that is written, and the only one that is read.
pub const VERSION: u32 = 2;

pub(super) const FILE_KIND: FileKind =
    FileKind { magic: *b"BHM sup\n", version: VERSION, name: "a file of learned supports" };

/// Writes a file of supports, replacing one of that name only when it is complete.
///
/// # Errors
/// If the file cannot be written.
pub fn save(path: &Path, supports: &LearnedSupports) -> Result<(), SupportsFileError> {
    framed::save(path, |to| to.write_all(&encode(supports)))
}

/// Reads a file of supports.
///
/// # Errors
/// If the file cannot be read, or is not a file of supports that this program understands, whole and undamaged.
pub fn load(path: &Path) -> Result<LearnedSupports, SupportsFileError> {
    FILE_KIND.load(path, decode)
}

/// The bytes of a file of supports.
#[must_use]
pub fn encode(supports: &LearnedSupports) -> Vec<u8> {
    // Into memory that grows, plain values have no way to fail.
    FILE_KIND.encode(&postcard::to_allocvec(&Coded::of(supports)).unwrap_or_default())
}

/// Reads supports from the bytes of a file.
///
/// # Errors
/// What [`SupportsBytesError`] names; no bytes make this panic, or allocate much more than their length.
pub fn decode(bytes: &[u8]) -> Result<LearnedSupports, SupportsBytesError> {
    let (coded, rest) = postcard::take_from_bytes::<Coded>(FILE_KIND.contents(bytes)?)
        .map_err(|error| SupportsBytesError::Contents { reason: error.to_string() })?;
    if !rest.is_empty() {
        return Err(SupportsBytesError::Contents { reason: "more bytes than the supports take".to_owned() });
    }
    Ok(coded.supports()?)
}
