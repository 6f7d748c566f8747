//! Which reading means "nothing returned": logs of the old format do not say, but they show it.

use std::ops::Range;

use super::{MaxRangeSource, ReadOptions};
use crate::ScanRecord;

/// Readings from this part of a sensor's maximum on mean "nothing returned": a sensor may have several codes for it
/// (81.83 m and 81.91 m), and the maximum a log states may be rounded up.
pub(super) const NO_RETURN_FROM: f32 = 0.99;

/// Where a plateau must stand out from what lies below it, in parts of its range.
const BELOW_PLATEAU: Range<f32> = 0.9..NO_RETURN_FROM;

/// How many times as frequent a plateau must be as all readings above it together (strays), and as the most frequent
/// value just below it (a robot that stands still reads every value again and again).
const PROMINENCE: usize = 4;

/// Fewest identical readings that make a plateau, whatever the size of the log.
const MIN_PLATEAU: usize = 5;

/// One reading in so many must lie on the plateau.
const PLATEAU_SHARE: usize = 10_000;

/// The range at and beyond which the readings of these scans mean "nothing returned", metres: for `range_max_m`.
///
/// A sensor that gets no echo reports its maximum, so that the histogram of readings ends in a plateau. A plateau is one
/// value that makes up at least 5 readings and one in 10 000, and is four times as frequent as all readings above it
/// together (strays) and as any single value from 1 % to 10 % below it. The answer is then 1 % below the plateau.
///
/// Without a plateau every reading is an echo, and the answer is just above the largest finite one (`f32::MAX` if none is
/// positive). If nothing lies below, there is no plateau either: it could be a round room.
#[must_use]
pub fn no_return_range_m(scans: &[ScanRecord]) -> f32 {
    find(scans).0
}

/// Gives the scans their `range_max_m`: the caller's, else the one already stated (finite), else the one the readings show.
///
/// Returns the largest of them and where it comes from.
pub(super) fn settle(scans: &mut [ScanRecord], options: &ReadOptions) -> (f32, MaxRangeSource) {
    if let Some(max_range_m) = options.max_range_m {
        scans.iter_mut().for_each(|scan| scan.header.range_max_m = max_range_m);
        return (max_range_m, MaxRangeSource::Caller);
    }
    let mut source = MaxRangeSource::Stated;
    if scans.iter().any(|scan| scan.header.range_max_m.is_infinite()) {
        let (shown_m, shown_by) = find(scans);
        scans
            .iter_mut()
            .filter(|scan| scan.header.range_max_m.is_infinite())
            .for_each(|scan| scan.header.range_max_m = shown_m);
        source = shown_by;
    }
    (scans.iter().map(|scan| scan.header.range_max_m).fold(0.0, f32::max), source)
}

fn find(scans: &[ScanRecord]) -> (f32, MaxRangeSource) {
    let mut readings_m: Vec<f32> =
        scans.iter().flat_map(|scan| &scan.ranges_m).copied().filter(|&r| r > 0.0 && r.is_finite()).collect();
    readings_m.sort_unstable_by(|a, b| b.total_cmp(a));
    if let Some(plateau_m) = plateau(&readings_m) {
        return (NO_RETURN_FROM * plateau_m, MaxRangeSource::Plateau);
    }
    let largest_m = readings_m.first().copied().unwrap_or(f32::MAX);
    (largest_m.next_up().min(f32::MAX), MaxRangeSource::LargestReading)
}

/// The sensor's maximum among readings sorted downwards, if they show one.
fn plateau(falling_m: &[f32]) -> Option<f32> {
    let mut above = 0;
    for level in falling_m.chunk_by(|a, b| a == b) {
        let below = &falling_m[above + level.len()..];
        if PROMINENCE * above > below.len() + level.len() {
            return None;
        }
        let floor = (falling_m.len() / PLATEAU_SHARE).max(MIN_PLATEAU).max(PROMINENCE * above);
        if level.len() >= floor && !below.is_empty() && level.len() >= PROMINENCE * busiest_below(level[0], below) {
            return Some(level[0]);
        }
        above += level.len();
    }
    None
}

/// How often the most frequent value just below `top_m` occurs.
fn busiest_below(top_m: f32, falling_m: &[f32]) -> usize {
    let near = BELOW_PLATEAU.start * top_m..BELOW_PLATEAU.end * top_m;
    let first = falling_m.partition_point(|&r| r >= near.end);
    let last = falling_m.partition_point(|&r| r >= near.start);
    falling_m[first..last].chunk_by(|a, b| a == b).map(<[f32]>::len).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::{geometry::Pose, scan::ScanHeader};

    fn scan(ranges_m: Vec<f32>) -> ScanRecord {
        ScanRecord {
            header: ScanHeader {
                stamp_ns: 0,
                map_from_sensor: Pose::default(),
                angle_min_rad: 0.0,
                angle_increment_rad: 0.01,
                range_max_m: f32::INFINITY,
                ..ScanHeader::default()
            },
            ranges_m,
        }
    }

    /// Readings of 1.00 m to 21.00 m, each centimetre once.
    fn echoes() -> Vec<f32> {
        (100..=2_100).map(|cm| cm as f32 / 100.0).collect()
    }

    #[test]
    fn a_plateau_at_the_top_is_no_return() {
        for top_m in [81.83, 50.0, 30.0, 21.0, 8.0] {
            let mut ranges_m = echoes();
            ranges_m.iter_mut().for_each(|r| *r = r.min(top_m));
            ranges_m.extend([top_m; 40]);
            ranges_m.extend([f32::NAN, f32::INFINITY, -1.0, 0.0]);
            assert_eq!(find(&[scan(ranges_m)]), (0.99 * top_m, MaxRangeSource::Plateau));
        }
    }

    #[test]
    fn strays_above_the_plateau_do_not_hide_it() {
        let mut ranges_m = echoes();
        ranges_m.extend([81.83; 40]);
        ranges_m.extend([818.3, 91.83, 91.83]);
        assert_eq!(no_return_range_m(&[scan(ranges_m)]), 0.99 * 81.83);
    }

    #[test]
    fn without_a_plateau_every_reading_is_an_echo() {
        let (max_range_m, source) = find(&[scan(echoes())]);
        assert!(max_range_m > 21.0 && max_range_m < 21.000_01);
        assert_eq!(source, MaxRangeSource::LargestReading);
    }

    #[test]
    fn a_robot_that_stands_still_shows_no_plateau() {
        let still: Vec<ScanRecord> = (0..50).map(|_| scan(echoes())).collect();
        assert_eq!(find(&still).1, MaxRangeSource::LargestReading);
    }

    #[test]
    fn one_value_alone_is_no_plateau_and_no_value_no_limit() {
        assert_eq!(find(&[scan(vec![5.0; 180])]).1, MaxRangeSource::LargestReading);
        assert_eq!(no_return_range_m(&[scan(vec![f32::NAN; 3])]), f32::MAX);
        assert_eq!(no_return_range_m(&[]), f32::MAX);
    }

    #[test]
    fn a_caller_overrides_and_a_statement_stays() {
        let mut scans = [scan(echoes()), scan(echoes())];
        scans[0].header.range_max_m = 10.0;
        let (largest_m, source) = settle(&mut scans, &ReadOptions::default());
        assert_eq!((scans[0].header.range_max_m, source), (10.0, MaxRangeSource::LargestReading));
        assert_eq!(scans[1].header.range_max_m, largest_m);
        let asked = ReadOptions { max_range_m: Some(40.0) };
        assert_eq!(settle(&mut scans, &asked), (40.0, MaxRangeSource::Caller));
        assert!(scans.iter().all(|scan| scan.header.range_max_m == 40.0));
    }
}
