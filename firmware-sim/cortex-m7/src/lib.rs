//! The onboard program as firmware: the same loop as on a computer, wired to a serial link instead of shared memory.
//!
//! What it needs of a board stands behind [`board::Board`]; everything it keeps lies in [`state`].
#![no_std]

pub mod board;
mod faults;
mod log;
pub mod onboard;
pub mod port;
pub mod stack;
pub mod state;
