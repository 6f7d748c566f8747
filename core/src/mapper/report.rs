use core::fmt;

use crate::{beam::BeamTally, scan::MAX_BEAMS, tile::Claimed};

/// What became of a scan's observations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PointTally {
    /// Learned from by at least one tile.
    pub used: u32,
    /// Dropped: not finite, or further than the lattice reaches.
    pub unplaceable: u32,
    /// Dropped: outside the tiles that a bounded tiling has.
    pub outside: u32,
    /// Missed by at least one of its tiles: the scan touched more tiles than the lent list holds.
    pub over_capacity: u32,
    /// Learned, but as less uncertain than the scan's pose makes them: the stencil has no room for all of it (see
    /// [`Basis::widening`](crate::basis::Basis::widening)).
    pub narrowed: u32,
}

/// What integrating one scan did: every outcome by name.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IntegrateReport {
    /// The beams, used and dropped by reason.
    pub beams: BeamTally,
    /// The observations that the used beams gave.
    pub points: PointTally,
    /// Rows learned, summed over tiles: an observation is a row in each tile that holds its whole stencil.
    pub rows: u32,
    /// Rows dropped because the lent row memory was full.
    pub rows_over_capacity: u32,
    /// Rows that the posterior refused (see [`RowError`](crate::posterior::RowError)); always 0 with checked settings.
    pub rows_refused: u32,
    /// Tiles learned in.
    pub tiles_touched: u32,
    /// Tiles that began as the prior.
    pub tiles_created: u32,
    /// Tiles that came back from the archive.
    pub tiles_restored: u32,
    /// Tiles that left the store.
    pub tiles_evicted: u32,
    /// Evicted tiles that the archive did not keep.
    pub tiles_lost: u32,
    /// Tiles in which an update or a discount failed and changed nothing.
    pub tiles_failed: u32,
    /// Passes, summed over tiles.
    pub passes: u32,
    /// Passes that the safeguard rejected, summed over tiles.
    pub safeguards: u32,
    /// Passes whose information matrix `f32` could factor only with a little more on its diagonal, summed over tiles.
    pub conditioned: u32,
    /// Objective, summed over tiles, nats.
    pub objective: f32,
}

impl IntegrateReport {
    pub(super) fn count(&mut self, claimed: &Claimed) {
        self.tiles_touched += 1;
        self.tiles_created += u32::from(claimed.created);
        self.tiles_restored += u32::from(claimed.restored);
        self.tiles_evicted += u32::from(claimed.evicted);
        self.tiles_lost += u32::from(claimed.lost);
    }
}

/// A scan that was refused as a whole; the map is unchanged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScanRejected {
    /// More beams than [`MAX_BEAMS`].
    TooManyBeams {
        /// Beams of the scan.
        beams: usize,
    },
    /// A component of the pose is not a finite number.
    PoseNotFinite,
    /// The pose's covariance is not one: not finite, or not positive semidefinite.
    PoseCovariance,
    /// The pose is further from the lattice's origin than an `f32` resolves.
    PoseTooFar {
        /// Position, metres.
        x_m: f32,
        /// Position, metres.
        y_m: f32,
    },
    /// Heading or bearings are not finite, or absurdly large.
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
    /// Points and labels differ in number.
    LabelsMissing {
        /// Points given.
        points: usize,
        /// Labels given.
        labels: usize,
    },
    /// More points than the lent memory holds.
    TooManyPoints {
        /// Points given.
        points: usize,
        /// Points that fit.
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
            Self::LabelsMissing { points, labels } => write!(f, "{points} points but {labels} labels"),
            Self::TooManyPoints { points, capacity } => write!(f, "{points} points, {capacity} fit"),
        }
    }
}

impl core::error::Error for ScanRejected {}
