//! Uses the whole façade of `bhm-core` without `std` and without an allocator; see `Cargo.toml`.
#![no_std]

use bhm_core::{
    beam::LabelledPlace,
    geometry::{Point, Pose},
    lattice::Node,
    mapper::{Mapper, Memory},
    posterior::{Entry, RowState, Scratch},
    profile::COMPACT,
    scan::{Scan, ScanHeader},
    support::SupportTable,
    tile::{DirectoryEntry, NoArchive, Tile, TileIndex},
};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

const M: usize = 144;
const B: usize = 40;
const ROWS: usize = 512;

/// All the memory of a small map, as a caller would put it into a `static`.
#[repr(C)]
pub struct Proof {
    tiles: [Tile<2, M, B>; 4],
    directory: [DirectoryEntry; 4],
    scratch: Scratch<M, B>,
    places: [LabelledPlace; ROWS],
    firsts: [Option<Node<2>>; ROWS],
    touched: [TileIndex<2>; 16],
    entries: [Entry; ROWS * 16],
    states: [RowState; ROWS],
}

/// Integrates one scan and answers one query; the answer keeps the optimiser from removing either.
#[unsafe(no_mangle)]
pub extern "C" fn bhm_no_std_proof(proof: &mut Proof, ranges: &[f32; 181], x_m: f32, y_m: f32) -> f32 {
    let Proof { tiles, directory, scratch, places, firsts, touched, entries, states } = proof;
    let memory = Memory { tiles, directory, scratch, places, firsts, touched, entries, states, supports: SupportTable::EMPTY };
    let Ok(mut mapper) = Mapper::new(COMPACT.settings, memory) else { return -1.0 };
    let scan = Scan { header: ScanHeader { stamp_ns: 1, map_from_sensor: Pose::new(0.0, 0.0, 0.0), angle_min_rad: -1.57, angle_increment_rad: 0.017_45, range_max_m: 30.0, ..ScanHeader::default() }, ranges_m: ranges };
    if mapper.integrate(&scan, &mut NoArchive).is_err() {
        return -2.0;
    }
    let gradient = mapper.gradient(&Point::<2>::new(x_m, y_m));
    gradient.occupancy.probability + gradient.probability.x
}
