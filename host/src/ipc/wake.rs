//! How the writer of a service wakes its readers: an event of the same name.

use std::time::Duration;

use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::notifier::Notifier;
use iceoryx2::service::port_factory::event::PortFactory;

use super::topic::{Ipc, MAX_NODES, persistently, service_name};
use super::{IpcError, Participant};

/// How long a wait lasts at most before the waiter looks for itself: what bounds the harm of a wake-up that was lost
/// because its sender died, and of a late joiner's first message, which comes without one.
pub(super) const LONGEST_SLEEP: Duration = Duration::from_millis(50);

fn event_service(participant: &Participant, service: &'static str) -> Result<PortFactory<Ipc>, IpcError> {
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

    /// Wakes the readers. One that cannot be woken looks for itself after [`LONGEST_SLEEP`].
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

    /// Sleeps until woken, interrupted by a signal, or `patience` has passed; no longer than [`LONGEST_SLEEP`].
    pub(super) fn sleep(&self, patience: Duration) -> Result<(), IpcError> {
        match self.listener.timed_wait(|_| {}, patience.min(LONGEST_SLEEP)) {
            Ok(_) | Err(ListenerWaitError::InterruptSignal) => Ok(()),
            Err(cause) => Err(IpcError::failed(self.service, "news cannot be waited for", cause)),
        }
    }
}
