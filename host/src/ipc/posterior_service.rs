use std::marker::PhantomData;
use std::time::Duration;

use bhm_core::geometry::Pose;
use iceoryx2::sample::Sample;

use super::topic::{Ipc, Reader, Topic, Writer};
use super::wake::{Sleeper, Waker};
use super::{
    IpcError, Participant, PosteriorHeader, PosteriorRejected, PosteriorSample, PosteriorSource, PosteriorTile,
    Received,
};
use super::{
    posterior_message::KnownModel,
    posterior_sample::Refused,
    supports_reader::SupportsReader,
    supports_service::{SupportsWriter, offer},
};
use crate::supports::LearnedSupports;

const SERVICE: &str = "posterior";

/// Consumers that a posterior has room for unless said otherwise. Each costs three posteriors of shared memory.
pub const DEFAULT_CONSUMERS: usize = 4;

/// A consumer wants the newest posterior only, and may compare it with the one before.
fn topic<const M: usize, const B: usize>(readers: usize) -> Topic<PosteriorHeader, [PosteriorTile<M, B>]> {
    Topic { service: SERVICE, writer: "mapper", readers, buffer: 1, borrowed: 2, message: PhantomData }
}

/// What a mapper does not know about its own posterior.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PosteriorNews {
    /// Which run of which source was heard last, and the scan up to which all of its scans are dealt with.
    pub handled: Option<(u64, u64)>,
    /// Whether that source has ended, and its last scan is dealt with.
    pub ended: bool,
    /// Where the sensor stood at the newest scan integrated.
    pub map_from_sensor: Pose,
    /// Tiles kept elsewhere.
    pub archived: u64,
    /// Tiles evicted and not kept.
    pub lost: u64,
}

/// Writes posteriors into shared memory and hands them to whoever reads. It never waits for a reader.
#[derive(Debug)]
pub struct PosteriorPublisher<const M: usize, const B: usize> {
    writer: Writer<PosteriorHeader, [PosteriorTile<M, B>]>,
    /// The supports of their own that nodes of the map have, and who hands them out.
    supports: Option<(SupportsWriter, LearnedSupports)>,
    waker: Waker,
    mapper: u64,
    sequence: u64,
}

impl<const M: usize, const B: usize> PosteriorPublisher<M, B> {
    /// The domain's mapper publishes at most `slots` tiles at a time to at most `consumers` readers; `mapper` tells this run
    /// of it from every other, see [`fresh_id`](super::fresh_id).
    ///
    /// All shared memory it will ever need is taken here.
    ///
    /// # Errors
    /// [`IpcError::SharedMemory`] if there is no room, [`IpcError::AlreadyRunning`] if there is another mapper,
    /// [`IpcError::Incompatible`] if readers of another shape of tile are still waiting.
    pub fn open(participant: &Participant, mapper: u64, slots: usize, consumers: usize) -> Result<Self, IpcError> {
        Self::open_with(participant, mapper, slots, consumers, None)
    }

    /// The same for a map of which nodes have supports of their own: readers get those before the first posterior.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_with(
        participant: &Participant,
        mapper: u64,
        slots: usize,
        consumers: usize,
        supports: Option<LearnedSupports>,
    ) -> Result<Self, IpcError> {
        let consumers = consumers.max(1);
        // First, so that a reader which finds the posterior finds the supports.
        let offered = |supports| offer(participant, &supports, consumers).map(|writer| (writer, supports));
        let supports = supports.map(offered).transpose()?;
        let writer = topic(consumers).writer(participant, slots.max(1))?;
        Ok(Self { writer, supports, waker: Waker::new(participant, SERVICE)?, mapper, sequence: 0 })
    }

    /// From here on another run of the mapper publishes, counting anew.
    pub fn begin(&mut self, mapper: u64) {
        (self.mapper, self.sequence) = (mapper, 0);
    }

    /// Publishes the posterior's tiles as they are now, and answers the publication's number.
    ///
    /// # Errors
    /// If iceoryx2 failed, or the posterior has more tiles than `slots`.
    pub fn publish(&mut self, posterior: &impl PosteriorSource<M, B>, news: &PosteriorNews) -> Result<u64, IpcError> {
        let tiles = posterior.tiles();
        let resident = tiles.len();
        let mut header = PosteriorHeader::default();
        header.write(posterior.settings(), self.supports.as_ref().map(|(_, supports)| supports), (M, B), news);
        header.mapper = self.mapper;
        header.sequence = self.sequence + 1;
        header.stamp_ns = posterior.newest_stamp_ns();
        header.scans = posterior.scans();
        header.resident = resident as u64;
        self.writer.send(header, resident, |messages| {
            for (message, tile) in messages.iter_mut().zip(tiles) {
                message.write(&tile);
            }
            Ok(())
        })?;
        self.sequence += 1;
        self.greet_with_supports()?;
        self.waker.wake();
        Ok(self.sequence)
    }

    /// Hands the newest posterior to readers that came since; for cycles in which nothing is published.
    ///
    /// # Errors
    /// If iceoryx2 failed.
    pub fn greet(&self) -> Result<(), IpcError> {
        self.writer.greet()?;
        self.greet_with_supports()
    }

    /// After the posterior: a reader opens its port for supports before the one for posteriors, so that whoever got the
    /// posterior is reached.
    fn greet_with_supports(&self) -> Result<(), IpcError> {
        self.supports.as_ref().map_or(Ok(()), |(publisher, _)| publisher.greet())
    }
}

/// Reads posteriors where they lie.
#[derive(Debug)]
pub struct PosteriorSubscriber<const M: usize, const B: usize> {
    /// A posterior that came before its supports, kept until it is replaced or they are there: nobody sends it again.
    waiting: Option<Sample<Ipc, [PosteriorTile<M, B>], PosteriorHeader>>,
    reader: Reader<PosteriorHeader, [PosteriorTile<M, B>]>,
    supports: SupportsReader,
    known_model: KnownModel<M, B>,
    sleeper: Sleeper,
}

impl<const M: usize, const B: usize> PosteriorSubscriber<M, B> {
    /// A reader of the domain's posterior. Once open it outlives its mapper, and hears the next one.
    ///
    /// # Errors
    /// [`IpcError::Absent`] as long as no mapper was there, [`IpcError::Incompatible`] if its tiles have another shape,
    /// [`IpcError::TooManyReaders`].
    pub fn open(participant: &Participant) -> Result<Self, IpcError> {
        // First, so that a mapper which reaches this reader with a posterior reaches it with the supports as well.
        let supports = SupportsReader::open(participant)?;
        let reader = topic(1).reader_of_existing(participant)?;
        let sleeper = Sleeper::new(participant, SERVICE)?;
        Ok(Self { waiting: None, reader, supports, known_model: None, sleeper })
    }

    /// The newest posterior since the last call, waiting for it at most as long as said (and never longer than 50 ms).
    ///
    /// One whose supports have not arrived is [refused](PosteriorRejected::SupportsMissing) once, and given when they have,
    /// unless a newer one came meanwhile. A reader may hold two; it drops one to receive a third.
    ///
    /// # Errors
    /// If iceoryx2 failed.
    pub fn receive(&mut self, patience: Duration) -> Received<PosteriorSample<M, B>, PosteriorRejected> {
        if let Some(received) = self.take(patience)? {
            return Ok(Some(received));
        }
        if patience.is_zero() {
            return Ok(None);
        }
        self.sleeper.sleep(patience)?;
        self.take(patience)
    }

    fn take(&mut self, patience: Duration) -> Received<PosteriorSample<M, B>, PosteriorRejected> {
        let kept = match self.waiting.take() {
            // Given back before a newer one is taken, so that a reader can hold as many as it was promised.
            Some(old) if self.reader.has_next()? => {
                drop(old);
                None
            }
            kept => kept,
        };
        let known = kept.is_some();
        let sample = match kept {
            Some(kept) => Some(kept),
            None => self.reader.take()?,
        };
        let Some(sample) = sample else { return Ok(None) };
        let supports = self.supports.named(sample.user_header().supports_digest, patience)?;
        let supports = match supports {
            Ok(supports) => supports,
            Err(rejected) => return Ok(Some(Err(rejected.into()))),
        };
        match PosteriorSample::check(sample, supports.as_ref(), &mut self.known_model) {
            Ok(posterior) => Ok(Some(Ok(posterior))),
            Err(Refused { sample, why: why @ PosteriorRejected::SupportsMissing { .. } }) => {
                self.waiting = Some(sample);
                // Said once for each posterior.
                Ok((!known).then_some(Err(why)))
            }
            Err(Refused { why, .. }) => Ok(Some(Err(why))),
        }
    }
}
