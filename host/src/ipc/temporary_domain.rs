use std::fs;
use std::ops::Deref;
use std::process;
use std::sync::atomic::{AtomicU32, Ordering};

use super::{Domain, IpcError, shared_memory};

/// A domain that nobody else uses, and of which nothing is left afterwards: for tests, and for programs that start all
/// their processes themselves.
#[derive(Debug)]
pub struct TemporaryDomain {
    domain: Domain,
    name: String,
}

impl TemporaryDomain {
    /// A domain that did not exist.
    ///
    /// # Errors
    /// [`IpcError::Domain`], which is not expected: the name is made to be usable.
    pub fn new() -> Result<Self, IpcError> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let name = format!("t{}-{}", process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        Ok(Self { domain: Domain::named(&name)?, name })
    }

    /// The name by which another process finds it with [`Domain::named`].
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl Deref for TemporaryDomain {
    type Target = Domain;

    fn deref(&self) -> &Domain {
        &self.domain
    }
}

impl Drop for TemporaryDomain {
    fn drop(&mut self) {
        // What cannot be removed is left; there is nobody to tell.
        let _ = fs::remove_dir_all(self.domain.root());
        shared_memory::remove_all(&self.domain);
    }
}
