use super::{Beam, BeamEnd, BeamParameters, BeamRule, LabelledPlace, MAX_PIECES};
use crate::geometry::Place;

/// The free part of a beam as a chain of line segments (eqs. 11 and 12), then the hit.
///
/// The free part, up to `gap_m` before a hit, is cut into equal segments no longer than `longest_m`. Each says that the
/// average of the log-odds along it is that of free space. Where a segment crosses into another cell of the lattice the
/// mapper cuts it once more, so that every piece is one row of one stencil and nothing of it falls outside the band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineSegments {
    /// Longest segment, metres.
    pub longest_m: f32,
    /// Length before a hit that is left unlabelled, metres.
    pub gap_m: f32,
}

impl BeamRule for LineSegments {
    fn from_parameters(parameters: &BeamParameters) -> Self {
        Self { longest_m: parameters.segment_length * parameters.spacing_m, gap_m: parameters.gap_m }
    }

    #[inline]
    fn observe(&self, beam: &Beam, emit: &mut dyn FnMut(LabelledPlace) -> bool) {
        let (free_m, hit_m) = match beam.end {
            BeamEnd::Hit(range_m) => (range_m - self.gap_m, Some(range_m)),
            BeamEnd::Free(range_m) => (range_m, None),
        };
        let at = |along_m: f32| beam.origin_m + beam.direction * along_m;
        if free_m > 0.0 {
            let pieces = super::pieces(free_m, self.longest_m, MAX_PIECES);
            for piece in 0..pieces {
                // The same expression for an end and for the next one's begin: the chain has no gaps.
                let end = |number: usize| at(free_m * (number as f32 / pieces as f32));
                let place = Place::Segment { from_m: end(piece), to_m: end(piece + 1) };
                if !emit(LabelledPlace { place, occupied: false }) {
                    return;
                }
            }
        }
        if let Some(hit_m) = hit_m {
            emit(LabelledPlace { place: Place::Point(at(hit_m)), occupied: true });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use std::vec::Vec;

    fn places(rule: LineSegments, end: BeamEnd) -> Vec<LabelledPlace> {
        let beam = Beam { number: 3, origin_m: Point::<2>::new(1.0, 2.0), direction: Point::<2>::new(0.6, 0.8), end };
        let mut places = Vec::new();
        rule.observe(&beam, &mut |place| {
            places.push(place);
            true
        });
        places
    }

    fn length(displacement: Point<2>) -> f32 {
        displacement.x.hypot(displacement.y)
    }

    #[test]
    fn the_chain_covers_the_free_part_without_gaps_and_ends_before_the_hit() {
        let rule = LineSegments { longest_m: 0.5, gap_m: 0.1 };
        for range in [0.05_f32, 0.1, 0.3, 0.6, 4.1, 29.9] {
            let places = places(rule, BeamEnd::Hit(range));
            let (hit, chain) = places.split_last().unwrap();
            assert!(hit.occupied);
            let Place::Point(hit) = hit.place else { panic!("a hit is a point") };
            assert!((length(hit - Point::<2>::new(1.0, 2.0)) - range).abs() < 1e-5);
            assert_eq!(chain.len(), ((range - 0.1).max(0.0) / 0.5).ceil() as usize);
            let mut reached = Point::<2>::new(1.0, 2.0);
            for link in chain {
                let Place::Segment { from_m, to_m } = link.place else { panic!("free space is a segment") };
                assert!(!link.occupied && from_m == reached && length(to_m - from_m) <= 0.5 + 1e-5);
                reached = to_m;
            }
            let covered = length(reached - Point::<2>::new(1.0, 2.0));
            assert!((covered - (range - 0.1).max(0.0)).abs() < 1e-5);
        }
    }

    #[test]
    fn a_beam_without_return_never_hits() {
        let rule = LineSegments { longest_m: 0.5, gap_m: 0.1 };
        assert!(places(rule, BeamEnd::Free(5.0)).iter().all(|place| !place.occupied));
        assert_eq!(places(rule, BeamEnd::Free(5.0)).len(), 10);
    }
}
