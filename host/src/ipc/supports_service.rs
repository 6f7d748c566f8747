//! Learned supports from the mapper to the readers of its posterior: once, and kept for readers that come later.

use std::marker::PhantomData;

use super::topic::{Reader, Topic, Writer};
use super::{IpcError, Participant, SupportMessage, SupportsHeader};
use crate::supports::LearnedSupports;

/// A reader copies what it gets, and gives it back at once.
fn topic(readers: usize) -> Topic<SupportsHeader, [SupportMessage]> {
    Topic { service: "supports", writer: "mapper", readers, buffer: 1, borrowed: 1, message: PhantomData }
}

/// Keeps a mapper's supports where readers find them.
pub(super) type SupportsWriter = Writer<SupportsHeader, [SupportMessage]>;

/// Offers the supports to at most so many readers.
pub(super) fn offer(
    participant: &Participant,
    supports: &LearnedSupports,
    readers: usize,
) -> Result<SupportsWriter, IpcError> {
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
    Ok(writer)
}

/// A reader of the supports of the domain's mapper; `None` as long as no mapper offered supports.
pub(super) fn reader(participant: &Participant) -> Result<Option<Reader<SupportsHeader, [SupportMessage]>>, IpcError> {
    match topic(1).reader_of_existing(participant) {
        Err(IpcError::Absent { .. }) => Ok(None),
        reader => reader.map(Some),
    }
}
