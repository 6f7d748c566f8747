//! What becomes of each observation, against a count that looks at every tile; and of each beam where there are too many.

use std::collections::BTreeSet;

use bhm_core::{
    beam::{AnyBeamRule, PointSamples},
    geometry::Pose,
    lattice::MAX_NODE,
    mapper::ObservationTally,
    profile::{COMPACT, Capacities, Profile},
    scan::{Scan, ScanHeader},
    settings::{Settings, TileSettings},
};

use crate::{
    common::{Stream, labelled},
    eviction::{Index, holding},
    map::TestMap,
};

#[test]
fn every_observation_is_counted_as_what_became_of_it() {
    let far_m = MAX_NODE as f32 * COMPACT.settings.spacing_m;
    let mut all = ObservationTally::default();
    for (touched, tile_count) in [(128, None), (128, Some([2, 3])), (3, None), (2, Some([2, 3]))] {
        let tile = TileSettings { count: tile_count, ..COMPACT.settings.tile };
        let settings = Settings { tile, ..COMPACT.settings };
        let profile = Profile { settings, capacities: Capacities { touched, ..COMPACT.capacities }, ..COMPACT };
        let mut map = TestMap::<144, 40>::new(&profile);
        let mut stream = Stream::new(31);
        for _ in 0..40 {
            let places: Vec<[f32; 2]> = (0..30)
                .map(|_| match stream.below(12) {
                    0 => [f32::NAN, 1.0],
                    1 => [1.0, far_m],
                    _ => [0, 1].map(|_| stream.between(-6.0, 14.0) as f32),
                })
                .collect();
            let report = map.integrate_observations(&labelled(&places, |_| true));

            let exists = |index: &Index| {
                tile_count.is_none_or(|count| (0..2).all(|axis| (0..count[axis] as i32).contains(&index[axis])))
            };
            let (mut expected, mut rows) = (ObservationTally::default(), 0);
            let mut list = BTreeSet::new();
            let mut learned = Vec::new();
            for at in &places {
                if !at.iter().all(|x| x.abs() < far_m) {
                    expected.unplaceable += 1;
                    continue;
                }
                let tiles: Vec<_> = holding(&settings, *at).into_iter().filter(exists).collect();
                let mut found = 0;
                for tile in &tiles {
                    if list.contains(tile) || list.len() < touched {
                        list.insert(*tile);
                        found += 1;
                    }
                }
                expected.outside += u32::from(tiles.is_empty());
                expected.over_capacity += u32::from(found < tiles.len());
                expected.used += u32::from(found > 0);
                learned.push(tiles);
            }
            // A tile that is on the list learns every observation that it holds, those before it came on it as well.
            for tiles in &learned {
                rows += tiles.iter().filter(|tile| list.contains(*tile)).count() as u32;
            }
            assert_eq!(report.observations, expected, "{touched} tiles of {tile_count:?}: {report:?}");
            assert_eq!((report.tiles_touched as usize, report.rows), (list.len(), rows));
            assert!(map.all_tiles().iter().all(|tile| exists(&tile.index)));
            all.outside += expected.outside;
            all.over_capacity += expected.over_capacity;
            all.unplaceable += expected.unplaceable;
        }
    }
    assert!(all.outside > 100 && all.over_capacity > 100 && all.unplaceable > 100, "{all:?}");
}

/// As many observations as there is room for, and one more or less: every beam is used, or every second, every fourth, …
#[test]
fn beams_are_thinned_by_halves_until_they_fit() {
    let rule = PointSamples { free_spacing_m: 1.0, gap_m: 0.1 };
    // 1 to 5 free points and the hit, the ranges nowhere near where that number changes.
    let each: Vec<usize> = (0..60).map(|beam| 2 + beam * 7 % 5).collect();
    let ranges_m: Vec<f32> = each.iter().map(|count| *count as f32 - 1.4).collect();
    let header = ScanHeader {
        stamp_ns: 1,
        map_from_sensor: Pose::new(0.2, 0.1, 0.0),
        angle_min_rad: -3.0,
        angle_increment_rad: 0.1,
        range_max_m: 30.0,
        ..ScanHeader::default()
    };
    let used = |every: usize| each.iter().step_by(every);
    let levels = [1, 2, 4, 8, 16, 32, 64];
    let sums = levels.map(|every| used(every).sum::<usize>());
    for observations in sums.iter().flat_map(|sum| [sum - 1, *sum, sum + 1]) {
        let settings = Settings { beam: AnyBeamRule::PointSamples(rule), ..COMPACT.settings };
        let capacities = Capacities { tiles: 4, observations, ..COMPACT.capacities };
        let mut map = TestMap::<144, 40>::new(&Profile { settings, capacities, ..COMPACT });
        let report = map.integrate(&Scan { header, ranges_m: &ranges_m }).unwrap();
        let fits = levels.iter().zip(sums).find(|(_, sum)| *sum <= observations);
        let (beams, all) = fits.map_or((0, 0), |(every, sum)| (used(*every).len(), sum));
        let found =
            (report.beams.hits as usize, report.beams.over_capacity as usize, report.observations.used as usize);
        assert_eq!(found, (beams, 60 - beams, all), "room for {observations}");
    }
}
