//! What the loop makes of the time: deadlines, and how long a publication waits for more scans.

use std::{collections::VecDeque, vec, vec::Vec};

use super::*;

const BEGAN_NS: u64 = u64::MAX / 2;

/// A clock that each scan in turn lets run for so long, from being received to being learned.
pub(super) struct FakeClock {
    pub(super) now_ns: u64,
    /// For scans to come.
    updates_ns: VecDeque<u64>,
    /// For the one received.
    update_ns: u64,
}

impl FakeClock {
    fn new(updates_ns: impl IntoIterator<Item = u64>) -> Self {
        Self { now_ns: BEGAN_NS, updates_ns: updates_ns.into_iter().collect(), update_ns: 0 }
    }

    pub(super) fn receive(&mut self) -> u64 {
        self.update_ns = self.updates_ns.pop_front().expect("one for each scan");
        self.now_ns
    }

    pub(super) fn read(&mut self) -> u64 {
        self.now_ns += std::mem::take(&mut self.update_ns);
        self.now_ns
    }
}

/// A loop over scans of which the first two come twice and the third is refused; each takes as long as stated.
fn timed(updates_ns: Option<[u64; 7]>, deadline_ns: Option<u64>) -> Onboard<lent::Map, FakeLink, 144, 40> {
    let clock = updates_ns.map(FakeClock::new);
    let link = FakeLink { events: sent(1, [1, 2, 1, 2, 13, 14, 15]).collect(), clock, ..FakeLink::default() };
    let mut onboard = Onboard::new(lent::map(8), link, Options { deadline_ns, ..Options::default() });
    assert_eq!(onboard.run(), End::Stopped);
    assert_eq!((onboard.counters().integrated, onboard.counters().rejected()), (4, 1));
    onboard
}

#[test]
fn updates_slower_than_the_deadline_are_counted_and_nothing_else() {
    // The third and the fourth are duplicates, which are no updates.
    const UPDATES_NS: [u64; 7] = [40, 101, 1_000, 2_000, 300, 100, 7];
    // At the deadline is in time; a scan that is refused too late is late as well; publishing takes an hour each time.
    for (deadline_ns, missed) in
        [(None, 0), (Some(300), 0), (Some(299), 1), (Some(101), 1), (Some(100), 2), (Some(7), 4), (Some(0), 5)]
    {
        let onboard = timed(Some(UPDATES_NS), deadline_ns);
        assert_eq!(onboard.counters().deadlines_missed, missed, "{deadline_ns:?}");
        assert_eq!(onboard.update_time(), Some(UpdateTime { last_ns: 7, slowest_ns: 300 }));
        let plain = Counters { deadlines_missed: 0, ..*onboard.counters() };
        assert_eq!(plain, *timed(None, None).counters(), "all else is as without a clock");
    }
    // One report to begin with, one a message, duplicates included.
    let update = |last_ns, slowest_ns| Some(UpdateTime { last_ns, slowest_ns });
    let two = update(101, 101);
    assert_eq!(
        timed(Some(UPDATES_NS), None).link().updates,
        [None, update(40, 40), two, two, two, update(300, 300), update(100, 300), update(7, 300)]
    );
}

#[test]
fn without_a_clock_no_deadline_is_missed() {
    let onboard = timed(None, Some(0));
    assert_eq!((onboard.counters().deadlines_missed, onboard.update_time()), (0, None));
    assert!(onboard.link().updates.iter().all(Option::is_none));
}

const LINGER_NS: u64 = 1_000;

/// What a loop that lingers had published when everything had happened, but before it was stopped: the scans up to which.
fn lingering(events: impl IntoIterator<Item = Event>, has_clock: bool, behind: bool) -> Vec<Option<u64>> {
    let events: VecDeque<Event> = events.into_iter().collect();
    let turns = events.len();
    // Learning takes longer than the linger, which begins only after it.
    let clock = has_clock.then(|| FakeClock::new(vec![3 * LINGER_NS; turns]));
    let link = FakeLink { events, clock, behind, ..FakeLink::default() };
    let options = Options { publish_every: 3, linger_ns: LINGER_NS, ..Options::default() };
    let mut onboard = Onboard::new(lent::map(8), link, options);
    for _ in 0..turns {
        assert_eq!(onboard.step(), Step::Continue);
    }
    let handled = |onboard: &Onboard<_, _, 144, 40>| {
        let numbers = published(onboard).into_iter().map(|news| news.handled.map(|(_, sequence)| sequence));
        numbers.collect::<Vec<_>>()
    };
    let before = handled(&onboard);
    let newest = onboard.counters().received;
    assert_eq!(onboard.step(), Step::End(End::Stopped));
    assert_eq!(handled(&onboard).last(), Some(&Some(newest)), "a stop waits for no scan");
    before
}

fn pauses(lengths_ns: impl IntoIterator<Item = u64>) -> impl Iterator<Item = Event> {
    lengths_ns.into_iter().map(Event::Pause)
}

#[test]
fn a_posterior_waits_so_long_for_scans_to_share_its_publication() {
    // Until the linger is over, counted from the end of the newest scan, and once.
    assert_eq!(lingering(sent(1, [1]).chain(pauses([0, LINGER_NS - 1])), true, false), []);
    assert_eq!(lingering(sent(1, [1]).chain(pauses([0, LINGER_NS - 1, 1, 0, LINGER_NS])), true, false), [Some(1)]);
    let two = || sent(1, [1]).chain(pauses([LINGER_NS - 1])).chain(sent(1, [2]));
    assert_eq!(lingering(two().chain(pauses([LINGER_NS - 1])), true, false), []);
    assert_eq!(lingering(two().chain(pauses([LINGER_NS])), true, false), [Some(2)]);
    // As many scans as may share one are published without a pause, and the next lingers again.
    assert_eq!(lingering(two().chain(sent(1, [3])), true, false), [Some(3)]);
    assert_eq!(lingering(two().chain(sent(1, [3, 4])).chain(pauses([LINGER_NS - 1])), true, false), [Some(3)]);
    assert_eq!(lingering(two().chain(sent(1, [3, 4])).chain(pauses([LINGER_NS])), true, false), [Some(3), Some(4)]);
}

#[test]
fn a_world_that_is_behind_or_has_no_clock_waits_for_nothing() {
    let events = || sent(1, [1]).chain(pauses([0])).chain(sent(1, [2])).chain(pauses([0]));
    assert_eq!(lingering(events(), true, false), []);
    assert_eq!(lingering(events(), true, true), [Some(1), Some(2)]);
    assert_eq!(lingering(events(), false, false), [Some(1), Some(2)]);
}
