use bhm_core::geometry::Pose;

use crate::{Counters, Incoming, IncomingScan, Link, News, OnboardMap, Patience, Report, Unusable, UpdateTime};

/// How the loop behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Most scans between two publications. Publishing copies every resident tile, so that a backlog is worked off faster
    /// the larger this is; as soon as no scan waits, the posterior is published anyway.
    pub publish_every: u32,
    /// How long a posterior that is not published yet waits for another scan to share the publication with, nanoseconds; 0
    /// to publish as soon as no scan waits. For lines on which a publication takes longer than a scan; needs a link with a
    /// clock.
    pub linger_ns: u64,
    /// When the loop ends by itself.
    pub until: Until,
    /// How long a scan may take from being received to being integrated, or refused, nanoseconds; `None` for as long as it
    /// takes. One that takes longer is counted as missed and nothing else: what it taught the map stays. Needs a link with
    /// a clock, without which nothing is ever missed.
    ///
    /// Publishing is no part of it, since several scans may share a publication (`publish_every`); nor is the time that a
    /// scan lay waiting before the link received it, which shows as scans `lost`.
    pub deadline_ns: Option<u64>,
}

/// When the loop ends by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Until {
    /// Never: it ends when told to.
    Stopped,
    /// When a source said that it ends, and its last scan is dealt with and published.
    SourceEnds,
}

impl Default for Options {
    fn default() -> Self {
        Self { publish_every: 1, linger_ns: 0, until: Until::Stopped, deadline_ns: None }
    }
}

/// Why the loop ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The link said to stop.
    Stopped,
    /// The source ended.
    SourceEnded,
}

/// What one turn of the loop came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// There is more to do.
    Continue,
    /// That was all.
    End(End),
}

/// The loop: a map, a link, and what happened.
///
/// The loop neither waits for a reader nor allocates, and one turn deals with one scan at most.
#[derive(Debug)]
pub struct Onboard<P, L, const M: usize, const B: usize>
where
    L: Link<M, B>,
{
    link: L,
    learner: Learner<P>,
    options: Options,
    update: Option<UpdateTime>,
    unpublished: u32,
    /// When the newest scan was dealt with, by the link's clock.
    learned_ns: Option<u64>,
    last_fault: Option<L::Fault>,
}

/// The part of the loop that scans change, apart from the link that they are borrowed from.
#[derive(Debug)]
struct Learner<P> {
    map: P,
    counters: Counters,
    /// Which run of which source was heard last, and its newest scan.
    handled: Option<(u64, u64)>,
    ended: bool,
    map_from_sensor: Pose,
}

impl<P: OnboardMap<M, B>, L: Link<M, B>, const M: usize, const B: usize> Onboard<P, L, M, B> {
    /// A loop that has not begun.
    #[must_use]
    pub fn new(map: P, link: L, options: Options) -> Self {
        let learner = Learner {
            map,
            counters: Counters::default(),
            handled: None,
            ended: false,
            map_from_sensor: Pose::default(),
        };
        Self { link, learner, options, update: None, unpublished: 0, learned_ns: None, last_fault: None }
    }

    /// The map.
    #[must_use]
    pub fn map(&self) -> &P {
        &self.learner.map
    }

    /// The link.
    #[must_use]
    pub fn link(&self) -> &L {
        &self.link
    }

    /// Everything that happened.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.learner.counters
    }

    /// How long updates took; `None` before the first, and without a clock.
    #[must_use]
    pub fn update_time(&self) -> Option<UpdateTime> {
        self.update
    }

    /// What the link last said when it failed.
    #[must_use]
    pub fn last_fault(&self) -> Option<&L::Fault> {
        self.last_fault.as_ref()
    }

    /// Gives back the map and the link.
    #[must_use]
    pub fn into_parts(self) -> (P, L) {
        (self.learner.map, self.link)
    }

    /// Starts and turns until the end.
    pub fn run(&mut self) -> End {
        self.start();
        loop {
            if let Step::End(end) = self.step() {
                return end;
            }
        }
    }

    /// Shows the world that the loop is there: what it starts from, and that it is ready for scans.
    pub fn start(&mut self) {
        self.publish();
        self.report();
    }

    /// One turn.
    pub fn step(&mut self) -> Step {
        // What is unpublished is published before anything is waited for.
        let patience = if self.is_unpublished() { Patience::None } else { Patience::Some };
        match self.link.receive(patience) {
            Ok(Incoming::Scan(incoming)) => {
                let IncomingScan { last, received_ns, .. } = incoming;
                let learned = self.learner.learn(&incoming);
                self.learned_ns = self.link.now_ns();
                if learned {
                    self.time(received_ns);
                }
                self.unpublished += 1;
                if last || self.unpublished >= self.options.publish_every {
                    self.publish();
                }
                self.report();
                if last && self.options.until == Until::SourceEnds {
                    return Step::End(End::SourceEnded);
                }
            }
            Ok(Incoming::Unusable(Unusable::Unreadable)) => self.learner.counters.unreadable += 1,
            Ok(Incoming::Unusable(Unusable::ForAnother)) => self.learner.counters.for_another += 1,
            Ok(Incoming::Nothing) => {
                if !self.lingers() {
                    self.publish_the_rest();
                }
            }
            Ok(Incoming::Stop) => {
                // Once, whether or not it succeeds: a world that is gone never catches up.
                self.publish_the_rest();
                return Step::End(End::Stopped);
            }
            Err(fault) => {
                self.learner.counters.receive_failed += 1;
                self.last_fault = Some(fault);
            }
        }
        Step::Continue
    }

    /// Takes note of how long the update took that has just ended.
    fn time(&mut self, received_ns: Option<u64>) {
        let (Some(received_ns), Some(now_ns)) = (received_ns, self.learned_ns) else { return };
        // A clock that goes back although it must not says nothing; it does not say that five centuries went by.
        let took_ns = now_ns.saturating_sub(received_ns);
        self.update = Some(UpdateTime::after(self.update, took_ns));
        let missed = self.options.deadline_ns.is_some_and(|deadline_ns| took_ns > deadline_ns);
        self.learner.counters.deadlines_missed += u64::from(missed);
    }

    fn is_unpublished(&self) -> bool {
        self.unpublished > 0 || self.link.behind()
    }

    /// Whether another scan may still share the next publication.
    fn lingers(&mut self) -> bool {
        if self.options.linger_ns == 0 || self.link.behind() {
            return false;
        }
        let (Some(learned_ns), Some(now_ns)) = (self.learned_ns, self.link.now_ns()) else { return false };
        self.unpublished > 0 && now_ns.saturating_sub(learned_ns) < self.options.linger_ns
    }

    fn publish_the_rest(&mut self) {
        if self.is_unpublished() {
            self.publish();
            self.report();
        }
    }

    fn publish(&mut self) {
        self.unpublished = 0;
        let Learner { map, counters, handled, ended, map_from_sensor } = &mut self.learner;
        let news = News {
            handled: *handled,
            ended: *ended,
            map_from_sensor: *map_from_sensor,
            archived: map.archived() as u64,
            lost: counters.tiles_lost,
        };
        match self.link.publish(map.mapper(), &news) {
            Ok(()) => counters.published += 1,
            Err(fault) => {
                counters.publish_failed += 1;
                self.last_fault = Some(fault);
            }
        }
    }

    fn report(&mut self) {
        let Learner { counters, handled, ended, .. } = &mut self.learner;
        let report = Report { handled: *handled, ended: *ended, counters, update: self.update };
        if let Err(fault) = self.link.report(&report) {
            counters.report_failed += 1;
            self.last_fault = Some(fault);
        }
    }
}

impl<P> Learner<P> {
    /// Deals with a scan: once this returns, it is integrated, or refused and counted. False if it had been dealt with before.
    fn learn<const M: usize, const B: usize>(&mut self, incoming: &IncomingScan<'_>) -> bool
    where
        P: OnboardMap<M, B>,
    {
        let IncomingScan { source, sequence, last, scan, .. } = *incoming;
        self.counters.received += 1;
        match self.handled {
            Some((heard, newest)) if heard == source => {
                if sequence <= newest {
                    self.counters.duplicates += 1;
                    return false;
                }
                // Saturating, because a source may send any number.
                self.counters.lost = self.counters.lost.saturating_add(sequence - newest - 1);
            }
            // What a source sent before it was first heard was not sent to this loop.
            _ => self.counters.sources += 1,
        }
        let outcome = self.map.integrate(&scan);
        if outcome.is_ok() {
            self.map_from_sensor = scan.header.map_from_sensor;
        }
        self.counters.count(&outcome);
        self.handled = Some((source, sequence));
        self.ended = last;
        self.counters.sources_ended += u64::from(last);
        true
    }
}
