//! A lidar: which beams it sends and how well it measures. Depends on `noise` and `world`.

use bhm_core::geometry::Pose;
use bhm_core::scan::MAX_BEAMS;
use rand::Rng;

use super::{noise::standard_normal, world::World};

/// A planar lidar that looks along its x axis.
///
/// The beams are the middles of `beams` equal sectors of the field of view, so that a full circle has no beam twice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lidar {
    /// Angle the beams share, radians, in (0, 2π].
    pub field_of_view_rad: f32,
    /// Beams per scan, 1 to [`MAX_BEAMS`].
    pub beams: usize,
    /// Shortest range it can measure, metres.
    pub range_min_m: f32,
    /// Range at and beyond which nothing returns, metres.
    pub range_max_m: f32,
    /// Standard deviation of a range, metres.
    pub noise_std_m: f32,
}

/// Why a [`Lidar`] cannot be simulated.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidLidar {
    /// No beams, or more than a scan may have.
    #[error("a lidar has 1 to {MAX_BEAMS} beams, not {0}")]
    Beams(usize),
    /// A field of view that is not positive, or larger than a full circle.
    #[error("a lidar's field of view is positive and at most 2π rad, not {0}")]
    FieldOfView(f32),
    /// Ranges that are not `0 ≤ min < max < ∞`.
    #[error("a lidar's ranges: expected 0 <= shortest < longest < infinity, not {min_m} m and {max_m} m")]
    Ranges {
        /// Shortest range, metres.
        min_m: f32,
        /// Longest range, metres.
        max_m: f32,
    },
    /// A standard deviation that is negative or not finite.
    #[error("a lidar's noise has a standard deviation of at least 0 m, not {0}")]
    Noise(f32),
}

impl Lidar {
    /// A safety lidar of an indoor robot: 270°, 360 beams, 30 m, 1 cm.
    pub const INDOOR: Self = Self {
        field_of_view_rad: 1.5 * std::f32::consts::PI,
        beams: 360,
        range_min_m: 0.05,
        range_max_m: 30.0,
        noise_std_m: 0.01,
    };

    /// One ring of a vehicle's lidar: full circle, 720 beams, 60 m, 3 cm.
    pub const OUTDOOR: Self = Self {
        field_of_view_rad: std::f32::consts::TAU,
        beams: 720,
        range_min_m: 0.5,
        range_max_m: 60.0,
        noise_std_m: 0.03,
    };

    /// Bearing of the first beam, radians.
    #[must_use]
    pub fn angle_min_rad(&self) -> f32 {
        0.5 * (self.angle_increment_rad() - self.field_of_view_rad)
    }

    /// Bearing from one beam to the next, radians; counter-clockwise.
    #[must_use]
    pub fn angle_increment_rad(&self) -> f32 {
        self.field_of_view_rad / self.beams as f32
    }

    /// Whether the fields describe a lidar.
    ///
    /// # Errors
    /// [`InvalidLidar`] names the first field that does not.
    pub fn validate(&self) -> Result<(), InvalidLidar> {
        let &Self { field_of_view_rad, beams, range_min_m: min_m, range_max_m: max_m, noise_std_m } = self;
        if !(1..=MAX_BEAMS).contains(&beams) {
            return Err(InvalidLidar::Beams(beams));
        }
        if !(field_of_view_rad > 0.0 && field_of_view_rad <= std::f32::consts::TAU) {
            return Err(InvalidLidar::FieldOfView(field_of_view_rad));
        }
        if !(min_m >= 0.0 && min_m < max_m && max_m.is_finite()) {
            return Err(InvalidLidar::Ranges { min_m, max_m });
        }
        if !(noise_std_m >= 0.0 && noise_std_m.is_finite()) {
            return Err(InvalidLidar::Noise(noise_std_m));
        }
        Ok(())
    }

    /// One range per beam, metres, in a world where nothing moves: `+∞` where nothing returns, exactly 0 for every beam of a sensor inside a solid.
    ///
    /// A range below `range_min_m` is reported as measured; whoever reads the scan drops it.
    pub(super) fn measure(&self, world: &World, map_from_sensor: Pose, rng: &mut impl Rng) -> Vec<f32> {
        let origin = [map_from_sensor.x_m, map_from_sensor.y_m].map(f64::from);
        let first_rad = f64::from(map_from_sensor.theta_rad) + f64::from(self.angle_min_rad());
        let increment_rad = f64::from(self.angle_increment_rad());
        let nearby = world.within(origin, f64::from(self.range_max_m));
        let beam = |index| {
            // Drawn for every beam, so that what one beam meets does not change the noise of the others.
            let noise_m = f64::from(self.noise_std_m) * standard_normal(rng);
            let (sin, cos) = libm::sincos(first_rad + index as f64 * increment_rad);
            self.reading(nearby.range_along(origin, [cos, sin]), noise_m)
        };
        (0..self.beams).map(beam).collect()
    }

    fn reading(&self, true_range_m: Option<f64>, noise_m: f64) -> f32 {
        match true_range_m {
            Some(0.0) => 0.0,
            Some(range_m) if range_m < f64::from(self.range_max_m) => {
                let measured_m = (range_m + noise_m).max(0.0) as f32;
                if measured_m < self.range_max_m { measured_m } else { f32::INFINITY }
            }
            _ => f32::INFINITY,
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::sim::solid::{Bounds, Solid};

    const BOUNDS: Bounds = Bounds { min: [-10.0, -10.0], max: [10.0, 10.0] };

    fn ranges(lidar: Lidar, solids: Vec<Solid>, map_from_sensor: Pose) -> Vec<f32> {
        lidar.measure(&World::new(solids, BOUNDS), map_from_sensor, &mut ChaCha8Rng::seed_from_u64(1))
    }

    #[test]
    fn beams_point_where_a_reader_of_the_scan_believes() {
        let exact = Lidar { noise_std_m: 0.0, ..Lidar::OUTDOOR };
        let pose = Pose::new(1.5, -0.5, 2.0);
        let room = [
            Solid::between([-4.0, -3.0], [4.0, -2.0]),
            Solid::between([-4.0, 2.0], [4.0, 3.0]),
            Solid::between([-4.0, -3.0], [-3.0, 3.0]),
            Solid::between([3.0, -3.0], [4.0, 3.0]),
        ];
        for (index, range_m) in ranges(exact, room.to_vec(), pose).into_iter().enumerate() {
            let hit = pose.point_along(exact.angle_min_rad() + index as f32 * exact.angle_increment_rad(), range_m);
            // The room's inner face is the rectangle |x| = 3, |y| = 2.
            let off_m = (hit.x.abs() - 3.0).max(hit.y.abs() - 2.0).abs();
            assert!(off_m < 1e-5, "beam {index} ends {off_m} m off the wall");
        }
    }

    #[test]
    fn sectors_share_the_field_of_view() {
        let lidar = Lidar { beams: 4, field_of_view_rad: 2.0, ..Lidar::INDOOR };
        assert_eq!(lidar.angle_increment_rad(), 0.5);
        assert_eq!(lidar.angle_min_rad(), -0.75);
        assert_eq!(Lidar { beams: 1, ..Lidar::INDOOR }.angle_min_rad(), 0.0);
    }

    #[test]
    fn noise_is_normal_with_the_stated_deviation() {
        let lidar = Lidar { beams: 1, noise_std_m: 0.05, ..Lidar::INDOOR };
        let world = World::new(vec![Solid::between([5.0, -1.0], [6.0, 1.0])], BOUNDS);
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let draws = 40_000;
        let scores: Vec<f64> =
            (0..draws).map(|_| (f64::from(lidar.measure(&world, Pose::default(), &mut rng)[0]) - 5.0) / 0.05).collect();
        let moment = |power| scores.iter().map(|score| score.powi(power)).sum::<f64>() / f64::from(draws);
        // Five standard errors of each moment of the standard normal: variances 1, 2, 15 and 96.
        for (power, expected, variance) in [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0)] {
            let tolerance = 5.0 * (variance / f64::from(draws)).sqrt();
            assert!((moment(power) - expected).abs() < tolerance, "moment {power}: {}", moment(power));
        }
    }

    #[test]
    fn inside_a_solid_every_beam_reads_zero() {
        let solid = Solid::between([-1.0, -1.0], [1.0, 1.0]);
        let measured = ranges(Lidar::INDOOR, vec![solid], Pose::default());
        assert!(measured.len() == 360 && measured.iter().all(|range_m| *range_m == 0.0));
    }

    #[test]
    fn nothing_within_reach_reads_infinite() {
        let wall = Solid::between([7.0, -9.0], [8.0, 9.0]);
        let short_sighted = Lidar { range_max_m: 6.0, ..Lidar::INDOOR };
        assert!(ranges(short_sighted, vec![wall.clone()], Pose::default()).iter().all(|m| *m == f32::INFINITY));
        // At the very limit noise decides, but a finite reading never reaches the limit.
        let at_limit = Lidar { range_max_m: 7.01, noise_std_m: 0.5, ..Lidar::INDOOR };
        let measured = ranges(at_limit, vec![wall], Pose::default());
        assert!(measured.iter().any(|m| m.is_finite()));
        assert!(measured.iter().all(|m| *m < 7.01 || *m == f32::INFINITY));
    }

    #[test]
    fn one_beams_surroundings_do_not_change_anothers_noise() {
        let ahead = Solid::between([5.0, -1.0], [6.0, 1.0]);
        let aside = Solid::between([-1.0, 4.0], [1.0, 5.0]);
        let alone = ranges(Lidar::INDOOR, vec![ahead.clone()], Pose::default());
        let accompanied = ranges(Lidar::INDOOR, vec![ahead, aside], Pose::default());
        assert!(alone.iter().zip(&accompanied).all(|(a, b)| a == b || *a == f32::INFINITY));
    }

    #[test]
    fn refuses_what_is_no_lidar() {
        let with = |change: fn(&mut Lidar)| {
            let mut lidar = Lidar::INDOOR;
            change(&mut lidar);
            lidar.validate()
        };
        assert_eq!(with(|_| ()), Ok(()));
        assert_eq!(Lidar::OUTDOOR.validate(), Ok(()));
        assert_eq!(with(|lidar| lidar.beams = MAX_BEAMS), Ok(()));
        assert_eq!(with(|lidar| lidar.beams = 0), Err(InvalidLidar::Beams(0)));
        assert_eq!(with(|lidar| lidar.beams = MAX_BEAMS + 1), Err(InvalidLidar::Beams(MAX_BEAMS + 1)));
        assert_eq!(with(|lidar| lidar.field_of_view_rad = 6.3), Err(InvalidLidar::FieldOfView(6.3)));
        assert!(with(|lidar| lidar.field_of_view_rad = f32::NAN).is_err());
        assert_eq!(with(|lidar| lidar.noise_std_m = -1.0), Err(InvalidLidar::Noise(-1.0)));
        assert!(with(|lidar| lidar.noise_std_m = f32::NAN).is_err());
        assert!(with(|lidar| lidar.range_max_m = f32::INFINITY).is_err());
        assert!(with(|lidar| lidar.range_min_m = f32::NAN).is_err());
        assert!(with(|lidar| lidar.range_min_m = 30.0).is_err());
    }
}
