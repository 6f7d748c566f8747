use cobs::decode_in_place;
use crc32fast::Hasher;
use postcard::ser_flavors::{Cobs, Flavor, Slice};
use serde::{Deserialize, Serialize};

use super::LinkCounters;

/// The version of the protocol that is spoken here. Every version keeps the frame: a version first, its CRC-32 last.
pub const PROTOCOL_VERSION: u8 = 1;

/// Bytes of a frame's check.
const CRC_BYTES: usize = 4;

/// A message does not fit the buffer it was to be written into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DoesNotFit;

impl core::fmt::Display for DoesNotFit {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("a message is longer than a frame")
    }
}

impl core::error::Error for DoesNotFit {}

/// What is wrong with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// The frame is too short, or not COBS.
    Cut,
    /// The frame's checksum does not fit its content.
    Crc,
    /// The frame is whole, but of another version of the protocol.
    Version {
        /// Which.
        found: u8,
    },
    /// The frame is whole, but its content is not a message, or one that contradicts itself.
    Unreadable,
    /// The frame is longer than any message; the rest of it was skipped.
    Oversized,
}

/// Writes a message as the line carries it, `00 COBS(version ‖ postcard ‖ CRC-32) 00`, and answers those bytes.
///
/// The zero in front ends whatever noise an idle line may have left at the other end.
///
/// # Errors
/// [`DoesNotFit`].
pub fn encode<'b>(message: &impl Serialize, buffer: &'b mut [u8]) -> Result<&'b [u8], DoesNotFit> {
    let (front, rest) = buffer.split_first_mut().ok_or(DoesNotFit)?;
    *front = 0;
    let mut checked = Checked { inside: Cobs::try_new(Slice::new(rest)).map_err(|_| DoesNotFit)?, crc: Hasher::new() };
    checked.try_push(PROTOCOL_VERSION).map_err(|_| DoesNotFit)?;
    let length = postcard::serialize_with_flavor(message, checked).map_err(|_| DoesNotFit)?;
    Ok(&buffer[..=length])
}

/// Appends the check of what passes through.
struct Checked<'b> {
    inside: Cobs<Slice<'b>>,
    crc: Hasher,
}

impl Flavor for Checked<'_> {
    /// Bytes written.
    type Output = usize;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.try_extend(&[byte])
    }

    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        self.crc.update(bytes);
        self.inside.try_extend(bytes)
    }

    fn finalize(mut self) -> postcard::Result<usize> {
        self.inside.try_extend(&self.crc.finalize().to_le_bytes())?;
        self.inside.finalize().map(|written| written.len())
    }
}

/// Finds frames of at most `N` bytes (as the line carries them) in a stream of bytes, whatever happened to it: after any
/// damage it is in step again at the next zero.
#[derive(Debug)]
pub struct Deframer<const N: usize> {
    buffer: [u8; N],
    length: usize,
    oversized: bool,
    /// What was found.
    pub counters: LinkCounters,
}

impl<const N: usize> Default for Deframer<N> {
    fn default() -> Self {
        Self::NEW
    }
}

impl<const N: usize> Deframer<N> {
    /// One that has seen nothing, for a `static`.
    pub const NEW: Self = Self { buffer: [0; N], length: 0, oversized: false, counters: LinkCounters::NONE };

    /// Takes bytes off the front of `bytes` up to the end of a frame, and answers what the frame holds between version and
    /// check; `None` if the bytes end first. Whoever reads the content [counts](Self::count) what became of it.
    pub fn take(&mut self, bytes: &mut &[u8]) -> Option<Result<&[u8], Damage>> {
        loop {
            let end = bytes.iter().position(|byte| *byte == 0);
            let (content, rest) = bytes.split_at(end.unwrap_or(bytes.len()));
            *bytes = rest.get(1..).unwrap_or_default();
            self.counters.bytes_received += (content.len() + usize::from(end.is_some())) as u64;
            self.store(content);
            end?;
            // Nothing lies between the zero behind a frame and the one in front of the next.
            if self.length > 0 || self.oversized {
                break;
            }
        }
        Some(self.content())
    }

    /// Forgets the frame that was begun.
    pub fn drop_begun(&mut self) {
        (self.length, self.oversized) = (0, false);
    }

    /// Counts what became of a frame.
    pub fn count<T>(&mut self, outcome: &Result<T, Damage>) {
        let LinkCounters {
            frames_received,
            frames_cut,
            frames_bad_crc,
            frames_other_version,
            frames_unreadable,
            frames_oversized,
            ..
        } = &mut self.counters;
        *match outcome {
            Ok(_) => frames_received,
            Err(Damage::Cut) => frames_cut,
            Err(Damage::Crc) => frames_bad_crc,
            Err(Damage::Version { .. }) => frames_other_version,
            Err(Damage::Unreadable) => frames_unreadable,
            Err(Damage::Oversized) => frames_oversized,
        } += 1;
    }

    fn store(&mut self, bytes: &[u8]) {
        match self.buffer.get_mut(self.length..self.length + bytes.len()) {
            Some(room) if !self.oversized => {
                room.copy_from_slice(bytes);
                self.length += bytes.len();
            }
            _ => self.oversized = true,
        }
    }

    fn content(&mut self) -> Result<&[u8], Damage> {
        let frame = &mut self.buffer[..core::mem::take(&mut self.length)];
        if core::mem::take(&mut self.oversized) {
            return Err(Damage::Oversized);
        }
        let length = decode_in_place(frame).map_err(|_| Damage::Cut)?;
        let decoded = frame.get(..length).ok_or(Damage::Cut)?;
        let (checked, crc) = decoded.split_last_chunk::<CRC_BYTES>().ok_or(Damage::Cut)?;
        let (version, content) = checked.split_first().ok_or(Damage::Cut)?;
        if crc32fast::hash(checked) != u32::from_le_bytes(*crc) {
            return Err(Damage::Crc);
        }
        if *version != PROTOCOL_VERSION {
            return Err(Damage::Version { found: *version });
        }
        Ok(content)
    }
}

/// Reads the one message that a frame holds.
pub(super) fn read<'f, T: Deserialize<'f>>(content: &'f [u8]) -> Result<T, Damage> {
    match postcard::take_from_bytes(content) {
        Ok((message, [])) => Ok(message),
        _ => Err(Damage::Unreadable),
    }
}
