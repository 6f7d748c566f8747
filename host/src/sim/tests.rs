//! The scenes against naive oracles, and the simulation as a whole.

use bhm_core::geometry::Pose;
use bhm_core::scan::ScanHeader;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::ScanRecord;

fn scenes() -> impl Iterator<Item = &'static Scene> {
    Scene::names().map(|name| Scene::named(name).expect("listed"))
}

/// What a scene looks like some time after it began: all that moves stands still where it then is.
fn frozen(scene: &Scene) -> World {
    scene.world().at(FIRST_STAMP_NS + 7_300_000_000).into_owned()
}

fn random_point(bounds: Bounds, rng: &mut impl Rng) -> Position {
    [0, 1].map(|axis| rng.random_range(bounds.min[axis]..bounds.max[axis]))
}

fn edges(solid: &Solid) -> impl Iterator<Item = (Position, Position)> {
    let vertices = solid.vertices();
    (0..vertices.len()).map(|i| (vertices[i], vertices[(i + 1) % vertices.len()]))
}

/// How often the outline winds around a point, as the sum of the angles under which its edges are seen.
fn winding_number(solid: &Solid, point: Position) -> f64 {
    let seen_rad = |vertex: Position| (vertex[1] - point[1]).atan2(vertex[0] - point[0]);
    let angle_rad = |(a, b)| (seen_rad(b) - seen_rad(a) + 3.0 * std::f64::consts::PI).rem_euclid(std::f64::consts::TAU);
    edges(solid).map(|edge| angle_rad(edge) - std::f64::consts::PI).sum::<f64>() / std::f64::consts::TAU
}

fn is_inside(world: &World, point: Position) -> bool {
    world.solids().iter().any(|solid| winding_number(solid, point).round() != 0.0)
}

/// Where a ray crosses an edge, solving `origin + t·direction = a + s·(b − a)` by Cramer's rule.
fn crossing(origin: Position, direction: Position, (a, b): (Position, Position)) -> Option<f64> {
    let determinant = direction[1] * (b[0] - a[0]) - direction[0] * (b[1] - a[1]);
    let t = ((a[1] - origin[1]) * (b[0] - a[0]) - (a[0] - origin[0]) * (b[1] - a[1])) / determinant;
    let s = (direction[0] * (a[1] - origin[1]) - direction[1] * (a[0] - origin[0])) / determinant;
    (t >= 0.0 && (0.0..=1.0).contains(&s)).then_some(t)
}

fn distance_to_edge(point: Position, (a, b): (Position, Position)) -> f64 {
    let (edge, offset) = (solid::subtract(b, a), solid::subtract(point, a));
    let s = (solid::dot(edge, offset) / solid::dot(edge, edge)).clamp(0.0, 1.0);
    solid::length(solid::subtract(offset, edge.map(|x| s * x)))
}

#[test]
fn occupancy_is_what_the_winding_number_says() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for scene in scenes() {
        let world = frozen(scene);
        let mut occupied = 0;
        for _ in 0..5_000 {
            let point = random_point(world.bounds(), &mut rng).map(|x| x as f32);
            let expected = is_inside(&world, point.map(f64::from));
            assert_eq!(world.is_occupied(point), expected, "{} at {point:?}", scene.name);
            occupied += u32::from(expected);
        }
        assert!((250..2_500).contains(&occupied), "{}: {occupied} of 5000 points occupied", scene.name);
    }
}

#[test]
fn rays_end_where_the_first_edge_is_crossed() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    for scene in scenes() {
        let world = frozen(scene);
        for _ in 0..10_000 {
            let origin = random_point(world.bounds(), &mut rng);
            let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
            let direction = [cos, sin];
            let expected = if is_inside(&world, origin) {
                Some(0.0)
            } else {
                let crossings = world.solids().iter().flat_map(edges).filter_map(|e| crossing(origin, direction, e));
                crossings.min_by(f64::total_cmp)
            };
            let measured = world.range_along(origin, direction);
            // Rounding of positions up to 300 m, enlarged by edges met at a grazing angle.
            let agrees = match (measured, expected) {
                (Some(measured), Some(expected)) => (measured - expected).abs() < 1e-9,
                (None, None) => true,
                _ => false,
            };
            assert!(agrees, "{} from {origin:?} along {direction:?}: {measured:?}, not {expected:?}", scene.name);

            let reach = f64::from(scene.lidar.range_max_m);
            let nearby = world.within(origin, reach).range_along(origin, direction);
            assert_eq!(measured.filter(|t| *t < reach), nearby.filter(|t| *t < reach), "sorting out loses nothing");
        }
    }
}

#[test]
fn the_robot_keeps_clear_of_everything() {
    const CLEARANCE_M: f64 = 0.2;
    for scene in scenes() {
        let world = scene.world();
        let trajectory = scene.trajectory();
        for (index, pair) in trajectory.poses().windows(2).enumerate() {
            let world = world.at(FIRST_STAMP_NS + index as u64 * trajectory.period_ns());
            for part in [0.0, 0.25, 0.5, 0.75] {
                let between = |from: f32, to: f32| f64::from(from) + part * (f64::from(to) - f64::from(from));
                let point = [between(pair[0].x_m, pair[1].x_m), between(pair[0].y_m, pair[1].y_m)];
                assert!(!is_inside(&world, point), "{}: through a solid at {point:?}", scene.name);
                let distances = world.solids().iter().flat_map(edges).map(|edge| distance_to_edge(point, edge));
                let clearance_m = distances.fold(f64::MAX, f64::min);
                assert!(clearance_m >= CLEARANCE_M, "{}: {clearance_m} m at {point:?}", scene.name);
            }
        }
    }
}

#[test]
fn scenes_are_as_long_as_promised() {
    let scans = |name| Scene::named(name).expect("listed").simulate(0).len();
    assert!((400..=600).contains(&scans("building")), "{}", scans("building"));
    assert!((700..=900).contains(&scans("outdoor")), "{}", scans("outdoor"));
    assert_eq!(scans("traffic"), 450);
}

#[test]
fn a_scan_sees_what_moves_where_it_is_at_the_stamp() {
    // A 4 m long box comes at 10 m/s; its front is 0.8 m before the front axle, which is 2.4 m before the rear one.
    let oncoming = Mover::along(vec![[100.0, 0.0], [0.0, 0.0]], [4.0, 2.0], 10.0, 0.9);
    let bounds = Bounds { min: [-1.0, -10.0], max: [100.0, 10.0] };
    let world = World::new(vec![Solid::between([105.0, -9.0], [106.0, 9.0])], bounds).with_movers(vec![oncoming]);
    let lidar = Lidar { beams: 1, noise_std_m: 0.0, range_max_m: 200.0, ..Lidar::INDOOR };
    let fixed = Trajectory::new(vec![Pose::default(); 8], 1_000_000_000);
    let scans = Simulation::new(world.clone(), lidar, fixed, 0).expect("valid");
    for (seconds, scan) in scans.enumerate() {
        // The first stamp is 1 s: the lap has just begun again.
        let expected_m = 100.0 - 10.0 * seconds as f32 - 3.2;
        assert!((scan.ranges_m[0] - expected_m).abs() < 1e-4, "{} m, not {expected_m}", scan.ranges_m[0]);
        let just = [expected_m + 0.1, 0.0];
        assert!(
            world.at(scan.header.stamp_ns).is_occupied(just) && !world.is_occupied(just),
            "the truth is what stands still"
        );
    }
    assert_eq!(world.range_along([0.0; 2], [1.0, 0.0]), Some(105.0));
}

#[test]
fn noisy_poses_are_reported_but_scans_taken_from_the_true_ones() {
    let scene = Scene::named("building").expect("listed");
    let noise = PoseNoise { position_m: 0.1, heading_rad: 0.02 };
    let noisy = || scene.simulate(5).with_pose_noise(noise).expect("valid");
    assert_eq!(noisy().pose_noise(), noise);
    assert_eq!(scene.simulate(5).pose_noise(), PoseNoise::NONE);
    let (mut square_m2, mut square_rad2) = (0.0, 0.0);
    for (off, exact) in noisy().zip(scene.simulate(5)) {
        let (reported, pose) = (off.header.map_from_sensor, exact.header.map_from_sensor);
        square_m2 += f64::from((reported.x_m - pose.x_m).powi(2) + (reported.y_m - pose.y_m).powi(2));
        square_rad2 += f64::from((reported.theta_rad - pose.theta_rad).powi(2));
        assert_eq!(
            ScanRecord { header: ScanHeader { map_from_sensor: pose, pose_covariance: None, ..off.header }, ..off },
            exact,
            "all but the pose stays"
        );
    }
    // A mean of n squares of normal errors has the relative deviation √(2/n); five of them.
    let scans = scene.trajectory().poses().len() as f64;
    for (mean, expected, draws) in
        [(square_m2 / scans / 2.0, 0.1 * 0.1, 2.0 * scans), (square_rad2 / scans, 0.02 * 0.02, scans)]
    {
        assert!((mean / expected - 1.0).abs() < 5.0 * (2.0 / draws).sqrt(), "{mean}, not {expected}");
    }
    assert!(noisy().eq(noisy()), "the seed decides these errors too");
    assert_ne!(noisy().next(), scene.simulate(6).with_pose_noise(noise).expect("valid").next());
    let none = scene.simulate(5).with_pose_noise(PoseNoise::NONE).expect("valid");
    assert!(none.eq(scene.simulate(5)));
    let error = scene.simulate(5).with_pose_noise(PoseNoise { heading_rad: -1.0, ..noise }).expect_err("negative");
    assert_eq!(error.to_string(), "a pose's noise has standard deviations of at least 0, not 0.1 m and -1 rad");
}

#[test]
fn on_the_site_many_beams_return_and_many_do_not() {
    let scans = Scene::named("outdoor").expect("listed").simulate(0).step_by(50);
    let ranges: Vec<f32> = scans.flat_map(|scan| scan.ranges_m).collect();
    let lost = ranges.iter().filter(|range_m| **range_m == f32::INFINITY).count() as f64 / ranges.len() as f64;
    assert!((0.2..0.5).contains(&lost), "{lost}");
}

#[test]
fn the_seed_decides_everything() {
    let scans = |seed| Scene::named("building").expect("listed").simulate(seed).take(20).collect::<Vec<_>>();
    assert_eq!(scans(5), scans(5));
    assert_ne!(scans(5), scans(6));
}

/// Guards the promise that a seed means the same bits on every platform and with every later version.
#[test]
fn a_seed_stands_for_the_same_bits_everywhere() {
    let world = World::new(
        vec![Solid::regular_polygon([4.0, 1.0], 2.0, 7), Solid::wall([-3.0, -5.0], [9.0, -2.0], 0.2)],
        Bounds { min: [-10.0, -10.0], max: [10.0, 10.0] },
    );
    let drive = Drive { speed_m_s: 1.0, turn_rate_max_rad_s: 1.0, look_ahead_m: 0.5, scan_rate_hz: 2.0 };
    let trajectory = Trajectory::along(&[[0.0, 0.0], [0.0, 4.0], [-4.0, 4.0]], &drive).expect("valid");
    let simulation = Simulation::new(world, Lidar::INDOOR, trajectory, 42).expect("valid");
    let bits = simulation.flat_map(|scan| {
        let pose = scan.header.map_from_sensor;
        [pose.x_m, pose.y_m, pose.theta_rad].into_iter().chain(scan.ranges_m).map(f32::to_bits)
    });
    // FNV-1a over 32-bit words.
    let digest =
        bits.fold(0xcbf2_9ce4_8422_2325_u64, |hash, word| (hash ^ u64::from(word)).wrapping_mul(0x100_0000_01b3));
    assert_eq!(digest, 0xa7bb_ff49_7061_1077, "{digest:#x}");
}

#[test]
fn stamps_follow_the_scan_rate_and_the_length_is_known() {
    let fixed = Trajectory::new(vec![Pose::new(0.0, 0.0, 1.0); 3], 50_000_000);
    let empty = World::new(Vec::new(), Bounds { min: [-1.0; 2], max: [1.0; 2] });
    let mut simulation = Simulation::new(empty, Lidar::INDOOR, fixed, 0).expect("valid");
    for left in (0..3).rev() {
        let scan = simulation.next().expect("three scans");
        assert_eq!(scan.header.stamp_ns, FIRST_STAMP_NS + (2 - left) * 50_000_000);
        assert_eq!(simulation.len() as u64, left);
    }
    assert_eq!(simulation.next(), None);
}

#[test]
fn an_unknown_world_is_refused_with_the_known_ones() {
    let error = Scene::named("moon").expect_err("no such world");
    assert_eq!(error.to_string(), r#"no simulated world is called "moon"; there are: building, outdoor, traffic"#);
}

#[test]
fn an_invalid_lidar_is_refused() {
    let world = Scene::named("building").expect("listed").world();
    let blind = Lidar { beams: 0, ..Lidar::INDOOR };
    let refused = Simulation::new(world, blind, Trajectory::new(Vec::new(), 1), 0).expect_err("no beams");
    assert_eq!(refused.to_string(), "a lidar has 1 to 2048 beams, not 0");
}
