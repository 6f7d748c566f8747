use bhm_core::{
    mapper::Mapper,
    profile::Profile,
    scan::{MAX_BEAMS, Scan},
    tile::Tile,
};
use serde::Serialize;

use super::{
    Bytes, Damage, Deframer, DirectoryPart, DoesNotFit, FROM_DEVICE_BYTES, FromDevice, HelloFrame, LinkCounters,
    NewsFrame, PART_BYTES, Port, ScanFrame, SentTile, StatusFrame, TO_DEVICE_BYTES, TilePart, ToDevice, Wanted, encode,
    frame::read,
    packed::{self, TileVersion, tile_floats},
    sent::SentTiles,
};
use crate::{Incoming, IncomingScan, Link, News, Patience, Report, Unusable};

/// The memory that a [`SerialLink`] works in, 25 KB.
#[derive(Debug)]
pub struct LinkBuffers {
    deframer: Deframer<TO_DEVICE_BYTES>,
    ranges_m: [f32; MAX_BEAMS],
    part: [u8; PART_BYTES],
    frame: [u8; FROM_DEVICE_BYTES],
}

impl LinkBuffers {
    /// Empty buffers, for a `static`.
    pub const NEW: Self = Self {
        deframer: Deframer::NEW,
        ranges_m: [0.0; MAX_BEAMS],
        part: [0; PART_BYTES],
        frame: [0; FROM_DEVICE_BYTES],
    };
}

/// What went wrong on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SerialFault<F> {
    /// The port failed.
    Port(F),
    /// A message is longer than a frame.
    DoesNotFit,
    /// The map has more tiles than [`SentTile`]s were lent.
    TooManyTiles,
}

impl<F> From<DoesNotFit> for SerialFault<F> {
    fn from(_: DoesNotFit) -> Self {
        Self::DoesNotFit
    }
}

/// The world at the other end of a serial line: the device's end.
///
/// The link says nothing until a host greets the device. From then on it sends each tile that changed, then the directory of what the host
/// must have by now. A host that lacks some of it asks for that again.
#[derive(Debug)]
pub struct SerialLink<'m, P> {
    port: P,
    profile: &'m Profile,
    buffers: &'m mut LinkBuffers,
    sent: SentTiles<'m>,
    bytes_per_publication: Option<u32>,
    /// The number of this run, once a host gave it one.
    run: Option<u64>,
    directories: u64,
    /// Whether the host waits for a directory.
    announce: bool,
    /// Whether everything has to be sent, whatever it takes.
    finishing: bool,
}

/// What a frame came to.
enum Got {
    /// A scan without its ranges, of which so many were copied.
    Scan(IncomingScan<'static>, usize),
    Unusable(Unusable),
    Answered,
    Stop,
}

impl<'m, P: Port> SerialLink<'m, P> {
    /// A link that was not greeted yet, with `sent` as long as the map has slots.
    ///
    /// With `bytes_per_publication`, a publication ends when so many bytes of tiles are sent, at least one tile; the other
    /// tiles' turn comes with the next, those that were sent longest ago first. At the end of a source everything is sent.
    pub fn new(
        port: P,
        profile: &'m Profile,
        buffers: &'m mut LinkBuffers,
        sent: &'m mut [SentTile],
        bytes_per_publication: Option<u32>,
    ) -> Self {
        Self {
            port,
            profile,
            buffers,
            sent: SentTiles::new(sent),
            bytes_per_publication,
            run: None,
            directories: 0,
            announce: false,
            finishing: false,
        }
    }

    /// What this end saw of the line.
    #[must_use]
    pub fn counters(&self) -> &LinkCounters {
        &self.buffers.deframer.counters
    }

    /// The port.
    #[must_use]
    pub fn port(&self) -> &P {
        &self.port
    }

    /// Reads on until something came of it, or nothing is left to be read.
    fn listen<const M: usize, const B: usize>(&mut self) -> Result<Option<Got>, SerialFault<P::Error>> {
        self.buffers.deframer.counters.bytes_overrun = u64::from(self.port.overruns());
        // Byte by byte: what follows a message stays with the port until the message is dealt with.
        while self.port.read_ready().map_err(SerialFault::Port)? {
            let mut byte = [0];
            self.port.read(&mut byte).map_err(SerialFault::Port)?;
            let LinkBuffers { deframer, ranges_m, .. } = &mut *self.buffers;
            let Some(content) = deframer.take(&mut &byte[..]) else { continue };
            let mut answer = None;
            let got = content.and_then(read).and_then(|message| match message {
                ToDevice::Scan(scan) if Some(scan.run) == self.run => header(&scan, ranges_m),
                ToDevice::Scan(_) => Ok(Got::Unusable(Unusable::ForAnother)),
                ToDevice::Hello { run: 0 } => Err(Damage::Unreadable),
                ToDevice::Hello { run } => {
                    let run = *self.run.get_or_insert(run);
                    self.announce = true;
                    answer = Some(FromDevice::Hello(hello::<M, B>(run, self.profile, self.sent.slots())));
                    Ok(Got::Answered)
                }
                ToDevice::Refresh(wanted) => {
                    match wanted {
                        Wanted::All => self.sent.all_due(),
                        Wanted::Only(Bytes(bytes)) => {
                            let indices = packed::indices(bytes).ok_or(Damage::Unreadable)?;
                            indices.for_each(|index| self.sent.make_due(&index));
                        }
                    }
                    self.announce = true;
                    Ok(Got::Answered)
                }
                ToDevice::Finish { run } if Some(run) == self.run => {
                    (self.finishing, self.announce) = (true, true);
                    answer = Some(FromDevice::Finishing { run });
                    Ok(Got::Stop)
                }
                ToDevice::Finish { .. } => Ok(Got::Unusable(Unusable::ForAnother)),
            });
            deframer.count(&got);
            if let Some(answer) = answer {
                self.send(&answer)?;
            }
            return Ok(Some(got.unwrap_or(Got::Unusable(Unusable::Unreadable))));
        }
        Ok(None)
    }

    /// Sends a message that lies outside the buffers.
    fn send(&mut self, message: &impl Serialize) -> Result<(), SerialFault<P::Error>> {
        let LinkBuffers { deframer, frame, .. } = &mut *self.buffers;
        send(&mut self.port, message, frame, &mut deframer.counters).map(|_| ())
    }

    /// Sends a tile in parts and answers the bytes it took.
    fn send_tile<const M: usize, const B: usize>(
        &mut self,
        tile: &Tile<2, M, B>,
    ) -> Result<usize, SerialFault<P::Error>> {
        let LinkBuffers { deframer, part, frame, .. } = &mut *self.buffers;
        let view = tile.posterior.view();
        let mut bytes = 0;
        for from in (0..tile_floats::<M, B>()).step_by(PART_BYTES / size_of::<f32>()) {
            let length = packed::write_tile(&view, from, part);
            let message = FromDevice::TilePart(TilePart {
                index: tile.index,
                updates: tile.updates,
                touched_at: tile.touched_at,
                from: from as u32,
                floats: Bytes(&part[..length]),
            });
            bytes += send(&mut self.port, &message, frame, &mut deframer.counters)?;
        }
        Ok(bytes)
    }

    fn send_directory(&mut self, run: u64, news: &NewsFrame) -> Result<(), SerialFault<P::Error>> {
        let LinkBuffers { deframer, part, frame, .. } = &mut *self.buffers;
        let (listed, behind) = (self.sent.known().count() as u32, self.sent.due() as u32);
        let (parts, _) = part.as_chunks_mut::<{ TileVersion::BYTES }>();
        let mut tiles = self.sent.known();
        let mut from = 0;
        // An empty directory is a part as well.
        loop {
            let mut here = 0;
            for (to, tile) in parts.iter_mut().zip(&mut tiles) {
                *to = tile.to_bytes();
                here += 1;
            }
            let message = FromDevice::Directory(DirectoryPart {
                run,
                number: self.directories,
                listed,
                from,
                behind,
                tiles: Bytes(parts[..here].as_flattened()),
                news: *news,
            });
            send(&mut self.port, &message, frame, &mut deframer.counters)?;
            from += here as u32;
            if from >= listed {
                return Ok(());
            }
        }
    }
}

impl<P: Port, const M: usize, const B: usize> Link<M, B> for SerialLink<'_, P> {
    type Fault = SerialFault<P::Error>;

    fn receive(&mut self, patience: Patience) -> Result<Incoming<'_>, Self::Fault> {
        let mut got = self.listen::<M, B>()?;
        if got.is_none() {
            match patience {
                Patience::Some => self.port.idle(),
                Patience::None => self.port.pause(),
            }
            got = self.listen::<M, B>()?;
        }
        Ok(match got {
            None | Some(Got::Answered) => Incoming::Nothing,
            Some(Got::Stop) => Incoming::Stop,
            Some(Got::Unusable(why)) => Incoming::Unusable(why),
            Some(Got::Scan(incoming, beams)) => {
                let received_ns = self.port.now_ns();
                let scan = Scan { ranges_m: &self.buffers.ranges_m[..beams], ..incoming.scan };
                Incoming::Scan(IncomingScan { received_ns, scan, ..incoming })
            }
        })
    }

    fn publish(&mut self, mapper: &Mapper<'_, 2, M, B>, news: &News) -> Result<(), Self::Fault> {
        // Nobody is there yet; whoever comes gets everything.
        let Some(run) = self.run else { return Ok(()) };
        let store = mapper.tiles();
        if !self.sent.follow(store) {
            return Err(SerialFault::TooManyTiles);
        }
        let budget = self.bytes_per_publication.filter(|_| !news.ended && !self.finishing);
        let mut left = budget.map_or(usize::MAX, |bytes| bytes as usize);
        self.directories += 1;
        while left > 0
            && let Some(tile) = self.sent.next_due().and_then(|index| store.get(&index))
        {
            left = left.saturating_sub(self.send_tile(tile)?);
            let Tile { index, updates, touched_at, .. } = *tile;
            self.sent.sent(TileVersion { index, updates, touched_at }, self.directories);
        }
        self.send_directory(run, &NewsFrame::new(news, mapper.scans(), mapper.newest_stamp_ns()))?;
        self.announce = false;
        Ok(())
    }

    fn report(&mut self, report: &Report<'_>) -> Result<(), Self::Fault> {
        let Some(run) = self.run else { return Ok(()) };
        let stack_high_water_bytes = self.port.stack_high_water_bytes();
        let LinkBuffers { deframer, part, frame, .. } = &mut *self.buffers;
        let counters = packed::write_named(report.counters.iter(), part).ok_or(DoesNotFit)?;
        let (counters, rest) = part.split_at_mut(counters);
        let link = packed::write_named(deframer.counters.iter(), rest).ok_or(DoesNotFit)?;
        let message = FromDevice::Status(StatusFrame {
            run,
            directory: self.directories,
            handled: report.handled,
            ended: report.ended,
            last_update_ns: report.update.map_or(0, |update| update.last_ns),
            slowest_update_ns: report.update.map_or(0, |update| update.slowest_ns),
            stack_high_water_bytes,
            counters: Bytes(counters),
            link: Bytes(&rest[..link]),
        });
        send(&mut self.port, &message, frame, &mut deframer.counters).map(|_| ())
    }

    fn now_ns(&mut self) -> Option<u64> {
        self.port.now_ns()
    }

    fn behind(&self) -> bool {
        self.run.is_some() && (self.announce || self.sent.due() > 0)
    }
}

/// Sends a message and answers how many bytes it took.
fn send<P: Port>(
    port: &mut P,
    message: &impl Serialize,
    frame: &mut [u8],
    counters: &mut LinkCounters,
) -> Result<usize, SerialFault<P::Error>> {
    let bytes = encode(message, frame)?;
    port.write_all(bytes).map_err(SerialFault::Port)?;
    counters.frames_sent += 1;
    counters.bytes_sent += bytes.len() as u64;
    Ok(bytes.len())
}

fn header(frame: &ScanFrame<'_>, ranges_m: &mut [f32; MAX_BEAMS]) -> Result<Got, Damage> {
    let beams = frame.ranges_into(ranges_m)?;
    let &ScanFrame { source, sequence, last, header, .. } = frame;
    let scan = Scan { header, ranges_m: &[] };
    Ok(Got::Scan(IncomingScan { source, sequence, last, received_ns: None, scan }, beams))
}

fn hello<const M: usize, const B: usize>(run: u64, profile: &Profile, slots: usize) -> HelloFrame<'_> {
    HelloFrame {
        run,
        profile: profile.name,
        settings: profile.settings.digest().0,
        passes: profile.settings.passes,
        supports: M as u32,
        band: B as u32,
        slots: slots as u32,
    }
}
