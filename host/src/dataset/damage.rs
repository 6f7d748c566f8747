use std::fmt;

/// Most damage records a report keeps; further ones are only counted.
pub const MAX_DAMAGE_KEPT: usize = 64;

/// Longest piece of a damaged field that is kept for the message, characters.
const MAX_EXCERPT_CHARS: usize = 32;

/// A line or row that was skipped, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Damage {
    /// Line in the file (after decompression), counted from 1.
    pub line: u64,
    /// What is wrong with it.
    pub reason: DamageReason,
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.reason)
    }
}

/// Why a line or row cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DamageReason {
    /// The line ends where a field should follow.
    #[error("ends before the field {field}")]
    MissingField {
        /// Name of the first missing field, as the format calls it.
        field: &'static str,
    },
    /// Fields follow where the line should end, so none of them can be trusted to be in its place.
    #[error("has more fields than its kind allows")]
    TooManyFields,
    /// A field holds something unusable.
    #[error("field {field}: expected {expected}, found `{found}`")]
    BadField {
        /// Name of the field, as the format calls it.
        field: &'static str,
        /// What the field may hold.
        expected: &'static str,
        /// The beginning of what it holds.
        found: String,
    },
    /// The line is not text.
    #[error("is not UTF-8 text")]
    NotUtf8,
    /// The line is longer than any line of this format can be.
    #[error("is longer than {limit} bytes")]
    TooLong {
        /// Longest line read, bytes.
        limit: usize,
    },
    /// The file could not be read on from here: a compressed stream cut short or corrupt, or a failing disk.
    #[error("the file cannot be read on from here: {error}")]
    Unreadable {
        /// What the operating system or the decompressor said.
        error: String,
    },
}

impl DamageReason {
    pub(super) fn bad_field(field: &'static str, expected: &'static str, found: &str) -> Self {
        Self::BadField { field, expected, found: found.chars().take(MAX_EXCERPT_CHARS).collect() }
    }
}

/// Counts all damage and keeps the first [`MAX_DAMAGE_KEPT`] records.
#[derive(Debug, Default)]
pub(super) struct DamageLog {
    pub(super) total: u64,
    pub(super) kept: Vec<Damage>,
}

impl DamageLog {
    pub(super) fn record(&mut self, line: u64, reason: DamageReason) {
        self.total += 1;
        if self.kept.len() < MAX_DAMAGE_KEPT {
            self.kept.push(Damage { line, reason });
        }
    }

    /// "; 3 damaged, the first at line 7: …", for an error message; empty without damage.
    pub(super) fn summary(&self) -> String {
        self.kept.first().map_or_else(String::new, |first| format!("; {} damaged, the first: {first}", self.total))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_a_bounded_number_and_counts_all() {
        let mut log = DamageLog::default();
        for line in 1..=1_000 {
            log.record(line, DamageReason::NotUtf8);
        }
        assert_eq!((log.total, log.kept.len()), (1_000, MAX_DAMAGE_KEPT));
        assert_eq!(log.kept[0].to_string(), "line 1: is not UTF-8 text");
    }

    #[test]
    fn excerpts_are_short_and_cut_between_characters() {
        let reason = DamageReason::bad_field("x", "a number", &"é".repeat(500));
        assert_eq!(
            reason.to_string(),
            format!("field x: expected a number, found `{}`", "é".repeat(MAX_EXCERPT_CHARS))
        );
    }
}
