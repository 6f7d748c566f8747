//! A device at the end of a line, in the place of the onboard process.

mod outcome;
mod run;

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use std::vec::Vec;

use bhm_core::{
    profile::Profile,
    settings::Settings,
    shape::{self, ShapeVisitor},
};
use bhm_host::{
    ipc::{
        DEFAULT_CONSUMERS, Domain, IpcError, Participant, PosteriorPublisher, PosteriorSource, ScanSample, ScanSink,
        SourceTile, StatusPublisher,
    },
    map::{self, UnknownShape},
};

use crate::counters::counters;
use crate::serial::{BridgePort, DeviceStatus, HostEnd, Mirror, NewsFrame, packed::TileVersion};
pub use outcome::{BridgeError, BridgeSummary};

/// How a bridge behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BridgeOptions {
    /// Consumers of the posterior that shared memory is taken for; each costs three posteriors.
    pub consumers: usize,
    /// Whether to tell the device to end once a source has ended and its posterior is here, and then to end.
    pub until_end: bool,
    /// After how long without acknowledgement a scan is sent again. An emulated device may take seconds for one.
    pub send_again_after: Duration,
    /// After how long without a word from the device it is greeted again.
    pub greet_after: Duration,
    /// After how long without a word from the device it is given up.
    pub give_up_after: Duration,
}

impl Default for BridgeOptions {
    fn default() -> Self {
        Self {
            consumers: DEFAULT_CONSUMERS,
            until_end: false,
            send_again_after: Duration::from_secs(15),
            greet_after: Duration::from_secs(2),
            give_up_after: Duration::from_secs(60),
        }
    }
}

counters! {
    /// What a bridge did.
    BridgeCounters:
    /// Scans taken from shared memory for the device.
    scans_taken,
    /// Scans sent to the device again: nothing acknowledged them in time.
    scans_sent_again,
    /// Scans that the device had not acknowledged when it started again; a source that waits sends them again.
    scans_dropped,
    /// Messages in shared memory that could not be read.
    scans_unreadable,
    /// Scans in shared memory that were meant for an earlier run.
    scans_for_another,
    /// Requests for tiles that did not come.
    refreshes,
    /// Greetings.
    greetings,
    /// Times the device started again.
    device_restarts,
    /// Times the line was gone.
    line_gone,
    /// Posteriors published.
    posteriors,
    /// Devices refused: they have another profile, other settings, another shape.
    devices_refused,
    /// Messages in another version of the protocol.
    other_versions,
    /// Times shared memory failed.
    faults,
}

/// Takes the place of the onboard process in the domain: what a device at the end of `port` learns is published there, until
/// `stop` is raised, or as the options say.
///
/// Scans go to the device one at a time, the next when it acknowledged the one before; what cannot wait is overwritten in
/// shared memory and counted by the device as lost. A device that starts again is another run of the mapper to sources and
/// consumers.
///
/// # Errors
/// See [`BridgeError`].
pub fn run_bridge(
    profile: &Profile,
    domain: &Domain,
    options: &BridgeOptions,
    port: &mut dyn BridgePort,
    stop: &AtomicBool,
) -> Result<BridgeSummary, BridgeError> {
    let shape = map::shape(profile)?;
    shape::visit(shape, Open { profile, domain, options, port, stop }).map_err(UnknownShape::from)?
}

struct Open<'a> {
    profile: &'a Profile,
    domain: &'a Domain,
    options: &'a BridgeOptions,
    port: &'a mut dyn BridgePort,
    stop: &'a AtomicBool,
}

impl ShapeVisitor for Open<'_> {
    type Output = Result<BridgeSummary, BridgeError>;

    fn visit<const M: usize, const B: usize>(self) -> Self::Output {
        Bridge::<M, B>::open(self)?.run()
    }
}

/// A scan that the device has not acknowledged yet.
struct UnderWay {
    sample: ScanSample,
    source: u64,
    sequence: u64,
    sent: Instant,
}

/// What was published last.
#[derive(PartialEq)]
struct Published {
    tiles: Vec<TileVersion>,
    news: NewsFrame,
}

struct Bridge<'p, const M: usize, const B: usize> {
    // Fields are dropped in this order: a sample before its port, ports before what they belong to.
    under_way: Option<UnderWay>,
    scans: ScanSink,
    posterior: Option<(PosteriorPublisher<M, B>, usize)>,
    status: StatusPublisher,
    participant: Participant,
    mapper: u64,
    end: HostEnd<M, B>,
    port: &'p mut dyn BridgePort,
    stop: &'p AtomicBool,
    options: BridgeOptions,
    settings: Settings,
    counters: BridgeCounters,
    published: Option<Published>,
    device_status: DeviceStatus,
    last_fault: Option<IpcError>,
    last_refusal: Option<BridgeError>,
    /// When the device last said something that can be read here.
    heard: Instant,
    /// When it was last greeted or asked for something.
    asked: Instant,
    /// Whether the line is there.
    connected: bool,
    /// Whether the device was told to end.
    told_to_finish: bool,
    /// Whether it said that it does.
    finishing: bool,
}

/// What the device's tiles are together.
struct Mirrored<'a, const M: usize, const B: usize> {
    settings: &'a Settings,
    mirror: &'a Mirror<M, B>,
    news: &'a NewsFrame,
}

impl<const M: usize, const B: usize> PosteriorSource<M, B> for Mirrored<'_, M, B> {
    fn settings(&self) -> &Settings {
        self.settings
    }

    fn scans(&self) -> u64 {
        self.news.scans
    }

    fn newest_stamp_ns(&self) -> u64 {
        self.news.newest_stamp_ns
    }

    fn tiles(&self) -> impl ExactSizeIterator<Item = SourceTile<'_, M, B>> {
        self.mirror.tiles().map(|tile| {
            let TileVersion { index, updates, touched_at } = tile.version;
            SourceTile { index, updates, touched_at, view: tile.view() }
        })
    }
}
