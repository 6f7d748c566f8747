//! What happens when something must not have happened: a line in the log, and an exit that says so.

use core::{arch::naked_asm, panic::PanicInfo};

use crate::board::{Board, Selected};

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    defmt::error!("{}", defmt::Display2Format(info));
    Selected::end(false)
}

/// The processor could not go on: most likely the stack grew below its memory.
///
/// It begins with a fresh stack, since the old one may be what is at fault, and never returns to it.
#[unsafe(naked)]
#[unsafe(export_name = "HardFault")]
unsafe extern "C" fn hard_fault() -> ! {
    naked_asm!("mov r0, sp", "ldr r1, =_stack_start", "mov sp, r1", "b {fault}", fault = sym fault)
}

extern "C" fn fault(stack_pointer: usize) -> ! {
    const CONFIGURABLE_FAULT_STATUS: *const u32 = 0xE000_ED28 as *const u32;
    cortex_m::interrupt::disable();
    // SAFETY: a register of every ARMv7-M processor, readable at any time.
    let status = unsafe { core::ptr::read_volatile(CONFIGURABLE_FAULT_STATUS) };
    let bottom = crate::stack::bottom();
    if stack_pointer < bottom {
        defmt::error!("hard fault: stack overflow, {} bytes below its end", bottom - stack_pointer);
    } else {
        defmt::error!("hard fault: status {=u32:#010x}, stack pointer {=usize:#010x}", status, stack_pointer);
    }
    Selected::end(false)
}
