use std::time::Duration;

use bhm_core::scan::Scan;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::sample::Sample;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use super::service::{
    Ipc, MAX_NODES, Sleeper, Waker, open_or_create_error, persistently, publisher_error, service_name, subscriber_error,
};
use super::{
    IpcError, NumberedScan, Participant, Place, ScanAddress, ScanMessage, ScanMessageRejected, fresh_id, shared_memory,
    wire,
};

const SERVICE: &str = "scan";

/// Scans that wait for the mapper before the oldest is overwritten.
pub const SCAN_BUFFER: usize = 8;

/// The mapper, and onlookers.
const MAX_SINKS: usize = 4;

/// One that is being integrated, and one to spare.
const BORROWED: usize = 2;

/// The newest scan, for onlookers that come late. The mapper does not ask for it: see [`ScanSink::open`].
const HISTORY: usize = 1;

const LOANED: usize = 1;

fn service(participant: &Participant) -> Result<PortFactory<Ipc, ScanMessage, ()>, IpcError> {
    let name = service_name(SERVICE)?;
    persistently(participant, || {
        participant
            .node
            .service_builder(&name)
            .publish_subscribe::<ScanMessage>()
            .enable_safe_overflow(true)
            .history_size(HISTORY)
            .max_publishers(1)
            .max_subscribers(MAX_SINKS)
            .max_nodes(MAX_NODES)
            .subscriber_max_buffer_size(SCAN_BUFFER)
            .subscriber_max_borrowed_samples(BORROWED)
            .open_or_create()
            .map_err(|cause| open_or_create_error(participant, SERVICE, cause))
    })
}

/// Sends scans as they come: a live sensor. A mapper that is too slow loses the oldest and counts them.
#[derive(Debug)]
pub struct ScanSource {
    publisher: Publisher<Ipc, ScanMessage, ()>,
    waker: Waker,
    id: u64,
    sequence: u64,
}

impl ScanSource {
    /// The domain's source of scans; there is one at a time.
    ///
    /// # Errors
    /// [`IpcError::AlreadyRunning`] if there is another, [`IpcError::SharedMemory`] if there is no room.
    pub fn open(participant: &Participant) -> Result<Self, IpcError> {
        let chunks = MAX_SINKS * (SCAN_BUFFER + BORROWED) + HISTORY + LOANED;
        shared_memory::check_free((chunks * size_of::<ScanMessage>()) as u64)?;
        let service = service(participant)?;
        let publisher = persistently(participant, || {
            let publisher = service.publisher_builder().max_loaned_samples(LOANED).create();
            publisher.map_err(|cause| publisher_error(participant, SERVICE, "source of scans", cause))
        })?;
        shared_memory::reserve(&participant.domain)?;
        Ok(Self { publisher, waker: Waker::new(participant, SERVICE)?, id: fresh_id(), sequence: 0 })
    }

    /// What tells this source's run from every other.
    #[must_use]
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Sends a scan to whoever listens and answers its number. Never waits.
    ///
    /// # Errors
    /// [`IpcError::TooManyBeams`], or iceoryx2 failed.
    pub fn publish(&mut self, scan: &Scan<'_>, place: Place) -> Result<u64, IpcError> {
        let address = ScanAddress { source: self.id, mapper: None, sequence: self.sequence + 1, place };
        self.publish_as(&address, scan)?;
        self.sequence = address.sequence;
        Ok(address.sequence)
    }

    pub(super) fn publish_as(&self, address: &ScanAddress, scan: &Scan<'_>) -> Result<(), IpcError> {
        let loan = self.publisher.loan_uninit();
        let mut loan = loan.map_err(|cause| IpcError::failed(SERVICE, "no memory to write a scan in", cause))?;
        wire::in_place(loan.payload_mut()).write(address, scan)?;
        // SAFETY: `write` set every field but the ranges after the last beam, and those are numbers too, see `in_place`.
        let sample = unsafe { loan.assume_init() };
        sample.send().map_err(|cause| IpcError::failed(SERVICE, "a scan was not sent", cause))?;
        self.waker.wake();
        Ok(())
    }
}

/// Receives scans, in order.
#[derive(Debug)]
pub struct ScanSink {
    subscriber: Subscriber<Ipc, ScanMessage, ()>,
    sleeper: Sleeper,
}

impl ScanSink {
    /// A receiver of the scans that are sent from now on.
    ///
    /// What was sent before is not asked for: a paced source sends again what was never acknowledged, in order, and the
    /// newest scan ahead of those would make them look out of date.
    ///
    /// # Errors
    /// [`IpcError::TooManyReaders`], or iceoryx2 failed.
    pub fn open(participant: &Participant) -> Result<Self, IpcError> {
        let subscriber = service(participant)?.subscriber_builder().history_request(0).create();
        let subscriber = subscriber.map_err(|cause| subscriber_error(SERVICE, cause))?;
        Ok(Self { subscriber, sleeper: Sleeper::new(participant, SERVICE)? })
    }

    /// The next scan, waiting for it at most as long as said (and never longer than 50 ms).
    ///
    /// # Errors
    /// If iceoryx2 failed.
    pub fn receive(&mut self, patience: Duration) -> Result<Option<ScanSample>, IpcError> {
        if let Some(sample) = self.take()? {
            return Ok(Some(sample));
        }
        if patience.is_zero() {
            return Ok(None);
        }
        self.sleeper.sleep(patience)?;
        self.take()
    }

    fn take(&self) -> Result<Option<ScanSample>, IpcError> {
        let sample = self.subscriber.receive();
        let sample = sample.map_err(|cause| IpcError::failed(SERVICE, "a scan was not received", cause))?;
        Ok(sample.map(|sample| ScanSample { sample }))
    }
}

/// A scan message, borrowed from shared memory until this is dropped.
#[derive(Debug)]
pub struct ScanSample {
    sample: Sample<Ipc, ScanMessage, ()>,
}

impl ScanSample {
    /// The scan, if the message can be read; its ranges stay where they are.
    ///
    /// # Errors
    /// What is wrong with the message.
    pub fn check(&self) -> Result<NumberedScan<'_>, ScanMessageRejected> {
        self.sample.payload().check()
    }
}
