//! How reading recorded data went, said on standard error.

use std::path::Path;

use bhm_host::{
    ScanRecord,
    dataset::{Damage, MaxRangeSource, PointReport, ReadReport},
};
use tracing::{info, warn};

/// Damaged lines that are quoted; all are counted.
pub const DAMAGE_SHOWN: usize = 10;

/// Says how reading a scan log went.
pub fn scan_log(path: &Path, report: &ReadReport) {
    let file = path.display();
    damage(path, report.damaged, &report.damage);
    if report.stamps_repaired > 0 {
        warn!(
            "{file}: {} stamps were unusable or not later than the one before; made 1 ns later",
            report.stamps_repaired
        );
    }
    info!(
        "{file}: {} scans in {} lines; maximum range {} m ({})",
        report.scans,
        report.lines,
        report.max_range_m,
        source(report.max_range_source)
    );
}

/// Seconds from the first scan to the last, where the stamps are the recorder's own.
pub fn recorded_s(scans: &[ScanRecord], report: &ReadReport) -> Option<f64> {
    // Repaired stamps are nanoseconds apart: a few do no harm, many say nothing about time.
    let real = report.stamps_repaired * 10 < report.scans;
    let span_ns =
        scans.last().zip(scans.first()).map_or(0, |(last, first)| last.header.stamp_ns - first.header.stamp_ns);
    (real && span_ns > 0).then(|| span_ns as f64 / 1e9)
}

/// Says how reading labelled points went.
pub fn point_log(path: &Path, report: &PointReport) {
    damage(path, report.damaged, &report.damage);
    info!("{}: {} points", path.display(), report.points);
}

fn damage(path: &Path, total: u64, kept: &[Damage]) {
    for damage in kept.iter().take(DAMAGE_SHOWN) {
        warn!("{}: {damage}; skipped", path.display());
    }
    if total > 0 {
        warn!("{}: {total} damaged lines skipped", path.display());
    }
}

/// Where a maximum range comes from, in words.
pub fn source(source: MaxRangeSource) -> &'static str {
    match source {
        MaxRangeSource::Caller => "given",
        MaxRangeSource::Stated => "stated in the log",
        MaxRangeSource::Plateau => "found from the log: 1 % below the plateau of readings without return",
        MaxRangeSource::LargestReading => "found from the log: just above its largest reading, every one is an echo",
    }
}
