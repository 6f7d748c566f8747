use std::thread;
use std::time::{Duration, Instant};

use super::{
    IpcError, Participant, Received, SupportMessage, SupportsHeader, SupportsRejected, supports_service, topic::Reader,
    wake::LONGEST_SLEEP,
};
use crate::supports::LearnedSupports;

/// A mapper hands supports out a moment after the posterior; how often that is looked for.
const NAP: Duration = Duration::from_millis(1);

/// Has the supports that posteriors name.
#[derive(Debug)]
pub(super) struct SupportsReader {
    known: Option<LearnedSupports>,
    /// The digest that was waited for in vain, once.
    missed: u32,
    reader: Option<Reader<SupportsHeader, [SupportMessage]>>,
    participant: Participant,
}

impl SupportsReader {
    /// A reader; supports may be offered later.
    pub(super) fn open(participant: &Participant) -> Result<Self, IpcError> {
        let reader = supports_service::reader(participant)?;
        Ok(Self { known: None, missed: 0, reader, participant: participant.clone() })
    }

    /// The supports of that digest; `None` if there are to be none, or they have not arrived, waiting for them at most as
    /// long as said (and never longer than 50 ms).
    ///
    /// What arrives is kept only if it is what is asked for: a reader holds one table.
    pub(super) fn named(
        &mut self,
        digest: u32,
        patience: Duration,
    ) -> Result<Result<Option<LearnedSupports>, SupportsRejected>, IpcError> {
        if digest == 0 {
            return Ok(Ok(None));
        }
        let begun = Instant::now();
        loop {
            if let Some(known) = self.known.as_ref().filter(|known| known.digest() == digest) {
                return Ok(Ok(Some(known.clone())));
            }
            match self.take()? {
                Some(Ok(supports)) if supports.digest() == digest => self.known = Some(supports),
                // An earlier mapper's.
                Some(Ok(_)) => {}
                Some(Err(rejected)) => return Ok(Err(rejected)),
                None if self.missed == digest || begun.elapsed() >= patience.min(LONGEST_SLEEP) => {
                    self.missed = digest;
                    return Ok(Ok(None));
                }
                None => thread::sleep(NAP),
            }
        }
    }

    /// The newest supports since the last call, copied.
    fn take(&mut self) -> Received<LearnedSupports, SupportsRejected> {
        if self.reader.is_none() {
            self.reader = supports_service::reader(&self.participant)?;
        }
        let newest = self.reader.as_ref().map_or(Ok(None), Reader::take)?;
        Ok(newest.map(|sample| sample.user_header().check(sample.payload())))
    }
}
