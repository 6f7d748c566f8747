//! The loop against a world that is a list.

use std::collections::VecDeque;
use std::vec::Vec;

use bhm_core::{
    geometry::Pose,
    mapper::{IntegrateReport, Mapper},
    scan::ScanRejected,
    scan::{Scan, ScanHeader},
};

use crate::*;
use clock::FakeClock;

mod clock;

/// What a fake world does, in this order; then it says stop.
enum Event {
    Scan {
        source: u64,
        sequence: u64,
        last: bool,
    },
    Unusable(Unusable),
    Nothing,
    /// Nothing, for so many nanoseconds.
    Pause(u64),
    Fault,
}

/// What the loop did to it.
#[derive(Clone, Debug, PartialEq)]
enum Seen {
    Waited,
    Published(News),
    Reported { handled: Option<(u64, u64)>, ended: bool },
}

#[derive(Default)]
struct FakeLink {
    events: VecDeque<Event>,
    seen: Vec<Seen>,
    updates: Vec<Option<UpdateTime>>,
    publish_fails: bool,
    clock: Option<FakeClock>,
    behind: bool,
}

impl<const M: usize, const B: usize> Link<M, B> for FakeLink {
    type Fault = &'static str;

    fn receive(&mut self, patience: Patience) -> Result<Incoming<'_>, &'static str> {
        if patience == Patience::Some {
            self.seen.push(Seen::Waited);
        }
        match self.events.pop_front() {
            None => Ok(Incoming::Stop),
            Some(Event::Nothing) => Ok(Incoming::Nothing),
            Some(Event::Pause(ns)) => {
                if let Some(clock) = &mut self.clock {
                    clock.now_ns += ns;
                }
                Ok(Incoming::Nothing)
            }
            Some(Event::Fault) => Err("receive"),
            Some(Event::Unusable(why)) => Ok(Incoming::Unusable(why)),
            Some(Event::Scan { source, sequence, last }) => {
                let received_ns = self.clock.as_mut().map(FakeClock::receive);
                Ok(Incoming::Scan(IncomingScan { source, sequence, last, received_ns, scan: scan(sequence) }))
            }
        }
    }

    fn publish(&mut self, _: &Mapper<'_, 2, M, B>, news: &News) -> Result<(), &'static str> {
        self.seen.push(Seen::Published(*news));
        if let Some(clock) = &mut self.clock {
            // An hour: were publishing part of an update, every deadline would be missed.
            clock.now_ns += 3_600_000_000_000;
        }
        if self.publish_fails { Err("publish") } else { Ok(()) }
    }

    fn report(&mut self, report: &Report<'_>) -> Result<(), &'static str> {
        self.seen.push(Seen::Reported { handled: report.handled, ended: report.ended });
        self.updates.push(report.update);
        Ok(())
    }

    fn now_ns(&mut self) -> Option<u64> {
        self.clock.as_mut().map(FakeClock::read)
    }

    fn behind(&self) -> bool {
        self.behind
    }
}

const RANGES_M: [f32; 5] = [1.0, 2.0, f32::NAN, -1.0, 3.0];

/// A scan; number 13 is one that every mapper refuses.
fn scan(sequence: u64) -> Scan<'static> {
    Scan {
        header: ScanHeader {
            stamp_ns: sequence,
            map_from_sensor: Pose::new(if sequence == 13 { f32::NAN } else { sequence as f32 * 0.01 }, 0.0, 0.0),
            angle_min_rad: 0.0,
            angle_increment_rad: 0.1,
            range_min_m: 0.1,
            range_max_m: 20.0,
            ..ScanHeader::default()
        },
        ranges_m: &RANGES_M,
    }
}

/// A small map in lent memory, without an archive: what a microcontroller has.
pub(crate) mod lent {
    use bhm_core::{
        mapper::{Link, Mapper, Memory, ObservationSlot, TouchedTile},
        posterior::{Posterior, RowState, Scratch},
        profile,
        storage::Storage::Lent,
        support::SupportTable,
        tile::{DirectoryEntry, NoArchive, Tile},
    };
    use std::boxed::Box;
    use std::vec;

    use crate::LentMap;

    pub(crate) type Map = LentMap<'static, NoArchive, 144, 40>;

    pub(crate) fn map(slots: usize) -> Map {
        let memory = Memory {
            tiles: Lent(vec![Tile::VACANT; slots].leak()),
            directory: Lent(vec![DirectoryEntry::VACANT; slots].leak()),
            prior: Lent(Box::leak(Box::new(Posterior::ZERO))),
            scratch: Lent(Box::leak(Box::new(Scratch::ZERO))),
            observations: Lent(vec![ObservationSlot::VACANT; 256].leak()),
            features: Lent(vec![0.0; 256 * 16].leak()),
            links: Lent(vec![Link::VACANT; 256 * 4].leak()),
            touched: Lent(vec![TouchedTile::VACANT; 16].leak()),
            rows: Lent(vec![RowState::ZERO; 256].leak()),
            supports: SupportTable::EMPTY,
        };
        LentMap::new(Mapper::new(profile::COMPACT.settings, memory).expect("a good profile"), NoArchive)
    }
}

fn looped(events: impl IntoIterator<Item = Event>, options: Options) -> Onboard<lent::Map, FakeLink, 144, 40> {
    let link = FakeLink { events: events.into_iter().collect(), ..FakeLink::default() };
    Onboard::new(lent::map(8), link, options)
}

fn sent(source: u64, sequences: impl IntoIterator<Item = u64>) -> impl Iterator<Item = Event> {
    sequences.into_iter().map(move |sequence| Event::Scan { source, sequence, last: false })
}

fn published(onboard: &Onboard<lent::Map, FakeLink, 144, 40>) -> Vec<News> {
    let publications = onboard.link().seen.iter().filter_map(|seen| match seen {
        Seen::Published(news) => Some(*news),
        _ => None,
    });
    publications.collect()
}

#[test]
fn a_loop_that_is_stopped_at_once_has_shown_itself() {
    let mut onboard = looped([], Options::default());
    assert_eq!(onboard.run(), End::Stopped);
    let idle = Seen::Reported { handled: None, ended: false };
    assert_eq!(onboard.link().seen, [Seen::Published(News::default()), idle, Seen::Waited]);
    assert_eq!(*onboard.counters(), Counters { published: 1, ..Counters::default() });
}

#[test]
fn every_outcome_is_counted() {
    let mut events: Vec<Event> = sent(1, [1, 2, 5, 5, 4, 13]).collect();
    events.extend([
        Event::Unusable(Unusable::Unreadable),
        Event::Unusable(Unusable::ForAnother),
        Event::Nothing,
        Event::Fault,
    ]);
    // A source that comes back counts from anywhere; what went before was not for this loop.
    events.extend(sent(2, [70, 71]));
    let mut onboard = looped(events, Options::default());
    assert_eq!(onboard.run(), End::Stopped);
    let counters = *onboard.counters();
    assert_eq!((counters.received, counters.integrated, counters.rejected()), (8, 5, 1));
    assert_eq!(counters.rejected_pose_not_finite, 1);
    assert_eq!((counters.lost, counters.duplicates, counters.sources), (2 + 7, 2, 2));
    assert_eq!((counters.unreadable, counters.for_another, counters.receive_failed), (1, 1, 1));
    assert_eq!(counters.received, counters.integrated + counters.rejected() + counters.duplicates);
    // Three good beams a scan, one not a number, one negative.
    assert_eq!((counters.beams_hit, counters.beams_not_a_number, counters.beams_negative), (15, 5, 5));
    assert!(counters.tiles_created > 0 && counters.rows > 0 && counters.passes > 0);
    assert_eq!(onboard.last_fault(), Some(&"receive"));
    assert_eq!(onboard.map().mapper().scans(), 5);
    assert_eq!(published(&onboard).last().expect("published").handled, Some((2, 71)));
}

#[test]
fn every_reason_has_its_counter() {
    let rejections = [
        (ScanRejected::TooManyBeams { beams: 1 }, "rejected_too_many_beams"),
        (ScanRejected::PoseNotFinite, "rejected_pose_not_finite"),
        (ScanRejected::PoseCovariance, "rejected_pose_covariance"),
        (ScanRejected::PoseTooFar { x_m: 0.0, y_m: 0.0 }, "rejected_pose_too_far"),
        (ScanRejected::Angles { min_rad: 0.0, increment_rad: 0.0 }, "rejected_angles"),
        (ScanRejected::RangeLimits { min_m: 0.0, max_m: 0.0 }, "rejected_range_limits"),
        (ScanRejected::StampWentBack { stamp_ns: 0, newest_ns: 1 }, "rejected_stamp_went_back"),
        (ScanRejected::TooManyObservations { observations: 2, capacity: 1 }, "rejected_otherwise"),
    ];
    let mut counters = Counters::default();
    for (rejection, name) in &rejections {
        let before = counters;
        counters.count(&Err(*rejection));
        assert_eq!(counters.rejected(), before.rejected() + 1);
        let changed: Vec<_> = counters.iter().zip(before.iter()).filter(|(now, then)| now != then).collect();
        let [((changed, now), (_, then))] = changed[..] else { panic!("{changed:?}") };
        assert_eq!((changed, now), (*name, then + 1));
    }
    counters.count(&Ok(IntegrateReport { tiles_lost: 3, ..IntegrateReport::default() }));
    assert_eq!((counters.integrated, counters.tiles_lost), (1, 3));
    let names: std::collections::BTreeSet<_> = counters.iter().map(|(name, _)| name).collect();
    assert_eq!(names.len(), counters.iter().len());
    assert!(names.iter().all(|name| name.len() <= 32), "a status message cuts longer names off");
    assert!(names.len() <= 64, "a status message holds no more");
}

#[test]
fn a_backlog_is_published_now_and_then_and_a_pause_at_once() {
    let options = Options { publish_every: 4, ..Options::default() };
    let mut events: Vec<Event> = sent(1, 1..=9).collect();
    events.push(Event::Nothing);
    events.push(Event::Nothing);
    events.extend(sent(1, [10]));
    let mut onboard = looped(events, options);
    onboard.run();
    let handled: Vec<_> = published(&onboard).iter().map(|news| news.handled.map(|(_, sequence)| sequence)).collect();
    assert_eq!(handled, [None, Some(4), Some(8), Some(9), Some(10)]);
    let reports = onboard.link().seen.iter().filter(|seen| matches!(seen, Seen::Reported { .. })).count();
    assert_eq!(reports, 1 + 10 + 2, "one to begin with, one a scan, one for each later publication");
    let last = published(&onboard)[4];
    assert_eq!(last.map_from_sensor, scan(10).header.map_from_sensor);
}

#[test]
fn the_loop_waits_only_when_everything_is_published() {
    let options = Options { publish_every: 4, ..Options::default() };
    let events = sent(1, 1..=3).chain([Event::Nothing, Event::Nothing]).chain(sent(1, 4..=9));
    let mut onboard = looped(events, options);
    onboard.run();
    let (mut dealt_with, mut shown, mut waits) = (None, None, 0);
    for seen in &onboard.link().seen {
        match seen {
            Seen::Waited => {
                assert_eq!(dealt_with, shown);
                waits += 1;
            }
            Seen::Published(news) => shown = news.handled,
            Seen::Reported { handled, .. } => dealt_with = *handled,
        }
    }
    assert!(waits > 2 && shown == Some((1, 9)), "{waits} {shown:?}");
}

#[test]
fn a_refused_scan_is_dealt_with_like_any_other() {
    let mut onboard = looped(sent(1, [12, 13]), Options::default());
    onboard.run();
    assert_eq!((onboard.counters().integrated, onboard.counters().rejected_pose_not_finite), (1, 1));
    assert_eq!(onboard.link().seen.iter().rfind(|seen| !matches!(seen, Seen::Waited)), {
        Some(&Seen::Reported { handled: Some((1, 13)), ended: false })
    });
    assert_eq!(published(&onboard).last().expect("published").handled, Some((1, 13)));
    // Nobody asks for it again, and whoever sends it again is told so.
    let mut again = looped(sent(1, [12, 13, 13, 14]), Options::default());
    again.run();
    assert_eq!((again.counters().duplicates, again.counters().lost), (1, 0));
}

#[test]
fn the_end_of_a_source_ends_the_loop_if_it_is_asked_to() {
    let events = || sent(1, [1, 2]).chain([Event::Scan { source: 1, sequence: 3, last: true }]).chain(sent(2, [1]));
    let mut until_end = looped(events(), Options { until: Until::SourceEnds, ..Options::default() });
    assert_eq!(until_end.run(), End::SourceEnded);
    assert_eq!(until_end.counters().integrated, 3);
    let last = *published(&until_end).last().expect("published");
    assert_eq!((last.handled, last.ended), (Some((1, 3)), true));
    assert_eq!(until_end.link().seen.last(), Some(&Seen::Reported { handled: Some((1, 3)), ended: true }));

    let mut goes_on = looped(events(), Options::default());
    assert_eq!(goes_on.run(), End::Stopped);
    assert_eq!((goes_on.counters().sources_ended, goes_on.counters().sources), (1, 2));
    assert!(!published(&goes_on).last().expect("published").ended, "another source came");
}

#[test]
fn a_publication_that_fails_is_counted_and_the_loop_goes_on() {
    let link = FakeLink { events: sent(1, 1..=3).collect(), publish_fails: true, ..FakeLink::default() };
    let mut onboard = Onboard::<_, _, 144, 40>::new(lent::map(8), link, Options::default());
    assert_eq!(onboard.run(), End::Stopped);
    // Once to begin with, once a scan.
    assert_eq!((onboard.counters().publish_failed, onboard.counters().published), (4, 0));
    assert_eq!((onboard.counters().integrated, onboard.last_fault()), (3, Some(&"publish")));
}

#[test]
fn tiles_lost_without_an_archive_are_counted_and_published() {
    let link = FakeLink { events: sent(1, 1..=3).collect(), ..FakeLink::default() };
    let mut onboard = Onboard::<_, _, 144, 40>::new(lent::map(1), link, Options::default());
    onboard.run();
    let counters = *onboard.counters();
    assert!(counters.tiles_evicted > 0);
    assert_eq!(counters.tiles_lost, counters.tiles_evicted);
    assert_eq!(published(&onboard).last().expect("published").lost, counters.tiles_lost);
}
