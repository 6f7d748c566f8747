//! Where the robot drives. Depends on `solid`.

use std::f64::consts::TAU;

use bhm_core::geometry::Pose;

use super::solid::{Position, add, dot, length, subtract};

/// Motion is integrated in this many steps from one scan to the next.
const STEPS_PER_SCAN: usize = 10;

/// Longest trajectory: more than a day at 1 Hz; a longer one is a mistake in the units.
const MAX_SCANS: usize = 100_000;

/// How a robot follows its waypoints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Speed on a straight, metres per second; turns are taken more slowly.
    pub speed_m_s: f64,
    /// Fastest turn, radians per second.
    pub turn_rate_max_rad_s: f64,
    /// How far ahead on the route the robot aims, metres: the larger, the rounder the corners.
    pub look_ahead_m: f64,
    /// Scans per second.
    pub scan_rate_hz: f64,
}

/// The sensor's true pose at every scan.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    poses: Vec<Pose>,
    period_ns: u64,
}

/// Why a [`Drive`] cannot follow its waypoints.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidRoute {
    /// Nowhere to drive to.
    #[error("a route needs at least 2 waypoints, not {0}")]
    TooFewWaypoints(usize),
    /// A waypoint that is no place.
    #[error("waypoint {0} is not finite")]
    Waypoint(usize),
    /// A quantity of the [`Drive`] that is not a positive number.
    #[error("the drive's {quantity} must be positive and finite, not {value}")]
    Drive {
        /// The field's name.
        quantity: &'static str,
        /// What it was.
        value: f64,
    },
    /// More scans than any simulation needs.
    #[error("the route takes more than {MAX_SCANS} scans")]
    TooLong,
}

impl Trajectory {
    /// A trajectory given pose by pose, one scan every `period_ns` nanoseconds; a single pose repeated is a fixed sensor.
    #[must_use]
    pub fn new(poses: Vec<Pose>, period_ns: u64) -> Self {
        Self { poses, period_ns }
    }

    /// Drives from the first waypoint to the last, aiming at a point that runs ahead on the straight lines between them.
    ///
    /// The heading never jumps: the robot slows down as it turns, and turns on the spot before it drives back.
    ///
    /// # Errors
    /// [`InvalidRoute`] if there are fewer than two waypoints, a number is not finite or not positive, or the route is
    /// absurdly long.
    pub fn along(waypoints: &[Position], drive: &Drive) -> Result<Self, InvalidRoute> {
        drive.validate()?;
        let &[start, second, ..] = waypoints else {
            return Err(InvalidRoute::TooFewWaypoints(waypoints.len()));
        };
        if let Some(index) = waypoints.iter().position(|point| !point.iter().all(|x| x.is_finite())) {
            return Err(InvalidRoute::Waypoint(index));
        }

        let step_s = 1.0 / (drive.scan_rate_hz * STEPS_PER_SCAN as f64);
        let mut position = start;
        let mut heading_rad = bearing_rad(subtract(second, start));
        let mut aim = Aim { position: start, remaining: waypoints };
        let mut poses = Vec::new();
        while poses.len() < MAX_SCANS {
            poses.push(Pose::new(position[0] as f32, position[1] as f32, heading_rad as f32));
            for _ in 0..STEPS_PER_SCAN {
                aim.run_ahead(position, drive.look_ahead_m);
                let ahead = subtract(aim.position, position);
                if aim.remaining.is_empty() && length(ahead) <= drive.speed_m_s * step_s {
                    return Ok(Self { poses, period_ns: (1e9 / drive.scan_rate_hz).round() as u64 });
                }
                let off_rad = wrapped(bearing_rad(ahead) - heading_rad);
                let turn_max_rad = drive.turn_rate_max_rad_s * step_s;
                heading_rad = wrapped(heading_rad + off_rad.clamp(-turn_max_rad, turn_max_rad));
                let step_m = drive.speed_m_s * step_s * libm::cos(off_rad).max(0.0);
                let (sin, cos) = libm::sincos(heading_rad);
                position = add(position, [step_m * cos, step_m * sin]);
            }
        }
        Err(InvalidRoute::TooLong)
    }

    /// The poses, one per scan.
    #[must_use]
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Time from one scan to the next, nanoseconds.
    #[must_use]
    pub fn period_ns(&self) -> u64 {
        self.period_ns
    }
}

impl Drive {
    fn validate(&self) -> Result<(), InvalidRoute> {
        let quantities = [
            ("speed_m_s", self.speed_m_s),
            ("turn_rate_max_rad_s", self.turn_rate_max_rad_s),
            ("look_ahead_m", self.look_ahead_m),
            ("scan_rate_hz", self.scan_rate_hz),
        ];
        match quantities.into_iter().find(|&(_, value)| !(value > 0.0 && value.is_finite())) {
            Some((quantity, value)) => Err(InvalidRoute::Drive { quantity, value }),
            None => Ok(()),
        }
    }
}

/// The point of the route the robot steers for.
struct Aim<'a> {
    position: Position,
    remaining: &'a [Position],
}

impl Aim<'_> {
    /// Moves on along the route to where it leaves the circle of `look_ahead_m` around the robot, or ends.
    fn run_ahead(&mut self, robot: Position, look_ahead_m: f64) {
        while let [next, later @ ..] = self.remaining {
            let offset = subtract(self.position, robot);
            if length(offset) >= look_ahead_m {
                break;
            }
            if length(subtract(*next, robot)) > look_ahead_m {
                // |offset + t·leg| = look_ahead has one root t in (0, 1): the leg starts within the circle and ends outside.
                let leg = subtract(*next, self.position);
                let (a, b, c) = (dot(leg, leg), dot(offset, leg), dot(offset, offset) - look_ahead_m * look_ahead_m);
                let t = ((b * b - a * c).sqrt() - b) / a;
                self.position = add(self.position, leg.map(|x| t * x));
                break;
            }
            self.position = *next;
            self.remaining = later;
        }
    }
}

fn bearing_rad(direction: Position) -> f64 {
    libm::atan2(direction[1], direction[0])
}

/// The same angle in [−π, π].
fn wrapped(angle_rad: f64) -> f64 {
    libm::remainder(angle_rad, TAU)
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRIVE: Drive = Drive { speed_m_s: 1.0, turn_rate_max_rad_s: 1.5, look_ahead_m: 0.5, scan_rate_hz: 10.0 };

    fn distance_m(pose: &Pose, point: Position) -> f64 {
        length(subtract([pose.x_m, pose.y_m].map(f64::from), point))
    }

    #[test]
    fn a_straight_route_takes_the_time_it_should() {
        let trajectory = Trajectory::along(&[[0.0, 0.0], [0.0, 9.95]], &DRIVE).expect("valid");
        assert_eq!(trajectory.period_ns(), 100_000_000);
        assert_eq!(trajectory.poses().len(), 100);
        assert!(trajectory.poses().iter().all(|pose| pose.x_m.abs() < 1e-6));
    }

    #[test]
    fn neither_speed_nor_turn_rate_is_exceeded() {
        // A right angle, a repeated waypoint, a way straight back, a sharp corner.
        let route = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [4.0, 3.0], [4.0, -2.0], [3.0, 4.0]];
        let trajectory = Trajectory::along(&route, &DRIVE).expect("valid");
        // Poses are rounded to f32, here below 8 m.
        let rounding = 1e-6;
        for pair in trajectory.poses().windows(2) {
            let moved_m = distance_m(&pair[0], [f64::from(pair[1].x_m), f64::from(pair[1].y_m)]);
            let turned_rad = wrapped(f64::from(pair[1].theta_rad) - f64::from(pair[0].theta_rad)).abs();
            assert!(moved_m <= DRIVE.speed_m_s / DRIVE.scan_rate_hz + rounding, "{moved_m} m in one scan");
            assert!(turned_rad <= DRIVE.turn_rate_max_rad_s / DRIVE.scan_rate_hz + rounding, "{turned_rad} rad");
        }
        for waypoint in route {
            let nearest = trajectory.poses().iter().map(|pose| distance_m(pose, waypoint)).fold(f64::MAX, f64::min);
            assert!(nearest <= DRIVE.look_ahead_m + 0.1, "{waypoint:?} is passed at {nearest} m");
        }
    }

    #[test]
    fn refuses_routes_nobody_can_drive() {
        let there = [[0.0, 0.0], [1.0, 0.0]];
        let along = |waypoints: &[Position], drive| Trajectory::along(waypoints, &drive).map(|_| ());
        assert_eq!(along(&there, DRIVE), Ok(()));
        assert_eq!(along(&there[..1], DRIVE), Err(InvalidRoute::TooFewWaypoints(1)));
        assert_eq!(along(&[[0.0, 0.0], [f64::NAN, 0.0]], DRIVE), Err(InvalidRoute::Waypoint(1)));
        assert_eq!(
            along(&there, Drive { speed_m_s: 0.0, ..DRIVE }),
            Err(InvalidRoute::Drive { quantity: "speed_m_s", value: 0.0 })
        );
        assert!(along(&there, Drive { scan_rate_hz: f64::NAN, ..DRIVE }).is_err());
        assert_eq!(along(&there, Drive { speed_m_s: 1e-6, ..DRIVE }), Err(InvalidRoute::TooLong));
    }
}
