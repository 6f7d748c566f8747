use super::{BeamRule, MAX_PIECES, Observation, Ray};
use crate::{
    define::settings,
    geometry::Place,
    kernel::Averaging,
    settings::{SettingsError, number},
};

settings! {
    /// The free part of a ray as a chain of line segments (eqs. 11 and 12), then the hit.
    ///
    /// The free part, up to `gap_m` before a hit, is cut into equal segments no longer than `length` spacings. Each says that
    /// the average of the log-odds along it is that of free space. Where a segment crosses into another cell of the lattice
    /// the mapper cuts it once more, so that every piece is one row of one stencil and nothing of it falls outside the band.
    LineSegments {
        /// Longest segment, in spacings: long enough that the lattice's own lines, and not the chain's joints, cut most of them.
        length: f32 = 4.0,
        /// Samples by which features are averaged along a segment; 0 for the closed form.
        samples: Averaging = Averaging::Exact,
        /// Length before a hit that is left unlabelled, metres: two or three standard deviations of the range noise.
        gap_m: f32 = 0.1,
    }
}

impl LineSegments {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        let length = self.length > 0.0 && self.length <= 1e3;
        number::expect("segment length", self.length, "above 0, at most 1000", length)?;
        number::samples("samples of a segment", self.samples)?;
        number::gap(self.gap_m)
    }
}

impl BeamRule for LineSegments {
    #[inline]
    fn observe<const D: usize>(&self, ray: &Ray<D>, spacing_m: f32, mut emit: impl FnMut(Observation<D>) -> bool) {
        let Some(end) = ray.reading.end() else { return };
        let (free_m, hit_m) = super::free_and_hit(end, self.gap_m);
        if free_m > 0.0 {
            let pieces = super::pieces(free_m, self.length * spacing_m, MAX_PIECES);
            for piece in 0..pieces {
                // The same expression for an end and for the next one's begin: the chain has no gaps.
                let end = |number: usize| ray.at(free_m * (number as f32 / pieces as f32));
                let place = Place::Segment { from_m: end(piece), to_m: end(piece + 1) };
                if !emit(Observation { place, occupied: false }) {
                    return;
                }
            }
        }
        if let Some(hit_m) = hit_m {
            emit(Observation::at_point(ray.at(hit_m), true));
        }
    }

    fn segment_averaging(&self) -> Averaging {
        self.samples
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{beam::Reading, geometry::Point};
    use std::vec::Vec;

    fn places(rule: LineSegments, reading: Reading) -> Vec<Observation<2>> {
        let ray = Ray { number: 3, origin_m: Point::<2>::new(1.0, 2.0), direction: Point::<2>::new(0.6, 0.8), reading };
        let mut places = Vec::new();
        rule.observe(&ray, 0.125, |place| {
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
        let rule = LineSegments::DEFAULT;
        for range in [0.05_f32, 0.1, 0.3, 0.6, 4.1, 29.9] {
            let places = places(rule, Reading::Hit(range));
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
        let rule = LineSegments::DEFAULT;
        assert!(places(rule, Reading::BeyondRange(5.0)).iter().all(|place| !place.occupied));
        assert_eq!(places(rule, Reading::BeyondRange(5.0)).len(), 10);
    }
}
