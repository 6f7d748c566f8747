use std::marker::PhantomData;
use std::time::Duration;

use bhm_core::scan::Scan;
use iceoryx2::sample::Sample;

use super::topic::{Ipc, Reader, Topic, Writer};
use super::wake::{Sleeper, Waker};
use super::{IpcError, NumberedScan, Participant, Place, ScanAddress, ScanMessage, ScanMessageRejected, fresh_id};

/// Scans that wait for the mapper before the oldest is overwritten.
pub const SCAN_BUFFER: usize = 8;

const TOPIC: Topic<(), ScanMessage> = Topic {
    service: "scan",
    writer: "source of scans",
    // The mapper, and onlookers.
    readers: 4,
    buffer: SCAN_BUFFER,
    // One that is being integrated, and one to spare.
    borrowed: 2,
    message: PhantomData,
};

/// Sends scans as they come: a live sensor. A mapper that is too slow loses the oldest and counts them.
#[derive(Debug)]
pub struct ScanSource {
    writer: Writer<(), ScanMessage>,
    waker: Waker,
    id: u64,
    sequence: u64,
}

impl ScanSource {
    /// The domain's source of scans; there is one at a time.
    ///
    /// # Errors
    /// [`IpcError::AlreadyRunning`] if there is another, [`IpcError::SharedMemory`] if there is no room.
    pub fn open(participant: &Participant) -> Result<Self, IpcError> {
        let writer = TOPIC.writer(participant, 1)?;
        Ok(Self { writer, waker: Waker::new(participant, TOPIC.service)?, id: fresh_id(), sequence: 0 })
    }

    /// What tells this source's run from every other.
    #[must_use]
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Sends a scan to whoever listens and answers its number. Never waits.
    ///
    /// # Errors
    /// [`IpcError::TooManyBeams`], or iceoryx2 failed.
    pub fn publish(&mut self, scan: &Scan<'_>, place: Place) -> Result<u64, IpcError> {
        let address = ScanAddress { source: self.id, mapper: None, sequence: self.sequence + 1, place };
        self.publish_as(&address, scan)?;
        self.sequence = address.sequence;
        Ok(address.sequence)
    }

    pub(super) fn publish_as(&self, address: &ScanAddress, scan: &Scan<'_>) -> Result<(), IpcError> {
        self.writer.send((), 1, |message| message.write(address, scan))?;
        self.waker.wake();
        Ok(())
    }
}

/// Receives scans, in order.
#[derive(Debug)]
pub struct ScanSink {
    reader: Reader<(), ScanMessage>,
    sleeper: Sleeper,
}

impl ScanSink {
    /// A receiver of the scans that are sent from now on.
    ///
    /// What was sent before is not asked for: a paced source sends again what was never acknowledged, in order, and the
    /// newest scan ahead of those would make them look out of date.
    ///
    /// # Errors
    /// [`IpcError::TooManyReaders`], or iceoryx2 failed.
    pub fn open(participant: &Participant) -> Result<Self, IpcError> {
        Ok(Self { reader: TOPIC.reader(participant, 0)?, sleeper: Sleeper::new(participant, TOPIC.service)? })
    }

    /// The next scan, waiting for it at most as long as said (and never longer than 50 ms).
    ///
    /// # Errors
    /// If iceoryx2 failed.
    pub fn receive(&mut self, patience: Duration) -> Result<Option<ScanSample>, IpcError> {
        let sample = self.reader.receive(&self.sleeper, patience)?;
        Ok(sample.map(|sample| ScanSample { sample }))
    }
}

/// A scan message, borrowed from shared memory until this is dropped.
#[derive(Debug)]
pub struct ScanSample {
    sample: Sample<Ipc, ScanMessage, ()>,
}

impl ScanSample {
    /// The scan, if the message can be read; its ranges stay where they are.
    ///
    /// # Errors
    /// The first fault found in the message.
    pub fn check(&self) -> Result<NumberedScan<'_>, ScanMessageRejected> {
        self.sample.payload().check()
    }
}
