//! Whatever a sensor sends: dropped and counted, or rejected, and nothing that was refused leaves a trace in the map.

mod common;

use bhm_core::{
    beam::{BeamLimits, BeamTally, Observation},
    geometry::{Point, Pose, PoseCovariance},
    lattice::MAX_NODE,
    map::Map as _,
    profile::{COMPACT, Capacities, Profile},
    scan::ScanRejected,
    scan::{MAX_BEAMS, ScanHeader},
    settings::Settings,
};
use bhm_host::{ScanRecord, map::OwnedMapper};
use common::{labelled, posterior_bits};

type Map = OwnedMapper<144, 40>;

fn open() -> Map {
    Map::new(&COMPACT).unwrap()
}

/// Every number of every tile, and the counters: two maps with the same are the same map.
fn state(map: &Map) -> (u64, u64, Vec<u32>) {
    let mut bits = Vec::new();
    for tile in map.mapper().tiles().iter() {
        bits.extend(tile.index.map(|i| i as u32));
        bits.extend([tile.updates as u32, tile.touched_at as u32]);
        bits.extend(posterior_bits(&tile.posterior));
    }
    (map.mapper().scans(), map.mapper().newest_stamp_ns(), bits)
}

/// A scan of a round room.
fn good(stamp_ns: u64) -> ScanRecord {
    ScanRecord {
        header: ScanHeader {
            stamp_ns,
            map_from_sensor: Pose::new(0.3, -0.2, 0.7),
            angle_min_rad: -3.0,
            angle_increment_rad: 0.1,
            range_min_m: 0.1,
            range_max_m: 20.0,
            ..ScanHeader::default()
        },
        ranges_m: (0..60).map(|i| 3.0 + 0.01 * i as f32).collect(),
    }
}

#[test]
fn bad_ranges_are_counted_and_leave_no_trace() {
    let (mut dirty, mut clean) = (open(), open());
    for stamp in 1..4 {
        let mut scan = good(stamp);
        let bad = [
            (0, f32::NAN),
            (7, -f32::NAN),
            (8, -1.0),
            (9, f32::NEG_INFINITY),
            (20, -f32::MIN_POSITIVE),
            (30, 0.05),
            (31, 0.0),
            (40, f32::INFINITY),
            (41, 1e30),
            (42, 20.0),
            (59, f32::NAN),
        ];
        // A missing return teaches nothing under these settings, so this is the scan without those beams.
        let mut without = scan.clone();
        for (beam, range_m) in bad {
            scan.ranges_m[beam] = range_m;
            without.ranges_m[beam] = 20.0;
        }
        let report = dirty.integrate(&scan.as_scan()).unwrap();
        clean.integrate(&without.as_scan()).unwrap();
        let expected =
            BeamTally { hits: 49, no_return: 3, not_a_number: 3, negative: 3, too_near: 2, ..BeamTally::default() };
        assert_eq!(report.beams, expected);
        assert_eq!((report.beams.total(), report.beams.dropped()), (60, 8));
        assert_eq!(report.observations.unplaceable, 0);
    }
    assert!(state(&dirty) == state(&clean));
}

#[test]
fn a_scan_of_nothing_but_rubbish_teaches_nothing() {
    let mut map = open();
    let rubbish = [f32::NAN, -5.0, f32::INFINITY, f32::NEG_INFINITY];
    let scan = ScanRecord { ranges_m: rubbish.iter().copied().cycle().take(MAX_BEAMS).collect(), ..good(1) };
    // 2 048 steps of 0.1 rad is a bearing of 202 rad: unusual, and accepted.
    let report = map.integrate(&scan.as_scan()).unwrap();
    assert_eq!((report.beams.total() as usize, report.rows, map.mapper().tiles().resident()), (MAX_BEAMS, 0, 0));
}

#[test]
fn what_is_rejected_leaves_no_trace() {
    let mut map = open();
    map.integrate(&good(100).as_scan()).unwrap();
    let before = state(&map);
    let nan = f32::NAN;
    let far_m = MAX_NODE as f32 * COMPACT.settings.spacing_m;
    let base = good(101);
    let with = |change: &dyn Fn(&mut ScanRecord)| {
        let mut scan = base.clone();
        change(&mut scan);
        scan
    };
    let pose = |x, y, theta| with(&|scan| scan.header.map_from_sensor = Pose::new(x, y, theta));
    let angles = |min, increment| {
        with(&|scan| {
            scan.header.angle_min_rad = min;
            scan.header.angle_increment_rad = increment;
        })
    };
    let limits = |min, max| {
        with(&|scan| {
            scan.header.range_min_m = min;
            scan.header.range_max_m = max;
        })
    };
    let many = with(&|scan| scan.ranges_m = vec![1.0; MAX_BEAMS + 1]);
    let mut rejected = vec![(many, ScanRejected::TooManyBeams { beams: 2_049 })];
    for bad in [nan, f32::INFINITY, f32::NEG_INFINITY] {
        for scan in [pose(bad, 0.0, 0.0), pose(0.0, bad, 0.0), pose(0.0, 0.0, bad)] {
            rejected.push((scan, ScanRejected::PoseNotFinite));
        }
    }
    for (x_m, y_m) in [(far_m, 0.0), (0.0, -far_m), (1e30, 1e30), (f32::MAX, 0.0)] {
        rejected.push((pose(x_m, y_m, 0.0), ScanRejected::PoseTooFar { x_m, y_m }));
    }
    let steps =
        [(nan, 0.1), (0.0, nan), (f32::INFINITY, 0.1), (0.0, f32::INFINITY), (1e9, 0.1), (0.0, 1e6), (0.0, -1e30)];
    for (min_rad, increment_rad) in steps {
        let expected = ScanRejected::Angles { min_rad, increment_rad };
        let scan = angles(min_rad, increment_rad);
        assert!(format!("{:?}", map.integrate(&scan.as_scan())) == format!("{:?}", Err::<(), _>(expected)), "{scan:?}");
    }
    // A heading that cannot be reduced is an angle too.
    assert!(matches!(map.integrate(&pose(0.0, 0.0, 1e9).as_scan()), Err(ScanRejected::Angles { .. })));
    for (min_m, max_m) in [(nan, 1.0), (0.1, nan), (-0.1, 1.0), (1.0, 1.0), (2.0, 1.0), (f32::INFINITY, f32::INFINITY)]
    {
        let scan = limits(min_m, max_m);
        let expected = ScanRejected::RangeLimits { min_m, max_m };
        assert!(format!("{:?}", map.integrate(&scan.as_scan())) == format!("{:?}", Err::<(), _>(expected)), "{scan:?}");
    }
    for covariance in [
        PoseCovariance { xx_m2: -1e-6, ..PoseCovariance::independent(0.1, 0.01) },
        PoseCovariance { theta_rad2: nan, ..PoseCovariance::independent(0.1, 0.01) },
        PoseCovariance { xy_m2: 0.02, ..PoseCovariance::independent(0.1, 0.01) },
    ] {
        rejected.push((with(&|scan| scan.header.pose_covariance = Some(covariance)), ScanRejected::PoseCovariance));
    }
    for stamp_ns in [0, 1, 99] {
        rejected.push((good(stamp_ns), ScanRejected::StampWentBack { stamp_ns, newest_ns: 100 }));
    }
    for (scan, expected) in rejected {
        assert_eq!(map.integrate(&scan.as_scan()), Err(expected));
        assert!(state(&map) == before, "{scan:?} left a trace");
        assert!(!expected.to_string().is_empty());
    }
    assert!(state(&map) == before);
    // What is only unusual is accepted: the same stamp again, no beam at all, no upper limit, turning clockwise.
    for scan in [good(100), with(&|scan| scan.ranges_m.clear()), limits(0.0, f32::INFINITY), angles(3.0, -0.1)] {
        map.integrate(&scan.as_scan()).unwrap();
    }
}

#[test]
fn points_that_are_no_points_are_counted_and_leave_no_trace() {
    let (mut dirty, mut clean) = (open(), open());
    let far_m = MAX_NODE as f32 * COMPACT.settings.spacing_m;
    let bad =
        [[f32::NAN, 0.0], [0.0, f32::INFINITY], [-f32::INFINITY, 1.0], [f32::MAX, 0.0], [0.0, -far_m], [f32::NAN; 2]];
    let good: Vec<[f32; 2]> = (0..40).map(|i| [0.1 * i as f32, 1.0]).collect();
    let mut mixed = good.clone();
    for (i, point) in bad.iter().enumerate() {
        mixed.insert(i * 7, *point);
    }
    let integrate = |map: &mut Map, points: &[[f32; 2]]| {
        map.integrate_observations(&labelled(points, |at| at[0] > 2.0 && at[1] == 1.0)).unwrap()
    };
    for _ in 0..3 {
        let report = integrate(&mut dirty, &mixed);
        assert_eq!((report.observations.unplaceable, report.observations.used), (bad.len() as u32, good.len() as u32));
        integrate(&mut clean, &good);
    }
    assert!(state(&dirty) == state(&clean));

    let before = state(&dirty);
    let many = COMPACT.capacities.observations + 1;
    let too_many = ScanRejected::TooManyObservations { observations: many, capacity: many - 1 };
    let origin = Observation::at_point(Point::zeros(), true);
    assert_eq!(dirty.integrate_observations(&vec![origin; many]), Err(too_many));
    assert!(state(&dirty) == before);
}

/// Beams that reach past the lattice: their far points are counted, the near ones learned.
#[test]
fn beams_past_the_lattice_are_counted() {
    let mut map = open();
    let edge_m = (MAX_NODE as f32 - 4.0) * COMPACT.settings.spacing_m;
    let scan =
        ScanRecord { header: ScanHeader { map_from_sensor: Pose::new(edge_m, 0.0, 0.0), ..good(1).header }, ..good(1) };
    let report = map.integrate(&scan.as_scan()).unwrap();
    assert_eq!(report.tiles_failed, 0);
    assert!(report.observations.unplaceable > 0 && report.observations.used > 0, "{report:?}");
}

/// More observations than the lent memory: thinned beam by beam, and every beam accounted for.
#[test]
fn thinned_beams_are_all_accounted_for() {
    for observations in [1_000, 200, 60, 20] {
        let profile = Profile { capacities: Capacities { observations, ..COMPACT.capacities }, ..COMPACT };
        let mut map = Map::new(&profile).unwrap();
        let report = map.integrate(&good(1).as_scan()).unwrap();
        assert_eq!(report.beams.total(), 60, "room for {observations}: {report:?}");
    }
}

/// Even where the memory does not hold a single beam.
#[test]
fn beams_are_accounted_for_where_not_one_fits() {
    let profile = Profile { capacities: Capacities { observations: 2, ..COMPACT.capacities }, ..COMPACT };
    let mut map = Map::new(&profile).unwrap();
    let report = map.integrate(&good(1).as_scan()).unwrap();
    assert_eq!(report.rows, 0);
    assert_eq!((report.beams.total(), report.beams.dropped()), (60, 60), "{report:?}");
}

/// A sensor without an upper limit and settings that believe any range: absurd readings must not bring anything down.
#[test]
fn an_absurd_range_is_only_far_away() {
    for (range_max_m, no_return_free_m) in [(1e30, 0.0), (f32::INFINITY, f32::INFINITY)] {
        let limits = BeamLimits { range_max_m, no_return_free_m };
        let profile = Profile { settings: Settings { limits, ..COMPACT.settings }, ..COMPACT };
        let Ok(mut map) = Map::new(&profile) else { continue };
        let scan = ScanRecord {
            header: ScanHeader { range_max_m: f32::INFINITY, ..good(1).header },
            ranges_m: vec![3.0, 1e25, f32::INFINITY, 4.0],
        };
        let report = map.integrate(&scan.as_scan()).unwrap();
        assert_eq!(report.beams.total(), 4);
    }
}

/// Something covers the lens: every beam of a dense lidar ends in the same cell, scan after scan, in a map that knows
/// nothing yet. That is much to learn about one place, not a reason to learn nothing.
#[test]
fn a_covered_lens_is_learned() {
    for beams in [360, 1_081, MAX_BEAMS] {
        for radius_m in [0.05, 0.2] {
            let mut map = open();
            let increment_rad = std::f32::consts::TAU / beams as f32;
            let mut failed = 0;
            for stamp in 0..20 {
                let scan = ScanRecord {
                    header: ScanHeader { range_min_m: 0.0, angle_increment_rad: increment_rad, ..good(stamp).header },
                    ranges_m: vec![radius_m; beams],
                };
                failed += map.integrate(&scan.as_scan()).unwrap().tiles_failed;
            }
            let at = good(0).header.map_from_sensor.point_along(1.0, radius_m);
            println!(
                "{beams} beams of {radius_m} m, 20 scans: {failed} updates failed; {:?}",
                map.mapper().occupancy(&at)
            );
            assert_eq!(failed, 0, "{beams} beams of {radius_m} m");
        }
    }
}

/// One place, told a thousand times in one batch, in a map that knows nothing yet, with the settings as they ship.
#[test]
fn a_thousand_times_the_same_is_learned() {
    let mut failures = Vec::new();
    for count in [300, 1_000, 3_000] {
        for every_second in [false, true] {
            let mut map = open();
            let told = |i| Observation::at_point(Point::<2>::new(1.2, 1.15), every_second && i % 2 == 0);
            let report = map.integrate_observations(&(0..count).map(told).collect::<Vec<_>>()).unwrap();
            if report.tiles_failed > 0 {
                failures.push((count, every_second, report.tiles_failed));
            }
        }
    }
    assert!(failures.is_empty(), "(points, contradicting, tiles that failed): {failures:?}");
}
