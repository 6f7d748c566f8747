use std::{
    iter::Peekable,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::{Duration, Instant},
};

use bhm_host::{
    ScanRecord,
    ipc::{self, Domain, PacedSource, Place, ScanSource},
};
use clap::Args;

use super::json_lines::{Beginning, Sent, SourceLine};
use crate::{
    options::PoseDeviations,
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
    #[arg(long, value_name = "HZ", value_parser = rate)]
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
        let scans = scans.peekable();
        let sent = if self.live {
            self.send_live(scans, &mut ScanSource::open(&participant)?, stop)?
        } else {
            self.send_paced(scans, &mut PacedSource::open(&participant)?, stop)?
        };
        output.result(&SourceLine::Sent(sent.clone()), || {
            let Sent { scans, sent_again, seconds, complete } = sent;
            let stopped = if complete { "" } else { ", then stopped" };
            format!("sent {scans} scans ({sent_again} again) in {seconds:.2} s{stopped}\n")
        })
    }

    fn send_live(
        &self,
        mut scans: Peekable<impl Iterator<Item = ScanRecord>>,
        source: &mut ScanSource,
        stop: &AtomicBool,
    ) -> anyhow::Result<Sent> {
        let mut sent = Sent::default();
        let start = Instant::now();
        let first_ns = scans.peek().map_or(0, |scan| scan.header.stamp_ns);
        while let Some(scan) = scans.next() {
            let due =
                self.due(sent.scans).unwrap_or(Duration::from_nanos(scan.header.stamp_ns.saturating_sub(first_ns)));
            if !sleep_until(start + due, stop) {
                return Ok(Sent { seconds: start.elapsed().as_secs_f64(), ..sent });
            }
            source.publish(&scan.as_scan(), place(&mut scans))?;
            sent.scans += 1;
        }
        Ok(Sent { complete: true, seconds: start.elapsed().as_secs_f64(), ..sent })
    }

    fn send_paced(
        &self,
        mut scans: Peekable<impl Iterator<Item = ScanRecord>>,
        source: &mut PacedSource,
        stop: &AtomicBool,
    ) -> anyhow::Result<Sent> {
        let mut sent = Sent::default();
        let start = Instant::now();
        let mut going = true;
        while let Some(scan) = scans.next() {
            let due = start + self.due(sent.scans).unwrap_or_default();
            going = sleep_until(due, stop) && source.send(&scan.as_scan(), place(&mut scans), stop)? == ipc::Sent::Yes;
            if !going {
                break;
            }
            sent.scans += 1;
        }
        let complete = going && source.finish(stop)? == ipc::Sent::Yes;
        Ok(Sent { complete, sent_again: source.sent_again(), seconds: start.elapsed().as_secs_f64(), ..sent })
    }

    /// When the scan after so many is due, counted from the first.
    fn due(&self, sent: u64) -> Option<Duration> {
        self.rate.map(|rate_hz| Duration::from_secs_f64(sent as f64 / rate_hz))
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

fn rate(text: &str) -> Result<f64, String> {
    let rate_hz = text.parse::<f64>().ok().filter(|rate_hz| (1e-3..=1e6).contains(rate_hz));
    rate_hz.ok_or_else(|| "expected a number of scans per second, 0.001 to 1000000".to_owned())
}
