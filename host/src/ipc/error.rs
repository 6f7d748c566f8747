use super::SharedMemoryError;

/// What a reader gets, from outside in: a fault of its port, nothing yet, a message that cannot be used and why, or a
/// message.
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
    /// Nobody offers the service (yet).
    #[error("no mapper offers '{service}' in this domain ({root})")]
    Absent {
        /// The service.
        service: &'static str,
        /// The domain's root path.
        root: String,
    },
    /// The peer was built with another layout or another shape of tile.
    #[error("'{service}' is in use with another message layout or tile shape; every process needs the same version")]
    Incompatible {
        /// The service.
        service: &'static str,
    },
    /// No more readers fit.
    #[error("'{service}' has as many readers as it allows")]
    TooManyReaders {
        /// The service.
        service: &'static str,
    },
    /// Shared memory does not suffice.
    #[error(transparent)]
    SharedMemory(#[from] SharedMemoryError),
    /// The service is being created or removed by somebody else; only seen if that takes longer than a second.
    #[error("'{service}' is in flux: {cause}")]
    InFlux {
        /// The service.
        service: &'static str,
        /// What iceoryx2 said.
        cause: String,
    },
    /// A scan has more beams than a message holds.
    #[error("{beams} beams, at most {} fit a scan message", bhm_core::scan::MAX_BEAMS)]
    TooManyBeams {
        /// Beams of the scan.
        beams: usize,
    },
    /// Anything else.
    #[error("'{service}': {what}: {cause}")]
    Failed {
        /// The service.
        service: &'static str,
        /// What was tried.
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
