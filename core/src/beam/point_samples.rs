use super::{Beam, BeamEnd, BeamParameters, BeamRule, LabelledPlace, MAX_PIECES};
use crate::geometry::Place;

/// Points of free space at a stated density along the beam, then the hit.
///
/// The free part, up to `gap_m` before a hit, is cut into equal strata no longer than `free_spacing_m`, with one point in
/// each. Where in its stratum is a function of the beam's number (a golden-ratio sequence), so that neighbouring beams do
/// not draw rings around the robot, and the same scan always gives the same points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointSamples {
    /// Longest stratum, metres.
    pub free_spacing_m: f32,
    /// Length before a hit that is left unlabelled, metres: range noise must not put free points on the wall.
    pub gap_m: f32,
}

/// The fractional part of the golden ratio.
const GOLDEN: f32 = 0.618_034;

impl BeamRule for PointSamples {
    fn from_parameters(parameters: &BeamParameters) -> Self {
        Self { free_spacing_m: parameters.free_spacing_m, gap_m: parameters.gap_m }
    }

    #[inline]
    fn observe(&self, beam: &Beam, emit: &mut dyn FnMut(LabelledPlace) -> bool) {
        let (free_m, hit_m) = match beam.end {
            BeamEnd::Hit(range_m) => (range_m - self.gap_m, Some(range_m)),
            BeamEnd::Free(range_m) => (range_m, None),
        };
        if free_m > 0.0 {
            let strata = super::pieces(free_m, self.free_spacing_m, MAX_PIECES);
            let phase = (beam.number as f32 + 0.5) * GOLDEN;
            let phase = phase - phase as i32 as f32;
            for stratum in 0..strata {
                let along_m = free_m * (stratum as f32 + phase) / strata as f32;
                let point_m = beam.origin_m + beam.direction * along_m;
                if !emit(LabelledPlace { place: Place::Point(point_m), occupied: false }) {
                    return;
                }
            }
        }
        if let Some(hit_m) = hit_m {
            let point_m = beam.origin_m + beam.direction * hit_m;
            emit(LabelledPlace { place: Place::Point(point_m), occupied: true });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use std::vec::Vec;

    fn points(rule: PointSamples, number: usize, end: BeamEnd) -> Vec<LabelledPlace> {
        let beam = Beam { number, origin_m: Point::<2>::new(1.0, 2.0), direction: Point::<2>::new(0.6, 0.8), end };
        let mut points = Vec::new();
        rule.observe(&beam, &mut |point| {
            points.push(point);
            true
        });
        points
    }

    #[test]
    fn the_density_the_gap_and_the_hit_are_as_stated() {
        let rule = PointSamples { free_spacing_m: 0.5, gap_m: 0.1 };
        for number in 0..500 {
            for range in [0.05_f32, 0.1, 0.3, 0.6, 4.1, 29.9] {
                let points = points(rule, number, BeamEnd::Hit(range));
                let (hit, free) = points.split_last().unwrap();
                let along = |p: &LabelledPlace| {
                    (p.place.middle_m() - Point::<2>::new(1.0, 2.0)).dot(&Point::<2>::new(0.6, 0.8))
                };
                assert!(hit.occupied && (along(hit) - range).abs() < 1e-5);
                assert_eq!(free.len(), ((range - 0.1).max(0.0) / 0.5).ceil() as usize);
                for (i, point) in free.iter().enumerate() {
                    let stratum = (range - 0.1) / free.len() as f32;
                    assert!(!point.occupied);
                    assert!((along(point) / stratum - i as f32 - 0.5).abs() <= 0.5 + 1e-4, "in its own stratum");
                }
            }
        }
    }

    #[test]
    fn a_beam_without_return_never_hits() {
        let rule = PointSamples { free_spacing_m: 0.5, gap_m: 0.1 };
        assert!(points(rule, 3, BeamEnd::Free(5.0)).iter().all(|p| !p.occupied));
        assert_eq!(points(rule, 3, BeamEnd::Free(5.0)).len(), 10);
    }
}
