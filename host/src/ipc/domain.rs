use std::path::{Path, PathBuf};
use std::rc::Rc;

use iceoryx2::prelude as iox;

use super::IpcError;

/// Where processes find each other's services. Two domains see nothing of each other.
///
/// Set in code and passed explicitly, so that a configuration file in the working directory has no say.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Domain {
    root: PathBuf,
    prefix: String,
}

/// Longest root path and prefix, bytes: socket addresses hold a hundred.
const MAX_ROOT: usize = 48;
const MAX_PREFIX: usize = 40;

impl Default for Domain {
    /// The domain of the user who runs the process.
    fn default() -> Self {
        let user = rustix::process::getuid().as_raw();
        Self { root: PathBuf::from(format!("/tmp/bhm-{user}")), prefix: format!("bhm_{user}_") }
    }
}

impl Domain {
    /// A domain whose files lie below `root`, and whose shared-memory segments have names that begin with `prefix`.
    ///
    /// # Errors
    /// [`IpcError::Domain`] if one of them is too long, or holds what a file name cannot.
    pub fn new(root: impl Into<PathBuf>, prefix: impl Into<String>) -> Result<Self, IpcError> {
        let domain = Self { root: root.into(), prefix: prefix.into() };
        domain.config().map(|_| domain)
    }

    /// One of several domains of the user who runs the process.
    ///
    /// # Errors
    /// [`IpcError::Domain`] if the name is not one to sixteen ASCII letters, digits or hyphens.
    pub fn named(name: &str) -> Result<Self, IpcError> {
        let usable = name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-');
        if !usable || name.is_empty() || name.len() > 16 {
            return Err(IpcError::Domain { what: "a domain's name", text: name.to_owned() });
        }
        let Self { root, prefix } = Self::default();
        Self::new(root.join(name), format!("{prefix}{name}_"))
    }

    /// The folder of the domain's files.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// What the names of the domain's shared-memory segments begin with.
    #[must_use]
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// Joins the domain, and clears away what dead processes left in it.
    ///
    /// Signals are left alone; see [`crate::stop_on_signals`].
    ///
    /// # Errors
    /// [`IpcError::Join`], most often because the domain belongs to another user.
    pub fn join(&self, name: &str) -> Result<Participant, IpcError> {
        // What fails is returned as an error; iceoryx2 need not say it as well. IOX2_LOG_LEVEL overrides this.
        iox::set_log_level_from_env_or(iox::LogLevel::Fatal);
        let unusable = |_| IpcError::Domain { what: "a participant's name", text: name.to_owned() };
        let node = iox::NodeBuilder::new()
            .name(&iox::NodeName::new(name).map_err(unusable)?)
            .config(&self.config()?)
            .signal_handling_mode(iox::SignalHandlingMode::Disabled)
            .create::<iox::ipc::Service>()
            .map_err(|cause| IpcError::Join { root: self.root_text(), cause: format!("{cause:?}") })?;
        Ok(Participant { node: Rc::new(node), domain: self.clone() })
    }

    pub(super) fn root_text(&self) -> String {
        self.root.display().to_string()
    }

    fn config(&self) -> Result<iox::Config, IpcError> {
        let bad_root = || IpcError::Domain { what: "a root path", text: self.root_text() };
        let bad_prefix = || IpcError::Domain { what: "a prefix", text: self.prefix.clone() };
        let root = self.root.to_str().filter(|root| root.len() <= MAX_ROOT && root.starts_with('/'));
        let root = iox::SemanticString::new(root.ok_or_else(bad_root)?.as_bytes()).map_err(|_| bad_root())?;
        if self.prefix.is_empty() || self.prefix.len() > MAX_PREFIX {
            return Err(bad_prefix());
        }
        let mut config = iox::Config::default();
        config.global.set_root_path(&root);
        config.global.prefix = iox::SemanticString::new(self.prefix.as_bytes()).map_err(|_| bad_prefix())?;
        Ok(config)
    }
}

/// A process's membership of a [`Domain`], on which it opens its ports. Copies are the same membership.
#[derive(Clone, Debug)]
pub struct Participant {
    pub(super) node: Rc<iox::Node<iox::ipc::Service>>,
    pub(super) domain: Domain,
}

impl Participant {
    /// The domain.
    #[must_use]
    pub fn domain(&self) -> &Domain {
        &self.domain
    }
}
