use std::marker::PhantomData;
use std::ops::Deref;
use std::time::Duration;

use iceoryx2::sample::Sample;

use super::topic::{Ipc, Reader, Topic, Writer};
use super::wake::{Sleeper, Waker};
use super::{IpcError, Participant, Progress, Received, StatusMessage, StatusRejected};

const TOPIC: Topic<(), StatusMessage> =
    Topic { service: "status", writer: "mapper", readers: 8, buffer: 1, borrowed: 2, message: PhantomData };

/// Says how far the mapper has come. There is one in a domain, and so one mapper.
#[derive(Debug)]
pub struct StatusPublisher {
    writer: Writer<(), StatusMessage>,
    waker: Waker,
    mapper: u64,
}

impl StatusPublisher {
    /// The domain's mapper speaks; `mapper` tells this run of it from every other, see [`fresh_id`](super::fresh_id).
    ///
    /// # Errors
    /// [`IpcError::AlreadyRunning`] if there is another mapper, [`IpcError::SharedMemory`] if there is no room.
    pub fn open(participant: &Participant, mapper: u64) -> Result<Self, IpcError> {
        let writer = TOPIC.writer(participant, 1)?;
        Ok(Self { writer, waker: Waker::new(participant, TOPIC.service)?, mapper })
    }

    /// From here on another run of the mapper speaks.
    pub fn begin(&mut self, mapper: u64) {
        self.mapper = mapper;
    }

    /// Says how far the mapper has come. Never waits.
    ///
    /// # Errors
    /// If iceoryx2 failed.
    pub fn publish<'n>(
        &mut self,
        progress: &Progress,
        counters: impl IntoIterator<Item = (&'n str, u64)>,
    ) -> Result<(), IpcError> {
        self.writer.send((), 1, |message| {
            message.write(self.mapper, progress, counters);
            Ok(())
        })?;
        self.waker.wake();
        Ok(())
    }

    /// Hands the newest status to readers that came since; for cycles in which nothing is published.
    ///
    /// # Errors
    /// If iceoryx2 failed.
    pub fn greet(&self) -> Result<(), IpcError> {
        self.writer.greet()
    }
}

/// Reads how far the mapper has come.
#[derive(Debug)]
pub struct StatusSubscriber {
    reader: Reader<(), StatusMessage>,
    sleeper: Sleeper,
}

impl StatusSubscriber {
    /// A reader; the mapper may come later, and go and come again.
    ///
    /// # Errors
    /// [`IpcError::TooManyReaders`], or iceoryx2 failed.
    pub fn open(participant: &Participant) -> Result<Self, IpcError> {
        Ok(Self { reader: TOPIC.reader(participant, 1)?, sleeper: Sleeper::new(participant, TOPIC.service)? })
    }

    /// The newest status since the last call, waiting for it at most as long as said (and never longer than 50 ms).
    ///
    /// # Errors
    /// If iceoryx2 failed.
    pub fn receive(&mut self, patience: Duration) -> Received<StatusSample, StatusRejected> {
        let sample = self.reader.receive(&self.sleeper, patience)?;
        Ok(sample.map(|sample| sample.payload().check().map(|()| StatusSample { sample })))
    }
}

/// A status that passed the checks, borrowed from shared memory until this is dropped.
#[derive(Debug)]
pub struct StatusSample {
    sample: Sample<Ipc, StatusMessage, ()>,
}

impl Deref for StatusSample {
    type Target = StatusMessage;

    fn deref(&self) -> &StatusMessage {
        self.sample.payload()
    }
}
