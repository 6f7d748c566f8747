//! Where tests find recorded logs, and how they make damaged ones.

use std::io::Write;
use std::path::PathBuf;

use flate2::Compression;
use flate2::write::GzEncoder;

/// A file of recorded data, from the directory in `BHM_DATA` or from `shared/data` beside the workspace.
///
/// `None` where it is absent, which is said on standard error; in CI (`CI` set) absence fails the test instead.
pub(super) fn recorded(name: &str) -> Option<PathBuf> {
    let directory = std::env::var_os("BHM_DATA")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data")), PathBuf::from);
    let path = directory.join(name);
    if path.is_file() {
        return Some(path);
    }
    assert!(std::env::var_os("CI").is_none(), "{} is absent; set BHM_DATA to the recorded logs", path.display());
    eprintln!("skipped: {} is absent; set BHM_DATA to the recorded logs", path.display());
    None
}

pub(super) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// A `FLASER` line: n readings given as text, pose (1, 2, 0.5), this stamp.
pub(super) fn flaser(ranges: &[&str], stamp: &str) -> String {
    format!("FLASER {} {} 1 2 0.5 7 8 9 {stamp} host 0.1\n", ranges.len(), ranges.join(" "))
}

/// A `ROBOTLASER1` line with three readings and two remissions, pose (1, 2, 0.5).
pub(super) fn robot_laser(maximum_range: &str, stamp: &str) -> String {
    format!(
        "ROBOTLASER1 0 -1.5 3.0 1.5 {maximum_range} 0.01 0 3 1.25 2.5 81.91 2 10 20 1 2 0.5 7 8 9 0 0 0.1 0.2 1e6 {stamp} host 0.1\n"
    )
}
