//! CARMEN logs, plain or gzip.
#![no_main]

use std::{io::Write, path::Path};

use bhm_core::scan::MAX_BEAMS;
use bhm_fuzz::within;
use bhm_host::dataset::{CarmenLog, MAX_DAMAGE_KEPT, ReadOptions};
use flate2::{Compression, write::GzEncoder};

const LOG: &str = "# CARMEN Logfile\nPARAM laser_max 80\nODOM 1 2 3 0 0 0 1 h 1\n\
FLASER 3 1.25 2.5 81.91 1 2 0.5 1 2 0.5 12.5 h 12.5\nFLASER 2 nan -1 1 2 0.5 1 2 0.5 12.4 h 12.5\n\
ROBOTLASER1 0 -1.5 3.0 1.5 81.92 0.01 0 3 1.25 2.5 81.91 1 7 1 2 0.5 1 2 0.5 0 0 1 1 1 12.6 h 12.6\n";

fn seeds() -> Vec<Vec<u8>> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(LOG.as_bytes()).expect("memory takes everything");
    vec![LOG.as_bytes().to_vec(), packed.finish().expect("memory takes everything")]
}

fn check(bytes: &[u8]) {
    for max_range_m in [None, Some(80.0)] {
        let read = || CarmenLog::read_from(bytes, Path::new("fuzzed"), &ReadOptions { max_range_m });
        // Packed a thousandfold at most; a line of 28 bytes, a scan's fewest, becomes 100, in lists that grow by doubling.
        let Ok(log) = within((4 << 20) + 16_384 * bytes.len(), read) else { continue };
        let report = &log.report;
        assert_eq!(report.lines, report.scans + report.other_lines + report.damaged);
        assert_eq!(report.scans, log.scans.len() as u64);
        assert_eq!(report.damage.len() as u64, report.damaged.min(MAX_DAMAGE_KEPT as u64));
        assert!(!log.scans.is_empty() && log.scans.is_sorted_by(|a, b| a.header.stamp_ns < b.header.stamp_ns));
        for scan in &log.scans {
            assert!((1..=MAX_BEAMS).contains(&scan.ranges_m.len()) && scan.header.map_from_sensor.is_finite());
        }
    }
}

bhm_fuzz::target!(seeds, check);
