use embedded_io::{Read, ReadReady, Write};

/// A serial port as the loop on a device needs it: the traits of `embedded-io`, and what they lack. A board has one.
///
/// The loop reads only when [`ReadReady`] says that a byte is there, and writes whole messages at a time.
pub trait Port: Read + ReadReady + Write {
    /// Bytes that came and are lost, since the start: nobody read them in time.
    fn overruns(&self) -> u32;

    /// Rests until something happens, a byte that came before the call included, or a short while has passed.
    fn idle(&mut self);

    /// Lets a moment pass, tens of microseconds, or less if a byte comes: between two looks of a loop that waits for nothing.
    fn pause(&mut self) {}

    /// What a clock that never goes back shows, nanoseconds; `None` without one. See [`Link::now_ns`](crate::Link::now_ns).
    fn now_ns(&mut self) -> Option<u64> {
        None
    }

    /// The most that the stack ever took, bytes, if that is known.
    fn stack_high_water_bytes(&mut self) -> Option<u32> {
        None
    }
}
