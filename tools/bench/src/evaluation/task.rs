use bhm_core::beam::BeamLimits;
use bhm_host::{ScanRecord, dataset::LabelledPoints};

use super::{Sampling, Split, TestPoints, Training, TrainingScan};

/// Ground around the training points that methods of fixed area cover as well, metres.
const MARGIN_M: f32 = 1.0;

/// What every method learns, and what it is asked: the same for all of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// In the order of the log.
    pub training: Vec<TrainingScan>,
    /// Asked; none of it was learned.
    pub test: TestPoints,
    /// How far beams are believed.
    pub limits: BeamLimits,
}

impl Task {
    /// Of a log that was divided.
    #[must_use]
    pub fn of_split(scans: &[ScanRecord], split: Split, sampling: &Sampling) -> Self {
        let origin_m = |at: u64| {
            scans.get(at as usize).map(|scan| [scan.header.map_from_sensor.x_m, scan.header.map_from_sensor.y_m])
        };
        let beams = |(record, at)| TrainingScan::of_beams(at, record, sampling);
        let training = match split.training {
            Training::Scans(records) => records.into_iter().zip(split.positions).map(beams).collect(),
            Training::Points(points) => shown(points, origin_m),
        };
        Self { training, test: split.test, limits: sampling.limits }
    }

    /// Of points that were divided elsewhere; `origin_m` says where the sensor stood at a scan, where that is known.
    #[must_use]
    pub fn of_points(
        training: Vec<LabelledPoints>,
        test: Vec<LabelledPoints>,
        limits: BeamLimits,
        origin_m: impl Fn(u64) -> Option<[f32; 2]>,
    ) -> Self {
        Self { training: shown(training, origin_m), test: TestPoints::of(test), limits }
    }

    /// Least and greatest x and y of what is learned, with a metre around it; `None` if nothing is.
    #[must_use]
    pub fn area_m(&self) -> Option<[[f32; 2]; 2]> {
        let mut area: Option<[[f32; 2]; 2]> = None;
        for (point_m, _) in self.training.iter().flat_map(TrainingScan::points) {
            let [min, max] = area.get_or_insert([point_m, point_m]);
            for axis in 0..2 {
                min[axis] = min[axis].min(point_m[axis]);
                max[axis] = max[axis].max(point_m[axis]);
            }
        }
        area.map(|[min, max]| [min.map(|x| x - MARGIN_M), max.map(|x| x + MARGIN_M)])
    }
}

/// Labelled points as they are shown, with where the sensor stood.
fn shown(scans: Vec<LabelledPoints>, origin_m: impl Fn(u64) -> Option<[f32; 2]>) -> Vec<TrainingScan> {
    let with_origin = scans.into_iter().map(|points| (origin_m(points.scan), points));
    with_origin.map(|(origin_m, points)| TrainingScan::of_points(points, origin_m)).collect()
}
