use std::time::Duration;

use bhm_core::{geometry::Point, tile::TileSource};
use iceoryx2::prelude::ZeroCopySend;

use super::*;
use crate::ipc::service::{Ipc, service_name};

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
#[type_name("bhm.scan.v2")]
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
