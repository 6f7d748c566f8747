//! The services, for real, each test in a domain of its own; and every way in which a message can be wrong.

mod messages;
mod posterior;
mod scans;
mod supports;

use bhm_core::{
    geometry::Pose,
    profile::{self, Capacities, Profile},
    scan::ScanHeader,
};

use super::*;
use crate::{ScanRecord, map::OwnedMapper};

fn joined(domain: &Domain) -> Participant {
    domain.join("test").expect("a domain of one's own")
}

/// Few slots, so that tests do not fill the machine's shared memory.
const SMALL: Profile =
    Profile { capacities: Capacities { tiles: 24, observations: 4_096, rows: 4_096, touched: 64 }, ..profile::COMPACT };

/// Seventeen beams along an arc that moves with the number.
fn scan(number: u64) -> ScanRecord {
    ScanRecord {
        header: ScanHeader {
            stamp_ns: number * 100_000_000,
            map_from_sensor: Pose::new(number as f32 * 0.1, -0.2, 0.05 * number as f32),
            angle_min_rad: -0.8,
            angle_increment_rad: 0.1,
            range_min_m: 0.1,
            range_max_m: 30.0,
            ..ScanHeader::default()
        },
        ranges_m: (0..17).map(|beam| 2.0 + 0.1 * beam as f32 + 0.01 * number as f32).collect(),
    }
}

/// A map that has learned something.
fn learned(scans: u64) -> OwnedMapper<144, 40> {
    let mut map = OwnedMapper::new(&SMALL).expect("a profile of the shape");
    for number in 1..=scans {
        map.integrate(&scan(number).as_scan()).expect("a good scan");
    }
    map
}
