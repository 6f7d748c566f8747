//! A publish–subscribe service, whatever it carries: how it is opened, written and read, and what iceoryx2's errors mean
//! here.

use std::fmt::Debug;
use std::marker::PhantomData;
use std::thread;
use std::time::Duration;

use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::subscriber::{Subscriber, SubscriberCreateError};
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::port::{LoanError, ReceiveError};
use iceoryx2::prelude::{self as iox, IceoryxSend, ZeroCopySend};
use iceoryx2::sample::Sample;
use iceoryx2::sample_mut::SampleMut;
use iceoryx2::service::builder::publish_subscribe::{
    Builder, PublishSubscribeCreateError as CreateError, PublishSubscribeOpenError as OpenError,
    PublishSubscribeOpenOrCreateError as OpenOrCreateError,
};
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use super::{IpcError, Participant, shared_memory, wake::Sleeper, wire::PlainNumbers};

/// The flavour of iceoryx2 that crosses processes.
pub(super) type Ipc = iox::ipc::Service;

type Service<H, P> = PortFactory<Ipc, P, H>;

/// Most processes on one service.
pub(super) const MAX_NODES: usize = 16;

/// The newest message is kept for readers that come late.
const HISTORY: usize = 1;

/// A writer finishes one message before it begins the next.
const LOANED: usize = 1;

/// A service with one writer, which never waits: for a reader whose buffer is full the oldest message is overwritten.
///
/// A message is a [`Body`] behind a header of type `H`; `()` is no header.
#[derive(Debug)]
pub(super) struct Topic<H, P: ?Sized> {
    /// The service's name.
    pub(super) service: &'static str,
    /// The only process that may write to it, as errors name it.
    pub(super) writer: &'static str,
    /// Most readers at a time.
    pub(super) readers: usize,
    /// Messages that wait for a reader before the oldest is overwritten.
    pub(super) buffer: usize,
    /// Messages that a reader may hold at a time.
    pub(super) borrowed: usize,
    /// The types of header and body.
    pub(super) message: PhantomData<fn(H, &P)>,
}

/// What can stand before a message.
pub(super) trait Header: Debug + Default + ZeroCopySend + 'static {}
impl<H: Debug + Default + ZeroCopySend + 'static> Header for H {}

/// What a message is made of: one value of plain numbers, or a slice of them.
pub(super) trait Body<H: Header>: Debug + IceoryxSend + 'static {
    /// Bytes of the value, or of an element of the slice.
    const ELEMENT_BYTES: usize;

    fn open(builder: Builder<Self, H, Ipc>) -> Result<Service<H, Self>, OpenError>;

    fn open_or_create(builder: Builder<Self, H, Ipc>) -> Result<Service<H, Self>, OpenOrCreateError>;

    /// A publisher of slices of at most so many elements, or of one value.
    fn publisher(service: &Service<H, Self>, length: usize) -> Result<Publisher<Ipc, Self, H>, PublisherCreateError>;

    /// A message of so many elements, or of one value, that holds anything.
    fn loan(publisher: &Publisher<Ipc, Self, H>, length: usize) -> Result<SampleMut<Ipc, Self, H>, LoanError>;

    fn contents(loan: &mut SampleMut<Ipc, Self, H>) -> &mut Self;

    fn receive(subscriber: &Subscriber<Ipc, Self, H>) -> Result<Option<Sample<Ipc, Self, H>>, ReceiveError>;
}

/// iceoryx2 has the same functions for a value and for a slice, each twice.
macro_rules! body {
    ($body:ty, $length:pat, $builder:ident => $publisher:expr, $port:ident => $loan:expr) => {
        impl<H: Header, T: PlainNumbers + Debug + ZeroCopySend + 'static> Body<H> for $body {
            const ELEMENT_BYTES: usize = size_of::<T>();

            fn open(builder: Builder<Self, H, Ipc>) -> Result<Service<H, Self>, OpenError> {
                builder.open()
            }

            fn open_or_create(builder: Builder<Self, H, Ipc>) -> Result<Service<H, Self>, OpenOrCreateError> {
                builder.open_or_create()
            }

            fn publisher(
                service: &Service<H, Self>,
                $length: usize,
            ) -> Result<Publisher<Ipc, Self, H>, PublisherCreateError> {
                let $builder = service.publisher_builder().max_loaned_samples(LOANED);
                $publisher.create()
            }

            fn loan($port: &Publisher<Ipc, Self, H>, $length: usize) -> Result<SampleMut<Ipc, Self, H>, LoanError> {
                // SAFETY: the operating system handed shared memory over zeroed, only messages were written in it since,
                // and `PlainNumbers` says that any such bytes are a value of T.
                Ok(unsafe { $loan?.assume_init() })
            }

            fn contents(loan: &mut SampleMut<Ipc, Self, H>) -> &mut Self {
                loan.payload_mut()
            }

            fn receive(subscriber: &Subscriber<Ipc, Self, H>) -> Result<Option<Sample<Ipc, Self, H>>, ReceiveError> {
                subscriber.receive()
            }
        }
    };
}

body!(T, _, builder => builder, publisher => publisher.loan_uninit());
body!([T], length, builder => builder.initial_max_slice_len(length), publisher => publisher.loan_slice_uninit(length));

impl<H: Header, P: Body<H> + ?Sized> Topic<H, P> {
    /// The service's only writer, of messages of at most `length` elements. All shared memory that it will ever need is
    /// taken here.
    ///
    /// # Errors
    /// [`IpcError::SharedMemory`] if there is no room, [`IpcError::AlreadyRunning`] if there is another writer,
    /// [`IpcError::Incompatible`] if the service is in use with another type of message.
    pub(super) fn writer(&self, participant: &Participant, length: usize) -> Result<Writer<H, P>, IpcError> {
        let chunks = self.readers * (self.buffer + self.borrowed) + HISTORY + LOANED;
        let bytes = chunks * (length * P::ELEMENT_BYTES + size_of::<H>());
        shared_memory::check_free(bytes as u64)?;
        let service = self.open_or_create(participant)?;
        let publisher = persistently(participant, || {
            P::publisher(&service, length).map_err(|cause| match cause {
                PublisherCreateError::ExceedsMaxSupportedPublishers => {
                    IpcError::AlreadyRunning { who: self.writer, root: participant.domain.root_text() }
                }
                other => self.failed("cannot be written to", other),
            })
        })?;
        shared_memory::reserve(&participant.domain)?;
        Ok(Writer { publisher, service: self.service })
    }

    /// A reader, whose writer may come later. It is given `history` (0 or 1) of the messages that were sent before it came.
    ///
    /// # Errors
    /// [`IpcError::TooManyReaders`]; [`IpcError::Incompatible`] if the service is in use with another type of message.
    pub(super) fn reader(&self, participant: &Participant, history: usize) -> Result<Reader<H, P>, IpcError> {
        self.subscribe(&self.open_or_create(participant)?, history)
    }

    /// A reader of a service that a writer has created, and whose capacities only that writer knows.
    ///
    /// # Errors
    /// As [`reader`](Self::reader), and [`IpcError::Absent`] as long as no writer was there.
    pub(super) fn reader_of_existing(&self, participant: &Participant) -> Result<Reader<H, P>, IpcError> {
        let name = service_name(self.service)?;
        let service = persistently(participant, || {
            let builder = participant.node.service_builder(&name).publish_subscribe::<P>().user_header::<H>();
            P::open(builder).map_err(|cause| self.open_error(participant, cause))
        })?;
        self.subscribe(&service, HISTORY)
    }

    fn subscribe(&self, service: &Service<H, P>, history: usize) -> Result<Reader<H, P>, IpcError> {
        let subscriber = service.subscriber_builder().history_request(history).create();
        let subscriber = subscriber.map_err(|cause| match cause {
            SubscriberCreateError::ExceedsMaxSupportedSubscribers => IpcError::TooManyReaders { service: self.service },
            other => self.failed("cannot be read", other),
        })?;
        Ok(Reader { subscriber, service: self.service })
    }

    fn open_or_create(&self, participant: &Participant) -> Result<Service<H, P>, IpcError> {
        let name = service_name(self.service)?;
        persistently(participant, || {
            let builder = participant
                .node
                .service_builder(&name)
                .publish_subscribe::<P>()
                .user_header::<H>()
                .enable_safe_overflow(true)
                .history_size(HISTORY)
                .max_publishers(1)
                .max_subscribers(self.readers)
                .max_nodes(MAX_NODES)
                .subscriber_max_buffer_size(self.buffer)
                .subscriber_max_borrowed_samples(self.borrowed);
            P::open_or_create(builder).map_err(|cause| match cause {
                OpenOrCreateError::PublishSubscribeOpenError(cause) => self.open_error(participant, cause),
                OpenOrCreateError::PublishSubscribeCreateError(
                    CreateError::AlreadyExists
                    | CreateError::IsBeingCreatedByAnotherInstance
                    | CreateError::HangsInCreation
                    | CreateError::Interrupt,
                )
                | OpenOrCreateError::SystemInFlux => self.in_flux(cause),
                other => self.failed("cannot be created", other),
            })
        })
    }

    fn open_error(&self, participant: &Participant, cause: OpenError) -> IpcError {
        let service = self.service;
        match cause {
            OpenError::DoesNotExist => IpcError::Absent { service, root: participant.domain.root_text() },
            OpenError::IncompatibleTypes | OpenError::VersionMismatch => IpcError::Incompatible { service },
            OpenError::IsMarkedForDestruction
            | OpenError::HangsInCreation
            | OpenError::Interrupt
            | OpenError::ServiceInCorruptedState => self.in_flux(cause),
            OpenError::ExceedsMaxNumberOfNodes => IpcError::TooManyReaders { service },
            other => self.failed("cannot be opened", other),
        }
    }

    fn in_flux(&self, cause: impl Debug) -> IpcError {
        IpcError::InFlux { service: self.service, cause: format!("{cause:?}") }
    }

    fn failed(&self, what: &'static str, cause: impl Debug) -> IpcError {
        IpcError::failed(self.service, what, cause)
    }
}

/// The one end of a service that writes.
#[derive(Debug)]
pub(super) struct Writer<H: Header, P: Body<H> + ?Sized> {
    publisher: Publisher<Ipc, P, H>,
    service: &'static str,
}

impl<H: Header, P: Body<H> + ?Sized> Writer<H, P> {
    /// Hands the newest message to readers that came since it was sent; for cycles in which nothing is sent.
    pub(super) fn greet(&self) -> Result<(), IpcError> {
        self.publisher
            .update_connections()
            .map_err(|cause| IpcError::failed(self.service, "a reader was not reached", cause))
    }

    /// Sends a header and what is written over a message of so many elements that holds anything. Never waits.
    pub(super) fn send(
        &self,
        header: H,
        length: usize,
        write: impl FnOnce(&mut P) -> Result<(), IpcError>,
    ) -> Result<(), IpcError> {
        let loan = P::loan(&self.publisher, length);
        let mut loan =
            loan.map_err(|cause| IpcError::failed(self.service, "no memory to write a message in", cause))?;
        *loan.user_header_mut() = header;
        write(P::contents(&mut loan))?;
        let sent = loan.send();
        sent.map(drop).map_err(|cause| IpcError::failed(self.service, "a message was not sent", cause))
    }
}

/// An end of a service that reads.
#[derive(Debug)]
pub(super) struct Reader<H: Header, P: Body<H> + ?Sized> {
    subscriber: Subscriber<Ipc, P, H>,
    service: &'static str,
}

impl<H: Header, P: Body<H> + ?Sized> Reader<H, P> {
    /// The next message, if there is one.
    pub(super) fn take(&self) -> Result<Option<Sample<Ipc, P, H>>, IpcError> {
        P::receive(&self.subscriber)
            .map_err(|cause| IpcError::failed(self.service, "a message was not received", cause))
    }

    /// The next message, waiting for it at most as long as said and never longer than [`LONGEST_SLEEP`](wake::LONGEST_SLEEP).
    pub(super) fn receive(&self, sleeper: &Sleeper, patience: Duration) -> Result<Option<Sample<Ipc, P, H>>, IpcError> {
        if let Some(sample) = self.take()? {
            return Ok(Some(sample));
        }
        if patience.is_zero() {
            return Ok(None);
        }
        sleeper.sleep(patience)?;
        self.take()
    }

    /// Whether there is a next message.
    pub(super) fn has_next(&self) -> Result<bool, IpcError> {
        let next = self.subscriber.has_samples();
        next.map_err(|cause| IpcError::failed(self.service, "the writer was not reached", cause))
    }
}

pub(super) fn service_name(service: &'static str) -> Result<iox::ServiceName, IpcError> {
    iox::ServiceName::new(service).map_err(|cause| IpcError::failed(service, "cannot be a service's name", cause))
}

/// Tries again, for a second, what is refused only while another process starts, ends or is being cleared away.
pub(super) fn persistently<T>(
    participant: &Participant,
    mut attempt: impl FnMut() -> Result<T, IpcError>,
) -> Result<T, IpcError> {
    const ATTEMPTS: u32 = 40;
    const PAUSE: Duration = Duration::from_millis(25);
    for _ in 1..ATTEMPTS {
        match attempt() {
            Err(IpcError::InFlux { .. } | IpcError::AlreadyRunning { .. }) => thread::sleep(PAUSE),
            settled => return settled,
        }
        participant.node.try_cleanup_dead_nodes();
    }
    attempt()
}
