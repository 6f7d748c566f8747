//! Files in a frame, which shows what they are, whether they are whole, and whether they were altered.
//!
//! ```text
//! offset  bytes  what
//!      0      8  magic, which names the kind of file; its line feed shows a file that was transferred as text
//!      8      4  format version, little-endian like every number here
//!     12      8  length of the file
//!     20      …  contents
//!     -4      4  CRC-32 of everything before it
//! ```
//!
//! A file is not trusted: no bytes make [`FileKind::contents`] panic, and no stated length makes [`FileKind::load`] take more
//! memory than the file itself has bytes.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use crate::{dataset::describe, replace::replace};

/// Bytes before the contents.
pub const PREFIX_BYTES: usize = 20;

/// Bytes of the checksum after the contents.
pub const CHECKSUM_BYTES: usize = 4;

/// A kind of framed file.
#[derive(Clone, Copy, Debug)]
pub struct FileKind {
    /// The first bytes of every file of the kind.
    pub magic: [u8; 8],
    /// The format version that is written, and the only one that is read.
    pub version: u32,
    /// What the file is, for error messages: "a map file".
    pub name: &'static str,
}

/// Why bytes are not a whole, unaltered file of the expected kind.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// The bytes begin as another kind of file does.
    #[error("expected {expected}, found {found}")]
    Kind {
        /// The kind that was expected.
        expected: &'static str,
        /// What the bytes look like.
        found: String,
    },
    /// The file was written in another version of its format.
    #[error("format version {found}, only {understood} is understood")]
    Version {
        /// The version that the file states.
        found: u32,
        /// The version that this program reads.
        understood: u32,
    },
    /// The file ends too early.
    #[error("cut short at byte {found} of {expected}")]
    Cut {
        /// Bytes that the file should have.
        expected: u64,
        /// Bytes that it has.
        found: u64,
    },
    /// Something follows the end of the file.
    #[error("goes on after its end at byte {expected}")]
    TooLong {
        /// Bytes that the file should have.
        expected: u64,
    },
    /// The file was altered after it was written.
    #[error("damaged: checksum {computed:08x}, expected {stored:08x}")]
    Checksum {
        /// The checksum at the end of the file.
        stored: u32,
        /// The checksum of what the file holds.
        computed: u32,
    },
}

/// Why a file could not be written or read; `P` says what is wrong with one that was read and cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FileError<P> {
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
        problem: P,
    },
}

impl FileKind {
    /// Writes the bytes of a file, of which `contents` writes `contents_bytes`.
    ///
    /// # Errors
    /// If the bytes cannot be written, or the contents are not as long as said.
    pub fn write(
        &self,
        contents_bytes: usize,
        to: &mut dyn Write,
        contents: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> io::Result<()> {
        let length = (PREFIX_BYTES + contents_bytes + CHECKSUM_BYTES) as u64;
        let mut to = Checksummed { to, hasher: crc32fast::Hasher::new(), written: 0 };
        to.write_all(&self.magic)?;
        to.write_all(&self.version.to_le_bytes())?;
        to.write_all(&length.to_le_bytes())?;
        contents(&mut to)?;
        let Checksummed { to, hasher, written } = to;
        if written + CHECKSUM_BYTES as u64 != length {
            return Err(io::Error::other(format!("{written} bytes written of {length} announced")));
        }
        to.write_all(&hasher.finalize().to_le_bytes())
    }

    /// The bytes of a file with these contents.
    #[must_use]
    pub fn encode(&self, contents: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(PREFIX_BYTES + contents.len() + CHECKSUM_BYTES);
        // Into memory that grows nothing fails.
        let _ = self.write(contents.len(), &mut bytes, |to| to.write_all(contents));
        bytes
    }

    /// The contents of a file of this kind, given all its bytes.
    ///
    /// # Errors
    /// What [`FrameError`] names.
    pub fn contents<'a>(&self, bytes: &'a [u8]) -> Result<&'a [u8], FrameError> {
        let (expected, found) = (self.length(bytes)?, bytes.len() as u64);
        if found < expected {
            return Err(FrameError::Cut { expected, found });
        }
        if found > expected {
            return Err(FrameError::TooLong { expected });
        }
        let (content, stored) = bytes.split_last_chunk::<CHECKSUM_BYTES>().ok_or_else(|| cut(bytes))?;
        let (stored, computed) = (u32::from_le_bytes(*stored), crc32fast::hash(content));
        if stored != computed {
            return Err(FrameError::Checksum { stored, computed });
        }
        content.get(PREFIX_BYTES..).ok_or_else(|| cut(bytes))
    }

    /// The length that the beginning of a file states, bytes.
    fn length(&self, bytes: &[u8]) -> Result<u64, FrameError> {
        let Some(rest) = bytes.strip_prefix(&self.magic) else {
            // Cut within the magic, the bytes are still a piece of such a file.
            let cut_magic = !bytes.is_empty() && self.magic.starts_with(bytes);
            let kind = || FrameError::Kind { expected: self.name, found: describe(bytes) };
            return Err(if cut_magic { cut(bytes) } else { kind() });
        };
        let (version, rest) = rest.split_first_chunk().ok_or_else(|| cut(bytes))?;
        let version = u32::from_le_bytes(*version);
        if version != self.version {
            return Err(FrameError::Version { found: version, understood: self.version });
        }
        let (length, _) = rest.split_first_chunk().ok_or_else(|| cut(bytes))?;
        Ok(u64::from_le_bytes(*length))
    }

    /// Reads a file, whose bytes `decode` turns into what they stand for.
    ///
    /// # Errors
    /// If the file cannot be read, is not a whole and unaltered file of this kind, or `decode` refuses it.
    pub fn load<T, P: From<FrameError>>(
        &self,
        path: &Path,
        decode: impl FnOnce(&[u8]) -> Result<T, P>,
    ) -> Result<T, FileError<P>> {
        let unreadable = |source| FileError::Unreadable { path: path.to_owned(), source };
        let bad = |problem| FileError::Bad { path: path.to_owned(), problem };
        let file = File::open(path).map_err(unreadable)?;
        let mut bytes = Vec::new();
        // The beginning alone first: a file of another kind is not read to its end.
        (&file).take(PREFIX_BYTES as u64).read_to_end(&mut bytes).map_err(unreadable)?;
        let length = self.length(&bytes).map_err(|error| bad(error.into()))?;
        // One byte more than there should be, which shows a file that goes on. Memory grows with what is read.
        let left = length.saturating_sub(bytes.len() as u64).saturating_add(1);
        file.take(left).read_to_end(&mut bytes).map_err(unreadable)?;
        decode(&bytes).map_err(bad)
    }
}

/// Writes a file, replacing one of that name only when it is complete: a crash leaves the old one.
///
/// # Errors
/// [`FileError::Unwritable`].
pub fn save<P>(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), FileError<P>> {
    replace(path, write).map_err(|source| FileError::Unwritable { path: path.to_owned(), source })
}

/// The error for bytes that are too few for a frame.
fn cut(bytes: &[u8]) -> FrameError {
    FrameError::Cut { expected: (PREFIX_BYTES + CHECKSUM_BYTES) as u64, found: bytes.len() as u64 }
}

/// Passes bytes on, counts them and keeps their checksum.
struct Checksummed<'a> {
    to: &'a mut dyn Write,
    hasher: crc32fast::Hasher,
    written: u64,
}

impl Write for Checksummed<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.to.write(bytes)?;
        self.hasher.update(&bytes[..written]);
        self.written += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// The bytes of a file with its length and checksum made right again after some were changed: the contents are then what is
/// wrong.
#[cfg(test)]
pub(crate) fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let length = (bytes.len() as u64).to_le_bytes();
    if let Some(stated) = bytes.get_mut(12..PREFIX_BYTES) {
        stated.copy_from_slice(&length);
    }
    if let Some((content, checksum)) = bytes.split_last_chunk_mut::<CHECKSUM_BYTES>() {
        *checksum = crc32fast::hash(content).to_le_bytes();
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    const KIND: FileKind = FileKind { magic: *b"BHM map\n", version: 2, name: "a map file" };

    /// Put together by hand; the checksum is zlib's.
    const FILE: &[u8] = b"BHM map\n\x02\0\0\0\x20\0\0\0\0\0\0\0contents\xd2\x8f\x50\x3a";

    #[test]
    fn the_bytes_of_a_file_are_these() {
        assert_eq!(KIND.encode(b"contents"), FILE);
        assert_eq!(KIND.contents(FILE), Ok(&b"contents"[..]));
        assert!(KIND.write(9, &mut Vec::new(), |to| to.write_all(b"contents")).is_err(), "shorter than announced");
    }

    #[test]
    fn every_cut_and_every_flipped_bit_is_named() {
        for length in 0..FILE.len() {
            let expected = if length < PREFIX_BYTES { PREFIX_BYTES + CHECKSUM_BYTES } else { FILE.len() } as u64;
            match KIND.contents(&FILE[..length]).unwrap_err() {
                FrameError::Kind { found, .. } => assert_eq!((length, found.as_str()), (0, "an empty file")),
                error => assert_eq!(error, FrameError::Cut { expected, found: length as u64 }),
            }
            // As if it had been written so: a file with less in it, or none.
            let sealed = sealed(FILE[..length].to_vec());
            assert_eq!(KIND.contents(&sealed).is_ok(), length >= PREFIX_BYTES + CHECKSUM_BYTES, "{length} bytes");
        }
        let longer = [FILE, b"x"].concat();
        assert_eq!(KIND.contents(&longer), Err(FrameError::TooLong { expected: FILE.len() as u64 }));
        for bit in 0..8 * FILE.len() {
            let mut bytes = FILE.to_vec();
            bytes[bit / 8] ^= 1 << (bit % 8);
            let error = KIND.contents(&bytes).unwrap_err();
            let expected = match bit / 8 {
                0..8 => matches!(error, FrameError::Kind { .. }),
                8..12 => error == FrameError::Version { found: 2 ^ 1 << (bit - 64), understood: 2 },
                12..20 => matches!(error, FrameError::Cut { .. } | FrameError::TooLong { .. }),
                _ => matches!(error, FrameError::Checksum { .. }),
            };
            assert!(expected, "bit {bit} gives {error:?}");
        }
    }

    #[test]
    fn a_file_is_read_no_further_than_it_says_and_its_path_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let load = || KIND.load(&path, |bytes| KIND.contents(bytes).map(<[u8]>::to_vec));
        save::<FrameError>(&path, |to| to.write_all(FILE)).unwrap();
        assert_eq!(load().unwrap(), b"contents");
        let stating = |length: u64| [&FILE[..12], &length.to_le_bytes(), &FILE[20..]].concat();
        for (bytes, says) in [
            (&b""[..], "expected a map file, found an empty file"),
            (b"FLASER 2 1 1", "expected a map file, found text beginning with `FLASER 2 1 1`"),
            (b"BHM map\n\x07\0\0\0", "format version 7, only 2 is understood"),
            (b"BHM map\n\x02", "cut short at byte 9 of 24"),
            // No memory is taken for what a length only states.
            (&stating(u64::MAX), "cut short at byte 32 of 18446744073709551615"),
            (&stating(3), "goes on after its end at byte 3"),
        ] {
            std::fs::write(&path, bytes).unwrap();
            assert_eq!(load().unwrap_err().to_string(), format!("{}: {says}", path.display()));
        }
    }
}
