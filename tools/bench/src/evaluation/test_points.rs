use bhm_core::{geometry::Point, map::Occupancy};
use bhm_host::dataset::LabelledPoints;

use crate::metrics::{ScoreError, Scores};

/// What a method is asked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TestPoints {
    /// Places in the map, metres.
    pub points_m: Vec<[f32; 2]>,
    /// The truth about each.
    pub occupied: Vec<bool>,
    /// The position in the log of the scan that each is of.
    pub scans: Vec<u64>,
}

impl TestPoints {
    /// Of points that were held out elsewhere.
    #[must_use]
    pub fn of(scans: Vec<LabelledPoints>) -> Self {
        let mut all = Self::default();
        for points in scans {
            all.scans.resize(all.scans.len() + points.points_m.len(), points.scan);
            all.points_m.extend(points.points_m);
            all.occupied.extend(points.occupied);
        }
        all
    }

    /// How well a map answers them.
    ///
    /// # Errors
    /// If there are none, or the map says of a point what is no number.
    pub fn score(&self, occupancy: impl Fn(&Point<2>) -> Occupancy) -> Result<Scores, ScoreError> {
        let logits: Vec<f32> = self.points_m.iter().map(|point_m| occupancy(&Point::from(*point_m)).logit()).collect();
        Scores::of(&logits, &self.occupied)
    }

    /// The questions about scans up to this one; of more than `most` some, evenly.
    #[must_use]
    pub fn until(&self, scan: u64, most: usize) -> Self {
        let of_scan = || (0..self.scans.len()).filter(|i| self.scans[*i] <= scan);
        let every = of_scan().count().div_ceil(most.max(1)).max(1);
        let mut some = Self::default();
        of_scan().step_by(every).for_each(|i| some.push(self.scans[i], self.points_m[i], self.occupied[i]));
        some
    }

    pub(super) fn push(&mut self, scan: u64, point_m: [f32; 2], occupied: bool) {
        self.scans.push(scan);
        self.points_m.push(point_m);
        self.occupied.push(occupied);
    }
}
