//! Labelled points: what a scan says about single places, prepared to compare methods on the very same data.
//!
//! A row is four plain numbers, never quoted; read line by line, its number in the file is exact and its length bounded,
//! which a general CSV reader grants neither after empty lines nor in junk.

use std::io::BufRead;
use std::path::Path;

use super::DatasetError;
use super::damage::{Damage, DamageReason};
use super::input::{self, Lines};

const HEADER: [&str; 4] = ["scan", "x", "y", "label"];

/// Longest line that is read, bytes; a row is four short numbers.
const MAX_LINE_BYTES: usize = 1_024;

const EXPECTED: &str = "labelled points: a header line `scan,x,y,label` and at least one usable row";

/// The labelled points of one scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabelledPoints {
    /// Number of the scan, as the file has it.
    pub scan: u64,
    /// Places in the map, metres.
    pub points_m: Vec<[f32; 2]>,
    /// For each place whether something was hit there (label 1) or it was free (label 0).
    pub occupied: Vec<bool>,
}

/// A file of labelled points: comma-separated values with the header `scan,x,y,label`.
#[derive(Clone, Debug, PartialEq)]
pub struct PointLog {
    /// Runs of rows with the same scan number, in file order; a number that comes back later starts a new run.
    pub scans: Vec<LabelledPoints>,
    /// What was read and skipped.
    pub report: PointReport,
}

/// How reading labelled points went. `rows` is the sum of `points` and `damaged`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointReport {
    /// Rows seen, the header not counted.
    pub rows: u64,
    /// Rows that gave a point.
    pub points: u64,
    /// Rows that were skipped because they are damaged.
    pub damaged: u64,
    /// The first [`MAX_DAMAGE_KEPT`](super::MAX_DAMAGE_KEPT) of them.
    pub damage: Vec<Damage>,
}

impl PointLog {
    /// Reads a file, plain or gzip.
    ///
    /// # Errors
    /// When the file cannot be read, has another header, or holds no usable row.
    pub fn read(path: &Path) -> Result<Self, DatasetError> {
        Self::read_from(input::open(path)?, path)
    }

    /// Reads labelled points, plain or gzip, from any source; `name` stands for it in messages.
    ///
    /// # Errors
    /// As for [`read`](Self::read).
    pub fn read_from(reader: impl BufRead, name: &Path) -> Result<Self, DatasetError> {
        let unreadable = |source| DatasetError::unreadable(name, source);
        let reader = input::plain_or_gzip(reader).map_err(unreadable)?;
        let mut lines = Lines::new(reader, MAX_LINE_BYTES).map_err(unreadable)?;
        if !lines.next().is_some_and(is_header) {
            return Err(lines.into_error(name, EXPECTED));
        }
        let mut scans = Vec::new();
        let mut points = 0;
        while let Some(line) = lines.next() {
            if line.trim().is_empty() {
                continue;
            }
            match parse(line) {
                Ok(point) => {
                    append(&mut scans, point);
                    points += 1;
                }
                Err(reason) => lines.damaged(reason),
            }
        }
        if scans.is_empty() {
            return Err(lines.into_error(name, EXPECTED));
        }
        let damaged = lines.damage.total;
        Ok(Self { scans, report: PointReport { rows: points + damaged, points, damaged, damage: lines.damage.kept } })
    }
}

/// Whether a line is the header; a byte order mark, as spreadsheets write it, may precede it.
fn is_header(line: &str) -> bool {
    line.trim_start_matches('\u{feff}').split(',').map(str::trim).eq(HEADER)
}

/// One row.
#[derive(Clone, Copy)]
struct Point {
    scan: u64,
    place_m: [f32; 2],
    occupied: bool,
}

/// Adds a point to the last run, or to a new one if the scan is another.
fn append(scans: &mut Vec<LabelledPoints>, point: Point) {
    if scans.last().is_none_or(|run| run.scan != point.scan) {
        scans.push(LabelledPoints { scan: point.scan, ..LabelledPoints::default() });
    }
    if let Some(run) = scans.last_mut() {
        run.points_m.push(point.place_m);
        run.occupied.push(point.occupied);
    }
}

fn parse(row: &str) -> Result<Point, DamageReason> {
    let mut fields = row.split(',').map(str::trim);
    let mut next = |field| fields.next().ok_or(DamageReason::MissingField { field }).map(|text| (field, text));
    let [scan, x, y, label] = [next("scan")?, next("x")?, next("y")?, next("label")?];
    if fields.next().is_some() {
        return Err(DamageReason::TooManyFields);
    }
    let metres = |(field, text): (&'static str, &str)| {
        let value = text.parse().ok().filter(|value: &f32| value.is_finite());
        value.ok_or_else(|| DamageReason::bad_field(field, "a finite number", text))
    };
    Ok(Point {
        scan: scan.1.parse().map_err(|_| DamageReason::bad_field(scan.0, "a whole number", scan.1))?,
        place_m: [metres(x)?, metres(y)?],
        occupied: match label.1 {
            "0" => false,
            "1" => true,
            _ => return Err(DamageReason::bad_field(label.0, "0 or 1", label.1)),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: impl AsRef<[u8]>) -> Result<PointLog, DatasetError> {
        PointLog::read_from(text.as_ref(), Path::new("made-up.csv"))
    }

    #[test]
    fn rows_are_grouped_by_runs() {
        let log = read("scan, x ,y,label\r\n4,1,2,1\r\n4,-1.5,2e1,0\n\n2,0,0,1\n4,0,1,0").unwrap();
        assert_eq!(
            log.scans,
            [
                LabelledPoints { scan: 4, points_m: vec![[1.0, 2.0], [-1.5, 20.0]], occupied: vec![true, false] },
                LabelledPoints { scan: 2, points_m: vec![[0.0, 0.0]], occupied: vec![true] },
                LabelledPoints { scan: 4, points_m: vec![[0.0, 1.0]], occupied: vec![false] },
            ]
        );
        assert_eq!(log.report, PointReport { rows: 4, points: 4, ..PointReport::default() });
    }

    #[test]
    fn every_damaged_row_is_named_with_its_reason() {
        let rows: [(&[u8], &str); 8] = [
            (b"1,2,3", "ends before the field label"),
            (b"1,2,3,0,5", "has more fields than its kind allows"),
            (b"-1,2,3,0", "field scan: expected a whole number, found `-1`"),
            (b"1,x,3,0", "field x: expected a finite number, found `x`"),
            (b"1,2,nan,0", "field y: expected a finite number, found `nan`"),
            (b"1,2,3,2", "field label: expected 0 or 1, found `2`"),
            (b"1,2,\xff,0", "is not UTF-8 text"),
            (b"\"1,2,3,0", "field scan: expected a whole number, found `\"1`"),
        ];
        let mut text = b"scan,x,y,label\n0,0,0,0\n\n".to_vec();
        for (row, _) in rows {
            text.extend([row, b"\n"].concat());
        }
        let report = read(text).unwrap().report;
        let said: Vec<String> = report.damage.iter().map(ToString::to_string).collect();
        let expected: Vec<String> = (4..).zip(rows).map(|(line, (_, why))| format!("line {line}: {why}")).collect();
        assert_eq!(said, expected);
        assert_eq!((report.rows, report.points, report.damaged), (9, 1, 8));
    }

    #[test]
    fn another_header_or_no_row_is_an_error_that_names_the_expected_one() {
        for (text, found) in [
            ("", "an empty file"),
            ("x,y,label\n1,2,0\n", "comma-separated values beginning with `x,y,label`"),
            ("FLASER 1 2", "text beginning with `FLASER 1 2`"),
            ("scan,x,y,label\n", "comma-separated values beginning with `scan,x,y,label`"),
        ] {
            let message = read(text).unwrap_err().to_string();
            assert_eq!(message, format!("made-up.csv: expected {EXPECTED}, found {found}"));
        }
    }
}
