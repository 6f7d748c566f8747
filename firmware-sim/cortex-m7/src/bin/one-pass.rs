//! The firmware with one pass over each scan instead of three: for slower processors and faster lidars.
#![no_std]
#![no_main]

use bhm_core::{profile::Profile, settings::Settings};
use bhm_cortex_m7::state::PROFILE;

static ONE_PASS: Profile = Profile { settings: Settings { passes: 1, ..PROFILE.settings }, ..PROFILE };

#[cortex_m_rt::entry]
fn main() -> ! {
    bhm_cortex_m7::onboard::run(&ONE_PASS)
}
