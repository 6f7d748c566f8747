//! An industrial site, 600 m × 300 m: halls, parked cars, trees and fences along a ring road; open to the south and east.

use crate::sim::{
    lidar::Lidar,
    scene::Scene,
    solid::{Bounds, Position, Solid},
    trajectory::{Drive, Trajectory},
    world::World,
};

pub(super) const SCENE: Scene = Scene { name: "outdoor", lidar: Lidar::OUTDOOR, world, trajectory };

/// Centre lines of the roads: `x = ±RING_X` and `x = 0`, `y = ±RING_Y`.
const RING_X: f64 = 180.0;
const RING_Y: f64 = 60.0;

const DRIVE: Drive = Drive { speed_m_s: 7.0, turn_rate_max_rad_s: 0.8, look_ahead_m: 8.0, scan_rate_hz: 5.0 };

/// Once around, then through the middle.
const ROUTE: [Position; 7] = [
    [0.0, -RING_Y],
    [-RING_X, -RING_Y],
    [-RING_X, RING_Y],
    [RING_X, RING_Y],
    [RING_X, -RING_Y],
    [0.0, -RING_Y],
    [0.0, RING_Y - 10.0],
];

fn trajectory() -> Trajectory {
    Trajectory::along(&ROUTE, &DRIVE).expect("the route is finite")
}

fn world() -> World {
    let mut solids = Vec::new();
    buildings(&mut solids);
    parked_cars(&mut solids);
    trees(&mut solids);
    fences(&mut solids);
    World::new(solids, Bounds { min: [-300.0, -150.0], max: [300.0, 150.0] })
}

#[rustfmt::skip]
fn buildings(solids: &mut Vec<Solid>) {
    // Centre, size, heading.
    let halls: [(Position, [f64; 2], f64); 16] = [
        // West of the middle road.
        ([-128.0, 14.0], [62.0, 48.0], 0.0), ([-130.0, -32.0], [50.0, 16.0], 0.05), ([-32.0, 24.0], [34.0, 18.0], 0.35),
        // East of it.
        ([50.0, 24.0], [54.0, 30.0], -0.14), ([148.0, 30.0], [24.0, 20.0], 0.6),
        // North of the ring.
        ([-135.0, 102.0], [72.0, 32.0], 0.05), ([-35.0, 106.0], [52.0, 38.0], 0.0), ([155.0, 112.0], [32.0, 44.0], 0.26),
        ([-60.0, 80.0], [10.0, 6.0], 0.0),
        // South of it.
        ([-120.0, -104.0], [84.0, 34.0], 0.0), ([-18.0, -108.0], [46.0, 26.0], -0.21), ([102.0, -100.0], [70.0, 28.0], 0.0),
        // West and east.
        ([-236.0, -12.0], [42.0, 92.0], 0.0), ([-250.0, 96.0], [34.0, 34.0], 0.785), ([-240.0, -112.0], [40.0, 24.0], 0.3),
        ([226.0, 34.0], [36.0, 58.0], 0.1),
    ];
    solids.extend(halls.map(|(centre, size_m, heading_rad)| Solid::rectangle(centre, size_m, heading_rad)));

    // L shapes: two wings that share a corner.
    let wings = [
        ([-80.0, -42.0], [-22.0, -24.0]), ([-80.0, -42.0], [-62.0, 30.0]),
        ([86.0, -44.0], [152.0, -24.0]), ([132.0, -44.0], [152.0, 4.0]),
        ([50.0, 86.0], [118.0, 104.0]), ([98.0, 86.0], [118.0, 136.0]),
    ];
    solids.extend(wings.map(|(min, max)| Solid::between(min, max)));

    solids.extend([26.0, 44.0, 62.0].map(|x| Solid::regular_polygon([x, -32.0], 7.0, 24)));
}

/// Rows of cars, parked across the row's direction; some places are free.
fn parked_cars(solids: &mut Vec<Solid>) {
    // First place, step to the next, places, heading.
    let rows: [(Position, Position, usize, f64); 6] = [
        ([-160.0, -69.0], [2.9, 0.0], 44, 1.571),
        ([20.0, -69.0], [2.9, 0.0], 40, 1.571),
        ([12.0, 68.0], [6.2, 0.0], 24, 0.0),
        ([24.0, -9.0], [2.9, 0.0], 34, 1.3),
        ([24.0, -16.0], [2.9, 0.0], 34, 1.3),
        ([189.0, -48.0], [0.0, 2.9], 16, 0.0),
    ];
    for (first, step, places, heading_rad) in rows {
        for place in (0..places).filter(|place| jitter(*place) > 0.3) {
            let along = place as f64;
            // Nobody parks exactly straight.
            let askew_rad = 0.1 * (jitter(place + 7) - 0.5);
            let centre = [first[0] + along * step[0], first[1] + along * step[1]];
            solids.push(Solid::rectangle(centre, [4.4, 1.8], heading_rad + askew_rad));
        }
    }
}

/// Avenues along the roads, and a loose grove in the open south-east.
fn trees(solids: &mut Vec<Solid>) {
    let mut plant = |x: f64, y: f64, index: usize| {
        solids.push(Solid::regular_polygon([x, y], 0.25 + 0.5 * jitter(index), 8));
    };
    for index in 0..24 {
        let along = index as f64;
        plant(-168.0 + 7.0 * along, 68.0, index);
        plant(-RING_X - 8.0, -56.0 + 5.0 * along, index + 3);
        plant(RING_X - 8.0, -50.0 + 4.4 * along, index + 5);
    }
    for index in 0..60 {
        let (column, row) = ((index % 12) as f64, (index / 12) as f64);
        plant(196.0 + 7.0 * column + 5.0 * jitter(index), -136.0 + 13.0 * row + 9.0 * jitter(index + 31), index);
    }
}

/// The site's north and west fences with a gate, and the yards inside.
fn fences(solids: &mut Vec<Solid>) {
    let runs: [(Position, Position); 9] = [
        ([-298.0, 148.0], [-90.0, 148.0]),
        ([-78.0, 148.0], [298.0, 148.0]),
        ([-298.0, -148.0], [-298.0, 148.1]),
        ([-298.0, -148.0], [-200.0, -148.0]),
        ([-90.0, 48.0], [-16.0, 51.0]),
        ([-16.0, 51.0], [-12.0, 36.0]),
        ([-12.0, -46.0], [-12.0, 10.0]),
        ([16.0, -50.0], [80.0, -50.0]),
        ([-215.0, 75.0], [-190.0, 140.0]),
    ];
    solids.extend(runs.map(|(from, to)| Solid::wall(from, to, 0.15)));
}

/// A number in [0, 1) that looks random but belongs to the index; its square, because plain multiples of the golden ratio
/// make a visible pattern.
fn jitter(index: usize) -> f64 {
    const GOLDEN_RATIO: f64 = 0.618_033_988_749_895;
    ((index * index) as f64 * GOLDEN_RATIO).fract()
}
