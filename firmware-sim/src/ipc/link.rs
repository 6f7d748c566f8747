use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use bhm_core::mapper::Mapper;
use bhm_host::ipc::{
    Domain, IpcError, Participant, Place, PosteriorNews, PosteriorPublisher, Progress, ScanSample, ScanSink,
    StatusPublisher, fresh_id,
};
use bhm_host::supports::LearnedSupports;

use crate::{Incoming, IncomingScan, Link, News, Patience, Report, Unusable};

/// How long to leave a link alone that failed to receive.
const AFTER_A_FAULT: Duration = Duration::from_millis(20);

/// The world through shared memory.
pub(super) struct SharedMemoryLink<'s, const M: usize, const B: usize> {
    // Fields are dropped in this order: a sample before its port, ports before what they belong to.
    held: Option<ScanSample>,
    scans: ScanSink,
    posterior: PosteriorPublisher<M, B>,
    status: StatusPublisher,
    _participant: Participant,
    mapper: u64,
    opened: Instant,
    stop: &'s AtomicBool,
}

impl<'s, const M: usize, const B: usize> SharedMemoryLink<'s, M, B> {
    pub(super) fn open(
        domain: &Domain,
        slots: usize,
        consumers: usize,
        supports: Option<LearnedSupports>,
        stop: &'s AtomicBool,
    ) -> Result<Self, IpcError> {
        let participant = domain.join("bhm-onboard")?;
        let mapper = fresh_id();
        // First, since it is what a second mapper is refused by.
        let status = StatusPublisher::open(&participant, mapper)?;
        let posterior = PosteriorPublisher::open_with(&participant, mapper, slots, consumers, supports)?;
        let scans = ScanSink::open(&participant)?;
        Ok(Self {
            held: None,
            scans,
            posterior,
            status,
            _participant: participant,
            mapper,
            opened: Instant::now(),
            stop,
        })
    }

    pub(super) fn mapper(&self) -> u64 {
        self.mapper
    }

    fn next_scan(&mut self, patience: Patience) -> Result<(), IpcError> {
        // Given back before the next is taken, so that its memory is free again.
        self.held = None;
        let patience = match patience {
            Patience::None => Duration::ZERO,
            Patience::Some => Duration::MAX,
        };
        self.held = self.scans.receive(patience)?;
        if self.held.is_none() {
            self.status.greet()?;
            self.posterior.greet()?;
        }
        Ok(())
    }
}

impl<const M: usize, const B: usize> Link<M, B> for SharedMemoryLink<'_, M, B> {
    type Fault = IpcError;

    fn receive(&mut self, patience: Patience) -> Result<Incoming<'_>, IpcError> {
        if self.stop.load(Ordering::Relaxed) {
            return Ok(Incoming::Stop);
        }
        if let Err(fault) = self.next_scan(patience) {
            thread::sleep(AFTER_A_FAULT);
            return Err(fault);
        }
        let received_ns = <Self as Link<M, B>>::now_ns(self);
        Ok(match self.held.as_ref().map(ScanSample::check) {
            None => Incoming::Nothing,
            Some(Err(_)) => Incoming::Unusable(Unusable::Unreadable),
            Some(Ok(numbered)) if numbered.address.mapper.is_some_and(|mapper| mapper != self.mapper) => {
                Incoming::Unusable(Unusable::ForAnother)
            }
            Some(Ok(numbered)) => Incoming::Scan(IncomingScan {
                source: numbered.address.source,
                sequence: numbered.address.sequence,
                last: numbered.address.place == Place::Last,
                received_ns,
                scan: numbered.scan,
            }),
        })
    }

    fn publish(&mut self, mapper: &Mapper<'_, 2, M, B>, news: &News) -> Result<(), IpcError> {
        let News { handled, ended, map_from_sensor, archived, lost } = *news;
        let news = PosteriorNews { handled, ended, map_from_sensor, archived, lost };
        self.posterior.publish(mapper, &news).map(|_| ())
    }

    fn report(&mut self, report: &Report<'_>) -> Result<(), IpcError> {
        let progress = Progress { handled: report.handled, ended: report.ended };
        self.status.publish(&progress, report.counters.iter())
    }

    fn now_ns(&mut self) -> Option<u64> {
        // Nanoseconds need 64 bits after five centuries.
        u64::try_from(self.opened.elapsed().as_nanos()).ok()
    }
}
