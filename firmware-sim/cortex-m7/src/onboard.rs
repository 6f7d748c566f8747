//! The program: the board's port, the map's memory and the loop, put together.

use crate::{
    board::{Board, Selected},
    port::BoardPort,
    stack,
    state::{self, STATE_BYTES},
};
use bhm_core::profile::Profile;
use bhm_firmware_sim::{LentArchive, LentMap, Onboard, Options, Step, Until, serial::SerialLink};

/// Ten scans a second: what is slower is counted as missed.
const DEADLINE_NS: u64 = 100_000_000;

/// Most scans between two publications: the tiles that one scan changes are more than any serial port moves in its time.
const PUBLISH_EVERY: u32 = 20;

/// How long the source may be silent before what it taught is published all the same.
const LINGER_NS: u64 = 3_000_000_000;

/// Scans between two lines of the log.
const LOG_EVERY: u64 = 50;

/// Maps what comes over the serial link until the host says that it was all.
pub fn run(profile: &'static Profile) -> ! {
    let state::Link { buffers, sent, queue } = state::link();
    let port = BoardPort::new(queue.split());
    Selected::start();
    let archive = Selected::archive();
    defmt::info!(
        "{=str}: profile {=str}, {=u32} passes, {=usize} tiles and {=usize} archived in {=usize} bytes, stack of {=u32}",
        Selected::NAME,
        profile.name,
        profile.settings.passes,
        profile.capacities.tiles,
        archive.len(),
        STATE_BYTES,
        stack::bytes(),
    );
    let mapper = match state::mapper(profile) {
        Ok(mapper) => mapper,
        Err(error) => defmt::panic!("the profile is unusable: {}", defmt::Display2Format(&error)),
    };
    let map = LentMap::new(mapper, LentArchive::new(archive));
    let link = SerialLink::new(port, profile, buffers, sent, None);
    let options = Options {
        publish_every: PUBLISH_EVERY,
        linger_ns: LINGER_NS,
        until: Until::Stopped,
        deadline_ns: Some(DEADLINE_NS),
    };
    let mut onboard = Onboard::new(map, link, options);
    onboard.start();
    let mut logged = 0;
    while onboard.step() == Step::Continue {
        let scans = onboard.counters().received;
        if scans >= logged + LOG_EVERY {
            logged = scans - scans % LOG_EVERY;
            log(&onboard);
        }
    }
    log(&onboard);
    defmt::info!("the host says that it was all");
    Selected::end(true)
}

fn log<P, L, const M: usize, const B: usize>(onboard: &Onboard<P, L, M, B>)
where
    P: bhm_firmware_sim::OnboardMap<M, B>,
    L: bhm_firmware_sim::Link<M, B>,
{
    let counters = onboard.counters();
    let update = onboard.update_time();
    defmt::info!(
        "{=u64} scans, {=u64} refused, {=u64} late; {=u64} tiles learned in; update {=u64} us, slowest {=u64} us; stack {=u32} bytes",
        counters.integrated,
        counters.rejected(),
        counters.deadlines_missed,
        counters.tiles_touched,
        update.map_or(0, |update| update.last_ns / 1_000),
        update.map_or(0, |update| update.slowest_ns / 1_000),
        stack::high_water_bytes(),
    );
}
