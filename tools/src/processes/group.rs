use std::{
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, bail, ensure};
use bhm_host::ipc::{AnyPosterior, AnyPosteriorSubscriber, Participant, TemporaryDomain, open_posterior_any};
use serde::Serialize;
use tracing::warn;

use super::{
    Deadline,
    child::Child,
    firmware::{self, Firmware},
    json_lines::{Beginning, Onboarded, Sent, SourceLine, WatchLine, Watched},
};
use crate::progress::ScanCount;

/// How often the processes are looked after.
const TICK: Duration = Duration::from_millis(20);

/// How long the others may go on when one has ended. Saving a large map on a slow disk is what takes long.
const GRACE: Duration = Duration::from_secs(120);

/// Three processes in a domain of their own: a source of scans, the onboard process, a consumer. Where the map is made by
/// firmware, a bridge stands for the onboard process, and the firmware's emulator is a fourth.
///
/// Dropped, it ends those that have not ended, and then removes the domain.
pub(super) struct ProcessGroup {
    onboard: Child,
    watch: Child,
    source: Option<Child>,
    firmware: Option<Child>,
    /// What is in shared memory at the end, where nobody saves it.
    reader: Option<Reader>,
    first_ended: Option<Instant>,
    domain: TemporaryDomain,
    log: GroupLog,
}

/// What the processes printed.
#[derive(Default)]
struct GroupLog {
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
    /// The firmware's emulator.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) firmware: Option<u32>,
}

/// Who makes the map.
pub(super) enum Maker<'a> {
    /// The onboard process, with a file of map options and a deadline; the map is saved.
    Onboard { config: &'a Path, map: &'a Path, deadline: Deadline },
    /// Firmware in an emulator, with a bridge between it and shared memory.
    Firmware(&'a Firmware),
}

/// Reads the posterior where it lies. The port is closed before the domain is left.
struct Reader {
    subscriber: Option<Box<dyn AnyPosteriorSubscriber>>,
    participant: Participant,
}

/// What the three processes did.
pub(super) struct GroupResult {
    pub(super) processes: ProcessIds,
    pub(super) beginning: Beginning,
    pub(super) sent: Sent,
    pub(super) onboarded: Onboarded,
    pub(super) watched: Watched,
    /// The posterior in shared memory at the end, where nobody saved it.
    pub(super) posterior: Option<Box<dyn AnyPosterior>>,
    /// What the posterior belongs to is dropped after it.
    _reader: Option<Reader>,
    _domain: TemporaryDomain,
}

impl ProcessGroup {
    /// Starts the mapper and its consumer.
    ///
    /// # Errors
    /// If the operating system refuses.
    pub(super) fn start(maker: &Maker<'_>) -> anyhow::Result<Self> {
        let domain = TemporaryDomain::new()?;
        let name = domain.name();
        let until_end = "--until-end".to_owned();
        let (onboard, firmware, reader) = match maker {
            Maker::Onboard { config, map, deadline } => {
                let [config, map] = [("--config", config), ("--save", map)].map(|(option, path)| {
                    let path = path.to_str().with_context(|| format!("{} is not Unicode", path.display()))?;
                    anyhow::Ok(format!("{option}={path}"))
                });
                let mut arguments = vec![until_end.clone(), "--consumers=1".to_owned(), config?, map?];
                arguments.extend(deadline.arguments());
                (Child::start("onboard", name, &arguments)?, None, None)
            }
            Maker::Firmware(firmware) => {
                let participant = domain.join("bhm-group")?;
                let socket = domain.root().join("firmware.socket");
                let running = firmware.start(&socket)?;
                let port = format!("--port={}", firmware::address(&socket));
                let arguments = [until_end.clone(), "--consumers=2".to_owned(), "--wait=30".to_owned(), port];
                let bridge = Child::start("bridge", name, &arguments)?;
                (bridge, Some(running), Some(Reader { subscriber: None, participant }))
            }
        };
        let watch = Child::start("watch", name, &[until_end])?;
        let (source, first_ended, log) = (None, None, GroupLog::default());
        Ok(Self { onboard, watch, source, firmware, reader, first_ended, domain, log })
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
    ) -> anyhow::Result<GroupResult> {
        let mut count = ScanCount::new();
        while !self.all_ended()? {
            ensure!(!stop.load(Ordering::Relaxed), "stopped before the end");
            thread::sleep(TICK);
            self.listen(&mut count)?;
            // Once the consumer has read the empty map it will see every later one.
            if self.source.is_none() && self.log.scans.is_some() {
                if let Some(Reader { subscriber, participant }) = &mut self.reader {
                    *subscriber = Some(open_posterior_any(participant)?);
                }
                self.source = Some(Child::start(source, self.domain.name(), arguments)?);
            }
        }
        self.listen(&mut count)?;
        let processes = ProcessIds {
            source: self.source.as_ref().map_or(0, Child::id),
            onboard: self.onboard.id(),
            watch: self.watch.id(),
            firmware: self.firmware.as_ref().map(Child::id),
        };
        let log = std::mem::take(&mut self.log);
        let mut posterior = None;
        if let Some(subscriber) = self.reader.as_mut().and_then(|reader| reader.subscriber.as_mut()) {
            // The last one published lies there still, although whoever published it has gone.
            let received = subscriber.receive(Duration::ZERO)?.context("there is no posterior in shared memory")?;
            posterior = Some(received?);
        }
        Ok(GroupResult {
            posterior,
            _reader: self.reader,
            _domain: self.domain,
            processes,
            beginning: log.beginning,
            sent: log.sent.context("the source did not say what it sent")?,
            onboarded: log.onboarded.context("the onboard process did not say what it did")?,
            watched: log.watched.context("the consumer did not say what it read")?,
        })
    }

    fn children(&mut self) -> impl Iterator<Item = &mut Child> {
        [&mut self.onboard, &mut self.watch].into_iter().chain(&mut self.source).chain(&mut self.firmware)
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

    /// Takes note of what they printed.
    fn listen(&mut self, count: &mut ScanCount) -> anyhow::Result<()> {
        let log = &mut self.log;
        if let Some(source) = &self.source {
            for line in source.printed()? {
                match line {
                    SourceLine::Begins(beginning) => log.beginning = beginning,
                    SourceLine::Sent(sent) => log.sent = Some(sent),
                }
            }
        }
        log.onboarded = self.onboard.printed()?.pop().or(log.onboarded.take());
        for line in self.watch.printed()? {
            match line {
                WatchLine::Posterior(seen) => log.scans = Some(seen.scans),
                WatchLine::Watched(watched) => log.watched = Some(watched),
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
