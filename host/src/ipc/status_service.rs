use std::ops::Deref;
use std::time::Duration;

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::sample::Sample;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use super::service::{
    Ipc, MAX_NODES, Sleeper, Waker, open_or_create_error, persistently, publisher_error, service_name, subscriber_error,
};
use super::{IpcError, Participant, Progress, Received, StatusMessage, StatusRejected, shared_memory, wire};

const SERVICE: &str = "status";
const MAX_READERS: usize = 8;
const BUFFER: usize = 1;
const BORROWED: usize = 2;
const HISTORY: usize = 1;
const LOANED: usize = 1;

fn service(participant: &Participant) -> Result<PortFactory<Ipc, StatusMessage, ()>, IpcError> {
    let name = service_name(SERVICE)?;
    persistently(participant, || {
        participant
            .node
            .service_builder(&name)
            .publish_subscribe::<StatusMessage>()
            .enable_safe_overflow(true)
            .history_size(HISTORY)
            .max_publishers(1)
            .max_subscribers(MAX_READERS)
            .max_nodes(MAX_NODES)
            .subscriber_max_buffer_size(BUFFER)
            .subscriber_max_borrowed_samples(BORROWED)
            .open_or_create()
            .map_err(|cause| open_or_create_error(participant, SERVICE, cause))
    })
}

/// Says how far the mapper has come. There is one in a domain, and so one mapper.
#[derive(Debug)]
pub struct StatusPublisher {
    publisher: Publisher<Ipc, StatusMessage, ()>,
    waker: Waker,
    mapper: u64,
}

impl StatusPublisher {
    /// The domain's mapper speaks; `mapper` tells this run of it from every other, see [`fresh_id`](super::fresh_id).
    ///
    /// # Errors
    /// [`IpcError::AlreadyRunning`] if there is another mapper, [`IpcError::SharedMemory`] if there is no room.
    pub fn open(participant: &Participant, mapper: u64) -> Result<Self, IpcError> {
        let chunks = MAX_READERS * (BUFFER + BORROWED) + HISTORY + LOANED;
        shared_memory::check_free((chunks * size_of::<StatusMessage>()) as u64)?;
        let service = service(participant)?;
        let publisher = persistently(participant, || {
            let publisher = service.publisher_builder().max_loaned_samples(LOANED).create();
            publisher.map_err(|cause| publisher_error(participant, SERVICE, "mapper", cause))
        })?;
        shared_memory::reserve(&participant.domain)?;
        Ok(Self { publisher, waker: Waker::new(participant, SERVICE)?, mapper })
    }

    /// From here on another run of the mapper speaks.
    pub fn begin(&mut self, mapper: u64) {
        self.mapper = mapper;
    }

    /// Says how far the mapper has come. Never waits.
    ///
    /// # Errors
    /// If iceoryx2 failed.
    pub fn publish<'n>(
        &mut self,
        progress: &Progress,
        counters: impl IntoIterator<Item = (&'n str, u64)>,
    ) -> Result<(), IpcError> {
        let loan = self.publisher.loan_uninit();
        let mut loan = loan.map_err(|cause| IpcError::failed(SERVICE, "no memory to write a status in", cause))?;
        wire::in_place(loan.payload_mut()).write(self.mapper, progress, counters);
        // SAFETY: `write` set every field.
        let sample = unsafe { loan.assume_init() };
        sample.send().map_err(|cause| IpcError::failed(SERVICE, "a status was not sent", cause))?;
        self.waker.wake();
        Ok(())
    }

    /// Hands the newest status to readers that came since; for cycles in which nothing is published.
    ///
    /// # Errors
    /// If iceoryx2 failed.
    pub fn greet(&self) -> Result<(), IpcError> {
        self.publisher
            .update_connections()
            .map_err(|cause| IpcError::failed(SERVICE, "a reader was not reached", cause))
    }
}

/// Reads how far the mapper has come.
#[derive(Debug)]
pub struct StatusSubscriber {
    subscriber: Subscriber<Ipc, StatusMessage, ()>,
    sleeper: Sleeper,
}

impl StatusSubscriber {
    /// A reader; the mapper may come later, and go and come again.
    ///
    /// # Errors
    /// [`IpcError::TooManyReaders`], or iceoryx2 failed.
    pub fn open(participant: &Participant) -> Result<Self, IpcError> {
        let subscriber = service(participant)?.subscriber_builder().create();
        let subscriber = subscriber.map_err(|cause| subscriber_error(SERVICE, cause))?;
        Ok(Self { subscriber, sleeper: Sleeper::new(participant, SERVICE)? })
    }

    /// The newest status since the last call, waiting for it at most as long as said (and never longer than 50 ms).
    ///
    /// # Errors
    /// If iceoryx2 failed.
    pub fn receive(&mut self, patience: Duration) -> Received<StatusSample, StatusRejected> {
        if let Some(sample) = self.take()? {
            return Ok(Some(sample));
        }
        if patience.is_zero() {
            return Ok(None);
        }
        self.sleeper.sleep(patience)?;
        self.take()
    }

    fn take(&self) -> Received<StatusSample, StatusRejected> {
        let sample = self.subscriber.receive();
        let sample = sample.map_err(|cause| IpcError::failed(SERVICE, "a status was not received", cause))?;
        Ok(sample.map(|sample| sample.payload().check().map(|()| StatusSample { sample })))
    }
}

/// A status that passed the checks, borrowed from shared memory until this is dropped.
#[derive(Debug)]
pub struct StatusSample {
    sample: Sample<Ipc, StatusMessage, ()>,
}

impl Deref for StatusSample {
    type Target = StatusMessage;

    fn deref(&self) -> &StatusMessage {
        self.sample.payload()
    }
}
