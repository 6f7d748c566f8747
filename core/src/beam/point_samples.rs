use super::{BeamRule, MAX_PIECES, Observation, Ray};
use crate::{
    define::settings,
    settings::{SettingsError, number},
};

settings! {
    /// Points of free space at a stated density along the ray, then the hit.
    ///
    /// The free part, up to `gap_m` before a hit, is cut into equal strata no longer than `free_spacing_m`, with one point in
    /// each. Where in its stratum is a function of the ray's number (a golden-ratio sequence), so that neighbouring rays do
    /// not draw rings around the robot, and the same sweep always gives the same points.
    PointSamples {
        /// Longest stratum, metres. One free point a metre: denser ones only repeat what neighbouring beams say.
        free_spacing_m: f32 = 1.0,
        /// Length before a hit that is left unlabelled, metres: two or three standard deviations of the range noise, which must
        /// not put free points on the wall.
        gap_m: f32 = 0.1,
    }
}

impl PointSamples {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        number::positive("free spacing", self.free_spacing_m)?;
        number::gap(self.gap_m)
    }
}

/// The fractional part of the golden ratio.
const GOLDEN: f32 = 0.618_034;

impl BeamRule for PointSamples {
    #[inline]
    fn observe<const D: usize>(&self, ray: &Ray<D>, _: f32, mut emit: impl FnMut(Observation<D>) -> bool) {
        let Some(end) = ray.reading.end() else { return };
        let (free_m, hit_m) = super::free_and_hit(end, self.gap_m);
        if free_m > 0.0 {
            let strata = super::pieces(free_m, self.free_spacing_m, MAX_PIECES);
            let phase = (ray.number as f32 + 0.5) * GOLDEN;
            let phase = phase - phase as i32 as f32;
            for stratum in 0..strata {
                let along_m = free_m * (stratum as f32 + phase) / strata as f32;
                if !emit(Observation::at_point(ray.at(along_m), false)) {
                    return;
                }
            }
        }
        if let Some(hit_m) = hit_m {
            emit(Observation::at_point(ray.at(hit_m), true));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{beam::Reading, geometry::Point};
    use std::vec::Vec;

    fn points(rule: PointSamples, number: usize, reading: Reading) -> Vec<Observation<2>> {
        let ray = Ray { number, origin_m: Point::<2>::new(1.0, 2.0), direction: Point::<2>::new(0.6, 0.8), reading };
        let mut points = Vec::new();
        rule.observe(&ray, 0.5, |point| {
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
                let points = points(rule, number, Reading::Hit(range));
                let (hit, free) = points.split_last().unwrap();
                let along = |p: &Observation<2>| {
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
        assert!(points(rule, 3, Reading::BeyondRange(5.0)).iter().all(|p| !p.occupied));
        assert_eq!(points(rule, 3, Reading::BeyondRange(5.0)).len(), 10);
    }
}
