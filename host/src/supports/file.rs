use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::{LearnedSupports, SupportsBytesError, SupportsFileError, coding::Coded};
use crate::{dataset::describe, replace::replace};

/// The format version that is written, and the only one that is read.
pub const VERSION: u32 = 1;

/// The first bytes of every file of supports. The line feed shows a file that was transferred as text.
pub(super) const MAGIC: [u8; 8] = *b"BHM sup\n";

/// Bytes before the contents.
pub(super) const PREFIX_BYTES: usize = 20;

/// Bytes of the checksum at the end.
pub(super) const CHECKSUM_BYTES: usize = 4;

/// Writes a file of supports, replacing one of that name only when it is complete.
///
/// # Errors
/// If the file cannot be written.
pub fn save(path: &Path, supports: &LearnedSupports) -> Result<(), SupportsFileError> {
    let bytes = encode(supports);
    replace(path, |to| to.write_all(&bytes))
        .map_err(|source| SupportsFileError::Unwritable { path: path.to_owned(), source })
}

/// Reads a file of supports.
///
/// # Errors
/// If the file cannot be read, or is not a file of supports that this program understands, whole and undamaged.
pub fn load(path: &Path) -> Result<LearnedSupports, SupportsFileError> {
    let unreadable = |source| SupportsFileError::Unreadable { path: path.to_owned(), source };
    let bad = |problem| SupportsFileError::Bad { path: path.to_owned(), problem };
    let file = File::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    // The beginning alone first: what is no such file is not read to its end.
    (&file).take(PREFIX_BYTES as u64).read_to_end(&mut bytes).map_err(unreadable)?;
    let length = stated_length(&bytes).map_err(bad)?;
    // By one byte more than there should be at most.
    let left = length.saturating_sub(bytes.len() as u64).saturating_add(1);
    file.take(left).read_to_end(&mut bytes).map_err(unreadable)?;
    decode(&bytes).map_err(bad)
}

/// The bytes of a file of supports.
#[must_use]
pub fn encode(supports: &LearnedSupports) -> Vec<u8> {
    // Into memory that grows, plain values have no way to fail.
    let contents = postcard::to_allocvec(&Coded::of(supports)).unwrap_or_default();
    let length = (PREFIX_BYTES + contents.len() + CHECKSUM_BYTES) as u64;
    let mut bytes = [&MAGIC[..], &VERSION.to_le_bytes(), &length.to_le_bytes(), &contents].concat();
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes
}

/// Reads supports from the bytes of a file.
///
/// # Errors
/// What [`SupportsBytesError`] names; no bytes make this panic, or allocate much more than their length.
pub fn decode(bytes: &[u8]) -> Result<LearnedSupports, SupportsBytesError> {
    let expected = stated_length(bytes)?;
    let found = bytes.len() as u64;
    if found < expected {
        return Err(SupportsBytesError::Cut { expected, found });
    }
    if found > expected {
        return Err(SupportsBytesError::TooLong { expected });
    }
    let no_room = || SupportsBytesError::Contents { reason: "they do not fit the file".to_owned() };
    let (content, stored) = bytes.split_last_chunk::<CHECKSUM_BYTES>().ok_or_else(no_room)?;
    let (stored, computed) = (u32::from_le_bytes(*stored), crc32fast::hash(content));
    if stored != computed {
        return Err(SupportsBytesError::Checksum { stored, computed });
    }
    let contents = content.get(PREFIX_BYTES..).ok_or_else(no_room)?;
    let (coded, rest) = postcard::take_from_bytes::<Coded>(contents)
        .map_err(|error| SupportsBytesError::Contents { reason: error.to_string() })?;
    if !rest.is_empty() {
        return Err(no_room());
    }
    Ok(coded.supports()?)
}

/// The length that the beginning of a file states.
fn stated_length(bytes: &[u8]) -> Result<u64, SupportsBytesError> {
    let cut = || SupportsBytesError::Cut { expected: PREFIX_BYTES as u64, found: bytes.len() as u64 };
    let Some(rest) = bytes.strip_prefix(&MAGIC) else {
        // Cut within the magic, it is still a piece of such a file.
        let cut_magic = !bytes.is_empty() && MAGIC.starts_with(bytes);
        return Err(if cut_magic { cut() } else { SupportsBytesError::NotSupports { found: describe(bytes) } });
    };
    let (version, rest) = rest.split_first_chunk::<4>().ok_or_else(cut)?;
    let found = u32::from_le_bytes(*version);
    if found != VERSION {
        return Err(SupportsBytesError::Version { found });
    }
    let (length, _) = rest.split_first_chunk::<8>().ok_or_else(cut)?;
    Ok(u64::from_le_bytes(*length))
}
