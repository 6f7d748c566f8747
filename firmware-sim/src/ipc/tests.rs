//! The onboard program through real shared memory, a thread where a robot has a process.

use std::string::ToString;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use std::vec::Vec;

use bhm_core::{
    geometry::{Point, PoseCovariance},
    lattice::Window,
    profile::{self, Capacities},
    scan::ScanHeader,
    settings::Settings,
    support::{GaussianSettings, SupportSettings},
};
use bhm_host::{
    ScanRecord,
    ipc::{
        IpcError, PacedSource, Participant, Place, PosteriorSubscriber, ScanSource, Sent, StatusSubscriber,
        TemporaryDomain, open_posterior_any,
    },
    map,
};

use super::*;
use crate::Until;

/// So few slots that a walk along a corridor fills the archive.
const TIGHT: Profile =
    Profile { capacities: Capacities { tiles: 12, observations: 4_096, rows: 4_096, touched: 12 }, ..profile::COMPACT };

const UNTIL_END: OnboardOptions = OnboardOptions {
    run: Options { publish_every: 10, linger_ns: 0, until: Until::SourceEnds, deadline_ns: None },
    consumers: 2,
    path_poses: 64,
    supports: None,
};

/// A robot that walks 40 m along a corridor and back.
fn scan(number: u64, of: u64) -> ScanRecord {
    let half = of as f32 / 2.0;
    let x_m = 40.0 * (1.0 - (number as f32 - half).abs() / half);
    ScanRecord {
        header: ScanHeader {
            stamp_ns: number * 1_000_000,
            map_from_sensor: Pose::new(x_m, 0.0, 0.0),
            angle_min_rad: -3.0,
            angle_increment_rad: 0.5,
            range_min_m: 0.1,
            range_max_m: 10.0,
            ..ScanHeader::default()
        },
        ranges_m: (0..13).map(|beam| 1.0 + 0.1 * beam as f32).collect(),
    }
}

fn domain() -> TemporaryDomain {
    TemporaryDomain::new().expect("a domain")
}

fn joined(domain: &Domain) -> Participant {
    domain.join("test").expect("a domain of one's own")
}

fn replay(domain: &Domain, scans: u64) {
    let here = joined(domain);
    let mut source = PacedSource::open(&here).expect("the only source");
    let never = AtomicBool::new(false);
    for number in 1..=scans {
        let place = if number == scans { Place::Last } else { Place::Within };
        assert_eq!(source.send(&scan(number, scans).as_scan(), place, &never), Ok(Sent::Yes));
    }
    assert_eq!(source.finish(&never), Ok(Sent::Yes));
}

/// Supports of two shapes along the corridor.
fn supports() -> LearnedSupports {
    let window = Window { first: [-4, -6], width: [90, 12] };
    let supports = (0..window.supports()).map(|number| {
        let size = if number % 3 == 0 { 0.3 } else { 0.1 };
        SupportSettings::GaussianSupport(GaussianSettings { size }).build(0.5)
    });
    LearnedSupports::new([0.0; 2], 0.5, window, supports.collect(), None).expect("good supports")
}

#[test]
fn a_map_with_learned_supports_is_the_one_made_offline_and_consumers_see_it() {
    const SCANS: u64 = 60;
    let domain = domain();
    let stop = AtomicBool::new(false);
    let supports = supports();
    let profile = Profile { settings: TIGHT.settings.fitted(supports.table()), ..TIGHT };
    let mut offline = map::open_with(&profile, Some(supports.clone())).expect("a compiled shape");
    for number in 1..=SCANS {
        offline.integrate(&scan(number, SCANS).as_scan()).expect("a good scan");
    }
    let expected = offline.digest();
    let options = OnboardOptions { run: Options::default(), supports: Some(supports.clone()), ..UNTIL_END };
    let at: Vec<_> = (0..1_000).map(|i| Point::<2>::new(i as f32 * 0.04, (i % 7) as f32 * 0.3 - 1.0)).collect();
    thread::scope(|scope| {
        let mapper = scope.spawn(|| {
            run_onboard(&profile, &domain, &options, &stop, |map, _| {
                assert_eq!(map.digest(), expected);
                Ok(())
            })
        });
        let here = joined(&domain);
        let mut reader = eventually(|| open_posterior_any(&here).ok());
        replay(&domain, SCANS);
        let last = eventually(|| {
            let posterior = reader.receive(Duration::MAX).expect("no fault")?.expect("its supports are there");
            (posterior.header().scans == SCANS).then_some(posterior)
        });
        let tiles = last.tile_indices();
        assert_eq!((last.digest(), last.header().supports_digest), (offline.digest_of(&tiles), supports.digest()));
        assert_eq!(last.model(), offline.model());
        let mut same = 0;
        for at in at {
            // Away from tiles that are in the archive alone, both say the same.
            same += usize::from(last.gradient(&at) == offline.gradient(&at));
        }
        assert!(same > 100, "{same} of 1000");
        stop.store(true, Ordering::Relaxed);
        mapper.join().expect("no panic").expect("no error");
    });
    let elsewhere = Profile { settings: Settings { spacing_m: 0.25, ..profile.settings }, ..profile };
    let refused = run_onboard(&elsewhere, &domain, &options, &stop, |_, _| Ok(())).expect_err("another lattice");
    assert!(refused.to_string().contains("spacing of 0.5 m, the map has 0.25 m"), "{refused}");
}

#[test]
fn a_scan_with_an_impossible_pose_covariance_is_rejected_and_counted() {
    let domain = domain();
    let stop = AtomicBool::new(false);
    let impossible = PoseCovariance { xx_m2: -1.0, ..PoseCovariance::independent(0.1, 0.01) };
    let summary = thread::scope(|scope| {
        scope.spawn(|| {
            let here = joined(&domain);
            let mut source = PacedSource::open(&here).expect("the only source");
            let never = AtomicBool::new(false);
            let covariances = [None, Some(impossible), Some(PoseCovariance::independent(0.05, 0.01))];
            for (number, pose_covariance) in (1..).zip(covariances) {
                let scan =
                    ScanRecord { header: ScanHeader { pose_covariance, ..scan(number, 3).header }, ..scan(number, 3) };
                let place = if number == 3 { Place::Last } else { Place::Within };
                assert_eq!(source.send(&scan.as_scan(), place, &never), Ok(Sent::Yes));
            }
            assert_eq!(source.finish(&never), Ok(Sent::Yes));
        });
        run_onboard(&TIGHT, &domain, &UNTIL_END, &stop, |_, _| Ok(())).expect("no error")
    });
    let counters = summary.counters;
    assert_eq!((counters.received, counters.integrated, counters.rejected_pose_covariance), (3, 2, 1));
}

/// Waits for what another thread is about to do.
fn eventually<T>(mut attempt: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(done) = attempt() {
            return done;
        }
        assert!(started.elapsed() < Duration::from_secs(20), "in vain");
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_replay_is_learned_whole_and_the_map_is_the_one_made_offline() {
    const SCANS: u64 = 400;
    let domain = domain();
    let stop = AtomicBool::new(false);
    let mut offline = map::open(&TIGHT).expect("a compiled shape");
    for number in 1..=SCANS {
        offline.integrate(&scan(number, SCANS).as_scan()).expect("a good scan");
    }
    let summary = thread::scope(|scope| {
        scope.spawn(|| replay(&domain, SCANS));
        run_onboard(&TIGHT, &domain, &UNTIL_END, &stop, |map, summary| {
            assert_eq!(map.tile_indices(), offline.tile_indices());
            assert_eq!(map.progress(), (SCANS, SCANS * 1_000_000));
            for step in 0..1_000 {
                let at = Point::<2>::new(step as f32 * 0.04, (step % 7) as f32 * 0.3 - 1.0);
                assert_eq!(map.occupancy(&at), offline.occupancy(&at));
            }
            assert_eq!(summary.counters.integrated, SCANS);
            let update = summary.update.expect("a computer has a clock");
            assert!(0 < update.last_ns && update.last_ns <= update.slowest_ns, "{update:?}");
            Ok(())
        })
        .expect("no error")
    });
    let counters = summary.counters;
    assert_eq!(summary.end, End::SourceEnded);
    assert_eq!((counters.received, counters.lost, counters.duplicates), (SCANS, 0, 0));
    assert!(counters.tiles_evicted > 0 && counters.tiles_restored > 0, "the store is too small for the corridor");
    assert_eq!((counters.tiles_lost, counters.publish_failed, summary.last_fault), (0, 0, None));
    assert_eq!(summary.path[0], scan(1, SCANS).header.map_from_sensor);
    assert!((32..=64).contains(&summary.path.len()));
}

#[test]
fn a_stop_publishes_what_was_learned_and_a_second_mapper_is_refused() {
    let domain = domain();
    let stop = AtomicBool::new(false);
    let options = OnboardOptions::default();
    thread::scope(|scope| {
        let mapper = scope.spawn(|| run_onboard(&TIGHT, &domain, &options, &stop, |_, _| Ok(())));
        let here = joined(&domain);
        let mut reader = eventually(|| open_posterior_any(&here).ok());
        let second = run_onboard(&TIGHT, &domain, &options, &stop, |_, _| Ok(())).expect_err("one is enough");
        assert!(matches!(second, OnboardError::Ipc(IpcError::AlreadyRunning { who: "mapper", .. })), "{second}");

        let mut source = ScanSource::open(&here).expect("the only source");
        source.publish(&scan(1, 2).as_scan(), Place::Within).expect("sent");
        eventually(|| {
            let received = reader.receive(Duration::MAX).expect("no fault")?;
            let posterior = received.expect("a good one");
            (posterior.header().scans == 1 && posterior.header().source == source.id()).then_some(())
        });
        stop.store(true, Ordering::Relaxed);
        let summary = mapper.join().expect("no panic").expect("no error");
        assert_eq!((summary.end, summary.counters.integrated), (End::Stopped, 1));
    });
}

#[test]
fn a_live_source_loses_scans_and_each_loss_is_counted() {
    const SCANS: u64 = 3_000;
    let domain = domain();
    let stop = AtomicBool::new(false);
    let slow = OnboardOptions { run: Options { publish_every: 1, ..UNTIL_END.run }, ..UNTIL_END };
    let summary = thread::scope(|scope| {
        let mapper = scope.spawn(|| run_onboard(&TIGHT, &domain, &slow, &stop, |_, _| Ok(())));
        let here = joined(&domain);
        let mut status = StatusSubscriber::open(&here).expect("room");
        let mut source = ScanSource::open(&here).expect("the only source");
        eventually(|| status.receive(Duration::MAX).expect("no fault")).expect("a good one");
        source.publish(&scan(1, SCANS).as_scan(), Place::Within).expect("sent");
        // Only once the first is heard does every gap count.
        eventually(|| status.receive(Duration::MAX).expect("no fault")?.ok()?.progress().handled);
        for number in 2..=SCANS {
            let place = if number == SCANS { Place::Last } else { Place::Within };
            source.publish(&scan(number, SCANS).as_scan(), place).expect("sent");
        }
        mapper.join().expect("no panic").expect("no error")
    });
    let counters = summary.counters;
    assert!(counters.lost > 0, "faster than any mapper");
    assert_eq!(counters.received + counters.lost, SCANS);
    assert_eq!(counters.integrated, counters.received);
}

#[test]
fn a_mapper_that_returns_is_heard_by_the_readers_and_the_source_it_left() {
    let domain = domain();
    let here = joined(&domain);
    let mut source = PacedSource::open(&here).expect("the only source");
    let never = AtomicBool::new(false);
    let options = OnboardOptions { consumers: 2, ..OnboardOptions::default() };
    let mut reader: Option<PosteriorSubscriber<144, 40>> = None;
    let mut mappers = Vec::new();
    for run in 0..3 {
        let stop = AtomicBool::new(false);
        thread::scope(|scope| {
            let mapper = scope.spawn(|| run_onboard(&TIGHT, &domain, &options, &stop, |_, _| Ok(())));
            for number in 1..=20 {
                let scan = scan(run * 20 + number, 100);
                assert_eq!(source.send(&scan.as_scan(), Place::Within, &never), Ok(Sent::Yes));
            }
            assert_eq!(source.finish(&never), Ok(Sent::Yes));
            let reader = reader.get_or_insert_with(|| PosteriorSubscriber::open(&here).expect("a mapper is there"));
            let newest = eventually(|| {
                let sample = reader.receive(Duration::MAX).expect("no fault")?.expect("a good one");
                (sample.header().scan_sequence == (run + 1) * 20).then(|| *sample.header())
            });
            assert_eq!(newest.scans, 20);
            mappers.push(newest.mapper);
            stop.store(true, Ordering::Relaxed);
            let summary = mapper.join().expect("no panic").expect("no error");
            assert_eq!((summary.counters.integrated, summary.counters.lost, summary.mapper), (20, 0, newest.mapper));
        });
    }
    mappers.dedup();
    assert_eq!(mappers.len(), 3);
}
