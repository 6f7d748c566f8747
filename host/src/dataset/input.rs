//! Bytes in: plain or gzip, line by line, never more of a line in memory than a line can honestly have.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::mem;
use std::path::Path;

use flate2::bufread::MultiGzDecoder;

use super::DatasetError;
use super::damage::{DamageLog, DamageReason};

const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// Bytes looked at to tell one format from another.
const HEAD_BYTES: usize = 64 * 1_024;

/// Longest piece of a first line that an error message quotes, characters.
const MAX_QUOTE_CHARS: usize = 40;

/// Opens a file for [`plain_or_gzip`].
pub(super) fn open(path: &Path) -> Result<BufReader<File>, DatasetError> {
    File::open(path).map(BufReader::new).map_err(|source| DatasetError::unreadable(path, source))
}

/// The decompressed bytes of a gzip stream (of any number of members), any other stream as it is.
///
/// What a stream is, its first bytes say: names lie, and logs are often unpacked by a browser on the way.
pub(super) fn plain_or_gzip<'a>(mut reader: impl BufRead + 'a) -> io::Result<Box<dyn BufRead + 'a>> {
    Ok(if reader.fill_buf()?.starts_with(&GZIP_MAGIC) {
        Box::new(BufReader::with_capacity(HEAD_BYTES, MultiGzDecoder::new(reader)))
    } else {
        Box::new(BufReader::with_capacity(HEAD_BYTES, reader))
    })
}

/// What a file looks like from its first bytes, in words for an error message.
pub(crate) fn describe(head: &[u8]) -> String {
    if head.is_empty() {
        return "an empty file".to_owned();
    }
    // Of the files that this program writes, the one that few of its commands read.
    if head.starts_with(b"BHM sct\n") {
        return "a list of scattered supports, which `bhm experiment placement` alone reads".to_owned();
    }
    let first_line = head.split(|&byte| byte == b'\n').next().unwrap_or_default();
    let text = String::from_utf8_lossy(first_line);
    if text.chars().any(|c| c == char::REPLACEMENT_CHARACTER || (c.is_control() && !c.is_whitespace())) {
        return "binary data".to_owned();
    }
    let quote: String = text.trim().chars().take(MAX_QUOTE_CHARS).collect();
    let kind = if quote.contains(',') { "comma-separated values" } else { "text" };
    format!("{kind} beginning with `{quote}`")
}

/// Reads lines of bounded length, counts them and collects damage: its own findings and those of the format's parser.
pub(super) struct Lines<R> {
    reader: R,
    limit: usize,
    text: String,
    found: String,
    broken: Option<io::Error>,
    /// Lines read; also the number of the line last given.
    pub(super) count: u64,
    /// What was skipped.
    pub(super) damage: DamageLog,
}

impl<R: BufRead> Lines<R> {
    /// Lines of at most `limit` bytes, their ends not counted.
    ///
    /// # Errors
    /// When not even the first bytes can be read.
    pub(super) fn new(mut reader: R, limit: usize) -> io::Result<Self> {
        let found = describe(reader.fill_buf()?);
        Ok(Self { reader, limit, text: String::new(), found, broken: None, count: 0, damage: DamageLog::default() })
    }

    /// The next line that is text; `None` at the end, or where the source breaks, which is recorded as damage.
    pub(super) fn next(&mut self) -> Option<&str> {
        loop {
            match self.advance() {
                Ok(false) => return None,
                Ok(true) => break,
                Err(reason) => self.damaged(reason),
            }
        }
        Some(&self.text)
    }

    /// Records that the line last given is of no use.
    pub(super) fn damaged(&mut self, reason: DamageReason) {
        self.damage.record(self.count, reason);
    }

    /// Why nothing usable came of this source: it broke, or it is not what was expected.
    pub(super) fn into_error(self, path: &Path, expected: &str) -> DatasetError {
        match self.broken {
            Some(source) => DatasetError::unreadable(path, source),
            None => DatasetError::wrong_content(path, expected, self.found + &self.damage.summary()),
        }
    }

    /// Reads a line into `text`; false at the end.
    fn advance(&mut self) -> Result<bool, DamageReason> {
        if self.broken.is_some() {
            return Ok(false);
        }
        let mut bytes = mem::take(&mut self.text).into_bytes();
        bytes.clear();
        match read_bounded(&mut self.reader, self.limit, &mut bytes) {
            Ok(Extent::Nothing) => return Ok(false),
            Ok(Extent::Line) => self.count += 1,
            Ok(Extent::TooLong) => {
                self.count += 1;
                return Err(DamageReason::TooLong { limit: self.limit });
            }
            Err(error) => {
                self.count += 1;
                let reason = DamageReason::Unreadable { error: error.to_string() };
                self.broken = Some(error);
                return Err(reason);
            }
        }
        self.text = String::from_utf8(bytes).map_err(|_| DamageReason::NotUtf8)?;
        Ok(true)
    }
}

/// How much a read gave.
enum Extent {
    /// The source is at its end.
    Nothing,
    /// A line, its end removed.
    Line,
    /// The beginning of a line that is too long; its remainder was passed over.
    TooLong,
}

fn read_bounded(reader: &mut impl BufRead, limit: usize, line: &mut Vec<u8>) -> io::Result<Extent> {
    let longest = limit as u64 + 1;
    if reader.take(longest).read_until(b'\n', line)? == 0 {
        return Ok(Extent::Nothing);
    }
    if line.last() == Some(&b'\n') {
        line.pop();
    } else if line.len() > limit {
        reader.skip_until(b'\n')?;
        return Ok(Extent::TooLong);
    }
    Ok(Extent::Line)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_bounded_and_counted() {
        let mut lines = Lines::new(&b"1234\n\n12345\n6789\n\xff\n12"[..], 4).unwrap();
        for (number, text) in [(1, "1234"), (2, ""), (4, "6789"), (6, "12")] {
            assert_eq!(lines.next(), Some(text));
            assert_eq!(lines.count, number);
        }
        lines.damaged(DamageReason::TooManyFields);
        assert_eq!(lines.next(), None);
        assert_eq!(lines.count, 6);
        let damage: Vec<_> = lines.damage.kept.into_iter().map(|damage| (damage.line, damage.reason)).collect();
        let expected = [DamageReason::TooLong { limit: 4 }, DamageReason::NotUtf8, DamageReason::TooManyFields];
        assert_eq!(damage, Vec::from_iter([3, 5, 6].into_iter().zip(expected)));
    }

    #[test]
    fn says_what_a_file_looks_like() {
        for (head, expected) in [
            (&b""[..], "an empty file"),
            (b"\x7fELF\x02\x01", "binary data"),
            (b"\xff\xfe\xfd\n", "binary data"),
            (b"scan,x,y,label\n1,2,3,0\n", "comma-separated values beginning with `scan,x,y,label`"),
            (b"\tDear diary,\r\n", "comma-separated values beginning with `Dear diary,`"),
            (b"hello world", "text beginning with `hello world`"),
        ] {
            assert_eq!(describe(head), expected);
        }
    }
}
