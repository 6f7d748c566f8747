use super::SharedMemoryError;

/// What receiving answers, from outside in: a fault of the port, no message yet, why a message cannot be used, or a message.
pub type Received<T, R> = Result<Option<Result<T, R>>, IpcError>;

/// Why a domain could not be joined, a port not opened, a message not sent or received.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum IpcError {
    /// A domain's name or path cannot be used.
    #[error("'{text}' cannot be used as {what}")]
    Domain {
        /// Name or root path.
        what: &'static str,
        /// What was given.
        text: String,
    },
    /// The domain could not be joined.
    #[error("cannot join the domain at {root}: {cause} (does it belong to another user?)")]
    Join {
        /// The domain's root path.
        root: String,
        /// What iceoryx2 said.
        cause: String,
    },
    /// A port that only one process may have is taken.
    #[error("another {who} is already running in this domain ({root})")]
    AlreadyRunning {
        /// Mapper or source of scans.
        who: &'static str,
        /// The domain's root path.
        root: String,
    },
    /// No process offers the service, perhaps only not yet.
    #[error("no mapper offers the service '{service}' in this domain ({root})")]
    Absent {
        /// The service.
        service: &'static str,
        /// The domain's root path.
        root: String,
    },
    /// The peer was built with another layout or another shape of tile.
    #[error(
        "the service '{service}' is in use with another message layout or tile shape; every process needs the same version"
    )]
    Incompatible {
        /// The service.
        service: &'static str,
    },
    /// The service has as many readers as it allows.
    #[error("the service '{service}' has as many readers as it allows")]
    TooManyReaders {
        /// The service.
        service: &'static str,
    },
    /// Shared memory does not suffice.
    #[error(transparent)]
    SharedMemory(#[from] SharedMemoryError),
    /// Another process is creating or removing the service; reported if that takes longer than a second.
    #[error("another process is creating or removing the service '{service}': {cause}")]
    InFlux {
        /// The service.
        service: &'static str,
        /// What iceoryx2 said.
        cause: String,
    },
    /// A scan has more beams than a message holds.
    #[error("a scan of {beams} beams, at most {} fit a scan message", bhm_core::scan::MAX_BEAMS)]
    TooManyBeams {
        /// Beams of the scan.
        beams: usize,
    },
    /// iceoryx2 failed for another reason.
    #[error("service '{service}': {what}: {cause}")]
    Failed {
        /// The service.
        service: &'static str,
        /// What went wrong.
        what: &'static str,
        /// What iceoryx2 said.
        cause: String,
    },
}

impl IpcError {
    pub(super) fn failed(service: &'static str, what: &'static str, cause: impl std::fmt::Debug) -> Self {
        Self::Failed { service, what, cause: format!("{cause:?}") }
    }
}
