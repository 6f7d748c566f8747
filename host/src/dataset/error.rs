use std::io;
use std::path::{Path, PathBuf};

/// Why a recorded file gives nothing usable. Damage inside a file that does give something is in its report instead.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// The file cannot be opened, or not a single scan or point could be read before reading failed.
    #[error("cannot read {}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the operating system or the decompressor said.
        source: io::Error,
    },
    /// The file is something else than what was asked for, or all of it is damaged.
    #[error("{}: expected {expected}, found {found}", path.display())]
    WrongContent {
        /// The file.
        path: PathBuf,
        /// What the reader looks for.
        expected: String,
        /// What the file looks like, with the first damaged line if there is one.
        found: String,
    },
    /// [`ReadOptions::max_range_m`](super::ReadOptions::max_range_m) is not a range.
    #[error("the maximum range must be a positive number of metres, not {max_range_m}")]
    BadMaxRange {
        /// The value given, metres.
        max_range_m: f32,
    },
}

impl DatasetError {
    pub(super) fn unreadable(path: &Path, source: io::Error) -> Self {
        Self::Unreadable { path: path.to_owned(), source }
    }

    pub(super) fn wrong_content(path: &Path, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::WrongContent { path: path.to_owned(), expected: expected.into(), found: found.into() }
    }
}
