use crate::scan::Scan;

/// How far beams are believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamLimits {
    /// Longest range that is used, metres: a hit beyond it only says that the beam was free up to here.
    pub range_max_m: f32,
    /// Range up to which a beam without return says "free", metres; 0 to learn nothing from it.
    pub no_return_free_m: f32,
}

/// How a beam ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BeamEnd {
    /// On something, at this range in metres.
    Hit(f32),
    /// Free up to this range in metres, and nothing is known beyond.
    Free(f32),
}

/// What became of a scan's beams, each counted once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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
    /// Beams that were not used.
    #[must_use]
    pub const fn dropped(&self) -> u32 {
        self.not_a_number + self.negative + self.too_near + self.over_capacity
    }

    /// Beams of the scan.
    #[must_use]
    pub const fn total(&self) -> u32 {
        self.hits + self.beyond_range + self.no_return + self.dropped()
    }
}

/// Decides what a range reading means and counts it; `None` if nothing is to be learned from the beam.
#[inline]
pub fn sort_beam(range_m: f32, scan: &Scan<'_>, limits: &BeamLimits, tally: &mut BeamTally) -> Option<BeamEnd> {
    if range_m.is_nan() {
        tally.not_a_number += 1;
        None
    } else if range_m < 0.0 {
        tally.negative += 1;
        None
    } else if range_m < scan.range_min_m {
        tally.too_near += 1;
        None
    } else if range_m >= scan.range_max_m {
        tally.no_return += 1;
        let free_m = limits.no_return_free_m.min(limits.range_max_m);
        (free_m > 0.0).then_some(BeamEnd::Free(free_m))
    } else if range_m > limits.range_max_m {
        tally.beyond_range += 1;
        Some(BeamEnd::Free(limits.range_max_m))
    } else {
        tally.hits += 1;
        Some(BeamEnd::Hit(range_m))
    }
}
