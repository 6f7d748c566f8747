//! What the firmware needs of a board.
//!
//! A board is one file in `boards/`, chosen at build time by its name in `BHM_BOARD`. It carries its memory map in its
//! documentation, as a block marked `memory.x`, and its serial port, log and clock as an implementation of [`Board`];
//! `Selected` names that.

use bhm_core::tile::Tile;
use bhm_firmware_sim::serial::Arriving;

use crate::state::{B, M};

/// A board. There is one, so that its methods need no value.
pub trait Board {
    /// What it is called.
    const NAME: &'static str;

    /// Starts the serial ports, the clock and their interrupts.
    fn start();

    /// Deals with the interrupt of that number; what the link's port received goes into `arriving`.
    fn interrupt(number: i16, arriving: &mut Arriving<'_>);

    /// Sends bytes over the link; waits until the port has taken them.
    fn write(bytes: &[u8]);

    /// Sends bytes of the log; waits until the port has taken them.
    fn log(bytes: &[u8]);

    /// Nanoseconds since the start, never less than before.
    fn now_ns() -> u64;

    /// Memory beside that of the map for tiles that leave it, vacant; empty where there is none. Asked for once.
    fn archive() -> &'static mut [Tile<2, M, B>];

    /// Ends the program, well or not, if something runs it that can be told; else stays here.
    fn end(well: bool) -> !;
}

include!(concat!(env!("OUT_DIR"), "/board.rs"));
