//! Tests that need more than one crate, or an oracle: see `tests/tests`, one file per subject.
