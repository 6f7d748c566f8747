//! Any of the three dies by `kill -9`, at moments drawn by lot from fixed seeds, and returns; the others go on.

use std::{thread, time::Duration};

use bhm_host::ipc::TemporaryDomain;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::process::Signal;
use serde_json::Value;

use super::process::Process;
use crate::support::Bench;

/// Scans of the simulated route. It takes more tiles than the profile's store has, and a digest of what is in shared memory
/// is the map's only where nothing is in the archive: hence `--slots` below.
const SCANS: u64 = 599;

fn count(onboard: &Value, name: &str) -> u64 {
    onboard["counters"][name].as_u64().unwrap_or_else(|| panic!("no {name} in {onboard}"))
}

/// What arrived was learned, all of it.
#[track_caller]
fn nothing_was_lost(onboard: &Value) {
    assert_eq!((count(onboard, "lost"), count(onboard, "receive_failed")), (0, 0), "{onboard}");
    assert_eq!(count(onboard, "integrated"), count(onboard, "received"), "{onboard}");
}

#[test]
fn a_mapper_that_is_killed_and_returns_gets_every_scan_that_was_not_acknowledged() {
    let bench = Bench::new();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let domain = TemporaryDomain::new().unwrap();
    let onboard = || Process::join(&bench, &domain, "onboard --profile compact --slots 128 --until-end --save map.bhm");
    let mut mapper = onboard();
    let watch = Process::join(&bench, &domain, "watch --until-end");
    watch.reads(0);
    let source = Process::join(&bench, &domain, "simulate");
    let mut deaths = 0;
    for _ in 0..4 {
        // In the middle of its work, …
        watch.reads(rng.random_range(5..40));
        mapper.kill();
        deaths += 1;
        // … and while it starts.
        let starting = onboard();
        thread::sleep(Duration::from_millis(rng.random_range(0..120)));
        starting.kill();
        deaths += 1;
        mapper = onboard();
    }
    let sent = source.ends().well();
    assert_eq!((&sent["sent"]["scans"], &sent["sent"]["complete"]), (&Value::from(SCANS), &Value::from(true)));
    let onboard = mapper.ends().well();
    nothing_was_lost(&onboard);
    assert!((1..SCANS).contains(&count(&onboard, "integrated")), "the dead had learned some: {onboard}");
    assert_eq!(onboard["source_ended"], true);
    let watched = watch.ends().well();
    let last = &watched["watched"]["last"];
    assert_eq!((&last["scan_sequence"], &last["ended"]), (&Value::from(SCANS), &Value::from(true)));
    assert_eq!(watched["watched"]["posterior"], onboard["posterior"]);
    assert!((5..=deaths + 1).contains(&watched["watched"]["mappers"].as_u64().unwrap()), "{watched}");
    assert_eq!(bench.json("info map.bhm")["posterior"], onboard["posterior"]);
}

#[test]
fn a_source_that_is_killed_makes_room_for_the_next() {
    let bench = Bench::new();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let domain = TemporaryDomain::new().unwrap();
    let onboard = Process::join(&bench, &domain, "onboard --profile compact --slots 128 --until-end");
    let watch = Process::join(&bench, &domain, "watch --until-end");
    watch.reads(0);
    let mut learned = 0;
    for round in 0..4 {
        // Each begins later on the route, since a map does not go back in time.
        let source = Process::join(&bench, &domain, &format!("simulate --rate 100 --skip {} --scans 100", round * 100));
        learned += rng.random_range(1..60);
        watch.reads(learned);
        source.kill();
        // What the dead one sent is learned still: it lies in shared memory.
        learned = settled(&watch, learned);
    }
    let source = Process::join(&bench, &domain, "simulate --skip 500");
    assert_eq!(source.ends().well()["sent"]["complete"], true);
    let onboard = onboard.ends().well();
    nothing_was_lost(&onboard);
    assert_eq!((count(&onboard, "sources"), count(&onboard, "sources_ended")), (5, 1));
    assert_eq!(count(&onboard, "integrated"), learned + SCANS - 500);
    watch.ends().well();
}

/// Scans of the newest posterior, once no more come.
fn settled(watch: &Process, mut scans: u64) -> u64 {
    while let Some(line) = watch.says_within(Duration::from_secs(2)) {
        scans = line["posterior"]["scans"].as_u64().unwrap_or(scans);
    }
    scans
}

#[test]
fn consumers_that_are_killed_disturb_nobody_and_make_room_for_the_next() {
    let bench = Bench::new();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let domain = TemporaryDomain::new().unwrap();
    // Room for one at a time.
    let onboard = Process::join(&bench, &domain, "onboard --profile compact --slots 128 --until-end --consumers 1");
    let consumer = || Process::join(&bench, &domain, "watch --until-end");
    consumer().reads(0);
    let source = Process::join(&bench, &domain, "simulate --rate 100");
    for _ in 0..6 {
        let watch = consumer();
        watch.reads(0);
        thread::sleep(Duration::from_millis(rng.random_range(0..300)));
        watch.kill();
    }
    let watch = consumer();
    assert_eq!(source.ends().well()["sent"]["complete"], true);
    let onboard = onboard.ends().well();
    nothing_was_lost(&onboard);
    assert_eq!((count(&onboard, "integrated"), count(&onboard, "published")), (SCANS, SCANS + 1));
    let watched = watch.ends().well();
    assert_eq!(watched["watched"]["posterior"], onboard["posterior"]);
}

#[test]
fn a_consumer_that_stands_still_does_not_hold_the_mapper_up() {
    let bench = Bench::new();
    let domain = TemporaryDomain::new().unwrap();
    let onboard = Process::join(&bench, &domain, "onboard --profile compact --slots 128 --until-end");
    let watch = Process::join(&bench, &domain, "watch --until-end");
    watch.reads(0);
    let source = Process::join(&bench, &domain, "simulate");
    watch.reads(10);
    watch.signal(Signal::STOP);
    // With a posterior in its hands, and more published than it has room for.
    assert_eq!(source.ends().well()["sent"]["complete"], true);
    let onboard = onboard.ends().well();
    nothing_was_lost(&onboard);
    assert_eq!(count(&onboard, "published"), SCANS + 1);
    // The mapper is gone; what it published last is not.
    watch.signal(Signal::CONT);
    let watched = watch.ends().well();
    assert!(watched["watched"]["skipped"].as_u64() > Some(0), "{watched}");
    assert_eq!(watched["watched"]["posterior"], onboard["posterior"]);
}

#[test]
fn a_second_mapper_and_a_second_source_are_refused() {
    let bench = Bench::new();
    let domain = TemporaryDomain::new().unwrap();
    let onboard = Process::join(&bench, &domain, "onboard --profile compact");
    let watch = Process::join(&bench, &domain, "watch");
    watch.reads(0);
    let source = Process::join(&bench, &domain, "simulate --rate 20");
    watch.reads(1);
    for (arguments, says) in [
        ("onboard --profile compact", "another mapper is already running in this domain"),
        ("simulate", "another source of scans is already running in this domain"),
    ] {
        let second = Process::join(&bench, &domain, arguments).ends();
        assert_eq!(second.code, Some(1), "{}", second.stderr);
        assert!(second.stderr.contains(says), "{}", second.stderr);
    }
    // Another domain is another world.
    let elsewhere = TemporaryDomain::new().unwrap();
    let third = Process::join(&bench, &elsewhere, "onboard --profile compact");
    Process::join(&bench, &elsewhere, "watch --once").ends().well();
    for process in [source, onboard, third] {
        process.signal(Signal::TERM);
        process.ends().well();
    }
}
