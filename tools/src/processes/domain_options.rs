use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use bhm_host::{ipc::Domain, stop_on_signals};
use clap::Args;
use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};
use signal_hook::{consts::SIGHUP, flag};

use crate::output::Usage;

/// Through which domain of shared memory a process talks to the others, and when it ends.
#[derive(Args, Clone, Debug)]
pub(crate) struct DomainOptions {
    /// Where the processes meet: those of another domain see nothing of it [default: one for each user]
    #[arg(long, env = "BHM_DOMAIN", value_name = "NAME")]
    domain: Option<String>,
    /// The process without which this one ends; given by commands that start others
    #[arg(long, hide = true, value_name = "PID")]
    parent: Option<i32>,
}

impl DomainOptions {
    /// The domain, and a flag that SIGINT, SIGTERM and the parent's death raise.
    ///
    /// # Errors
    /// [`Usage`] if the name is invalid; if the operating system refuses.
    pub(crate) fn join(&self) -> anyhow::Result<(Domain, Arc<AtomicBool>)> {
        let domain = self.domain.as_deref().map_or(Ok(Domain::default()), Domain::named);
        let domain = domain.map_err(|error| Usage(error.to_string()))?;
        let stop = stop_on_signals()?;
        if let Some(parent) = self.parent {
            // Not SIGTERM, of which the second ends a process at once: the system sends one for each thread of the parent.
            flag::register(SIGHUP, Arc::clone(&stop))?;
            set_parent_process_death_signal(Some(Signal::HUP))?;
            // It may have died before that.
            if getppid().map(Pid::as_raw_pid) != Some(parent) {
                stop.store(true, Ordering::Relaxed);
            }
        }
        Ok((domain, stop))
    }
}
