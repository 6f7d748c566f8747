//! Which tiles are in the store after each scan, against a list that is searched from end to end.

use std::collections::{BTreeMap, BTreeSet};

use bhm_core::{
    profile::{COMPACT, Capacities, Profile},
    settings::Settings,
};

use crate::{
    common::{Stream, labelled, posterior_bits},
    map::TestMap,
};

pub(crate) type Index = [i32; 2];

/// The tiles that hold the whole stencil of a place, from what a tiling is documented to be: tile `t` holds the nodes
/// `t·stride … t·stride + width − 1`, and a place sees `stencil` nodes a side, half of them below it.
pub(crate) fn holding(settings: &Settings, at: [f32; 2]) -> BTreeSet<Index> {
    let stencil = settings.tile.stencil as i64;
    let holds = |axis: usize, tile: i32| {
        let cell = (f64::from(at[axis]) / f64::from(settings.spacing_m)).floor() as i64;
        let (first, last) = (cell - (stencil / 2 - 1), cell + stencil / 2);
        let low = i64::from(tile) * settings.tile.stride[axis] as i64;
        low <= first && last < low + settings.tile.width[axis] as i64
    };
    let all = (-20..20).flat_map(|x| (-20..20).map(move |y| [x, y]));
    all.filter(|tile| holds(0, tile[0]) && holds(1, tile[1])).collect()
}

/// The least recently touched leaves; of those touched at the same scan, the one with the lowest index.
#[derive(Default)]
struct Model {
    slots: usize,
    /// Which, and the scan that touched it last.
    resident: Vec<(Index, u64)>,
    archived: BTreeSet<Index>,
    updates: BTreeMap<Index, u64>,
    evicted: u32,
    restored: u32,
}

impl Model {
    fn touch(&mut self, index: Index, scan: u64) {
        *self.updates.entry(index).or_default() += 1;
        self.resident.sort_unstable();
        if let Some(tile) = self.resident.iter_mut().find(|tile| tile.0 == index) {
            tile.1 = scan;
            return;
        }
        if self.resident.len() == self.slots {
            let mut oldest = 0;
            for (number, tile) in self.resident.iter().enumerate() {
                if tile.1 < self.resident[oldest].1 {
                    oldest = number;
                }
            }
            self.archived.insert(self.resident.remove(oldest).0);
            self.evicted += 1;
        }
        self.restored += u32::from(self.archived.remove(&index));
        self.resident.push((index, scan));
    }
}

#[test]
fn the_least_recently_touched_tile_leaves() {
    let settings = COMPACT.settings;
    let stride_m = settings.spacing_m * settings.tile.stride[0] as f32;
    for slots in [1, 2, 3, 5, 8] {
        let profile = Profile { capacities: Capacities { tiles: slots, ..COMPACT.capacities }, ..COMPACT };
        let mut map = TestMap::<144, 40>::new(&profile);
        let mut model = Model { slots, ..Model::default() };
        let mut stream = Stream::new(40 + slots as u64);
        let (mut evicted, mut restored) = (0, 0);
        for scan in 1..=400 {
            // Places near each other in a country of some thirty tiles, so that tiles are met again and again.
            let middle = [stream.between(-2.5, 2.5), stream.between(-2.5, 2.5)];
            let places: Vec<[f32; 2]> = (0..1 + stream.below(4))
                .map(|_| middle.map(|x| (x + stream.between(-0.3, 0.3)) as f32 * stride_m))
                .collect();
            let report = map.integrate_observations(&labelled(&places, |_| false));
            let touched: BTreeSet<Index> = places.iter().flat_map(|at| holding(&settings, *at)).collect();
            assert_eq!(report.tiles_touched as usize, touched.len(), "scan {scan}");
            for index in touched {
                model.touch(index, scan);
            }
            evicted += report.tiles_evicted;
            restored += report.tiles_restored;
            // Every touch is an update, and a tile keeps its count wherever it is.
            for tile in map.all_tiles() {
                assert_eq!(tile.updates, model.updates[&tile.index], "{slots} slots, scan {scan}: {:?}", tile.index);
            }
            let got: Vec<_> = map.mapper().tiles().iter().map(|tile| (tile.index, tile.touched_at)).collect();
            model.resident.sort_unstable();
            assert_eq!(got, model.resident, "{slots} slots, scan {scan}");
            let archived: BTreeSet<Index> = map.shelf().0.keys().copied().collect();
            assert_eq!(archived, model.archived, "{slots} slots, scan {scan}");
        }
        assert_eq!((evicted, restored), (model.evicted, model.restored), "{slots} slots");
        assert!(restored > 100, "{slots} slots: only {restored} tiles came back");
    }
}

/// Learned in a store of a few slots and in one that evicts nothing, tile by tile the same.
#[test]
fn a_tile_in_a_used_slot_knows_nothing_of_the_tile_before() {
    let learn = |slots: usize| {
        let profile = Profile { capacities: Capacities { tiles: slots, ..COMPACT.capacities }, ..COMPACT };
        let mut map = TestMap::<144, 40>::new(&profile);
        let mut stream = Stream::new(47);
        for _ in 0..60 {
            let at = [0, 1].map(|_| stream.between(-12.0, 12.0) as f32);
            map.integrate_observations(&labelled(&[at], |at| at[0] > 0.0));
        }
        let tiles = map.all_tiles();
        tiles.iter().map(|tile| (tile.index, tile.updates, posterior_bits(&tile.posterior))).collect::<Vec<_>>()
    };
    let large = learn(64);
    assert!(large.len() > 20, "{}", large.len());
    for slots in [1, 4] {
        assert!(learn(slots) == large, "{slots} slots");
    }
}
