use bhm_core::geometry::Pose;

use crate::{Counters, Incoming, IncomingScan, Link, News, OnboardMap, Patience, Report, Unusable};

/// How the loop behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Most scans between two publications. Publishing copies every resident tile, so that a backlog is worked off faster
    /// the larger this is; as soon as no scan waits, the posterior is published anyway.
    pub publish_every: u32,
    /// When the loop ends by itself.
    pub until: Until,
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
        Self { publish_every: 1, until: Until::Stopped }
    }
}

/// Why the loop ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It was told to.
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
/// Nothing it does waits for a reader or allocates, and one turn deals with one scan at most.
#[derive(Debug)]
pub struct Onboard<P, L, const M: usize, const B: usize>
where
    L: Link<M, B>,
{
    link: L,
    learner: Learner<P>,
    options: Options,
    unpublished: u32,
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
        Self { link, learner, options, unpublished: 0, last_fault: None }
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
                let last = incoming.last;
                self.learner.learn(&incoming);
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
            Ok(Incoming::Nothing) => self.publish_the_rest(),
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

    fn is_unpublished(&self) -> bool {
        self.unpublished > 0 || self.link.behind()
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
        if let Err(fault) = self.link.report(&Report { handled: *handled, ended: *ended, counters }) {
            counters.report_failed += 1;
            self.last_fault = Some(fault);
        }
    }
}

impl<P> Learner<P> {
    /// Deals with a scan: once this returns, it is integrated, or refused and counted.
    fn learn<const M: usize, const B: usize>(&mut self, incoming: &IncomingScan<'_>)
    where
        P: OnboardMap<M, B>,
    {
        let IncomingScan { source, sequence, last, scan } = *incoming;
        self.counters.received += 1;
        match self.handled {
            Some((heard, newest)) if heard == source => {
                if sequence <= newest {
                    self.counters.duplicates += 1;
                    return;
                }
                // Saturating, because a source may send any number.
                self.counters.lost = self.counters.lost.saturating_add(sequence - newest - 1);
            }
            // What a source sent before it was first heard was not sent to this loop.
            _ => self.counters.sources += 1,
        }
        match self.map.integrate(&scan) {
            Ok(report) => {
                self.map_from_sensor = scan.map_from_sensor;
                self.counters.count_integrated(&report);
            }
            Err(reason) => self.counters.count_rejected(&reason),
        }
        self.handled = Some((source, sequence));
        self.ended = last;
        self.counters.sources_ended += u64::from(last);
    }
}
