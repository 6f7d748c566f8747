use std::time::Duration;

use bhm_core::{geometry::Point, map::Map, tile::TileSource};
use iceoryx2::prelude::ZeroCopySend;

use super::*;
use crate::ipc::topic::{Ipc, service_name};
use crate::supports::{LearnedSupports, test_supports};

const SOON: Duration = Duration::from_secs(1);
const SLOTS: usize = SMALL.capacities.tiles;

fn publisher(participant: &Participant) -> PosteriorPublisher<144, 40> {
    PosteriorPublisher::open(participant, 5, SLOTS, 2).expect("the first, and room")
}

fn received(subscriber: &mut PosteriorSubscriber<144, 40>) -> PosteriorSample<144, 40> {
    subscriber.receive(SOON).expect("no fault").expect("a posterior").expect("a good one")
}

#[test]
fn a_posterior_answers_in_shared_memory_as_the_mapper_does() {
    let domain = TemporaryDomain::new().expect("a domain");
    let (here, there) = (joined(&domain), joined(&domain));
    let mut publisher = publisher(&here);
    let mut subscriber = PosteriorSubscriber::<144, 40>::open(&there).expect("a mapper is there");
    let map = learned(20);
    let news = PosteriorNews {
        handled: Some((7, 20)),
        ended: true,
        map_from_sensor: Pose::new(2.0, -0.2, 1.0),
        archived: 3,
        lost: 1,
    };
    assert_eq!(publisher.publish(map.mapper(), &news), Ok(1));
    let sample = received(&mut subscriber);
    let header = sample.header();
    assert_eq!((header.mapper, header.sequence, header.source, header.scan_sequence), (5, 1, 7, 20));
    assert_eq!((header.stamp_ns, header.scans), (2_000_000_000, 20));
    assert_eq!((header.archived, header.lost, header.ended()), (3, 1, true));
    assert_eq!(header.map_from_sensor(), news.map_from_sensor);
    assert_eq!(sample.tiles().len(), map.mapper().tiles().resident());
    for tile in map.mapper().tiles().iter() {
        let view = sample.posterior(&tile.index).expect("every tile is found");
        assert_eq!((view.mean, view.covariance), (&tile.posterior.mean, &tile.posterior.covariance));
    }
    assert!(sample.posterior(&[1_000, 1_000]).is_none());
    for step in 0..2_000 {
        let at = Point::<2>::new((step % 50) as f32 * 0.31 - 4.0, (step / 50) as f32 * 0.29 - 5.0);
        // Bit for bit: the same functions on the same numbers.
        assert_eq!(sample.view().occupancy(&at), map.mapper().occupancy(&at));
        assert_eq!(sample.view().gradient(&at), map.mapper().gradient(&at));
    }
}

/// A map of which nodes have supports of their own.
fn with_supports(supports: &LearnedSupports, scans: u64) -> OwnedMapper<144, 40> {
    let mut map = OwnedMapper::with_supports(&SMALL, Some(supports.clone())).expect("supports of the lattice");
    for number in 1..=scans {
        map.integrate(&scan(number).as_scan()).expect("a good scan");
    }
    map
}

#[track_caller]
fn same_answers(sample: &PosteriorSample<144, 40>, map: &OwnedMapper<144, 40>) {
    for step in 0..1_000 {
        let at = Point::<2>::new((step % 50) as f32 * 0.11 - 2.0, (step / 50) as f32 * 0.19 - 1.0);
        assert_eq!(sample.view().gradient(&at), map.mapper().gradient(&at));
    }
}

#[test]
fn a_posterior_with_supports_of_its_own_answers_as_the_mapper_does() {
    let domain = TemporaryDomain::new().expect("a domain");
    let (here, there) = (joined(&domain), joined(&domain));
    let supports = test_supports::some();
    let map = with_supports(&supports, 5);
    assert_ne!(
        map.mapper().gradient(&Point::<2>::new(0.1, 1.6)),
        learned(5).mapper().gradient(&Point::<2>::new(0.1, 1.6))
    );
    let mut publisher =
        PosteriorPublisher::open_with(&here, 5, SLOTS, 2, Some(supports.clone())).expect("the first, and room");
    let mut early = PosteriorSubscriber::<144, 40>::open(&there).expect("a mapper is there");
    publisher.publish(map.mapper(), &PosteriorNews::default()).expect("sent");
    let sample = received(&mut early);
    assert_eq!(sample.header().supports_digest, supports.digest());
    same_answers(&sample, &map);
    // One that comes late, of whatever shape, finds both.
    let mut late = open_posterior_any(&there).expect("a compiled shape");
    publisher.greet().expect("no fault");
    let posterior = late.receive(SOON).expect("no fault").expect("a posterior").expect("a good one");
    assert_eq!(&posterior.model().basis.supports.table, supports.table());
    let at = Point::<2>::new(0.1, 1.6);
    assert_eq!(posterior.gradient(&at), map.mapper().gradient(&at));
}

#[test]
fn a_reader_without_the_supports_never_answers_and_gets_them_later() {
    let domain = TemporaryDomain::new().expect("a domain");
    let (here, there) = (joined(&domain), joined(&domain));
    let plain = publisher(&here);
    let mut subscriber = PosteriorSubscriber::<144, 40>::open(&there).expect("a mapper is there");
    drop(plain);
    // A mapper with supports, on a domain whose reader has never heard of any.
    let supports = test_supports::some();
    let map = with_supports(&supports, 3);
    let mut second =
        PosteriorPublisher::open_with(&here, 6, SLOTS, 2, Some(supports.clone())).expect("the first has gone");
    second.publish(map.mapper(), &PosteriorNews::default()).expect("sent");
    let refused = subscriber.receive(SOON).expect("no fault").expect("a posterior").expect_err("no supports");
    assert_eq!(refused, PosteriorRejected::SupportsMissing { digest: supports.digest() });
    assert!(refused.to_string().contains("have not arrived"));
    // Said once, and the posterior is not lost.
    assert!(subscriber.receive(Duration::ZERO).expect("no fault").is_none());
    second.greet().expect("no fault");
    same_answers(&received(&mut subscriber), &map);
    // A newer one takes the place of one that waits; and another mapper's supports take the place of these.
    drop(second);
    let others = test_supports::over_a_building(0.5);
    let map = with_supports(&others, 4);
    let mut third =
        PosteriorPublisher::open_with(&here, 7, SLOTS, 2, Some(others.clone())).expect("the second has gone");
    let held = [(); 2].map(|()| {
        third.publish(map.mapper(), &PosteriorNews::default()).expect("sent");
        received(&mut subscriber)
    });
    same_answers(&held[1], &map);
    assert_eq!(held[0].header().supports_digest, others.digest());
}

#[test]
fn a_late_joiner_gets_the_newest_posterior() {
    let domain = TemporaryDomain::new().expect("a domain");
    let (here, there) = (joined(&domain), joined(&domain));
    let mut publisher = publisher(&here);
    for scans in 1..=3 {
        publisher.publish(learned(scans).mapper(), &PosteriorNews::default()).expect("sent");
    }
    let mut late = PosteriorSubscriber::<144, 40>::open(&there).expect("a mapper is there");
    publisher.greet().expect("no fault");
    assert_eq!(received(&mut late).header().scans, 3);
}

#[test]
fn a_reader_that_holds_what_it_has_never_blocks_the_mapper() {
    let domain = TemporaryDomain::new().expect("a domain");
    let (here, there) = (joined(&domain), joined(&domain));
    let mut publisher = publisher(&here);
    let mut slow = PosteriorSubscriber::<144, 40>::open(&there).expect("a mapper is there");
    let mut quick = PosteriorSubscriber::<144, 40>::open(&there).expect("two fit");
    let refused = PosteriorSubscriber::<144, 40>::open(&there).expect_err("three do not");
    assert_eq!(refused, IpcError::TooManyReaders { service: "posterior" });

    let mut map = learned(1);
    publisher.publish(map.mapper(), &PosteriorNews::default()).expect("sent");
    let first = received(&mut slow);
    for number in 2..=200 {
        map.integrate(&scan(number).as_scan()).expect("a good scan");
        assert_eq!(publisher.publish(map.mapper(), &PosteriorNews::default()), Ok(number));
        assert_eq!(received(&mut quick).header().sequence, number);
    }
    let second = received(&mut slow);
    assert_eq!((first.header().scans, second.header().scans), (1, 200), "what is held stays as it was");
    let learned_once = learned(1);
    let at = Point::<2>::new(1.9, 0.3);
    assert_eq!(first.view().occupancy(&at), learned_once.mapper().occupancy(&at));
    publisher.publish(map.mapper(), &PosteriorNews::default()).expect("sent");
    assert!(slow.receive(SOON).is_err(), "a third only if one is given back");
    drop(first);
    assert_eq!(received(&mut slow).header().sequence, 201);
}

#[test]
fn a_posterior_outlives_its_mapper_and_the_next_mapper_is_heard() {
    let domain = TemporaryDomain::new().expect("a domain");
    let (here, there) = (joined(&domain), joined(&domain));
    let mut first = publisher(&here);
    let mut subscriber = PosteriorSubscriber::<144, 40>::open(&there).expect("a mapper is there");
    let map = learned(2);
    first.publish(map.mapper(), &PosteriorNews::default()).expect("sent");
    let held = received(&mut subscriber);
    drop(first);
    drop(here);
    let at = Point::<2>::new(1.9, 0.3);
    assert_eq!(held.view().occupancy(&at), map.mapper().occupancy(&at));

    let again = joined(&domain);
    let mut second = PosteriorPublisher::<144, 40>::open(&again, 6, SLOTS, 2).expect("the first has gone");
    second.publish(map.mapper(), &PosteriorNews::default()).expect("sent");
    assert_eq!(received(&mut subscriber).header().mapper, 6);
}

#[test]
fn a_reader_without_a_mapper_is_told_so() {
    let domain = TemporaryDomain::new().expect("a domain");
    let here = joined(&domain);
    assert!(matches!(PosteriorSubscriber::<144, 40>::open(&here), Err(IpcError::Absent { .. })));
    assert!(matches!(open_posterior_any(&here), Err(IpcError::Absent { .. })));
}

#[test]
fn a_reader_of_any_shape_finds_the_right_one() {
    let domain = TemporaryDomain::new().expect("a domain");
    let (here, there) = (joined(&domain), joined(&domain));
    let mut publisher = publisher(&here);
    let wrong = PosteriorSubscriber::<196, 76>::open(&there).expect_err("another shape");
    assert_eq!(wrong, IpcError::Incompatible { service: "posterior" });
    let mut any = open_posterior_any(&there).expect("a compiled shape");
    let map = learned(4);
    publisher.publish(map.mapper(), &PosteriorNews::default()).expect("sent");
    let posterior = any.receive(SOON).expect("no fault").expect("a posterior").expect("a good one");
    assert_eq!(posterior.tile_indices().len(), map.mapper().tiles().resident());
    let at = Point::<2>::new(1.9, 0.3);
    assert_eq!(posterior.occupancy(&at), map.mapper().occupancy(&at));
    assert_eq!(posterior.gradient(&at), map.mapper().gradient(&at));
}

/// The scan of another version: same size, same service, another name.
#[repr(C)]
#[derive(Debug, ZeroCopySend)]
#[type_name("bhm.scan.v3")]
struct NextVersion([u64; size_of::<ScanMessage>() / 8]);

#[test]
fn a_peer_of_another_version_is_refused() {
    let domain = TemporaryDomain::new().expect("a domain");
    let (here, there) = (joined(&domain), joined(&domain));
    let name = service_name("scan").expect("a name");
    let newer = here.node.service_builder(&name).publish_subscribe::<NextVersion>().open_or_create();
    let newer: iceoryx2::service::port_factory::publish_subscribe::PortFactory<Ipc, _, _> = newer.expect("the first");
    assert_eq!(ScanSink::open(&there).err(), Some(IpcError::Incompatible { service: "scan" }));
    assert_eq!(ScanSource::open(&there).err(), Some(IpcError::Incompatible { service: "scan" }));
    drop(newer);
    ScanSink::open(&there).expect("the other has gone");
}

#[test]
fn a_mapper_that_needs_more_shared_memory_than_there_is_is_refused_in_numbers() {
    let domain = TemporaryDomain::new().expect("a domain");
    let refused = PosteriorPublisher::<5751, 361>::open(&joined(&domain), 5, 1_000_000, 4).expect_err("terabytes");
    let IpcError::SharedMemory(SharedMemoryError::NotEnough { needed_bytes, available_bytes }) = refused else {
        panic!("{refused}");
    };
    assert!(needed_bytes > available_bytes);
}
