use std::{
    iter::Peekable,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::{Duration, Instant},
};

use bhm_core::scan::Scan;
use bhm_host::{
    ScanRecord,
    ipc::{self, Domain, IpcError, PacedSource, Place, ScanSource},
};
use clap::Args;

use super::json_lines::{Beginning, Sent, SourceLine};
use crate::{
    options::{PoseDeviations, number},
    output::{Output, Usage},
};

/// How long a source sleeps before it looks whether it is to end.
const NAP: Duration = Duration::from_millis(50);

/// Which of a source's scans are meant.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct Part {
    /// Leave the first scans out
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) skip: usize,
    /// Send so many scans at most
    #[arg(long, value_name = "N")]
    pub(crate) scans: Option<usize>,
}

impl Part {
    /// These scans of all.
    pub(crate) fn of<I: ExactSizeIterator>(self, scans: I) -> impl ExactSizeIterator<Item = I::Item> {
        scans.skip(self.skip).take(self.scans.unwrap_or(usize::MAX))
    }

    /// The options that say the same to another process.
    pub(crate) fn arguments(self) -> Vec<String> {
        let mut arguments = vec![format!("--skip={}", self.skip)];
        arguments.extend(self.scans.map(|scans| format!("--scans={scans}")));
        arguments
    }
}

/// How a source sends its scans.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct Sending {
    #[command(flatten)]
    pub(crate) part: Part,
    #[command(flatten)]
    poses: PoseDeviations,
    /// Send like a sensor: at the rate of the stamps, whether or not anybody keeps up. Otherwise the source waits for the
    /// mapper, and no scan is lost
    #[arg(long)]
    live: bool,
    /// Send so many scans per second at most [default: with --live as stamped, else as fast as the mapper takes them]
    #[arg(long, value_name = "HZ",
        value_parser = number(|hz| (1e-3..=1e6).contains(hz), "a number of scans per second, 0.001 to 1000000"))]
    rate: Option<f64>,
}

impl Sending {
    /// Sends scans (the part meant) until they end or `stop` is raised, and says so.
    ///
    /// # Errors
    /// If shared memory fails, or there is another source.
    pub(crate) fn run(
        &self,
        scans: impl ExactSizeIterator<Item = ScanRecord>,
        recorded_s: Option<f64>,
        domain: &Domain,
        stop: &AtomicBool,
        output: &Output,
    ) -> anyhow::Result<()> {
        self.poses.check().map_err(Usage)?;
        let participant = domain.join("bhm-source")?;
        let beginning = Beginning { scans: scans.len() as u64, recorded_s };
        output.result(&SourceLine::Begins(beginning.clone()), || format!("sending {} scans\n", beginning.scans))?;
        let poses = self.poses;
        let scans = scans.map(move |mut scan| {
            poses.apply(&mut scan);
            scan
        });
        let mut scans = scans.peekable();
        let first_ns = scans.peek().map_or(0, |scan| scan.header.stamp_ns);
        let start;
        let sent = if self.live {
            let mut source = ScanSource::open(&participant)?;
            start = Instant::now();
            let stamped = |scan: &ScanRecord| Duration::from_nanos(scan.header.stamp_ns.saturating_sub(first_ns));
            self.send(scans, start, stop, stamped, |scan, place| source.publish(scan, place).map(|_| true))?
        } else {
            let mut source = PacedSource::open(&participant)?;
            start = Instant::now();
            let at_once = |_: &ScanRecord| Duration::ZERO;
            let send = |scan: &Scan<'_>, place| Ok(source.send(scan, place, stop)? == ipc::Sent::Yes);
            let sent = self.send(scans, start, stop, at_once, send)?;
            let complete = sent.complete && source.finish(stop)? == ipc::Sent::Yes;
            Sent { complete, sent_again: source.sent_again(), ..sent }
        };
        let sent = Sent { seconds: start.elapsed().as_secs_f64(), ..sent };
        output.result(&SourceLine::Sent(sent.clone()), || {
            let Sent { scans, sent_again, seconds, complete } = sent;
            let stopped = if complete { "" } else { ", then stopped" };
            format!("sent {scans} scans ({sent_again} again) in {seconds:.2} s{stopped}\n")
        })
    }

    /// Sends scan by scan, each when it is due after `start`: by the rate, if one is given. Ends before a scan that `send` says
    /// was not taken.
    fn send(
        &self,
        mut scans: Peekable<impl Iterator<Item = ScanRecord>>,
        start: Instant,
        stop: &AtomicBool,
        due: impl Fn(&ScanRecord) -> Duration,
        mut send: impl FnMut(&Scan<'_>, Place) -> Result<bool, IpcError>,
    ) -> anyhow::Result<Sent> {
        let mut sent = Sent { complete: true, ..Sent::default() };
        while sent.complete
            && let Some(scan) = scans.next()
        {
            let by_rate = |rate_hz| Duration::from_secs_f64(sent.scans as f64 / rate_hz);
            let due = start + self.rate.map_or_else(|| due(&scan), by_rate);
            sent.complete = sleep_until(due, stop) && send(&scan.as_scan(), place(&mut scans))?;
            sent.scans += u64::from(sent.complete);
        }
        Ok(sent)
    }
}

fn place<T>(rest: &mut Peekable<impl Iterator<Item = T>>) -> Place {
    if rest.peek().is_none() { Place::Last } else { Place::Within }
}

/// Sleeps; false if `stop` was raised.
fn sleep_until(due: Instant, stop: &AtomicBool) -> bool {
    while !stop.load(Ordering::Relaxed) {
        let left = due.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return true;
        }
        thread::sleep(left.min(NAP));
    }
    false
}
