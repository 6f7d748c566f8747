//! Labelled points, plain or gzip.
#![no_main]

use std::{fmt::Write as _, io::Write, path::Path};

use bhm_fuzz::within;
use bhm_host::dataset::{MAX_DAMAGE_KEPT, PointLog};
use flate2::{Compression, write::GzEncoder};

const POINTS: &str = "scan,x,y,label\n4,1,2,1\n4,-1.5,2e1,0\n\n2,0,0,1\n1,2,nan,0\n";

fn seeds() -> Vec<Vec<u8>> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(POINTS.as_bytes()).expect("memory takes everything");
    vec![POINTS.as_bytes().to_vec(), packed.finish().expect("memory takes everything")]
}

fn read(bytes: &[u8]) -> Option<PointLog> {
    PointLog::read_from(bytes, Path::new("fuzzed")).ok()
}

fn check(bytes: &[u8]) {
    // Packed a thousandfold at most; a row of 8 bytes becomes a list of its own if its scan is another.
    let Some(log) = within((4 << 20) + 32_768 * bytes.len(), || read(bytes)) else { return };
    let report = &log.report;
    assert_eq!(report.rows, report.points + report.damaged);
    assert_eq!(report.damage.len() as u64, report.damaged.min(MAX_DAMAGE_KEPT as u64));
    let mut rows = "scan,x,y,label\n".to_owned();
    let mut points = 0;
    for run in &log.scans {
        assert!(!run.points_m.is_empty() && run.points_m.len() == run.occupied.len());
        for ([x, y], occupied) in run.points_m.iter().zip(&run.occupied) {
            points += 1;
            writeln!(rows, "{},{x:e},{y:e},{}", run.scan, u8::from(*occupied)).expect("memory takes everything");
        }
    }
    assert_eq!(points, report.points);
    assert_eq!(read(rows.as_bytes()).expect("written as the format is").scans, log.scans);
}

bhm_fuzz::target!(seeds, check);
