//! A line in memory, and what goes wrong on lines.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;
use std::vec::Vec;

use embedded_io::{ErrorType, Read, ReadReady, Write};
use rand::Rng;

use crate::serial::Port;

/// Bytes under way to a device, and those it sent.
#[derive(Clone, Debug, Default)]
pub(super) struct Line(Rc<RefCell<Bytes>>);

#[derive(Debug, Default)]
struct Bytes {
    to_device: VecDeque<u8>,
    from_device: Vec<u8>,
}

impl Line {
    pub(super) fn send(&self, bytes: &[u8]) {
        self.0.borrow_mut().to_device.extend(bytes);
    }

    /// What the device sent since the last call.
    pub(super) fn sent(&self) -> Vec<u8> {
        std::mem::take(&mut self.0.borrow_mut().from_device)
    }

    pub(super) fn is_quiet(&self) -> bool {
        self.0.borrow().to_device.is_empty()
    }
}

impl ErrorType for Line {
    type Error = Infallible;
}

impl ReadReady for Line {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.is_quiet())
    }
}

impl Read for Line {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Infallible> {
        let mut line = self.0.borrow_mut();
        let length = into.len().min(line.to_device.len());
        into.iter_mut().zip(line.to_device.drain(..length)).for_each(|(to, from)| *to = from);
        Ok(length)
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.0.borrow_mut().from_device.extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl Port for Line {
    fn overruns(&self) -> u32 {
        7
    }

    fn idle(&mut self) {}

    fn stack_high_water_bytes(&mut self) -> Option<u32> {
        Some(4_096)
    }
}

/// What became of a frame on a bad line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fate {
    Untouched,
    Flipped,
    Cut,
    Inserted,
    Repeated,
    Lost,
}

/// Spoils a frame, with this probability, in one way or another.
pub(super) fn spoil(frame: &[u8], probability: f64, rng: &mut impl Rng) -> (Vec<u8>, Fate) {
    if !rng.random_bool(probability) {
        return (frame.to_vec(), Fate::Untouched);
    }
    let mut bytes = frame.to_vec();
    let at = |rng: &mut _, bytes: &[u8]| Rng::random_range(rng, 0..bytes.len());
    let fate = match rng.random_range(0..7) {
        0 | 1 => {
            for _ in 0..rng.random_range(1..4) {
                let at = at(rng, &bytes);
                bytes[at] ^= 1 << rng.random_range(0..8);
            }
            Fate::Flipped
        }
        2 => {
            bytes.truncate(at(rng, &bytes));
            Fate::Cut
        }
        3 => {
            bytes.drain(..at(rng, &bytes));
            Fate::Cut
        }
        4 => {
            for _ in 0..rng.random_range(1..20) {
                let at = at(rng, &bytes);
                bytes.insert(at, rng.random());
            }
            Fate::Inserted
        }
        5 => {
            bytes.extend_from_within(..);
            Fate::Repeated
        }
        _ => {
            bytes.clear();
            Fate::Lost
        }
    };
    (bytes, fate)
}

/// What lies between two zeros of a line and is not empty: what a reader has to account for.
pub(super) fn segments(line: &[u8]) -> u64 {
    line.split(|byte| *byte == 0).filter(|segment| !segment.is_empty()).count() as u64
}
