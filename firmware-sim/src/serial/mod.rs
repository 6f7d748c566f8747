//! The loop at the end of a serial line: postcard messages in COBS frames, each with the protocol's version and a CRC-32.
//!
//! Both ends use what is defined here. A device wires [`Onboard`](crate::Onboard) to a [`SerialLink`] over its [`Port`]; with
//! the feature `ipc`, a computer holds a [`HostEnd`], in which the device's posterior arises bit for bit, and reaches the
//! device through a [`HostPort`]. Ports on both sides are those of `embedded-io`.
//!
//! | | message | answered by |
//! |---|---|---|
//! | host → device | [`Hello`](ToDevice::Hello), with a number for the device's run if it has none | `Hello`, then a directory |
//! | | [`Scan`](ToDevice::Scan) | the tiles that changed, a directory, a status |
//! | | [`Refresh`](ToDevice::Refresh): tiles that the host lacks | those, a directory, a status |
//! | | [`Finish`](ToDevice::Finish) | `Finishing`, what is left to be sent, and then no more |
//! | device → host | [`Hello`](FromDevice::Hello): run, profile, digest of the settings, shape | |
//! | | [`TilePart`](FromDevice::TilePart): a part of a tile | |
//! | | [`Directory`](FromDevice::Directory): what the host must have by now | a refresh, if it has not |
//! | | [`Status`](FromDevice::Status): how far the device is, with the counters of the loop and of its link | |
//!
//! On the line a frame is `00 COBS(version ‖ postcard ‖ CRC-32 little-endian) 00`. What is damaged is dropped and counted
//! ([`LinkCounters`]), and the reader is in step again at the next zero. What is dropped is made good above: the host sends a
//! scan again that no directory or status acknowledges (the loop drops duplicates), and asks again for tiles that a directory
//! lists and it lacks. A device that starts again has no run, refuses scans meant for the run before, and gets its run from
//! the next greeting.
//!
//! Integers are varints of fixed width types, floats travel as their bits: the line does not depend on either end's machine.
#![forbid(unsafe_code)]

mod device;
mod frame;
#[cfg(feature = "ipc")]
mod host;
mod link_counters;
mod message;
pub mod packed;
mod port;
mod queue;
mod sent;
#[cfg(test)]
mod tests;

/// The traits that a [`Port`] builds on, in the version that it wants.
pub use embedded_io;

pub use device::{LinkBuffers, SerialFault, SerialLink};
pub use frame::{Damage, Deframer, DoesNotFit, PROTOCOL_VERSION, encode};
#[cfg(feature = "ipc")]
pub use host::*;
pub use link_counters::LinkCounters;
pub use message::{
    Bytes, DirectoryPart, FROM_DEVICE_BYTES, FromDevice, HelloFrame, NewsFrame, PART_BYTES, ScanFrame, StatusFrame,
    TO_DEVICE_BYTES, TilePart, ToDevice, Wanted,
};
pub use port::Port;
pub use queue::{Arrived, Arriving, ReceiveQueue};
pub use sent::SentTile;
