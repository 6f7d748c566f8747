//! Recorded logs: scans with their poses, and labelled points.
//!
//! Reading is forgiving and never silent. A damaged line is skipped and reported with its number and reason; a file that
//! gives nothing at all is a [`DatasetError`]. Files may be plain or gzip, whatever their names. Nothing here panics on any
//! bytes, and nothing prints: what is worth telling is in the [`ReadReport`].
//!
//! A new format of scan logs is one file that implements `ScanFormat`, and one line in `SCAN_FORMATS`.
//!
//! ```no_run
//! use bhm_host::dataset::{self, ReadOptions};
//!
//! let log = dataset::read_log("intel.log.gz".as_ref(), &ReadOptions::default())?;
//! println!("{} scans, {} damaged lines", log.report.scans, log.report.damaged);
//! # Ok::<(), dataset::DatasetError>(())
//! ```

mod carmen;
mod damage;
mod error;
mod input;
mod max_range;
mod points;
mod stamps;
#[cfg(test)]
mod test_data;
#[cfg(test)]
mod tests;

use std::io::BufRead;
use std::path::Path;

pub use carmen::CarmenLog;
pub use damage::{Damage, DamageReason, MAX_DAMAGE_KEPT};
pub use error::DatasetError;
pub(crate) use input::describe;
pub use max_range::no_return_range_m;
pub use points::{LabelledPoints, PointLog, PointReport};

use crate::ScanRecord;

/// What the caller knows better than the log.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Range at and beyond which a reading means "nothing returned", metres; `None` finds it from the log
    /// (see [`no_return_range_m`]).
    pub max_range_m: Option<f32>,
}

impl ReadOptions {
    fn check(&self) -> Result<(), DatasetError> {
        match self.max_range_m {
            Some(max_range_m) if !(max_range_m.is_finite() && max_range_m > 0.0) => {
                Err(DatasetError::BadMaxRange { max_range_m })
            }
            _ => Ok(()),
        }
    }
}

/// The scans of a log, oldest first, and how reading them went.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanLog {
    /// At least one scan; their stamps strictly increase.
    pub scans: Vec<ScanRecord>,
    /// What was read, skipped and repaired.
    pub report: ReadReport,
}

/// How reading a scan log went. `lines` is the sum of `scans`, `other_lines` and `damaged`.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadReport {
    /// Lines seen.
    pub lines: u64,
    /// Lines that gave a scan.
    pub scans: u64,
    /// Lines of kinds that are of no use here: odometry, parameters, comments, empty lines.
    pub other_lines: u64,
    /// Lines that were skipped because they are damaged.
    pub damaged: u64,
    /// The first [`MAX_DAMAGE_KEPT`] of them.
    pub damage: Vec<Damage>,
    /// Scans whose recorded stamp was unusable or not later than the one before, and was replaced by that plus 1 ns.
    pub stamps_repaired: u64,
    /// Range at and beyond which a reading means "nothing returned", metres; the largest, should the scans differ.
    pub max_range_m: f32,
    /// Where `max_range_m` comes from.
    pub max_range_source: MaxRangeSource,
}

/// Where the range that means "nothing returned" comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaxRangeSource {
    /// From [`ReadOptions::max_range_m`].
    Caller,
    /// Every scan states its sensor's maximum.
    Stated,
    /// Found as a plateau of identical readings at the top.
    Plateau,
    /// No plateau was found: every reading is an echo, and this is just above the largest.
    LargestReading,
}

/// A format of scan logs.
trait ScanFormat {
    /// The format's name with article, for messages.
    fn name(&self) -> &'static str;

    /// Whether a file that begins like this may be one.
    fn recognises(&self, head: &[u8]) -> bool;

    /// Reads such a file, decompressed; `path` is for messages.
    fn read(&self, reader: &mut dyn BufRead, path: &Path, options: &ReadOptions) -> Result<ScanLog, DatasetError>;
}

/// Every format that [`read_log`] knows.
const SCAN_FORMATS: &[&dyn ScanFormat] = &[&CarmenLog];

/// Opens a file as it is, or decompressed where it is gzip, which its first bytes say and not its name.
///
/// # Errors
/// When the file cannot be opened or read.
pub fn open(path: &Path) -> Result<Box<dyn BufRead>, DatasetError> {
    input::plain_or_gzip(input::open(path)?).map_err(|source| DatasetError::unreadable(path, source))
}

/// Reads a scan log, plain or gzip, of whatever known format its first bytes show.
///
/// # Errors
/// When the file cannot be read, is of no known format, or holds no usable scan; when an option makes no sense.
pub fn read_log(path: &Path, options: &ReadOptions) -> Result<ScanLog, DatasetError> {
    let unreadable = |source| DatasetError::unreadable(path, source);
    let mut reader = input::plain_or_gzip(input::open(path)?).map_err(unreadable)?;
    let head = reader.fill_buf().map_err(unreadable)?;
    match SCAN_FORMATS.iter().find(|format| format.recognises(head)) {
        Some(format) => format.read(&mut *reader, path, options),
        None => {
            let names: Vec<&str> = SCAN_FORMATS.iter().map(|format| format.name()).collect();
            Err(DatasetError::wrong_content(path, names.join(" or "), describe(head)))
        }
    }
}
