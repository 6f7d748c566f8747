//! Scans from shared memory, and what a map makes of those that can be read.
#![no_main]

use bhm_core::profile::{COMPACT, Capacities, Profile};
use bhm_fuzz::{bytes_of, message, scan, within};
use bhm_host::{
    ipc::{Place, ScanAddress, ScanMessage},
    map,
};

const SMALL: Profile =
    Profile { capacities: Capacities { tiles: 4, observations: 256, rows: 256, touched: 8 }, ..COMPACT };

/// A scan of so many beams at most is learned as well, so that one input does not take long.
const LEARNED_BEAMS: usize = 32;

fn seeds() -> Vec<Vec<u8>> {
    let mut seeds = Vec::new();
    for (place, mapper) in [(Place::Within, None), (Place::Last, Some(7))] {
        let mut written = message::<ScanMessage>(&[]);
        let address = ScanAddress { source: 3, mapper, sequence: 5, place };
        written.write(&address, &scan(9).as_scan()).expect("few beams");
        // What follows the last beam may be missing.
        let ranges_at = size_of::<ScanMessage>() - size_of_val(&written.ranges_m);
        seeds.push(bytes_of(&*written)[..ranges_at + 4 * scan(9).ranges_m.len()].to_vec());
    }
    seeds
}

fn check(bytes: &[u8]) {
    let received = message::<ScanMessage>(bytes);
    let Ok(read) = within(0, || received.check()) else { return };
    let mut written = message::<ScanMessage>(&[]);
    within(0, || written.write(&read.address, &read.scan)).expect("as many beams as came");
    let again = written.check().expect("what was accepted is written so that it can be read");
    // As text, in which not-a-number is like itself.
    assert_eq!(format!("{again:?}"), format!("{read:?}"));
    if read.scan.ranges_m.len() <= LEARNED_BEAMS {
        let mut map = map::open(&SMALL).expect("a good profile");
        if map.integrate(&read.scan).is_ok() {
            let pose = read.scan.header.map_from_sensor;
            let at = [pose.x_m, pose.y_m].into();
            assert!(map.occupancy(&at).probability.is_finite());
        }
    }
}

bhm_fuzz::target!(seeds, check);
