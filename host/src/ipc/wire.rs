//! What all messages have in common.

use std::process;
use std::time::{SystemTime, UNIX_EPOCH};

/// A message of which every bit pattern is a value: it may be wrong, never undefined.
///
/// # Safety
/// The type must be made of integers, floating-point numbers and arrays of them only.
pub(super) unsafe trait PlainNumbers {}

/// A short name inside a message: UTF-8, filled up with zeros.
pub(super) type Name = [u8; NAME_BYTES];

/// Longest name, bytes.
pub(super) const NAME_BYTES: usize = 32;

/// The name as a message holds it, cut off after [`NAME_BYTES`].
pub(super) fn name_of(text: &str) -> Name {
    let mut name = [0; NAME_BYTES];
    for (to, from) in name.iter_mut().zip(text.bytes()) {
        *to = from;
    }
    name
}

/// The text of a name; `None` if it is not UTF-8.
pub(super) fn text_of(name: &Name) -> Option<&str> {
    let end = name.iter().position(|byte| *byte == 0).unwrap_or(NAME_BYTES);
    str::from_utf8(&name[..end]).ok()
}

/// A number that no other run of a program has: what a source and a mapper are told apart by. Never 0.
#[must_use]
pub fn fresh_id() -> u64 {
    // Nanoseconds need 61 bits until 2043; the process in the upper bits separates two that start at the same moment.
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as u64);
    (now ^ (u64::from(process::id()) << 40)).max(1)
}
