use std::{
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, bail, ensure};
use bhm_host::ipc::TemporaryDomain;
use serde::Serialize;
use tracing::warn;

use super::{
    Deadline,
    child::Child,
    said::{Beginning, Onboarded, Sent, SourceSays, WatchSays, Watched},
};
use crate::progress::ScanCount;

/// How often the processes are looked after.
const TICK: Duration = Duration::from_millis(20);

/// How long the others may go on when one has ended. Saving a large map on a slow disk is what takes long.
const GRACE: Duration = Duration::from_secs(120);

/// Three processes in a domain of their own: a source of scans, the onboard process, a consumer.
///
/// Dropped, it ends those that have not ended, and then removes the domain.
pub(super) struct Crew {
    onboard: Child,
    watch: Child,
    source: Option<Child>,
    first_ended: Option<Instant>,
    domain: TemporaryDomain,
    log: CrewLog,
}

/// What the processes said.
#[derive(Default)]
struct CrewLog {
    beginning: Beginning,
    sent: Option<Sent>,
    onboarded: Option<Onboarded>,
    watched: Option<Watched>,
    /// Scans in the newest posterior that the consumer read.
    scans: Option<u64>,
}

/// The processes' ids.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct ProcessIds {
    pub(super) source: u32,
    pub(super) onboard: u32,
    pub(super) watch: u32,
}

/// What the three processes did.
pub(super) struct Outcome {
    pub(super) processes: ProcessIds,
    pub(super) beginning: Beginning,
    pub(super) sent: Sent,
    pub(super) onboarded: Onboarded,
    pub(super) watched: Watched,
}

impl Crew {
    /// Starts the mapper and its consumer. `config` is a file of map options; the map is saved as `map`.
    ///
    /// # Errors
    /// If the operating system refuses.
    pub(super) fn start(config: &Path, map: &Path, deadline: Deadline) -> anyhow::Result<Self> {
        let domain = TemporaryDomain::new()?;
        let name = domain.name();
        let [config, map] = [("--config", config), ("--save", map)].map(|(option, path)| {
            let path = path.to_str().with_context(|| format!("{} is not Unicode", path.display()))?;
            anyhow::Ok(format!("{option}={path}"))
        });
        let mut arguments = vec!["--until-end".to_owned(), "--consumers=1".to_owned(), config?, map?];
        arguments.extend(deadline.arguments());
        let onboard = Child::start("onboard", name, &arguments)?;
        let watch = Child::start("watch", name, &arguments[..1])?;
        Ok(Self { onboard, watch, source: None, first_ended: None, domain, log: CrewLog::default() })
    }

    /// Has `bhm SOURCE ARGUMENTS` send its scans to them and waits until all are done.
    ///
    /// # Errors
    /// If a process fails, ends early or does not end, or `stop` is raised.
    pub(super) fn run(
        mut self,
        source: &'static str,
        arguments: &[String],
        stop: &AtomicBool,
    ) -> anyhow::Result<Outcome> {
        let mut count = ScanCount::new();
        while !self.all_ended()? {
            ensure!(!stop.load(Ordering::Relaxed), "stopped before the end");
            thread::sleep(TICK);
            self.listen(&mut count)?;
            // Once the consumer has read the empty map it will see every later one.
            if self.source.is_none() && self.log.scans.is_some() {
                self.source = Some(Child::start(source, self.domain.name(), arguments)?);
            }
        }
        self.listen(&mut count)?;
        let processes = ProcessIds {
            source: self.source.as_ref().map_or(0, Child::id),
            onboard: self.onboard.id(),
            watch: self.watch.id(),
        };
        let log = std::mem::take(&mut self.log);
        Ok(Outcome {
            processes,
            beginning: log.beginning,
            sent: log.sent.context("the source did not say what it sent")?,
            onboarded: log.onboarded.context("the onboard process did not say what it did")?,
            watched: log.watched.context("the consumer did not say what it read")?,
        })
    }

    fn children(&mut self) -> impl Iterator<Item = &mut Child> {
        [&mut self.onboard, &mut self.watch].into_iter().chain(&mut self.source)
    }

    /// Whether all have ended, as they should.
    fn all_ended(&mut self) -> anyhow::Result<bool> {
        let begun = self.source.is_some();
        let (mut ended, mut running) = (Vec::new(), Vec::new());
        for child in self.children() {
            let list = if child.has_ended()? { &mut ended } else { &mut running };
            list.push(child.role());
        }
        if let Some(early) = ended.first().filter(|_| !begun) {
            bail!("{early} ended before there was a scan");
        }
        if !ended.is_empty() && !running.is_empty() {
            let since = *self.first_ended.get_or_insert_with(Instant::now);
            ensure!(since.elapsed() < GRACE, "{} ended, and {} went on", ended.join(", "), running.join(", "));
        }
        Ok(running.is_empty())
    }

    /// Takes note of what they said.
    fn listen(&mut self, count: &mut ScanCount) -> anyhow::Result<()> {
        let log = &mut self.log;
        if let Some(source) = &self.source {
            for line in source.said()? {
                match line {
                    SourceSays::Begins(beginning) => log.beginning = beginning,
                    SourceSays::Sent(sent) => log.sent = Some(sent),
                }
            }
        }
        log.onboarded = self.onboard.said()?.pop().or(log.onboarded.take());
        for line in self.watch.said()? {
            match line {
                WatchSays::Posterior(seen) => log.scans = Some(seen.scans),
                WatchSays::Watched(watched) => log.watched = Some(watched),
            }
        }
        count.show(log.scans.unwrap_or_default(), log.beginning.scans);
        for child in self.children() {
            for line in child.logged() {
                let role = child.role();
                count.pause(|| warn!("{role}: {}", line.trim_start().trim_start_matches("WARN ")));
            }
        }
        Ok(())
    }
}
