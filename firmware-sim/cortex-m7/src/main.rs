//! The firmware: a map of the profile `compact`.
#![no_std]
#![no_main]

#[cortex_m_rt::entry]
fn main() -> ! {
    bhm_cortex_m7::onboard::run(&bhm_cortex_m7::state::PROFILE)
}
