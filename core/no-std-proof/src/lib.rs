//! Uses the whole façade of `bhm-core` without `std` and without an allocator; see `Cargo.toml`.
#![no_std]

use bhm_core::{
    geometry::Pose,
    map::Map,
    mapper::Mapper,
    profile::{COMPACT, Capacities, Profile},
    scan::{Scan, ScanHeader},
    static_memory,
    tile::NoArchive,
};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

/// A small map.
const SMALL: Profile =
    Profile { capacities: Capacities { tiles: 4, observations: 512, rows: 512, touched: 16 }, ..COMPACT };

/// All of its memory, as a caller would put it into a `static`.
pub type Memory = static_memory!(SMALL);

/// Integrates one scan and answers one query; the answer keeps the optimiser from removing either.
#[unsafe(no_mangle)]
pub extern "C" fn bhm_no_std_proof(memory: &mut Memory, ranges_m: &[f32; 181], x_m: f32, y_m: f32) -> f32 {
    let Ok(mut mapper) = Mapper::new(SMALL.settings, memory.lend()) else { return -1.0 };
    let header = ScanHeader {
        stamp_ns: 1,
        map_from_sensor: Pose::new(0.0, 0.0, 0.0),
        angle_min_rad: -1.57,
        angle_increment_rad: 0.017_45,
        range_max_m: 30.0,
        ..ScanHeader::default()
    };
    if mapper.integrate(&Scan { header, ranges_m }, &mut NoArchive).is_err() {
        return -2.0;
    }
    let gradient = mapper.gradient(&[x_m, y_m].into());
    let ray = mapper.cast_ray(&[x_m, y_m].into(), &[1.0, 0.0].into(), 5.0, 0.5);
    gradient.occupancy.probability + gradient.probability.x + ray.first_m.unwrap_or(0.0)
}
