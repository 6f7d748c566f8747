use core::sync::atomic::{AtomicU32, Ordering};

use heapless::spsc::{Consumer, Producer, Queue};

/// Bytes on their way from an interrupt to the loop: a [`heapless`] queue, and a count of the bytes that did not fit.
///
/// `N − 1` bytes fit. The loop reads between two updates only, so that a queue should hold what may come during one: a host
/// that waits for a scan's acknowledgement sends no more than greetings and requests.
#[derive(Debug)]
pub struct ReceiveQueue<const N: usize> {
    bytes: Queue<u8, N>,
    overruns: AtomicU32,
}

impl<const N: usize> Default for ReceiveQueue<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> ReceiveQueue<N> {
    /// An empty one, for a `static`.
    #[must_use]
    pub const fn new() -> Self {
        Self { bytes: Queue::new(), overruns: AtomicU32::new(0) }
    }

    /// The interrupt's end and the loop's end.
    pub fn split(&mut self) -> (Arriving<'_>, Arrived<'_>) {
        let Self { bytes, overruns } = self;
        let (producer, consumer) = bytes.split();
        (Arriving { bytes: producer, overruns }, Arrived { bytes: consumer, overruns })
    }
}

/// The interrupt's end of a [`ReceiveQueue`].
pub struct Arriving<'q> {
    bytes: Producer<'q, u8>,
    overruns: &'q AtomicU32,
}

impl Arriving<'_> {
    /// A byte came. If the queue is full it is lost, and counted.
    pub fn push(&mut self, byte: u8) {
        if self.bytes.enqueue(byte).is_err() {
            self.lost(1);
        }
    }

    /// Bytes came and were lost before they could be read: the hardware says so.
    pub fn lost(&mut self, bytes: u32) {
        self.overruns.fetch_add(bytes, Ordering::Relaxed);
    }
}

/// The loop's end of a [`ReceiveQueue`].
pub struct Arrived<'q> {
    bytes: Consumer<'q, u8>,
    overruns: &'q AtomicU32,
}

impl Arrived<'_> {
    /// The oldest byte that was not read, if there is one.
    pub fn pop(&mut self) -> Option<u8> {
        self.bytes.dequeue()
    }

    /// Whether no byte waits to be read.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !self.bytes.ready()
    }

    /// Bytes that were lost so far.
    #[must_use]
    pub fn overruns(&self) -> u32 {
        self.overruns.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_counted_and_the_rest_keeps_its_order() {
        let mut queue = ReceiveQueue::<8>::new();
        let (mut arriving, mut arrived) = queue.split();
        assert!(arrived.is_empty());
        (0..10).for_each(|byte| arriving.push(byte));
        arriving.lost(5);
        assert_eq!(arrived.overruns(), 3 + 5);
        assert!((0..7).all(|byte| arrived.pop() == Some(byte)));
        assert_eq!((arrived.pop(), arrived.is_empty()), (None, true));
        arriving.push(77);
        assert_eq!((arrived.pop(), arrived.overruns()), (Some(77), 8));
    }
}
