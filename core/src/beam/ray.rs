use crate::{
    define::settings,
    geometry::Point,
    settings::{SettingsError, number},
};

settings! {
    /// How far beams are believed.
    BeamLimits {
        /// Longest range that is used, metres: a hit beyond it only says that the beam was free up to here.
        range_max_m: f32 = 40.0,
        /// Range up to which a beam without return says "free", metres; 0 to learn nothing from it.
        ///
        /// A missing return indoors is more often a black or shiny surface than free space.
        no_return_free_m: f32 = 0.0,
    }
}

impl BeamLimits {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        let positive = self.range_max_m > 0.0;
        number::expect("maximum range", self.range_max_m, number::POSITIVE, positive)?;
        let not_negative = self.no_return_free_m >= 0.0;
        number::expect("no-return range", self.no_return_free_m, number::NOT_NEGATIVE, not_negative)
    }
}

/// One beam of a range sensor in the map frame: where it begins, where it points and what its reading means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray<const D: usize> {
    /// Which beam of its sweep, from 0.
    pub number: usize,
    /// Where the sensor stands, metres.
    pub origin_m: Point<D>,
    /// Unit vector along the beam.
    pub direction: Point<D>,
    /// What the range reading means.
    pub reading: Reading,
}

/// What a range reading means, ranges in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// A hit at this range.
    Hit(f32),
    /// A hit beyond the longest range used: free up to this range.
    BeyondRange(f32),
    /// No return: free up to this range, which is 0 where the limits say that nothing is learned from it.
    NoReturn(f32),
    /// Unusable: not a number.
    NotANumber,
    /// Unusable: negative.
    Negative,
    /// Unusable: shorter than the sensor can measure.
    TooNear,
}

/// How a usable ray ends, metres from its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RayEnd {
    /// On something.
    Hit(f32),
    /// Free up to here, and nothing is known beyond.
    Free(f32),
}

impl Reading {
    /// What a reading of `range_m` means for a sensor that measures from `range_min_m` up to, and not including,
    /// `range_max_m`.
    #[inline]
    #[must_use]
    pub fn new(range_m: f32, range_min_m: f32, range_max_m: f32, limits: &BeamLimits) -> Self {
        if range_m.is_nan() {
            Self::NotANumber
        } else if range_m < 0.0 {
            Self::Negative
        } else if range_m < range_min_m {
            Self::TooNear
        } else if range_m >= range_max_m {
            Self::NoReturn(limits.no_return_free_m.min(limits.range_max_m))
        } else if range_m > limits.range_max_m {
            Self::BeyondRange(limits.range_max_m)
        } else {
            Self::Hit(range_m)
        }
    }

    /// How the ray ends; `None` if nothing is learned from it.
    #[inline]
    #[must_use]
    pub fn end(&self) -> Option<RayEnd> {
        match *self {
            Self::Hit(range_m) => Some(RayEnd::Hit(range_m)),
            Self::BeyondRange(range_m) => Some(RayEnd::Free(range_m)),
            Self::NoReturn(range_m) => (range_m > 0.0).then_some(RayEnd::Free(range_m)),
            Self::NotANumber | Self::Negative | Self::TooNear => None,
        }
    }
}

impl RayEnd {
    /// The range, metres.
    #[inline]
    #[must_use]
    pub const fn range_m(&self) -> f32 {
        match self {
            Self::Hit(range_m) | Self::Free(range_m) => *range_m,
        }
    }
}

impl<const D: usize> Ray<D> {
    /// The point at `range_m` along the ray, metres.
    #[inline]
    #[must_use]
    pub fn at(&self, range_m: f32) -> Point<D> {
        self.origin_m + self.direction * range_m
    }

    /// Where the ray ends, metres; `None` if nothing is learned from it.
    #[inline]
    #[must_use]
    pub fn end_m(&self) -> Option<Point<D>> {
        self.reading.end().map(|end| self.at(end.range_m()))
    }
}

/// What became of a sweep's beams, each counted once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BeamTally {
    /// Gave a hit and free space.
    pub hits: u32,
    /// Hit something beyond the longest range used: free space only.
    pub beyond_range: u32,
    /// Had no return: free space only, or nothing if the limits say so.
    pub no_return: u32,
    /// Dropped: not a number.
    pub not_a_number: u32,
    /// Dropped: negative.
    pub negative: u32,
    /// Dropped: shorter than the sensor can measure.
    pub too_near: u32,
    /// Dropped: no room for its observations (see [`IntegrateReport`](crate::mapper::IntegrateReport)).
    pub over_capacity: u32,
}

impl BeamTally {
    /// Counts a reading by what it means.
    #[inline]
    pub fn count(&mut self, reading: &Reading) {
        *match reading {
            Reading::Hit(_) => &mut self.hits,
            Reading::BeyondRange(_) => &mut self.beyond_range,
            Reading::NoReturn(_) => &mut self.no_return,
            Reading::NotANumber => &mut self.not_a_number,
            Reading::Negative => &mut self.negative,
            Reading::TooNear => &mut self.too_near,
        } += 1;
    }

    /// Beams that were not used.
    #[must_use]
    pub const fn dropped(&self) -> u32 {
        self.not_a_number + self.negative + self.too_near + self.over_capacity
    }

    /// Beams of the sweep.
    #[must_use]
    pub const fn total(&self) -> u32 {
        self.hits + self.beyond_range + self.no_return + self.dropped()
    }
}
