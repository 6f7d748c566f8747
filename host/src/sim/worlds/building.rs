//! One floor of an office building, 40 m × 25 m: ten rooms and a lobby along a corridor.

use crate::sim::{
    lidar::Lidar,
    scene::Scene,
    solid::{Bounds, Position, Solid},
    trajectory::{Drive, Trajectory},
    world::World,
};

pub(super) const SCENE: Scene = Scene { name: "building", lidar: Lidar::INDOOR, world, trajectory };

const OUTER_WALL_M: f64 = 0.4;
const INNER_WALL_M: f64 = 0.2;
const DOOR_M: f64 = 1.2;

/// Centre lines of the outer walls and of the corridor's: `x = ±WEST_EAST`, `y = ±SOUTH_NORTH`, `y = ±CORRIDOR`.
const WEST_EAST: f64 = 20.0;
const SOUTH_NORTH: f64 = 12.5;
const CORRIDOR: f64 = 1.25;

const DRIVE: Drive = Drive { speed_m_s: 1.5, turn_rate_max_rad_s: 1.8, look_ahead_m: 0.8, scan_rate_hz: 5.0 };

/// A round trip through every room.
#[rustfmt::skip]
const ROUTE: [Position; 47] = [
    // West end of the corridor, the two south-west offices.
    [-17.5, 0.0], [-16.5, 0.0], [-16.5, -6.0], [-16.0, -9.0], [-10.0, -9.0], [-8.0, -7.5], [-8.0, 0.0],
    // Around the table of the meeting room.
    [-3.5, 0.0], [-3.5, -9.0], [2.5, -9.0], [2.5, 0.0],
    // A look into the kitchen.
    [7.0, 0.0], [7.0, -3.5], [9.0, -3.5], [9.0, 0.0],
    // The south-east office and the store behind it.
    [16.0, 0.0], [16.0, -7.0], [14.0, -8.4], [10.5, -8.4], [9.0, -9.6], [7.5, -8.8], [9.0, -7.8], [10.5, -8.4],
    [13.0, -8.4], [14.0, -5.0], [16.0, -3.0], [16.0, 0.0],
    // The north-east offices.
    [17.5, 0.0], [17.5, 6.0], [16.0, 8.0], [12.0, 8.0], [11.0, 7.0], [11.0, 0.0],
    // Around the lobby's reception desk.
    [5.0, 0.0], [5.0, 6.0], [4.0, 8.6], [1.0, 8.6], [0.0, 6.0], [0.0, 0.0],
    // The north-west offices, and back.
    [-6.0, 0.0], [-6.0, 7.5], [-7.5, 9.0], [-12.5, 9.0], [-14.0, 7.0], [-14.0, 1.0], [-15.0, 0.0], [-16.5, 0.0],
];

fn trajectory() -> Trajectory {
    Trajectory::along(&ROUTE, &DRIVE).expect("the route is finite")
}

fn world() -> World {
    let mut solids = Vec::new();
    walls(&mut solids);
    furniture(&mut solids);
    let margin = 1.5;
    let max = [WEST_EAST + margin, SOUTH_NORTH + margin];
    World::new(solids, Bounds { min: max.map(|x| -x), max })
}

fn walls(solids: &mut Vec<Solid>) {
    // Outer walls overlap at the corners; the corridor's east end is the building's open entrance.
    let reach = 0.5 * OUTER_WALL_M;
    let [west_east, south_north] = [WEST_EAST + reach, SOUTH_NORTH + reach].map(|x| [-x, x]);
    wall_along_x(solids, -SOUTH_NORTH, west_east, OUTER_WALL_M, &[]);
    wall_along_x(solids, SOUTH_NORTH, west_east, OUTER_WALL_M, &[]);
    wall_along_y(solids, -WEST_EAST, south_north, OUTER_WALL_M, &[]);
    wall_along_y(solids, WEST_EAST, south_north, OUTER_WALL_M, &[0.0]);

    // Inner walls end on the centre line of the one they meet.
    let inner = INNER_WALL_M;
    wall_along_x(solids, -CORRIDOR, [-WEST_EAST, WEST_EAST], inner, &[-16.5, -8.0, -3.5, 2.5, 7.0, 9.0, 16.0]);
    wall_along_x(solids, CORRIDOR, [-WEST_EAST, -1.5], inner, &[-14.0, -6.0]);
    wall_along_x(solids, CORRIDOR, [6.5, WEST_EAST], inner, &[11.0, 17.5]);

    let south = [-SOUTH_NORTH, -CORRIDOR];
    wall_along_y(solids, -13.0, south, inner, &[-9.0]);
    wall_along_y(solids, -5.0, south, inner, &[]);
    wall_along_y(solids, 4.0, south, inner, &[]);
    wall_along_y(solids, 12.0, south, inner, &[-8.4]);
    wall_along_x(solids, -6.0, [4.0, 12.0], inner, &[]);

    let north = [CORRIDOR, SOUTH_NORTH];
    wall_along_y(solids, -11.0, north, inner, &[9.0]);
    wall_along_y(solids, -3.0, north, inner, &[]);
    wall_along_y(solids, 8.0, north, inner, &[]);
    wall_along_y(solids, 14.0, north, inner, &[8.0]);
}

fn furniture(solids: &mut Vec<Solid>) {
    // Desks along the windows and shelves along the partitions.
    for [x, y] in [[-18.6, -11.3], [-14.6, -11.3], [-11.4, -11.3], [-7.0, -11.3], [18.4, -10.8], [14.5, -11.3]] {
        solids.push(Solid::rectangle([x, y], [1.6, 0.8], 0.0));
    }
    for [x, y] in [[-18.5, 11.2], [-14.5, 11.2], [-9.0, 11.2], [-5.0, 11.2], [10.5, 11.2], [16.0, 11.2], [18.5, 11.2]] {
        solids.push(Solid::rectangle([x, y], [1.8, 0.8], 0.0));
    }
    for [x, y] in [[-19.4, 5.0], [-12.5, -4.5], [-19.4, -4.5], [19.4, 4.0], [19.4, -5.0], [8.5, 4.5]] {
        solids.push(Solid::rectangle([x, y], [0.45, 2.4], 0.0));
    }
    // Meeting table, and two tables that someone left askew.
    solids.push(Solid::rectangle([-0.5, -5.8], [2.0, 4.4], 0.0));
    solids.push(Solid::rectangle([-17.6, 8.2], [2.2, 1.1], 0.6));
    solids.push(Solid::rectangle([-10.3, -5.2], [1.4, 1.4], -0.45));
    // Kitchen: a counter and a round table.
    solids.push(Solid::between([4.1, -5.9], [10.5, -5.2]));
    solids.push(Solid::regular_polygon([10.8, -2.8], 0.5, 12));
    // Store: two rows of racks.
    solids.push(Solid::between([4.6, -7.0], [7.4, -6.4]));
    solids.push(Solid::between([4.6, -11.6], [10.6, -10.8]));
    // Lobby: a round reception desk between two columns, benches at the back.
    solids.push(Solid::regular_polygon([2.5, 5.8], 1.2, 16));
    for x in [-1.2, 6.4] {
        solids.push(Solid::regular_polygon([x, 3.2], 0.35, 10));
        solids.push(Solid::rectangle([x, 11.6], [1.9, 0.6], 0.0));
    }
}

fn wall_along_x(solids: &mut Vec<Solid>, y: f64, x_span: [f64; 2], thickness_m: f64, doors_x: &[f64]) {
    solids.extend(between_doors(x_span, doors_x).map(|[from, to]| Solid::wall([from, y], [to, y], thickness_m)));
}

fn wall_along_y(solids: &mut Vec<Solid>, x: f64, y_span: [f64; 2], thickness_m: f64, doors_y: &[f64]) {
    solids.extend(between_doors(y_span, doors_y).map(|[from, to]| Solid::wall([x, from], [x, to], thickness_m)));
}

/// What doors centred at ascending `doors` leave of a span.
fn between_doors([start, end]: [f64; 2], doors: &[f64]) -> impl Iterator<Item = [f64; 2]> {
    let starts = std::iter::once(start).chain(doors.iter().map(|door| door + 0.5 * DOOR_M));
    let ends = doors.iter().map(|door| door - 0.5 * DOOR_M).chain(std::iter::once(end));
    starts.zip(ends).map(|(from, to)| [from, to])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Inside corners of each room, as south-west and north-east.
    const ROOMS: [(&str, Position, Position); 11] = [
        ("south-west office", [-19.8, -12.3], [-13.1, -1.35]),
        ("second office", [-12.9, -12.3], [-5.1, -1.35]),
        ("meeting room", [-4.9, -12.3], [3.9, -1.35]),
        ("kitchen", [4.1, -5.9], [11.9, -1.35]),
        ("store", [4.1, -12.3], [11.9, -6.1]),
        ("south-east office", [12.1, -12.3], [19.8, -1.35]),
        ("north-east office", [14.1, 1.35], [19.8, 12.3]),
        ("its anteroom", [8.1, 1.35], [13.9, 12.3]),
        ("lobby", [-2.9, 1.35], [7.9, 12.3]),
        ("library", [-10.9, 1.35], [-3.1, 12.3]),
        ("north-west office", [-19.8, 1.35], [-11.1, 12.3]),
    ];

    #[test]
    fn every_room_is_visited_for_a_while() {
        let trajectory = trajectory();
        for (room, min, max) in ROOMS {
            let inside = |x: f32, y: f32| Bounds { min, max }.contains([f64::from(x), f64::from(y)]);
            let scans = trajectory.poses().iter().filter(|pose| inside(pose.x_m, pose.y_m)).count();
            assert!(scans >= 10, "{room}: {scans} scans");
        }
    }

    #[test]
    fn doors_leave_the_rest_of_a_wall() {
        let pieces: Vec<_> = between_doors([0.0, 10.0], &[2.0, 6.0]).collect();
        assert_eq!(pieces, [[0.0, 1.4], [2.6, 5.4], [6.6, 10.0]]);
    }
}
