//! From a scan to labelled places, for every mapper alike.

use super::ScanRejected;
use crate::{
    beam::{AnyBeamRule, Beam, BeamLimits, BeamTally, LabelledPlace, sort_beam},
    geometry::{Place, Point},
    lattice::Lattice,
    scan::{MAX_BEAMS, Scan},
};

/// Whether a scan as a whole can be used by a map whose newest scan is of `newest_ns`.
pub(crate) fn check(
    scan: &Scan<'_>,
    newest_ns: u64,
    placeable: impl FnOnce(&Point<2>) -> bool,
) -> Result<(), ScanRejected> {
    if scan.ranges_m.len() > MAX_BEAMS {
        return Err(ScanRejected::TooManyBeams { beams: scan.ranges_m.len() });
    }
    let pose = &scan.map_from_sensor;
    if !pose.is_finite() {
        return Err(ScanRejected::PoseNotFinite);
    }
    if scan.pose_covariance.is_some_and(|covariance| !covariance.is_valid()) {
        return Err(ScanRejected::PoseCovariance);
    }
    if !placeable(&pose.position()) {
        return Err(ScanRejected::PoseTooFar { x_m: pose.x_m, y_m: pose.y_m });
    }
    let last_rad = scan.angle_min_rad + scan.angle_increment_rad * scan.ranges_m.len() as f32;
    if !pose.direction(scan.angle_min_rad).x.is_finite() || !pose.direction(last_rad).x.is_finite() {
        return Err(ScanRejected::Angles { min_rad: scan.angle_min_rad, increment_rad: scan.angle_increment_rad });
    }
    // Written so that NaN limits are refused; an infinite upper limit is a sensor that marks no-return by +∞ alone.
    if !(scan.range_min_m >= 0.0 && scan.range_max_m > scan.range_min_m) {
        return Err(ScanRejected::RangeLimits { min_m: scan.range_min_m, max_m: scan.range_max_m });
    }
    if scan.stamp_ns < newest_ns {
        return Err(ScanRejected::StampWentBack { stamp_ns: scan.stamp_ns, newest_ns });
    }
    Ok(())
}

/// How beams become labelled places.
pub(crate) struct Reading<'a> {
    pub(crate) limits: &'a BeamLimits,
    pub(crate) rule: &'a AnyBeamRule,
    /// Where segments are cut, so that every piece is a row of one stencil and nothing of it falls outside the band; `None`
    /// where rows may be of any width.
    pub(crate) cut: Option<&'a Lattice<2>>,
}

impl Reading<'_> {
    /// Fills `places` and says how many there are, and what became of the beams.
    ///
    /// If they do not fit, every second beam is used (then every fourth, …), so that what is dropped is spread over all
    /// directions.
    pub(crate) fn read(&self, scan: &Scan<'_>, places: &mut [LabelledPlace]) -> (usize, BeamTally) {
        let mut every = 1;
        loop {
            let mut tally = BeamTally::default();
            match self.every(every, scan, places, &mut tally) {
                Some(read) => return (read, tally),
                None if every >= MAX_BEAMS => {
                    // Not even the first beam fits.
                    let over_capacity = scan.ranges_m.len() as u32;
                    return (0, BeamTally { over_capacity, ..Default::default() });
                }
                None => every *= 2,
            }
        }
    }

    /// Reads every `every`-th beam; `None` if the places do not fit.
    fn every(
        &self,
        every: usize,
        scan: &Scan<'_>,
        places: &mut [LabelledPlace],
        tally: &mut BeamTally,
    ) -> Option<usize> {
        let pose = &scan.map_from_sensor;
        let (mut len, mut overflow) = (0, false);
        for (number, range_m) in scan.ranges_m.iter().enumerate() {
            if number % every != 0 {
                tally.over_capacity += 1;
                continue;
            }
            let Some(end) = sort_beam(*range_m, scan, self.limits, tally) else { continue };
            let bearing_rad = scan.angle_min_rad + number as f32 * scan.angle_increment_rad;
            let beam = Beam { number, origin_m: pose.position(), direction: pose.direction(bearing_rad), end };
            let mut push = |place: LabelledPlace| {
                match places.get_mut(len) {
                    Some(slot) => *slot = place,
                    None => overflow = true,
                }
                len += 1;
                !overflow
            };
            self.rule.observe(&beam, &mut |observed| match (observed.place, self.cut) {
                (Place::Segment { from_m, to_m }, Some(lattice)) => lattice
                    .cut(from_m, to_m)
                    .all(|(from_m, to_m)| push(LabelledPlace { place: Place::Segment { from_m, to_m }, ..observed })),
                _ => push(observed),
            });
            if overflow {
                return None;
            }
        }
        Some(len)
    }
}
