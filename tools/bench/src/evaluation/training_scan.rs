use bhm_core::beam::{BeamLimits, RayEnd};
use bhm_host::{ScanRecord, dataset::LabelledPoints};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Fewest free points of a beam that methods which learn points are shown.
const FEWEST_FREE_POINTS: usize = 2;

/// One scan as every method is shown it: its beams, where whole beams are learned, and points of them.
///
/// Methods that learn points all learn the same ones: the hit of each beam, and free points uniform up to the gap before it.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainingScan {
    /// Position of the scan in its log.
    pub scan: u64,
    origin_m: Option<[f32; 2]>,
    beams: Option<ScanRecord>,
    rays: Vec<Line>,
    points: LabelledPoints,
}

/// A beam as a straight line through free space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Where it ends, metres.
    pub end_m: [f32; 2],
    /// Whether on something; else nothing is known beyond.
    pub hit: bool,
}

/// How beams become points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// How far beams are believed.
    pub limits: BeamLimits,
    /// One free point for each such length of a beam, at least two, metres.
    pub free_spacing_m: f32,
    /// Length before a hit that has no free point, metres.
    pub gap_m: f32,
    /// Seed of where they lie; each scan has dice of its own.
    pub seed: u64,
}

impl TrainingScan {
    /// Of whole beams.
    #[must_use]
    pub fn of_beams(scan: u64, record: ScanRecord, sampling: &Sampling) -> Self {
        let Sampling { limits, free_spacing_m, gap_m, seed } = *sampling;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(scan);
        let pose = record.header.map_from_sensor;
        let mut points = LabelledPoints { scan, ..LabelledPoints::default() };
        let mut rays = Vec::new();
        for ray in record.as_scan().rays(&limits) {
            let Some(end) = ray.reading.end() else { continue };
            let at = |along_m: f32| <[f32; 2]>::from(ray.at(along_m));
            let hit = matches!(end, RayEnd::Hit(_));
            let free_m = if hit { end.range_m() - gap_m } else { end.range_m() };
            if free_m > 0.0 {
                for _ in 0..FEWEST_FREE_POINTS.max((free_m / free_spacing_m).ceil() as usize) {
                    points.points_m.push(at(rng.random::<f32>() * free_m));
                    points.occupied.push(false);
                }
            }
            let end_m = at(end.range_m());
            if hit {
                points.points_m.push(end_m);
                points.occupied.push(true);
            }
            rays.push(Line { end_m, hit });
        }
        Self { scan, origin_m: Some([pose.x_m, pose.y_m]), beams: Some(record), rays, points }
    }

    /// Of points, from a sensor at `origin_m` where that is known; the hits among them are then the ends of rays.
    #[must_use]
    pub fn of_points(points: LabelledPoints, origin_m: Option<[f32; 2]>) -> Self {
        let ends = points.points_m.iter().zip(&points.occupied).filter(|(_, occupied)| **occupied);
        let rays = if origin_m.is_some() {
            ends.map(|(end_m, _)| Line { end_m: *end_m, hit: true }).collect()
        } else {
            Vec::new()
        };
        Self { scan: points.scan, origin_m, beams: None, rays, points }
    }

    /// The whole scan, held-out beams as NaN; `None` where points are learned.
    #[must_use]
    pub fn beams(&self) -> Option<&ScanRecord> {
        self.beams.as_ref()
    }

    /// Where the sensor stood, metres; `None` where only points are known.
    #[must_use]
    pub fn origin_m(&self) -> Option<[f32; 2]> {
        self.origin_m
    }

    /// Every beam as a ray from [`origin_m`](Self::origin_m); none where that is not known.
    #[must_use]
    pub fn rays(&self) -> &[Line] {
        &self.rays
    }

    /// Labelled points, metres; `true` for occupied.
    pub fn points(&self) -> impl ExactSizeIterator<Item = ([f32; 2], bool)> {
        self.points.points_m.iter().copied().zip(self.points.occupied.iter().copied())
    }

    /// The same, as they are written to a file.
    #[must_use]
    pub fn labelled(&self) -> &LabelledPoints {
        &self.points
    }
}
