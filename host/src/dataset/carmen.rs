//! CARMEN logs: one message per line, fields separated by blanks, metres and radians.
//!
//! | message | fields |
//! |---|---|
//! | `FLASER` | n, n ranges, laser x y theta, odometry x y theta |
//! | `ROBOTLASER1` | laser_type start_angle field_of_view angular_resolution maximum_range accuracy remission_mode, n, n ranges, m, m remissions, laser x y theta, robot x y theta, tv rv forward_safety side_safety turn_axis |
//!
//! each followed by ipc_timestamp, host and logger_timestamp. All fields must be there, and no more: a wrong n would otherwise
//! pass ranges off as a pose.

use std::f32::consts::{FRAC_PI_2, PI};
use std::io::BufRead;
use std::path::Path;

use bhm_core::geometry::Pose;
use bhm_core::scan::{MAX_BEAMS, ScanHeader};

use super::damage::DamageReason;
use super::input::{self, Lines};
use super::max_range::{self, NO_RETURN_FROM};
use super::stamps::StampRepair;
use super::{DatasetError, ReadOptions, ReadReport, ScanFormat, ScanLog};
use crate::ScanRecord;

/// Longest line that is read, bytes: as many ranges and remissions as a scan may have beams, at 32 bytes each, and ample
/// room for the rest.
const MAX_LINE_BYTES: usize = MAX_BEAMS * 2 * 32 + 4_096;

/// Shortest range of a scan, metres. The format does not say, but it writes centimetres, and a zero is a failed reading.
const RANGE_MIN_M: f32 = 0.01;

/// What a damage report says was expected of a count.
const READINGS: &str = "1 to 2048";
const REMISSIONS: &str = "0 to 2048";
const _: () = assert!(MAX_BEAMS == 2_048, "READINGS and REMISSIONS name it");

/// How the lines of a CARMEN log begin.
const KEYWORDS: [&[u8]; 12] = [
    b"# CARMEN",
    b"FLASER",
    b"RLASER",
    b"LASER",
    b"ROBOTLASER",
    b"RAWLASER",
    b"ODOM",
    b"PARAM",
    b"SYNC",
    b"NEFF",
    b"TRUEPOS",
    b"NMEA",
];

const EXPECTED: &str = "a CARMEN log with at least one usable FLASER or ROBOTLASER1 line";

/// The CARMEN log format, of which `FLASER` and `ROBOTLASER1` messages are read.
///
/// `FLASER` does not state bearings: its n beams spread over 180°, the first at 90° to the right; the step is 180°/(n−1) for
/// odd n and 180°/n for even n (so 1° for 180 and 181 beams, 0.5° for 360 and 361), and a single beam looks ahead.
/// Nor does it state the sensor's maximum, see [`no_return_range_m`](super::no_return_range_m); `ROBOTLASER1` states both.
#[derive(Clone, Copy, Debug)]
pub struct CarmenLog;

impl CarmenLog {
    /// Reads a log, plain or gzip, from any source; `name` stands for it in messages.
    ///
    /// # Errors
    /// When the log cannot be read or holds no usable scan; when an option makes no sense.
    pub fn read_from(reader: impl BufRead, name: &Path, options: &ReadOptions) -> Result<ScanLog, DatasetError> {
        let mut reader = input::plain_or_gzip(reader).map_err(|source| DatasetError::unreadable(name, source))?;
        ScanFormat::read(&Self, &mut reader, name, options)
    }
}

impl ScanFormat for CarmenLog {
    fn name(&self) -> &'static str {
        "a CARMEN log"
    }

    fn recognises(&self, head: &[u8]) -> bool {
        let mut lines = head.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii_start);
        lines.any(|line| KEYWORDS.iter().any(|&keyword| line.starts_with(keyword)))
    }

    fn read(&self, reader: &mut dyn BufRead, path: &Path, options: &ReadOptions) -> Result<ScanLog, DatasetError> {
        options.check()?;
        let unreadable = |source| DatasetError::unreadable(path, source);
        let mut lines = Lines::new(reader, MAX_LINE_BYTES).map_err(unreadable)?;
        let mut scans = Vec::new();
        let mut stamps = StampRepair::default();
        let mut other_lines = 0;
        while let Some(line) = lines.next() {
            match parse(line) {
                Ok(Some(ParsedScan { mut record, stamp_s })) => {
                    record.header.stamp_ns = stamps.next_ns(stamp_s);
                    scans.push(record);
                }
                Ok(None) => other_lines += 1,
                Err(reason) => lines.damaged(reason),
            }
        }
        if scans.is_empty() {
            return Err(lines.into_error(path, EXPECTED));
        }

        let (max_range_m, max_range_source) = max_range::settle(&mut scans, options);
        let report = ReadReport {
            lines: lines.count,
            scans: scans.len() as u64,
            other_lines,
            damaged: lines.damage.total,
            damage: lines.damage.kept,
            stamps_repaired: stamps.repaired,
            max_range_m,
            max_range_source,
        };
        Ok(ScanLog { scans, report })
    }
}

/// A scan as its line gives it: the stamp not yet in order, `range_max_m` infinite where the line does not state one.
struct ParsedScan {
    record: ScanRecord,
    stamp_s: f64,
}

/// The scan of a line, `None` for a line of another kind.
fn parse(line: &str) -> Result<Option<ParsedScan>, DamageReason> {
    let mut fields = Fields(line.split_ascii_whitespace());
    match fields.0.next() {
        Some("FLASER") => flaser(&mut fields).map(Some),
        Some("ROBOTLASER1") => robot_laser(&mut fields).map(Some),
        _ => Ok(None),
    }
}

fn flaser(fields: &mut Fields<'_>) -> Result<ParsedScan, DamageReason> {
    let ranges_m = fields.ranges()?;
    let (angle_min_rad, angle_increment_rad) = flaser_bearings(ranges_m.len());
    let map_from_sensor = fields.pose()?;
    fields.skip(3, "odometry pose")?;
    let stamp_s = fields.stamp_and_end()?;
    let header = header(map_from_sensor, angle_min_rad, angle_increment_rad);
    Ok(ParsedScan { record: ScanRecord { header, ranges_m }, stamp_s })
}

/// The header of a scan whose line states no maximum range.
fn header(map_from_sensor: Pose, angle_min_rad: f32, angle_increment_rad: f32) -> ScanHeader {
    let (range_min_m, range_max_m) = (RANGE_MIN_M, f32::INFINITY);
    let header = ScanHeader::default();
    ScanHeader { map_from_sensor, angle_min_rad, angle_increment_rad, range_min_m, range_max_m, ..header }
}

/// Bearing of the first beam and step, radians, of a `FLASER` line with this many beams.
fn flaser_bearings(beams: usize) -> (f32, f32) {
    match beams {
        1 => (0.0, PI),
        odd if odd % 2 == 1 => (-FRAC_PI_2, PI / (odd - 1) as f32),
        even => (-FRAC_PI_2, PI / even as f32),
    }
}

fn robot_laser(fields: &mut Fields<'_>) -> Result<ParsedScan, DamageReason> {
    fields.skip(1, "laser_type")?;
    let angle_min_rad = fields.finite("start_angle")?;
    fields.skip(1, "field_of_view")?;
    let angle_increment_rad =
        fields.parsed("angular_resolution", "a step in radians", |step: &f32| step.is_normal())?;
    let stated_max_m: f32 = fields.parsed("maximum_range", "a number", |_| true)?;
    fields.skip(2, "accuracy and remission_mode")?;
    let ranges_m = fields.ranges()?;
    let remissions = fields.parsed("num_remissions", REMISSIONS, |count| *count <= MAX_BEAMS)?;
    fields.skip(remissions, "remission")?;
    let map_from_sensor = fields.pose()?;
    fields.skip(3, "robot_pose")?;
    fields.skip(5, "laser_tv to turn_axis")?;
    let stamp_s = fields.stamp_and_end()?;
    let mut header = header(map_from_sensor, angle_min_rad, angle_increment_rad);
    if stated_max_m.is_finite() && stated_max_m > 0.0 {
        header.range_max_m = NO_RETURN_FROM * stated_max_m;
    }
    Ok(ParsedScan { record: ScanRecord { header, ranges_m }, stamp_s })
}

/// The fields of a line, taken one by one.
struct Fields<'a>(std::str::SplitAsciiWhitespace<'a>);

impl<'a> Fields<'a> {
    fn next(&mut self, field: &'static str) -> Result<&'a str, DamageReason> {
        self.0.next().ok_or(DamageReason::MissingField { field })
    }

    fn skip(&mut self, count: usize, field: &'static str) -> Result<(), DamageReason> {
        (0..count).try_for_each(|_| self.next(field).map(drop))
    }

    fn parsed<T: std::str::FromStr>(
        &mut self,
        field: &'static str,
        expected: &'static str,
        usable: impl Fn(&T) -> bool,
    ) -> Result<T, DamageReason> {
        let text = self.next(field)?;
        text.parse().ok().filter(usable).ok_or_else(|| DamageReason::bad_field(field, expected, text))
    }

    fn finite(&mut self, field: &'static str) -> Result<f32, DamageReason> {
        self.parsed(field, "a finite number", |value: &f32| value.is_finite())
    }

    /// A count and as many ranges. What a range may be is the core's business: NaN and negative ones pass.
    fn ranges(&mut self) -> Result<Vec<f32>, DamageReason> {
        let count = self.parsed("num_readings", READINGS, |count| (1..=MAX_BEAMS).contains(count))?;
        (0..count).map(|_| self.parsed("range", "a number", |_| true)).collect()
    }

    fn pose(&mut self) -> Result<Pose, DamageReason> {
        Ok(Pose::new(self.finite("laser x")?, self.finite("laser y")?, self.finite("laser theta")?))
    }

    /// The stamp in seconds, and what ends every line.
    fn stamp_and_end(&mut self) -> Result<f64, DamageReason> {
        let stamp_s = self.parsed("ipc_timestamp", "a number", |_| true)?;
        self.skip(1, "host")?;
        self.skip(1, "logger_timestamp")?;
        if self.0.next().is_some() { Err(DamageReason::TooManyFields) } else { Ok(stamp_s) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_data::{flaser, robot_laser};
    use super::super::{Damage, MaxRangeSource};
    use super::*;

    fn read(log: impl AsRef<[u8]>) -> Result<ScanLog, DatasetError> {
        CarmenLog::read_from(log.as_ref(), Path::new("made-up.log"), &ReadOptions::default())
    }

    #[test]
    fn old_messages_spread_their_beams_over_half_a_turn() {
        let one_degree = 1_f32.to_radians();
        for (beams, step_rad) in
            [(180, one_degree), (181, one_degree), (360, one_degree / 2.0), (361, one_degree / 2.0)]
        {
            let scan = &read(flaser(&vec!["1.5"; beams], "12.5")).unwrap().scans[0];
            assert_eq!((scan.ranges_m.len(), scan.header.angle_min_rad), (beams, -FRAC_PI_2));
            assert!((scan.header.angle_increment_rad - step_rad).abs() < 1e-9);
        }
        assert_eq!(flaser_bearings(1), (0.0, PI));
        assert_eq!(flaser_bearings(3), (-FRAC_PI_2, FRAC_PI_2));
        assert_eq!(flaser_bearings(2), (-FRAC_PI_2, FRAC_PI_2));
    }

    #[test]
    fn the_pose_is_the_laser_s_and_the_stamp_the_robot_s() {
        for line in [flaser(&["1.25", "2.5", "81.91"], "12.5"), robot_laser("81.92", "12.5")] {
            let scan = &read(line).unwrap().scans[0];
            assert_eq!(scan.header.map_from_sensor, Pose::new(1.0, 2.0, 0.5));
            assert_eq!(scan.header.stamp_ns, 12_500_000_000);
            assert_eq!(scan.ranges_m, [1.25, 2.5, 81.91]);
        }
    }

    #[test]
    fn new_messages_state_bearings_and_maximum() {
        let log = read(robot_laser("81.92", "1")).unwrap();
        let scan = &log.scans[0];
        assert_eq!((scan.header.angle_min_rad, scan.header.angle_increment_rad), (-1.5, 1.5));
        assert_eq!((scan.header.range_max_m, log.report.max_range_source), (0.99 * 81.92, MaxRangeSource::Stated));
        let unstated = read(robot_laser("0", "1")).unwrap();
        assert_eq!(unstated.report.max_range_source, MaxRangeSource::LargestReading);
    }

    #[test]
    fn a_caller_s_maximum_must_be_a_range() {
        for max_range_m in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let options = ReadOptions { max_range_m: Some(max_range_m) };
            let error = CarmenLog::read_from(flaser(&["1"], "1").as_bytes(), Path::new("x"), &options).unwrap_err();
            assert!(matches!(error, DatasetError::BadMaxRange { .. }));
        }
    }

    #[test]
    fn ranges_are_passed_on_as_they_are() {
        let scan = &read(flaser(&["nan", "inf", "-nan", "-1", "1e400", "0"], "1")).unwrap().scans[0];
        assert!(scan.ranges_m[0].is_nan() && scan.ranges_m[2].is_nan());
        assert_eq!(scan.ranges_m[3..], [-1.0, f32::INFINITY, 0.0]);
    }

    #[test]
    fn every_damaged_line_is_named_with_its_reason() {
        let too_many = flaser(&vec!["1"; MAX_BEAMS + 1], "1");
        let lines: [(&[u8], &str); 12] = [
            (b"FLASER", "ends before the field num_readings"),
            (b"FLASER 0 1 2 3 4 5 6 7 h 8", "field num_readings: expected 1 to 2048, found `0`"),
            (b"FLASER -4 1", "field num_readings: expected 1 to 2048, found `-4`"),
            (b"FLASER 99999999999999999999 1", "field num_readings: expected 1 to 2048, found `99999999999999999999`"),
            (too_many.trim().as_bytes(), "field num_readings: expected 1 to 2048, found `2049`"),
            (b"FLASER 2 1 x 1 2 3 4 5 6 7 h 8", "field range: expected a number, found `x`"),
            (b"FLASER 2 1 1 1 nan 3 4 5 6 7 h 8", "field laser y: expected a finite number, found `nan`"),
            (b"FLASER 2 1 1 1 2 3 4 5", "ends before the field odometry pose"),
            (b"FLASER 2 1 1 1 2 3 4 5 6 h 7 8", "field ipc_timestamp: expected a number, found `h`"),
            (b"FLASER 1 1 1 2 3 4 5 6 7 h 8 9", "has more fields than its kind allows"),
            (
                b"ROBOTLASER1 0 -1.5 3.0 0 80 0.01 0 1 1 0",
                "field angular_resolution: expected a step in radians, found `0`",
            ),
            (b"FLASER 1 \xff", "is not UTF-8 text"),
        ];
        let mut log = flaser(&["1"], "1").into_bytes();
        for (line, _) in lines {
            log.extend([line, b"\n"].concat());
        }
        let report = read(log).unwrap().report;
        let said: Vec<String> = report.damage.iter().map(ToString::to_string).collect();
        let expected: Vec<String> = (2..).zip(lines).map(|(line, (_, why))| format!("line {line}: {why}")).collect();
        assert_eq!(said, expected);
        assert_eq!((report.lines, report.scans, report.damaged, report.other_lines), (13, 1, 12, 0));
    }

    #[test]
    fn a_line_without_end_is_passed_over() {
        let log = format!("{}\n{}", "FLASER ".repeat(MAX_LINE_BYTES), flaser(&["1"], "1"));
        let report = read(log).unwrap().report;
        assert_eq!(report.damage, [Damage { line: 1, reason: DamageReason::TooLong { limit: MAX_LINE_BYTES } }]);
        assert_eq!(report.scans, 1);
    }

    #[test]
    fn other_lines_are_counted() {
        let log = format!("# CARMEN Logfile\n\nODOM 1 2\nRAWLASER1 x\nFLASERS 1\n{}", flaser(&["1"], "1"));
        let report = read(log).unwrap().report;
        assert_eq!((report.lines, report.other_lines, report.damaged), (6, 5, 0));
    }

    #[test]
    fn a_log_that_is_all_damaged_says_where_it_starts() {
        assert_eq!(
            read("ODOM 1\nFLASER 2 1 2\nFLASER 3\n").unwrap_err().to_string(),
            "made-up.log: expected a CARMEN log with at least one usable FLASER or ROBOTLASER1 line, found text beginning \
             with `ODOM 1`; 2 damaged, the first: line 2: ends before the field laser x"
        );
    }
}
