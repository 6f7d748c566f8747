//! Learned supports from the mapper to the readers of its posterior: once, and kept for readers that come later.

use std::marker::PhantomData;

use super::topic::{Reader, Topic, Writer};
use super::{IpcError, Participant, Received, SupportMessage, SupportsHeader, SupportsRejected};
use crate::supports::LearnedSupports;

/// A reader copies what it gets, and gives it back at once.
fn topic(readers: usize) -> Topic<SupportsHeader, [SupportMessage]> {
    Topic { service: "supports", writer: "mapper", readers, buffer: 1, borrowed: 1, message: PhantomData }
}

/// Keeps a mapper's supports where readers find them.
#[derive(Debug)]
pub(super) struct SupportsPublisher {
    writer: Writer<SupportsHeader, [SupportMessage]>,
}

impl SupportsPublisher {
    /// Offers the supports to at most so many readers.
    pub(super) fn open(
        participant: &Participant,
        supports: &LearnedSupports,
        readers: usize,
    ) -> Result<Self, IpcError> {
        let count = supports.supports().len();
        let writer = topic(readers).writer(participant, count)?;
        let mut header = SupportsHeader::default();
        header.write(supports);
        writer.send(header, count, |messages| {
            for (message, support) in messages.iter_mut().zip(supports.supports()) {
                message.write(support);
            }
            Ok(())
        })?;
        Ok(Self { writer })
    }

    /// Hands the supports to readers that came since.
    pub(super) fn greet(&self) -> Result<(), IpcError> {
        self.writer.greet()
    }
}

/// Reads the supports of the domain's mapper.
#[derive(Debug)]
pub(super) struct SupportsSubscriber {
    reader: Reader<SupportsHeader, [SupportMessage]>,
}

impl SupportsSubscriber {
    /// A reader; `None` as long as no mapper offered supports.
    pub(super) fn open(participant: &Participant) -> Result<Option<Self>, IpcError> {
        match topic(1).reader_of_existing(participant) {
            Err(IpcError::Absent { .. }) => Ok(None),
            reader => Ok(Some(Self { reader: reader? })),
        }
    }

    /// The newest supports since the last call, copied.
    pub(super) fn take(&self) -> Received<LearnedSupports, SupportsRejected> {
        Ok(self.reader.take()?.map(|sample| sample.user_header().check(sample.payload())))
    }
}
