//! What every format promises: real logs give what they are known to hold, and no bytes make a reader panic.

use std::error::Error;
use std::path::Path;

use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::test_data::{flaser, gzip, robot_laser};
use super::*;
use bhm_oracle::recorded;

const NAME: &str = "made-up.log";

fn read(bytes: &[u8]) -> Result<ScanLog, DatasetError> {
    CarmenLog::read_from(bytes, Path::new(NAME), &ReadOptions::default())
}

fn read_points(bytes: &[u8]) -> Result<PointLog, DatasetError> {
    PointLog::read_from(bytes, Path::new(NAME))
}

fn short_log() -> String {
    (1..40).map(|i| "ODOM 1 2 3\n".to_owned() + &flaser(&["1.5", "2.25", "81.83"], &i.to_string())).collect()
}

#[test]
fn recorded_scan_logs_give_all_their_scans() {
    for (name, scans, beams, stamps_repaired, top_m) in [
        ("intel-corrected.log.gz", 910, 180, 4, 81.83),
        ("csail-corrected.log.gz", 406, 361, 404, 81.91),
        ("freiburg-campus-corrected.log.gz", 2008, 360, 2007, 81.91),
    ] {
        let Some(path) = recorded(name) else { continue };
        let log = read_log(&path, &ReadOptions::default()).unwrap();
        let report = &log.report;
        let no_return = log.scans.iter().flat_map(|s| &s.ranges_m).filter(|&&r| r >= report.max_range_m).count();
        eprintln!("{name}: {report:?}, {no_return} readings without return of {}", log.scans.len() * beams);
        assert_eq!((log.scans.len(), report.scans, report.damaged), (scans, scans as u64, 0));
        assert_eq!(report.lines, report.scans + report.other_lines);
        assert!(
            log.scans.iter().all(|scan| scan.ranges_m.len() == beams && scan.header.range_max_m == report.max_range_m)
        );
        assert!(log.scans.is_sorted_by(|a, b| a.header.stamp_ns < b.header.stamp_ns));
        assert_eq!(report.stamps_repaired, stamps_repaired);
        assert_eq!((report.max_range_m, report.max_range_source), (0.99 * top_m, MaxRangeSource::Plateau));
    }
}

#[test]
fn recorded_logs_without_their_plateau_show_none() {
    for name in ["intel-corrected.log.gz", "csail-corrected.log.gz", "freiburg-campus-corrected.log.gz"] {
        let Some(path) = recorded(name) else { continue };
        let mut scans = read_log(&path, &ReadOptions::default()).unwrap().scans;
        scans.iter_mut().for_each(|scan| scan.ranges_m.retain(|&r| r < scan.header.range_max_m));
        let largest_m = scans.iter().flat_map(|scan| &scan.ranges_m).copied().fold(0.0, f32::max);
        assert_eq!(no_return_range_m(&scans), largest_m.next_up(), "{name}");
    }
}

#[test]
fn recorded_points_give_all_their_rows() {
    for (name, points) in [("intel-beams-train.csv.gz", 431_124), ("intel-beams-test.csv.gz", 47_760)] {
        let Some(path) = recorded(name) else { continue };
        let log = PointLog::read(&path).unwrap();
        assert_eq!((log.report.points, log.report.rows, log.report.damaged), (points, points, 0));
        assert_eq!(log.scans.iter().map(|scan| scan.points_m.len() as u64).sum::<u64>(), points);
        assert!(log.scans.iter().all(|scan| scan.points_m.len() == scan.occupied.len()));
        assert!(log.scans.is_sorted_by(|a, b| a.scan < b.scan), "one run per scan");
    }
}

#[test]
fn the_front_door_goes_by_content_not_by_name() {
    let directory = tempfile::tempdir().unwrap();
    for (name, bytes) in [("plain.gz", short_log().into_bytes()), ("packed.txt", gzip(short_log().as_bytes()))] {
        let path = directory.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(read_log(&path, &ReadOptions::default()).unwrap().scans.len(), 39);
    }
}

#[test]
fn the_front_door_says_what_it_found_instead() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("what.log");
    for (bytes, found) in [
        (&b""[..], "an empty file"),
        (b"\0\x01\x02\x03", "binary data"),
        (b"scan,x,y,label\n1,0,0,1\n", "comma-separated values beginning with `scan,x,y,label`"),
    ] {
        std::fs::write(&path, bytes).unwrap();
        let message = read_log(&path, &ReadOptions::default()).unwrap_err().to_string();
        assert_eq!(message, format!("{}: expected a CARMEN log, found {found}", path.display()));
    }
    std::fs::write(&path, [0x1f, 0x8b, 8, 0]).unwrap();
    let error = read_log(&path, &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("what.log") && error.source().is_some(), "{error}");
    let absent = read_log(&directory.path().join("absent"), &ReadOptions::default()).unwrap_err();
    assert!(matches!(absent, DatasetError::Unreadable { .. }));
    let folder = read_log(directory.path(), &ReadOptions::default()).unwrap_err();
    assert!(matches!(folder, DatasetError::Unreadable { .. }));
}

#[test]
fn a_cut_gzip_stream_keeps_what_came_before() {
    let mut noise = 1_u32;
    let log: String = (1..2_000)
        .map(|i| {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            flaser(&["1.5", &format!("{}", noise % 5_000)], &i.to_string())
        })
        .collect();
    let packed = gzip(log.as_bytes());
    let cut = read(&packed[..packed.len() / 2]).unwrap();
    let whole = read(&packed).unwrap();
    assert_eq!(whole.report.damaged, 0);
    assert!(cut.scans.len() > 500 && cut.scans.len() < whole.scans.len());
    assert_eq!(cut.report.damaged, 1);
    assert!(matches!(cut.report.damage[0].reason, DamageReason::Unreadable { .. }));
    assert_eq!(cut.report.damage[0].line, cut.report.lines);
    assert!(matches!(read(&packed[..12]), Err(DatasetError::Unreadable { .. })));

    let rows: String = (0..2_000).map(|i| format!("{i},{},0.5,1\n", i * 7_919 % 1_000)).collect();
    let packed = gzip(format!("scan,x,y,label\n{rows}").as_bytes());
    let cut = read_points(&packed[..packed.len() / 2]).unwrap();
    assert_eq!((cut.report.damaged, cut.report.rows), (1, cut.report.points + 1));
    assert!(matches!(read_points(&packed[..12]), Err(DatasetError::Unreadable { .. })));
}

fn seeded(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, rng_seed: RngSeed::Fixed(0x6268_6d01), failure_persistence: None, ..Default::default() }
}

/// What must hold of any log that was read at all.
fn assert_consistent(result: Result<ScanLog, DatasetError>) {
    let Ok(ScanLog { scans, report }) = result else { return };
    assert_eq!(report.scans, scans.len() as u64);
    assert_eq!(report.lines, report.scans + report.other_lines + report.damaged);
    assert_eq!(report.damage.len() as u64, report.damaged.min(MAX_DAMAGE_KEPT as u64));
    assert!(!scans.is_empty() && scans.is_sorted_by(|a, b| a.header.stamp_ns < b.header.stamp_ns));
    assert!(scans.iter().all(|scan| scan.header.map_from_sensor.is_finite() && scan.header.range_max_m > 0.0));
}

proptest! {
    #![proptest_config(seeded(512))]

    #[test]
    fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..2_000)) {
        assert_consistent(read(&bytes));
        assert_consistent(read(&[&b"\x1f\x8b\x08\0\0\0\0\0\0\x03"[..], &bytes].concat()));
        assert_consistent(read(&[short_log().as_bytes(), &bytes].concat()));
        let _ = read_points(&bytes);
        let _ = read_points(&[b"scan,x,y,label\n1,2,3,1\n", &bytes[..]].concat()).unwrap();
    }

    #[test]
    fn flipped_bits_are_survived(flips in prop::collection::vec((any::<prop::sample::Index>(), 0..8_u8), 1..60)) {
        let log = short_log() + &robot_laser("81.92", "50").repeat(20);
        for mut bytes in [log.clone().into_bytes(), gzip(log.as_bytes())] {
            for (index, bit) in &flips {
                let at = index.index(bytes.len());
                bytes[at] ^= 1 << bit;
            }
            assert_consistent(read(&bytes));
            let _ = read_points(&bytes);
        }
    }

    #[test]
    fn a_log_cut_anywhere_gives_its_whole_lines(at in any::<prop::sample::Index>()) {
        let log = short_log();
        let cut = &log.as_bytes()[..at.index(log.len())];
        let whole_scans = cut.split(|&b| b == b'\n').filter(|line| line.ends_with(b"host 0.1")).count();
        match read(cut) {
            Ok(log) => assert!(log.scans.len() == whole_scans || log.scans.len() == whole_scans + 1),
            Err(_) => assert_eq!(whole_scans, 0),
        }
        assert_consistent(read(cut));
    }

    #[test]
    fn what_is_written_is_read_back(
        scans in prop::collection::vec((prop::collection::vec(any::<f32>(), 1..400), any::<[i16; 3]>()), 1..6),
    ) {
        let lines = scans.iter().enumerate().map(|(i, (ranges_m, [x, y, theta]))| {
            let ranges: Vec<String> = ranges_m.iter().map(f32::to_string).collect();
            format!("FLASER {} {} {x} {y} {theta} 0 0 0 {i} host {i}\r\n", ranges.len(), ranges.join(" "))
        });
        let log = read(lines.collect::<String>().as_bytes()).unwrap();
        assert_eq!(log.report.damaged, 0);
        for (i, (record, (ranges_m, pose))) in log.scans.iter().zip(&scans).enumerate() {
            assert!(record.ranges_m.iter().zip(ranges_m).all(|(a, b)| a == b || (a.is_nan() && b.is_nan())));
            assert_eq!([record.header.map_from_sensor.x_m, record.header.map_from_sensor.y_m, record.header.map_from_sensor.theta_rad], pose.map(f32::from));
            assert_eq!(record.header.stamp_ns, i as u64 * 1_000_000_000);
        }
    }
}
