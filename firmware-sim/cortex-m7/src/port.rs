//! The serial link's port: the board's, with a queue between its interrupt and the loop.

use core::{cell::RefCell, convert::Infallible};

use bhm_firmware_sim::serial::{
    Arrived, Arriving, Port,
    embedded_io::{ErrorType, Read, ReadReady, Write},
};
use critical_section::Mutex;

use crate::{
    board::{Board, Selected},
    stack,
};

/// How often a pause looks whether a byte came: some ten thousand instructions.
const PAUSE_LOOKS: u32 = 2_000;

/// The interrupt's end of the queue, once there is one.
static ARRIVING: Mutex<RefCell<Option<Arriving<'static>>>> = Mutex::new(RefCell::new(None));

/// The board's port.
pub struct BoardPort {
    arrived: Arrived<'static>,
}

impl BoardPort {
    /// The port that reads from the queue which the interrupt fills from now on.
    pub fn new((arriving, arrived): (Arriving<'static>, Arrived<'static>)) -> Self {
        critical_section::with(|section| ARRIVING.replace(section, Some(arriving)));
        Self { arrived }
    }
}

impl ErrorType for BoardPort {
    type Error = Infallible;
}

impl ReadReady for BoardPort {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.arrived.is_empty())
    }
}

impl Read for BoardPort {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Infallible> {
        while !into.is_empty() && self.arrived.is_empty() {
            self.idle();
        }
        let bytes = core::iter::from_fn(|| self.arrived.pop());
        Ok(into.iter_mut().zip(bytes).map(|(to, from)| *to = from).count())
    }
}

impl Write for BoardPort {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        Selected::write(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl Port for BoardPort {
    fn overruns(&self) -> u32 {
        self.arrived.overruns()
    }

    fn idle(&mut self) {
        // Masked, an interrupt still ends the sleep: none can slip in between the question and the sleep.
        cortex_m::interrupt::free(|_| {
            if self.arrived.is_empty() {
                cortex_m::asm::wfi();
            }
        });
    }

    fn pause(&mut self) {
        for _ in 0..PAUSE_LOOKS {
            if !self.arrived.is_empty() {
                return;
            }
            cortex_m::asm::nop();
        }
    }

    fn now_ns(&mut self) -> Option<u64> {
        Some(Selected::now_ns())
    }

    fn stack_high_water_bytes(&mut self) -> Option<u32> {
        Some(stack::high_water_bytes())
    }
}

/// Every interrupt of the board.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(number: i16) {
    critical_section::with(|section| {
        if let Some(arriving) = ARRIVING.borrow_ref_mut(section).as_mut() {
            Selected::interrupt(number, arriving);
        }
    });
}
