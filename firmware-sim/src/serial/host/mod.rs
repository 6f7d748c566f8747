//! The computer's end of the line.

mod device_says;
mod mirror;
mod port;

use std::boxed::Box;
use std::vec;
use std::vec::Vec;

use bhm_core::{profile::Profile, scan::Scan, tile::TileIndex};
use bhm_host::ipc::{IpcError, NumberedScan, Place, ScanAddress};

use super::{
    Bytes, Damage, Deframer, DoesNotFit, FROM_DEVICE_BYTES, FromDevice, LinkCounters, ScanFrame, TO_DEVICE_BYTES,
    ToDevice, Wanted, encode, frame::read, packed,
};
pub use device_says::{Device, DeviceRefused, DeviceStatus};
pub use mirror::{Directory, Mirror, MirrorCounters, MirroredTile};
pub use port::{BridgePort, HostPort, PortAddress};

/// Most tiles that are asked for by name; if more are missing, all are asked for.
const MOST_NAMED: usize = 512;

/// What a device's bytes came to.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The device answered a greeting. If that is another run of the device than before, nothing is known of its map any more.
    Hello {
        /// Which device answered.
        device: Device,
        /// Whether this is another run of the device than before.
        new_run: bool,
    },
    /// A device answered whose posterior cannot be used here.
    Refused(DeviceRefused),
    /// Something whole came in another version of the protocol.
    OtherVersion {
        /// The message's version of the protocol.
        found: u8,
    },
    /// The [mirror](HostEnd::mirror) is, right now, what the directory lists.
    Posterior(Directory),
    /// The mirror is not what the directory lists: some tiles did not come. Ask for them with [`HostEnd::refresh`].
    Incomplete(Directory),
    /// How far the device has come.
    Status(DeviceStatus),
    /// The device was told to end, and does so.
    Finishing,
}

/// The computer's end of a serial line: takes what a device sends, and words what is sent to it.
///
/// This end reads and writes no port and knows no time: who uses it greets the device again if it is silent for long, and asks
/// again while [something is missing](Self::is_settled).
#[derive(Debug)]
pub struct HostEnd<const M: usize, const B: usize> {
    deframer: Box<Deframer<FROM_DEVICE_BYTES>>,
    known: Known<M, B>,
    buffer: Box<[u8]>,
    part: Vec<u8>,
}

/// What a device said.
#[derive(Debug)]
struct Known<const M: usize, const B: usize> {
    profile: Profile,
    mirror: Mirror<M, B>,
    device: Option<Device>,
    /// The newest directory that came whole, if any did in this run.
    directory: Option<Directory>,
    /// The newest directory that a status named.
    announced: u64,
    for_another_run: u64,
}

impl<const M: usize, const B: usize> HostEnd<M, B> {
    /// The end for devices of this profile.
    #[must_use]
    pub fn new(profile: &Profile) -> Self {
        let known = Known {
            profile: *profile,
            mirror: Mirror::new(),
            device: None,
            directory: None,
            announced: 0,
            for_another_run: 0,
        };
        Self { deframer: Box::default(), known, buffer: vec![0; TO_DEVICE_BYTES].into(), part: Vec::new() }
    }

    /// The device that answered last, if one did that can be used.
    #[must_use]
    pub fn device(&self) -> Option<&Device> {
        self.known.device.as_ref()
    }

    /// The device's tiles.
    #[must_use]
    pub fn mirror(&self) -> &Mirror<M, B> {
        &self.known.mirror
    }

    /// What this end saw of the line.
    #[must_use]
    pub fn counters(&self) -> &LinkCounters {
        &self.deframer.counters
    }

    /// What became of tiles and directories.
    #[must_use]
    pub fn mirror_counters(&self) -> &MirrorCounters {
        &self.known.mirror.counters
    }

    /// Whole messages of another run than the one that answered last, or of a device that was not asked yet.
    #[must_use]
    pub fn for_another_run(&self) -> u64 {
        self.known.for_another_run
    }

    /// Tiles that did not come although the newest directory lists them.
    #[must_use]
    pub fn missing(&self) -> &[TileIndex<2>] {
        self.known.directory.as_ref().map_or(&[], |directory| &directory.missing)
    }

    /// Whether everything is here that the device has, as far as it has said.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        let complete =
            |directory: &Directory| directory.missing.is_empty() && directory.behind == 0 && !self.lacks_directory();
        self.known.directory.as_ref().is_some_and(complete)
    }

    /// Whether the device said that there is a newer directory than came.
    #[must_use]
    pub fn lacks_directory(&self) -> bool {
        self.known.announced > self.known.mirror.directory()
    }

    /// Forgets the frame that was begun: the line was cut. Whether the device is the same, its answer to a greeting says.
    pub fn drop_begun(&mut self) {
        self.deframer.drop_begun();
    }

    /// Takes bytes off the front of `bytes` until something came of them; `None` if nothing did.
    pub fn take(&mut self, bytes: &mut &[u8]) -> Option<Event> {
        while !bytes.is_empty() {
            let outcome = self.deframer.take(bytes)?.and_then(|content| self.known.understand(read(content)?));
            self.deframer.count(&outcome);
            match outcome {
                Ok(Some(event)) => return Some(event),
                Err(Damage::Version { found }) => return Some(Event::OtherVersion { found }),
                Ok(None) | Err(_) => {}
            }
        }
        None
    }

    /// A greeting, as the line carries it; `fresh` is a number that was never used before, for a device that has no run yet.
    pub fn hello(&mut self, fresh: u64) -> &[u8] {
        self.send(&ToDevice::Hello { run: fresh.max(1) }).unwrap_or_default()
    }

    /// A scan for the device's present run; `None` as long as no device answered.
    ///
    /// # Errors
    /// [`IpcError::TooManyBeams`].
    pub fn scan(&mut self, numbered: &NumberedScan<'_>) -> Result<Option<&[u8]>, IpcError> {
        let Some(run) = self.device().map(|device| device.run) else { return Ok(None) };
        let NumberedScan { address: ScanAddress { source, sequence, place, .. }, scan } = *numbered;
        let Scan { header, ranges_m } = scan;
        let mut part = std::mem::take(&mut self.part);
        part.clear();
        part.extend(ranges_m.iter().flat_map(|range| range.to_le_bytes()));
        let frame = ScanFrame { run, source, sequence, last: place == Place::Last, header, ranges_m: Bytes(&part) };
        let sent = self.send(&ToDevice::Scan(frame)).map(<[u8]>::len);
        self.part = part;
        let length = sent.map_err(|_| IpcError::TooManyBeams { beams: ranges_m.len() })?;
        Ok(Some(&self.buffer[..length]))
    }

    /// A request for tiles that are missing, and for the directory.
    pub fn refresh(&mut self, missing: &[TileIndex<2>]) -> &[u8] {
        let named: Vec<u8> = missing.iter().take(MOST_NAMED).flat_map(packed::index_bytes).collect();
        let wanted = if missing.len() > MOST_NAMED { Wanted::All } else { Wanted::Only(Bytes(&named)) };
        self.send(&ToDevice::Refresh(wanted)).unwrap_or_default()
    }

    /// Tells the device's present run to end; `None` as long as no device answered.
    pub fn finish(&mut self) -> Option<&[u8]> {
        let run = self.device()?.run;
        self.send(&ToDevice::Finish { run }).ok()
    }

    fn send(&mut self, message: &ToDevice<'_>) -> Result<&[u8], DoesNotFit> {
        let bytes = encode(message, &mut self.buffer)?;
        self.deframer.counters.frames_sent += 1;
        self.deframer.counters.bytes_sent += bytes.len() as u64;
        Ok(bytes)
    }
}

impl<const M: usize, const B: usize> Known<M, B> {
    fn begin(&mut self, device: Option<Device>) {
        self.mirror.begin(device.as_ref().map_or(0, |device| device.slots));
        self.device = device;
        self.directory = None;
        self.announced = 0;
    }

    fn understand(&mut self, message: FromDevice<'_>) -> Result<Option<Event>, Damage> {
        let ours = self.device.as_ref().map(|device| device.run);
        Ok(match message {
            FromDevice::Hello(hello) if hello.run == 0 => return Err(Damage::Unreadable),
            FromDevice::Hello(hello) => Some(match Device::check::<M, B>(&hello, &self.profile) {
                Ok(device) => {
                    let new_run = ours != Some(device.run);
                    if new_run {
                        self.begin(Some(device.clone()));
                    }
                    Event::Hello { device, new_run }
                }
                Err(why) => Event::Refused(why),
            }),
            FromDevice::TilePart(part) if ours.is_some() => {
                self.mirror.take_part(&part);
                None
            }
            FromDevice::Directory(part) if Some(part.run) == ours => {
                let directory = self.mirror.take_directory(&part);
                self.directory = directory.clone().or(self.directory.take());
                directory.map(|directory| {
                    let complete = directory.missing.is_empty();
                    if complete { Event::Posterior(directory) } else { Event::Incomplete(directory) }
                })
            }
            FromDevice::Status(status) if Some(status.run) == ours => {
                let status_read = DeviceStatus::read(&status)?;
                self.announced = self.announced.max(status.directory);
                Some(Event::Status(status_read))
            }
            FromDevice::Finishing { run } if Some(run) == ours => Some(Event::Finishing),
            _ => {
                self.for_another_run += 1;
                None
            }
        })
    }
}
