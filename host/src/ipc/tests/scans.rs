use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use super::*;

const AT_ONCE: Duration = Duration::ZERO;
const SOON: Duration = Duration::from_secs(1);

#[test]
fn a_scan_crosses_shared_memory_in_place() {
    let domain = TemporaryDomain::new().expect("a domain");
    let (here, there) = (joined(&domain), joined(&domain));
    let mut source = ScanSource::open(&here).expect("the first");
    let mut sink = ScanSink::open(&there).expect("room");
    let sent = scan(5);
    assert_eq!(source.publish(&sent.as_scan(), Place::Last), Ok(1));
    let sample = sink.receive(SOON).expect("no fault").expect("a scan");
    let numbered = sample.check().expect("a good message");
    assert_eq!(numbered.address, ScanAddress { source: source.id(), mapper: None, sequence: 1, place: Place::Last });
    assert_eq!(format!("{:?}", numbered.scan), format!("{:?}", sent.as_scan()));
    assert!(sink.receive(AT_ONCE).expect("no fault").is_none());
}

#[test]
fn a_second_source_and_a_second_mapper_are_refused() {
    let domain = TemporaryDomain::new().expect("a domain");
    let (here, there) = (joined(&domain), joined(&domain));
    let source = ScanSource::open(&here).expect("the first");
    let refused = ScanSource::open(&there).expect_err("the second");
    assert!(matches!(refused, IpcError::AlreadyRunning { who: "source of scans", .. }), "{refused}");
    drop(source);
    ScanSource::open(&there).expect("the first has gone");

    let status = StatusPublisher::open(&here, 1).expect("the first");
    let refused = StatusPublisher::open(&there, 2).expect_err("the second");
    assert!(matches!(refused, IpcError::AlreadyRunning { who: "mapper", .. }), "{refused}");
    drop(status);
    StatusPublisher::open(&there, 2).expect("the first has gone");
}

#[test]
fn two_domains_see_nothing_of_each_other() {
    let (one, other) = (TemporaryDomain::new().expect("a domain"), TemporaryDomain::new().expect("a domain"));
    let (here, there) = (joined(&one), joined(&other));
    let mut source = ScanSource::open(&here).expect("the first here");
    ScanSource::open(&there).expect("the first there");
    let mut sink = ScanSink::open(&there).expect("room");
    source.publish(&scan(1).as_scan(), Place::Within).expect("sent");
    assert!(sink.receive(SOON).expect("no fault").is_none());
}

#[test]
fn a_live_source_never_waits_and_the_newest_scans_arrive() {
    let domain = TemporaryDomain::new().expect("a domain");
    let here = joined(&domain);
    let mut source = ScanSource::open(&here).expect("the first");
    let mut sink = ScanSink::open(&here).expect("room");
    for number in 1..=100 {
        source.publish(&scan(number).as_scan(), Place::Within).expect("sent");
    }
    let mut arrived = Vec::new();
    while let Some(sample) = sink.receive(AT_ONCE).expect("no fault") {
        arrived.push(sample.check().expect("a good message").address.sequence);
    }
    assert_eq!(arrived, (101 - SCAN_BUFFER as u64..=100).collect::<Vec<_>>());
}

/// A mapper that acknowledges, dies after a while without a word, and is replaced.
#[test]
fn a_replay_delivers_every_scan_to_slow_mappers_that_replace_each_other() {
    const SCANS: u64 = 2_000;
    let domain = TemporaryDomain::new().expect("a domain");
    let stop = AtomicBool::new(false);
    let mut heard: Vec<Vec<u64>> = Vec::new();
    thread::scope(|scope| {
        let sender = scope.spawn(|| {
            let here = joined(&domain);
            let mut source = PacedSource::open(&here).expect("the first");
            for number in 1..=SCANS {
                let place = if number == SCANS { Place::Last } else { Place::Within };
                assert_eq!(source.send(&scan(number).as_scan(), place, &stop), Ok(Sent::Yes));
                assert!(source.under_way() <= SCAN_BUFFER);
            }
            assert_eq!(source.finish(&stop), Ok(Sent::Yes));
            source.sent_again()
        });
        for (run, dies_after) in [(1, 300), (2, 700), (3, u64::MAX)] {
            heard.push(slow_mapper(&domain, run, dies_after));
        }
        let sent_again = sender.join().expect("no panic");
        assert!((1..=2 * SCAN_BUFFER as u64).contains(&sent_again), "{sent_again} sent again");
    });
    // Each run hears consecutive scans, and begins with the first that the one before did not acknowledge.
    let mut next = 1;
    for run in &heard {
        assert_eq!(*run, (next..next + run.len() as u64).collect::<Vec<_>>());
        next += run.len() as u64;
    }
    assert_eq!(next, SCANS + 1);
}

fn slow_mapper(domain: &Domain, mapper: u64, dies_after: u64) -> Vec<u64> {
    let here = domain.join("mapper").expect("joined");
    let mut sink = ScanSink::open(&here).expect("room");
    let mut status = StatusPublisher::open(&here, mapper).expect("the only one");
    status.publish(&Progress::default(), []).expect("sent");
    let mut heard = Vec::new();
    let started = Instant::now();
    loop {
        assert!(started.elapsed() < Duration::from_secs(60), "stuck after {:?}", heard.last());
        let Some(sample) = sink.receive(SOON).expect("no fault") else {
            status.greet().expect("no fault");
            continue;
        };
        let address = sample.check().expect("a good message").address;
        if address.mapper != Some(mapper) {
            continue;
        }
        if heard.len() as u64 == dies_after {
            // Without acknowledging this one, and with others in the buffer.
            return heard;
        }
        heard.push(address.sequence);
        if heard.len().is_multiple_of(50) {
            thread::sleep(Duration::from_millis(3));
        }
        let progress =
            Progress { handled: Some((address.source, address.sequence)), ended: address.place == Place::Last };
        status.publish(&progress, [("received", heard.len() as u64)]).expect("sent");
        if address.place == Place::Last {
            return heard;
        }
    }
}

#[test]
fn a_replay_without_a_mapper_waits_until_it_is_stopped() {
    let domain = TemporaryDomain::new().expect("a domain");
    let here = joined(&domain);
    let mut source = PacedSource::open(&here).expect("the first");
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            thread::sleep(Duration::from_millis(120));
            stop.store(true, Ordering::Relaxed);
        });
        assert_eq!(source.send(&scan(1).as_scan(), Place::Within, &stop), Ok(Sent::Stopped));
    });
    assert_eq!(source.under_way(), 0);
}
