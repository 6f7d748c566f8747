use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bhm_core::scan::{MAX_BEAMS, Scan};

use super::{IpcError, Participant, Place, SCAN_BUFFER, ScanAddress, ScanSource, StatusSubscriber};
use crate::ScanRecord;

/// Sends scans no faster than the mapper deals with them, so that none is lost: a replay.
///
/// At most [`SCAN_BUFFER`] scans are under way, which is what the mapper's buffer holds. If there is no mapper it waits for
/// one. If the mapper dies and another takes its place, what was never acknowledged is sent again, in order, addressed to
/// the new one (which ignores what was meant for the old). What *was* acknowledged is not: the dead mapper had learned it,
/// and its map is gone unless it was saved.
#[derive(Debug)]
pub struct PacedSource {
    source: ScanSource,
    status: StatusSubscriber,
    mapper: Option<u64>,
    under_way: VecDeque<UnderWay>,
    /// Memory of scans that were acknowledged.
    spare: Vec<Vec<f32>>,
    sequence: u64,
    sent_again: u64,
}

#[derive(Debug)]
struct UnderWay {
    sequence: u64,
    place: Place,
    scan: ScanRecord,
}

/// Whether the scans were taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sent {
    /// Yes.
    Yes,
    /// The wait was ended by the stop flag.
    Stopped,
}

impl PacedSource {
    /// The domain's source of scans; there is one at a time.
    ///
    /// # Errors
    /// See [`ScanSource::open`] and [`StatusSubscriber::open`].
    pub fn open(participant: &Participant) -> Result<Self, IpcError> {
        Ok(Self {
            source: ScanSource::open(participant)?,
            status: StatusSubscriber::open(participant)?,
            mapper: None,
            under_way: VecDeque::with_capacity(SCAN_BUFFER),
            spare: Vec::with_capacity(SCAN_BUFFER),
            sequence: 0,
            sent_again: 0,
        })
    }

    /// What tells this source's run from every other.
    #[must_use]
    pub fn id(&self) -> u64 {
        self.source.id()
    }

    /// Scans that were sent again because the mapper was replaced.
    #[must_use]
    pub fn sent_again(&self) -> u64 {
        self.sent_again
    }

    /// Scans that were sent and not yet acknowledged.
    #[must_use]
    pub fn under_way(&self) -> usize {
        self.under_way.len()
    }

    /// Sends a scan, as soon as there is a mapper with room for it.
    ///
    /// # Errors
    /// [`IpcError::TooManyBeams`], or iceoryx2 failed.
    pub fn send(&mut self, scan: &Scan<'_>, place: Place, stop: &AtomicBool) -> Result<Sent, IpcError> {
        if scan.ranges_m.len() > MAX_BEAMS {
            return Err(IpcError::TooManyBeams { beams: scan.ranges_m.len() });
        }
        // Told what is new even if there is room, so that a mapper that was replaced is noticed.
        self.listen(Duration::ZERO)?;
        while self.mapper.is_none() || self.under_way.len() >= SCAN_BUFFER {
            if stop.load(Ordering::Relaxed) {
                return Ok(Sent::Stopped);
            }
            self.listen(Duration::MAX)?;
        }
        self.sequence += 1;
        let mut ranges_m = self.spare.pop().unwrap_or_default();
        ranges_m.clear();
        ranges_m.extend_from_slice(scan.ranges_m);
        let kept = UnderWay { sequence: self.sequence, place, scan: ScanRecord { header: scan.header, ranges_m } };
        self.publish(&kept)?;
        self.under_way.push_back(kept);
        Ok(Sent::Yes)
    }

    /// Waits until everything sent was acknowledged.
    ///
    /// # Errors
    /// If iceoryx2 failed.
    pub fn finish(&mut self, stop: &AtomicBool) -> Result<Sent, IpcError> {
        while !self.under_way.is_empty() {
            if stop.load(Ordering::Relaxed) {
                return Ok(Sent::Stopped);
            }
            self.listen(Duration::MAX)?;
        }
        Ok(Sent::Yes)
    }

    fn publish(&self, kept: &UnderWay) -> Result<(), IpcError> {
        let address =
            ScanAddress { source: self.id(), mapper: self.mapper, sequence: kept.sequence, place: kept.place };
        self.source.publish_as(&address, &kept.scan.as_scan())
    }

    /// Takes note of the newest status, if there is one.
    fn listen(&mut self, patience: Duration) -> Result<(), IpcError> {
        let (mapper, handled) = match self.status.receive(patience)? {
            // One that cannot be read tells nothing; the next may.
            None | Some(Err(_)) => return Ok(()),
            Some(Ok(status)) => (status.mapper, status.progress().handled),
        };
        if let Some((source, handled)) = handled
            && source == self.id()
        {
            while self.under_way.front().is_some_and(|kept| kept.sequence <= handled) {
                self.spare.extend(self.under_way.pop_front().map(|kept| kept.scan.ranges_m));
            }
        }
        if self.mapper != Some(mapper) {
            self.mapper = Some(mapper);
            self.sent_again += self.under_way.len() as u64;
            for kept in &self.under_way {
                self.publish(kept)?;
            }
        }
        Ok(())
    }
}
