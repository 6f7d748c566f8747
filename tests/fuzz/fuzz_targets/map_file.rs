//! Map files, and what a map from a file does when it is asked and goes on learning.
#![no_main]

use bhm_core::{
    geometry::Point,
    profile::{COMPACT, Capacities, Profile},
    rule::{AnyRule, JaakkolaJordan, XiStart},
    settings::{BiasSettings, Settings, TileSettings},
    support::{GaussianSettings, SupportSettings, SupportTable},
};
use bhm_fuzz::{learned_supports, scan, sealed, within};
use bhm_host::{
    map,
    snapshot::{Extras, Snapshot, decode},
};

/// The slots of tiles may take 1 GiB (`MAX_TILE_BYTES`), which is only asked for and not touched; the rest of a map with the
/// largest capacities, and two copies of what the file holds, fit into a quarter of that.
const LIMIT_BYTES: usize = (1 << 30) + (256 << 20);

const SMALL: Profile =
    Profile { capacities: Capacities { tiles: 4, observations: 256, rows: 256, touched: 8 }, ..COMPACT };

fn seeds() -> Vec<Vec<u8>> {
    let rule = AnyRule::JaakkolaJordan(JaakkolaJordan { start: XiStart::PredictedUpTo(4.0) });
    let tile = TileSettings { count: Some([2, 2]), ..COMPACT.settings.tile };
    let bounded = Settings { bias: Some(BiasSettings::DEFAULT), tile, rule, ..COMPACT.settings };
    let supports = learned_supports();
    let support = SupportSettings::GaussianSupport(GaussianSettings { size: 0.1 });
    let spread = Settings { support, ..COMPACT.settings }.fitted(&SupportTable::EMPTY);
    let mut seeds = Vec::new();
    for (settings, supports) in
        [(COMPACT.settings, None), (bounded, None), (spread, None), (COMPACT.settings, Some(supports))]
    {
        let mut map = map::open_with(&Profile { settings, ..SMALL }, supports).expect("a good profile");
        let extras = Extras { profile: "compact".to_owned(), path_m: vec![[0.3, -0.2], [0.5, 0.0]] };
        // Without tiles nearly every byte is the header's.
        seeds.push(written(&*map, &extras));
        map.integrate(&scan(7).as_scan()).expect("a good scan");
        seeds.push(written(&*map, &extras));
    }
    seeds
}

fn written(map: &dyn map::AnyMap, extras: &Extras) -> Vec<u8> {
    let mut bytes = Vec::new();
    map.write_snapshot(extras, &mut bytes).expect("memory takes everything");
    bytes
}

fn check(bytes: &[u8]) {
    for bytes in [bytes, &sealed(bytes)] {
        let Ok(Snapshot { mut map, extras }) = within(LIMIT_BYTES, || decode(bytes)) else { continue };
        let first = written(&*map, &extras);
        let again = decode(&first).expect("what was accepted is written so that it can be read");
        assert_eq!((map.digest(), &extras), (again.map.digest(), &again.extras));
        assert!(written(&*again.map, &again.extras) == first, "the same bytes");
        // Its numbers may be none that learning arrives at; answers may then be of no use, but there are some.
        for at in [[0.0, 0.0], [0.3, -0.2], [-7.9, 8.1]] {
            let _ = (map.occupancy(&Point::from(at)), map.gradient(&Point::from(at)));
        }
        let _ = map.integrate(&scan(u64::MAX).as_scan());
    }
}

bhm_fuzz::target!(seeds, check);
