//! What a mapper learns from: sweeps of range sensors, and the planar lidar scan among them, borrowed from whoever received it.

use core::fmt;

use nalgebra::SMatrix;

use crate::{
    beam::{BeamLimits, Ray, Reading},
    geometry::{Point, Pose, PoseCovariance},
};

/// Most beams a scan may have: the wire format's capacity, and a bound on the work of one scan.
pub const MAX_BEAMS: usize = 2_048;

/// One sweep of a range sensor: rays from where the sensor stood, all at one time.
///
/// A mapper of dimension `D` learns from any of them; a further sensor is another implementation.
pub trait Sweep<const D: usize> {
    /// When the sweep was taken, nanoseconds on the source's clock.
    fn stamp_ns(&self) -> u64;

    /// Number of beams.
    fn beams(&self) -> usize;

    /// Whether the sweep as a whole can be used; `is_placeable` says whether the map can place a point.
    ///
    /// # Errors
    /// The first reason why it cannot.
    fn check(&self, is_placeable: impl FnOnce(&Point<D>) -> bool) -> Result<(), ScanRejected>;

    /// Every beam as a ray in the map frame, in the order of the beams, unusable readings included. Calling it again starts
    /// again.
    fn rays(&self, limits: &BeamLimits) -> impl Iterator<Item = Ray<D>>;

    /// How uncertain the place of a point seen by this sweep is: its covariance in the map frame, m²; `None` where poses are
    /// taken as exact.
    fn covariance_at(&self, point_m: &Point<D>) -> Option<SMatrix<f32, D, D>>;
}

/// A scan without its ranges: what every carrier of scans has in common.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ScanHeader {
    /// When the scan was taken, nanoseconds on the source's clock. May repeat, must not go back.
    pub stamp_ns: u64,
    /// Where the sensor stands in the map.
    pub map_from_sensor: Pose,
    /// How uncertain that pose is: widens what the scan's points mean. `None` where poses are taken as exact.
    pub pose_covariance: Option<PoseCovariance>,
    /// Bearing of the first beam, radians from the sensor's x axis, counter-clockwise.
    pub angle_min_rad: f32,
    /// Bearing from one beam to the next, radians; negative for a sensor that turns clockwise.
    pub angle_increment_rad: f32,
    /// Shortest range the sensor can measure, metres.
    pub range_min_m: f32,
    /// Range at and beyond which a reading means "nothing returned", metres; infinite for a sensor that marks it by +∞ alone.
    pub range_max_m: f32,
}

/// A planar lidar scan: ranges at equally spaced bearings, and where the sensor stood.
///
/// A range of `+∞`, or at or beyond `range_max_m`, means "nothing returned". Ranges are not trusted: NaN, negative ones and
/// those below `range_min_m` are dropped one by one and counted.
///
/// ```
/// use bhm_core::{beam::BeamLimits, geometry::Pose, scan::{Scan, ScanHeader}};
///
/// let header = ScanHeader {
///     map_from_sensor: Pose::new(1.0, 2.0, 0.0),
///     angle_min_rad: -0.5,
///     angle_increment_rad: 0.5,
///     range_max_m: 30.0,
///     ..ScanHeader::default()
/// };
/// let scan = Scan { header, ranges_m: &[2.0, 3.0, f32::INFINITY] };
/// let ends: Vec<_> = scan.rays(&BeamLimits::DEFAULT).filter_map(|ray| ray.end_m()).collect();
/// assert_eq!(ends.len(), 2, "nothing is learned from a beam without return");
/// assert_eq!(ends[1].as_slice(), [4.0, 2.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scan<'a> {
    /// Everything but the ranges.
    pub header: ScanHeader,
    /// One range per beam, metres; at most [`MAX_BEAMS`].
    pub ranges_m: &'a [f32],
}

impl<'a> Scan<'a> {
    /// Every beam as a ray in the map frame, in the order of the beams, unusable readings included. Calling it again starts
    /// again.
    #[inline(always)]
    pub fn rays(&self, limits: &BeamLimits) -> impl Iterator<Item = Ray<2>> + use<'a> {
        let ScanHeader { map_from_sensor: pose, angle_min_rad, angle_increment_rad, range_min_m, range_max_m, .. } =
            self.header;
        let limits = *limits;
        self.ranges_m.iter().enumerate().map(move |(number, range_m)| Ray {
            number,
            origin_m: pose.position(),
            direction: pose.direction(angle_min_rad + number as f32 * angle_increment_rad),
            reading: Reading::new(*range_m, range_min_m, range_max_m, &limits),
        })
    }
}

impl Sweep<2> for Scan<'_> {
    #[inline]
    fn stamp_ns(&self) -> u64 {
        self.header.stamp_ns
    }

    #[inline]
    fn beams(&self) -> usize {
        self.ranges_m.len()
    }

    fn check(&self, is_placeable: impl FnOnce(&Point<2>) -> bool) -> Result<(), ScanRejected> {
        let ScanHeader { map_from_sensor: pose, angle_min_rad, angle_increment_rad, range_min_m, range_max_m, .. } =
            self.header;
        if self.ranges_m.len() > MAX_BEAMS {
            return Err(ScanRejected::TooManyBeams { beams: self.ranges_m.len() });
        }
        if !pose.is_finite() {
            return Err(ScanRejected::PoseNotFinite);
        }
        if self.header.pose_covariance.is_some_and(|covariance| !covariance.is_valid()) {
            return Err(ScanRejected::PoseCovariance);
        }
        if !is_placeable(&pose.position()) {
            return Err(ScanRejected::PoseTooFar { x_m: pose.x_m, y_m: pose.y_m });
        }
        let last_rad = angle_min_rad + angle_increment_rad * self.ranges_m.len() as f32;
        if !pose.direction(angle_min_rad).x.is_finite() || !pose.direction(last_rad).x.is_finite() {
            return Err(ScanRejected::Angles { min_rad: angle_min_rad, increment_rad: angle_increment_rad });
        }
        // Written so that NaN limits are refused.
        if !(range_min_m >= 0.0 && range_max_m > range_min_m) {
            return Err(ScanRejected::RangeLimits { min_m: range_min_m, max_m: range_max_m });
        }
        Ok(())
    }

    #[inline(always)]
    fn rays(&self, limits: &BeamLimits) -> impl Iterator<Item = Ray<2>> {
        Scan::rays(self, limits)
    }

    #[inline]
    fn covariance_at(&self, point_m: &Point<2>) -> Option<SMatrix<f32, 2, 2>> {
        let lever_m = point_m - self.header.map_from_sensor.position();
        self.header.pose_covariance.map(|covariance| covariance.at(&lever_m))
    }
}

/// A sweep that was refused as a whole; the map is unchanged.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ScanRejected {
    /// More beams than [`MAX_BEAMS`].
    TooManyBeams {
        /// Beams of the scan.
        beams: usize,
    },
    /// A component of the pose is not a finite number.
    PoseNotFinite,
    /// The pose's covariance is invalid: not finite, or not positive semidefinite.
    PoseCovariance,
    /// The pose is further from the lattice's origin than an `f32` resolves.
    PoseTooFar {
        /// Position, metres.
        x_m: f32,
        /// Position, metres.
        y_m: f32,
    },
    /// Heading or bearings are not finite, or larger than 8 192 rad.
    Angles {
        /// Bearing of the first beam, radians.
        min_rad: f32,
        /// Radians per beam.
        increment_rad: f32,
    },
    /// The range limits are not `0 ≤ min < max`.
    RangeLimits {
        /// Lower limit, metres.
        min_m: f32,
        /// Upper limit, metres.
        max_m: f32,
    },
    /// Older than a scan that was already integrated.
    StampWentBack {
        /// The scan's stamp, nanoseconds.
        stamp_ns: u64,
        /// The newest stamp integrated, nanoseconds.
        newest_ns: u64,
    },
    /// More observations than the mapper's memory holds.
    TooManyObservations {
        /// Observations given.
        observations: usize,
        /// Observations that fit.
        capacity: usize,
    },
}

impl fmt::Display for ScanRejected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooManyBeams { beams } => write!(f, "{beams} beams, at most {MAX_BEAMS} are accepted"),
            Self::PoseNotFinite => write!(f, "the pose is not finite"),
            Self::PoseCovariance => write!(f, "the pose's covariance is not finite and positive semidefinite"),
            Self::PoseTooFar { x_m, y_m } => {
                write!(f, "the pose ({x_m} m, {y_m} m) is too far from the map's origin for single precision")
            }
            Self::Angles { min_rad, increment_rad } => {
                write!(f, "heading or bearings are unusable (from {min_rad} rad in steps of {increment_rad} rad)")
            }
            Self::RangeLimits { min_m, max_m } => {
                write!(f, "range limits {min_m} m to {max_m} m are not 0 ≤ min < max")
            }
            Self::StampWentBack { stamp_ns, newest_ns } => {
                write!(f, "stamp {stamp_ns} ns is older than the newest integrated, {newest_ns} ns")
            }
            Self::TooManyObservations { observations, capacity } => {
                write!(f, "{observations} observations, {capacity} fit")
            }
        }
    }
}

impl core::error::Error for ScanRejected {}
