//! Both ends against lines that flip, cut, insert, repeat and lose, and against each other.

mod device;
mod frames;
#[cfg(feature = "ipc")]
mod host;
mod line;
#[cfg(feature = "ipc")]
mod loopback;
