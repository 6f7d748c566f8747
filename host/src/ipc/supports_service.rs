//! Learned supports from the mapper to the readers of its posterior: once, and kept for readers that come later.

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;

use super::service::{
    Ipc, MAX_NODES, open_error, open_or_create_error, persistently, publisher_error, service_name, subscriber_error,
};
use super::{IpcError, Participant, SupportMessage, SupportsHeader, SupportsRejected, shared_memory, wire};
use crate::supports::LearnedSupports;

const SERVICE: &str = "supports";

/// A reader copies what it gets, and gives it back at once.
const BUFFER: usize = 1;
const BORROWED: usize = 1;

/// For the reader that comes late: nothing is ever sent twice.
const HISTORY: usize = 1;

const LOANED: usize = 1;

/// Keeps a mapper's supports where readers find them.
#[derive(Debug)]
pub(super) struct SupportsPublisher {
    publisher: Publisher<Ipc, [SupportMessage], SupportsHeader>,
}

impl SupportsPublisher {
    /// Offers the supports to at most so many readers.
    pub(super) fn open(
        participant: &Participant,
        supports: &LearnedSupports,
        readers: usize,
    ) -> Result<Self, IpcError> {
        let name = service_name(SERVICE)?;
        let count = supports.supports().len();
        let chunks = readers * (BUFFER + BORROWED) + HISTORY + LOANED;
        let bytes = chunks * (count * size_of::<SupportMessage>() + size_of::<SupportsHeader>());
        shared_memory::check_free(bytes as u64)?;
        let service = persistently(participant, || {
            participant
                .node
                .service_builder(&name)
                .publish_subscribe::<[SupportMessage]>()
                .user_header::<SupportsHeader>()
                .enable_safe_overflow(true)
                .history_size(HISTORY)
                .max_publishers(1)
                .max_subscribers(readers)
                .max_nodes(MAX_NODES)
                .subscriber_max_buffer_size(BUFFER)
                .subscriber_max_borrowed_samples(BORROWED)
                .open_or_create()
                .map_err(|cause| open_or_create_error(participant, SERVICE, cause))
        })?;
        let publisher = persistently(participant, || {
            let builder = service.publisher_builder().initial_max_slice_len(count).max_loaned_samples(LOANED);
            builder.create().map_err(|cause| publisher_error(participant, SERVICE, "mapper", cause))
        })?;
        shared_memory::reserve(&participant.domain)?;
        let loan = publisher.loan_slice_uninit(count);
        let mut loan = loan.map_err(|cause| IpcError::failed(SERVICE, "no memory to write supports in", cause))?;
        for (slot, support) in loan.payload_mut().iter_mut().zip(supports.supports()) {
            wire::in_place(slot).write(support);
        }
        loan.user_header_mut().write(supports);
        // SAFETY: as many supports were written as were loaned, every field of each.
        let sample = unsafe { loan.assume_init() };
        sample.send().map_err(|cause| IpcError::failed(SERVICE, "supports were not sent", cause))?;
        Ok(Self { publisher })
    }

    /// Hands the supports to readers that came since.
    pub(super) fn greet(&self) -> Result<(), IpcError> {
        self.publisher
            .update_connections()
            .map_err(|cause| IpcError::failed(SERVICE, "a reader was not reached", cause))
    }
}

/// Reads the supports of the domain's mapper.
#[derive(Debug)]
pub(super) struct SupportsSubscriber {
    subscriber: Subscriber<Ipc, [SupportMessage], SupportsHeader>,
}

impl SupportsSubscriber {
    /// A reader; `None` as long as no mapper offered supports.
    pub(super) fn open(participant: &Participant) -> Result<Option<Self>, IpcError> {
        let name = service_name(SERVICE)?;
        let service = persistently(participant, || {
            participant
                .node
                .service_builder(&name)
                .publish_subscribe::<[SupportMessage]>()
                .user_header::<SupportsHeader>()
                .open()
                .map_err(|cause| open_error(participant, SERVICE, cause))
        });
        let service = match service {
            Err(IpcError::Absent { .. }) => return Ok(None),
            other => other?,
        };
        let subscriber = service.subscriber_builder().create().map_err(|cause| subscriber_error(SERVICE, cause))?;
        Ok(Some(Self { subscriber }))
    }

    /// The newest supports since the last call, copied.
    pub(super) fn take(&self) -> Result<Option<Result<LearnedSupports, SupportsRejected>>, IpcError> {
        let sample = self.subscriber.receive();
        let sample = sample.map_err(|cause| IpcError::failed(SERVICE, "supports were not received", cause))?;
        Ok(sample.map(|sample| sample.user_header().check(sample.payload())))
    }
}
