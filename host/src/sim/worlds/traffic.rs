//! A street corner with traffic, 170 m × 90 m, seen by a sensor that stands still at the kerb of the main road.
//!
//! After the first data set of Senanayake and Ramos (AAAI 2018): a robot that does not move, with a lidar of 180° and 80 m,
//! among vehicles that do. The main road runs along x, a side street leaves it away from the sensor; people drive on the
//! right. As everywhere, the truth is what stands still: the road is free.

use std::f64::consts::FRAC_PI_2;

use bhm_core::geometry::Pose;

use crate::sim::{
    lidar::Lidar,
    mover::Mover,
    scene::Scene,
    solid::{Bounds, Position, Solid},
    trajectory::Trajectory,
    world::World,
};

pub(super) const SCENE: Scene = Scene { name: "traffic", lidar: LIDAR, world, trajectory };

const LIDAR: Lidar = Lidar {
    field_of_view_rad: std::f32::consts::PI,
    beams: 360,
    range_min_m: 0.5,
    range_max_m: 80.0,
    noise_std_m: 0.03,
};

/// 45 s at 10 Hz.
const SCANS: usize = 450;
const PERIOD_NS: u64 = 100_000_000;

/// The sensor stands at the origin and looks across the road, along y.
fn trajectory() -> Trajectory {
    Trajectory::new(vec![Pose::new(0.0, 0.0, std::f32::consts::FRAC_PI_2); SCANS], PERIOD_NS)
}

/// Centre lines of the main road's lanes, `y`, and of the side street's, `x`.
const EASTBOUND: f64 = 11.0;
const WESTBOUND: f64 = 14.5;
const SOUTHBOUND: f64 = 28.0;
const NORTHBOUND: f64 = 32.0;

/// Lanes go on out of sight: vehicles turn up and vanish there.
const LANE_END: f64 = 120.0;

/// Radius of a turn at the corner, metres.
const TURN_RADIUS_M: f64 = 8.0;

/// Every route is about 240 m long and takes this time, seconds: 36 km/h. As all repeat together, who gives way to whom is
/// settled by the phases once and for all.
const LAP_S: f64 = 24.0;

const CAR_M: [f64; 2] = [4.5, 1.8];
const VAN_M: [f64; 2] = [6.2, 2.1];
const BUS_M: [f64; 2] = [11.5, 2.5];

fn world() -> World {
    let mut solids = Vec::new();
    buildings(&mut solids);
    parked_cars(&mut solids);
    street_furniture(&mut solids);
    World::new(solids, Bounds { min: [-85.0, -5.0], max: [85.0, 85.0] }).with_movers(vehicles())
}

fn vehicles() -> Vec<Mover> {
    let west = vec![[LANE_END, WESTBOUND], [-LANE_END, WESTBOUND]];
    let east = vec![[-LANE_END, EASTBOUND], [LANE_END, EASTBOUND]];
    // Out of the side street, to the right; it ends where the lane ends that it joins, and is as long.
    let mut out_of_street = vec![[SOUTHBOUND, 110.0]];
    out_of_street.extend(quarter_turn([SOUTHBOUND - TURN_RADIUS_M, WESTBOUND + TURN_RADIUS_M]).rev());
    out_of_street.push([-LANE_END, WESTBOUND]);
    // From the eastbound lane to the left into the side street, across the westbound lane.
    let mut into_street = vec![[-LANE_END, EASTBOUND]];
    into_street.extend(quarter_turn([NORTHBOUND - TURN_RADIUS_M, EASTBOUND + TURN_RADIUS_M]));
    into_street.push([NORTHBOUND, 102.5]);

    // A route and who takes it: size and phase. Where lanes meet, they arrive 0.06 of a lap or more apart.
    let mut movers = Vec::new();
    let mut drive = |path: Vec<Position>, vehicles: &[([f64; 2], f64)]| {
        let start = |&(size_m, phase): &([f64; 2], f64)| Mover::along(path.clone(), size_m, LAP_S, phase);
        movers.extend(vehicles.iter().map(start));
    };
    drive(west, &[(CAR_M, 0.02), (VAN_M, 0.16), (CAR_M, 0.40), (CAR_M, 0.55), (BUS_M, 0.80)]);
    drive(out_of_street, &[(CAR_M, 0.28), (VAN_M, 0.68), (CAR_M, 0.92)]);
    drive(east, &[(CAR_M, 0.05), (CAR_M, 0.22), (CAR_M, 0.33), (BUS_M, 0.60), (VAN_M, 0.86)]);
    drive(into_street, &[(CAR_M, 0.48), (CAR_M, 0.72)]);
    movers
}

/// From below a centre counter-clockwise to its right.
fn quarter_turn(centre: Position) -> impl DoubleEndedIterator<Item = Position> {
    const CHORDS: u32 = 6;
    (0..=CHORDS).map(move |index| {
        let (sin, cos) = libm::sincos(FRAC_PI_2 * (f64::from(index) / f64::from(CHORDS) - 1.0));
        [centre[0] + TURN_RADIUS_M * cos, centre[1] + TURN_RADIUS_M * sin]
    })
}

#[rustfmt::skip]
fn buildings(solids: &mut Vec<Solid>) {
    let blocks: [(Position, Position); 9] = [
        // Along the main road, west and east of the side street.
        ([-82.0, 24.0], [-50.0, 38.0]), ([-40.0, 25.0], [-14.0, 39.0]), ([-4.0, 23.0], [19.0, 33.0]), ([9.0, 33.0], [19.0, 60.0]),
        ([41.0, 24.0], [56.0, 36.0]), ([41.0, 44.0], [55.0, 80.0]),
        // Behind them, and at the ends of the sensor's side.
        ([-62.0, 52.0], [-28.0, 66.0]), ([-84.0, -4.0], [-66.0, 4.0]), ([62.0, -4.0], [84.0, 4.5]),
    ];
    solids.extend(blocks.map(|(min, max)| Solid::between(min, max)));
    solids.push(Solid::rectangle([74.0, 54.0], [18.0, 12.0], 0.5));
    solids.push(Solid::wall([-50.0, 37.0], [-40.0, 37.0], 0.2));
}

/// Rows of cars at the kerbs; some places are free.
fn parked_cars(solids: &mut Vec<Solid>) {
    const PLACE_M: f64 = 6.0;
    // First place, step to the next, free places among so many.
    let rows: [(Position, [f64; 2], &[usize], usize); 5] = [
        ([-80.0, 7.5], [PLACE_M, 0.0], &[2], 5),
        ([54.0, 7.5], [PLACE_M, 0.0], &[1], 5),
        ([-76.0, 18.2], [PLACE_M, 0.0], &[0, 3, 4, 9, 12], 15),
        ([48.0, 18.2], [PLACE_M, 0.0], &[2, 3], 6),
        ([35.8, 28.0], [0.0, PLACE_M], &[1, 5], 9),
    ];
    for (first, step, free, places) in rows {
        let heading_rad = libm::atan2(step[1], step[0]);
        for place in (0..places).filter(|place| !free.contains(place)) {
            let centre = [0, 1].map(|axis| first[axis] + place as f64 * step[axis]);
            solids.push(Solid::rectangle(centre, [4.4, 1.8], heading_rad));
        }
    }
}

/// Trees and lamps on the pavements, a bus shelter, a kiosk, a skip.
fn street_furniture(solids: &mut Vec<Solid>) {
    for x in [-71.0, -60.0, -45.0, -36.0, -25.0, -9.0, 4.0, 13.0, 45.0, 57.0, 70.0, 78.0] {
        solids.push(Solid::regular_polygon([x, 21.2], 0.35, 8));
    }
    for x in [-56.0, -38.0, -22.0, 10.0, 26.0, 52.0] {
        solids.push(Solid::regular_polygon([x, 5.4], 0.12, 8));
    }
    solids.push(Solid::rectangle([-44.0, 5.0], [4.0, 1.2], 0.0));
    solids.push(Solid::rectangle([41.0, 2.5], [2.4, 2.4], 0.2));
    solids.push(Solid::rectangle([-31.0, 1.5], [3.2, 1.6], -0.4));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::FIRST_STAMP_NS;

    fn stamps_ns() -> impl Iterator<Item = u64> {
        (0..SCANS as u64).map(|scan| FIRST_STAMP_NS + scan * PERIOD_NS)
    }

    /// Points of the outline, at most a metre apart.
    fn outline(solid: &Solid) -> impl Iterator<Item = Position> {
        let vertices = solid.vertices();
        (0..vertices.len()).flat_map(move |i| {
            let (a, b) = (vertices[i], vertices[(i + 1) % vertices.len()]);
            (0..12).map(move |part| [0, 1].map(|axis| a[axis] + f64::from(part) / 12.0 * (b[axis] - a[axis])))
        })
    }

    #[test]
    fn nobody_collides() {
        let world = world();
        for stamp_ns in stamps_ns().step_by(2) {
            let vehicles: Vec<Solid> = world.movers().iter().map(|mover| mover.at(stamp_ns)).collect();
            for (index, vehicle) in vehicles.iter().enumerate() {
                let others = vehicles.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, other)| other);
                for other in others.chain(world.solids()) {
                    let collides = outline(vehicle).any(|point| other.contains(point));
                    assert!(!collides, "{:?} and {:?} at {stamp_ns} ns", vehicle.bounds(), other.bounds());
                }
            }
        }
    }

    #[test]
    fn vehicles_turn_up_and_vanish_out_of_sight_and_the_road_is_never_empty() {
        let world = world();
        let in_sight = |solid: &Solid| solid.bounds().reaches([0.0; 2], f64::from(LIDAR.range_max_m));
        let mut before: Vec<Solid> = world.movers().iter().map(|mover| mover.at(FIRST_STAMP_NS)).collect();
        let mut jumps = 0;
        for stamp_ns in stamps_ns().skip(1) {
            let now: Vec<Solid> = world.movers().iter().map(|mover| mover.at(stamp_ns)).collect();
            for (before, now) in before.iter().zip(&now) {
                // 1 m from scan to scan; the outline of one that turns, a little more.
                let jumped = (0..2).any(|axis| (now.bounds().min[axis] - before.bounds().min[axis]).abs() > 2.0);
                assert!(!(jumped && (in_sight(before) || in_sight(now))), "at {stamp_ns} ns");
                jumps += u32::from(jumped);
            }
            assert!(now.iter().filter(|vehicle| in_sight(vehicle)).count() >= 5, "at {stamp_ns} ns");
            before = now;
        }
        // 15 vehicles, 45 s, one jump in 24 s.
        assert!((15..=30).contains(&jumps), "{jumps}");
    }

    #[test]
    fn some_beams_meet_vehicles_and_more_do_not() {
        let standing = World::new(world().solids().to_vec(), world().bounds());
        let lidar = Lidar { noise_std_m: 0.0, ..LIDAR };
        let scans = |world| crate::sim::Simulation::new(world, lidar, trajectory(), 0).expect("valid").step_by(10);
        let (mut shorter, mut lost, mut beams) = (0, 0, 0);
        for (with, without) in scans(world()).zip(scans(standing)) {
            for (with_m, without_m) in with.ranges_m.iter().zip(&without.ranges_m) {
                assert!(with_m <= without_m, "a vehicle hides, it does not reveal");
                shorter += u32::from(with_m < without_m);
                lost += u32::from(with_m.is_infinite());
                beams += 1;
            }
        }
        let [shorter, lost] = [shorter, lost].map(|some| f64::from(some) / f64::from(beams));
        assert!((0.1..0.5).contains(&shorter), "{shorter} of the beams meet vehicles");
        assert!((0.02..0.3).contains(&lost), "{lost} of the beams do not return");
    }
}
