//! What the services share: how they are opened, how readers are woken, and what iceoryx2's errors mean here.

use std::thread;
use std::time::Duration;

use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::port::subscriber::SubscriberCreateError;
use iceoryx2::prelude as iox;
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError as CreateError, PublishSubscribeOpenError as OpenError,
    PublishSubscribeOpenOrCreateError as OpenOrCreateError,
};

use super::{IpcError, Participant};

/// The flavour of iceoryx2 that crosses processes.
pub(super) type Ipc = iox::ipc::Service;

/// Most processes on one service.
pub(super) const MAX_NODES: usize = 16;

/// How long a wait lasts at most before the waiter looks for itself: what bounds the harm of a wake-up that was lost
/// because its sender died, and of a late joiner's first message, which comes without one.
pub(super) const LONGEST_SLEEP: Duration = Duration::from_millis(50);

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

pub(super) fn service_name(service: &'static str) -> Result<iox::ServiceName, IpcError> {
    iox::ServiceName::new(service).map_err(|cause| IpcError::failed(service, "cannot be a service's name", cause))
}

pub(super) fn open_error(participant: &Participant, service: &'static str, cause: OpenError) -> IpcError {
    match cause {
        OpenError::DoesNotExist => IpcError::Absent { service, root: participant.domain.root_text() },
        OpenError::IncompatibleTypes | OpenError::VersionMismatch => IpcError::Incompatible { service },
        OpenError::IsMarkedForDestruction
        | OpenError::HangsInCreation
        | OpenError::Interrupt
        | OpenError::ServiceInCorruptedState => IpcError::InFlux { service, cause: format!("{cause:?}") },
        OpenError::ExceedsMaxNumberOfNodes => IpcError::TooManyReaders { service },
        other => IpcError::failed(service, "cannot be opened", other),
    }
}

pub(super) fn open_or_create_error(
    participant: &Participant,
    service: &'static str,
    cause: OpenOrCreateError,
) -> IpcError {
    match cause {
        OpenOrCreateError::PublishSubscribeOpenError(cause) => open_error(participant, service, cause),
        OpenOrCreateError::PublishSubscribeCreateError(
            CreateError::AlreadyExists
            | CreateError::IsBeingCreatedByAnotherInstance
            | CreateError::HangsInCreation
            | CreateError::Interrupt,
        )
        | OpenOrCreateError::SystemInFlux => IpcError::InFlux { service, cause: format!("{cause:?}") },
        other => IpcError::failed(service, "cannot be created", other),
    }
}

pub(super) fn publisher_error(
    participant: &Participant,
    service: &'static str,
    who: &'static str,
    cause: PublisherCreateError,
) -> IpcError {
    match cause {
        PublisherCreateError::ExceedsMaxSupportedPublishers => {
            IpcError::AlreadyRunning { who, root: participant.domain.root_text() }
        }
        other => IpcError::failed(service, "cannot be written to", other),
    }
}

pub(super) fn subscriber_error(service: &'static str, cause: SubscriberCreateError) -> IpcError {
    match cause {
        SubscriberCreateError::ExceedsMaxSupportedSubscribers => IpcError::TooManyReaders { service },
        other => IpcError::failed(service, "cannot be read", other),
    }
}

fn event_service(
    participant: &Participant,
    service: &'static str,
) -> Result<iceoryx2::service::port_factory::event::PortFactory<Ipc>, IpcError> {
    let name = service_name(service)?;
    persistently(participant, || {
        participant
            .node
            .service_builder(&name)
            .event()
            .max_notifiers(MAX_NODES)
            .max_listeners(MAX_NODES)
            .max_nodes(MAX_NODES)
            .open_or_create()
            .map_err(|cause| IpcError::InFlux { service, cause: format!("{cause:?}") })
    })
}

/// Wakes the readers of a service.
#[derive(Debug)]
pub(super) struct Waker {
    notifier: Notifier<Ipc>,
}

impl Waker {
    pub(super) fn new(participant: &Participant, service: &'static str) -> Result<Self, IpcError> {
        let notifier = event_service(participant, service)?.notifier_builder().create();
        let notifier = notifier.map_err(|cause| IpcError::failed(service, "readers cannot be woken", cause))?;
        Ok(Self { notifier })
    }

    /// Wakes them. One that cannot be woken looks for itself after [`LONGEST_SLEEP`].
    pub(super) fn wake(&self) {
        let _ = self.notifier.notify();
    }
}

/// Sleeps until a service has news.
#[derive(Debug)]
pub(super) struct Sleeper {
    listener: Listener<Ipc>,
    service: &'static str,
}

impl Sleeper {
    pub(super) fn new(participant: &Participant, service: &'static str) -> Result<Self, IpcError> {
        let listener = event_service(participant, service)?.listener_builder().create();
        let listener = listener.map_err(|cause| IpcError::failed(service, "news cannot be waited for", cause))?;
        Ok(Self { listener, service })
    }

    /// Sleeps until woken, interrupted by a signal, or out of patience; no longer than [`LONGEST_SLEEP`].
    pub(super) fn sleep(&self, patience: Duration) -> Result<(), IpcError> {
        match self.listener.timed_wait(|_| {}, patience.min(LONGEST_SLEEP)) {
            Ok(_) | Err(ListenerWaitError::InterruptSignal) => Ok(()),
            Err(cause) => Err(IpcError::failed(self.service, "news cannot be waited for", cause)),
        }
    }
}
