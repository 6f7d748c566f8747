//! How tests make damaged logs.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;

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
