use crate::counters::counters;

counters! {
    /// What one end of the line saw of it.
    ///
    /// What lies between two zeros on the line and is not empty is in exactly one of `frames_received`, `frames_cut`,
    /// `frames_bad_crc`, `frames_other_version`, `frames_unreadable` and `frames_oversized`.
    LinkCounters:
    /// Bytes that came, those between frames included.
    bytes_received,
    /// Frames that came whole and could be read.
    frames_received,
    /// Frames that are too short, or no COBS: cut, or hit where their lengths stand.
    frames_cut,
    /// Frames whose check does not fit their content.
    frames_bad_crc,
    /// Whole frames of another version of the protocol.
    frames_other_version,
    /// Whole frames that hold no message, or one that contradicts itself.
    frames_unreadable,
    /// Frames longer than any message.
    frames_oversized,
    /// Bytes that came while the receive queue was full, and are gone.
    bytes_overrun,
    /// Bytes sent.
    bytes_sent,
    /// Frames sent.
    frames_sent,
}

impl LinkCounters {
    /// Frames that came and were of no use.
    #[must_use]
    pub fn frames_damaged(&self) -> u64 {
        self.frames_cut
            + self.frames_bad_crc
            + self.frames_other_version
            + self.frames_unreadable
            + self.frames_oversized
    }
}
